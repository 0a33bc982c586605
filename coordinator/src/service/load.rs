//! The loop under load, with workers that render nothing and a store that keeps nothing: how many units a second it grants and takes in.
//!
//! `GRADFARM_LOAD=1000x1000000 cargo test -p gradfarm --lib service::load -- --nocapture` has 1,000 workers on 1,000,000 units; what is measured
//! is printed, and nothing is asked of it.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use gradfarm_proto::Digest;
use gradfarm_proto::convert::LeaseName;
use gradfarm_proto::v1::coordinator_message::Message;
use tokio::sync::{mpsc, oneshot};

use super::command::{Command, Hello};
use super::dispatch::Dispatcher;
use crate::job::tests::record;
use crate::job::{Answer, Capabilities, DeliveredRecord, JobId, JobRecord, WorkerId};
use crate::schedule::split::tests::{plan, single};
use crate::store::Memory;

/// Units of a frame of the job.
const UNITS_PER_FRAME: u32 = 4096;

async fn ask<T>(loop_: &mpsc::Sender<Command>, command: impl FnOnce(oneshot::Sender<T>) -> Command) -> T {
    let (reply, answer) = oneshot::channel();
    loop_.send(command(reply)).await.unwrap();
    answer.await.unwrap()
}

/// A worker that delivers whatever it is granted, until the loop is gone.
async fn work(number: u32, loop_: mpsc::Sender<Command>, delivered: Arc<AtomicU64>) {
    let (outbox, mut inbox) = mpsc::channel(1024);
    let worker = WorkerId::fresh();
    let capabilities = Capabilities { threads: 4, ..Capabilities::default() };
    let (name, version) = (format!("worker {number}"), String::new());
    let hello = Hello { worker, protocol: 1, name, version, capabilities, held: Vec::new(), scenes: Vec::new() };
    let key = ask(&loop_, |reply| Command::Connect { hello: Box::new(hello), outbox, reply }).await;
    loop_.send(Command::Credit { from: key, leases: 6 }).await.unwrap();
    while let Some(message) = inbox.recv().await {
        let Some(Message::Grant(grant)) = message.message else { continue };
        let leases: Vec<LeaseName> = grant.leases.into_iter().map(|lease| lease.lease.unwrap().try_into().unwrap()).collect();
        let deliver = |lease: LeaseName| {
            let content = Digest::of(&lease.unit.to_le_bytes());
            let result = DeliveredRecord { content, blob: content, size: 1, load: 0.0, compile: 0.0, render: 0.1 };
            ask(&loop_, move |reply| Command::Deliver { worker, lease, result, reply })
        };
        let count = leases.len() as u32;
        for answer in futures::future::join_all(leases.into_iter().map(deliver)).await {
            assert_eq!(answer, Answer::Accepted);
            delivered.fetch_add(1, Ordering::Relaxed);
        }
        if loop_.send(Command::Credit { from: key, leases: count }).await.is_err() {
            return;
        }
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn every_unit_is_granted_and_counted_once_under_load() {
    let asked = std::env::var("GRADFARM_LOAD").unwrap_or_else(|_| "50x12288".to_owned());
    let (workers, units) = asked.split_once('x').map(|(w, u)| (w.parse::<u32>().unwrap(), u.parse::<u32>().unwrap())).unwrap();
    let frames = units.div_ceil(UNITS_PER_FRAME);
    let span = Duration::from_secs(60);
    let (dispatcher, pending) =
        Dispatcher::restore(Arc::new(Memory::new()), span, 10 * span, Arc::default(), Box::new(|_, _| {})).await.unwrap();
    let (loop_, commands) = mpsc::channel(1024);
    let (stop, stopped) = oneshot::channel::<()>();
    let running = tokio::spawn(dispatcher.run(pending, commands, async { drop(stopped.await) }));
    let record = JobRecord { plan: plan(256, 256, 16), frame_count: frames, moments: single(3..3 + frames), ..record("load") };
    let start = Instant::now();
    let job: JobId = ask(&loop_, |reply| Command::Submit { record: Box::new(record), kept: false, paused: false, reply }).await.unwrap();
    let submitted = start.elapsed();
    let (start, delivered) = (Instant::now(), Arc::new(AtomicU64::new(0)));
    for number in 0..workers {
        tokio::spawn(work(number, loop_.clone(), delivered.clone()));
    }
    let all = u64::from(frames * UNITS_PER_FRAME);
    while delivered.load(Ordering::Relaxed) < all {
        assert!(!running.is_finished(), "the loop ended");
        tokio::time::sleep(Duration::from_millis(5)).await;
    }
    let seconds = start.elapsed().as_secs_f64();
    let (reply, answer) = oneshot::channel();
    let look = move |dispatcher: &mut Dispatcher| {
        let job = dispatcher.job(job).unwrap();
        reply.send((job.units_done(), job.leases(), job.unit(0).map(|unit| unit.epoch))).ok();
    };
    loop_.send(Command::Look(Box::new(look))).await.unwrap();
    assert_eq!(answer.await.unwrap(), (all, 0, Some(1)));
    drop(stop);
    running.await.unwrap().unwrap();
    eprintln!("{workers} workers, {all} units: submitted in {submitted:?}, {:.0} units/s granted and completed", all as f64 / seconds);
}
