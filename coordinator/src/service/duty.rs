//! Whether this coordinator is on duty: whether it can take work at all, and how it goes off duty without breaking anything off.

use std::sync::atomic::{AtomicBool, Ordering::Relaxed};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use tokio::sync::watch;

use super::command::Command;
use super::dispatch::{Dispatcher, Turn};
use super::handle::Handle;
use crate::error::Error;
use crate::job::{FileKind, JobId};

/// How long loop and store may take to answer.
const PATIENCE: Duration = Duration::from_secs(2);
/// For how long an answer holds: strangers may ask as often as they like.
const FRESH: Duration = Duration::from_millis(500);
/// After so much silence the others may hold this coordinator for dead.
const SILENCE: Duration = Duration::from_secs(3);

/// What is known about being on duty, shared by all handles.
#[derive(Debug)]
pub(crate) struct Duty {
    draining: AtomicBool,
    /// When the last sign of life was given, on a store that several coordinators share.
    beaten: Mutex<Instant>,
    /// What was said last, and when.
    told: tokio::sync::Mutex<Option<(Instant, Vec<String>)>>,
    /// Requests under way that change something.
    busy: watch::Sender<usize>,
}

impl Default for Duty {
    fn default() -> Self {
        let (draining, beaten, busy) = (AtomicBool::new(false), Mutex::new(Instant::now()), watch::Sender::new(0));
        Self { draining, beaten, told: tokio::sync::Mutex::default(), busy }
    }
}

impl Duty {
    /// A sign of life was given.
    pub(super) fn beat(&self) {
        *self.beaten.lock().unwrap_or_else(PoisonError::into_inner) = Instant::now();
    }

    fn silent_for(&self) -> Duration {
        self.beaten.lock().unwrap_or_else(PoisonError::into_inner).elapsed()
    }
}

/// A request under way, until it is dropped.
#[derive(Debug)]
pub(crate) struct Busy(Arc<Duty>);

impl Drop for Busy {
    fn drop(&mut self) {
        self.0.busy.send_modify(|count| *count -= 1);
    }
}

impl Handle {
    /// Notes a request that changes something, for as long as what is returned lives.
    pub(crate) fn busy(&self) -> Busy {
        self.duty.busy.send_modify(|count| *count += 1);
        Busy(self.duty.clone())
    }

    /// Ready when no such request is under way.
    pub async fn idle(&self) {
        // The sender is in our own hands.
        let mut count = self.duty.busy.subscribe();
        let _open = count.wait_for(|count| *count == 0).await;
    }

    /// Why this coordinator should get no requests at this moment; nothing if it should.
    pub async fn unready(&self) -> Vec<String> {
        let mut told = self.duty.told.lock().await;
        if let Some((_, reasons)) = told.as_ref().filter(|(when, _)| when.elapsed() < FRESH) {
            return reasons.clone();
        }
        let mut reasons = Vec::new();
        if self.duty.draining.load(Relaxed) {
            reasons.push("it is about to stop and grants nothing any more".to_owned());
        }
        match tokio::time::timeout(PATIENCE, self.look(|_| ())).await {
            Ok(Ok(())) => {}
            Ok(Err(error)) => reasons.push(error.to_string()),
            Err(_) => reasons.push(format!("its loop did not answer within {} s", PATIENCE.as_secs())),
        }
        // Nothing is there, but the store must answer to say so.
        let asked = self.store.file(JobId::from_bytes([0; 16]), 0, FileKind::Png);
        match tokio::time::timeout(PATIENCE, asked).await {
            Ok(Ok(_)) => {}
            Ok(Err(error)) => {
                tracing::warn!(%error, "not ready");
                reasons.push("the store cannot be read".to_owned());
            }
            Err(_) => reasons.push(format!("the store did not answer within {} s", PATIENCE.as_secs())),
        }
        let silence = self.duty.silent_for();
        if self.store.cluster().is_some() && silence > SILENCE {
            reasons.push(format!("it could give the other coordinators no sign of life for {} s", silence.as_secs()));
        }
        *told = Some((Instant::now(), reasons.clone()));
        reasons
    }

    /// Goes off duty: grants nothing any more and tells the workers. What they deliver is still taken in.
    ///
    /// # Errors
    /// Only [`Error::Stopped`].
    pub async fn drain(&self) -> Result<(), Error> {
        self.duty.draining.store(true, Relaxed);
        *self.duty.told.lock().await = None;
        self.tell(Command::Drain).await
    }
}

impl Dispatcher {
    /// Grants nothing from now on.
    pub(super) fn drain(&mut self, turn: &mut Turn) {
        if !std::mem::replace(&mut self.draining, true) {
            turn.effects.push(super::dispatch::Effect::Look(Box::new(|dispatcher| dispatcher.roster.announce_stop())));
        }
    }
}
