//! What people watch: pictures of frames, and news of the whole farm.

use std::collections::BTreeMap;
use std::sync::Arc;

use gradfarm_core::film::Image;

use super::handle::Handle;
use super::look;
use super::view::JobSummary;
use crate::error::Error;
use crate::job::JobId;
use crate::preview::{Moment, View};

/// What a watcher of the farm has seen: of each job something that changes with it.
pub(crate) type Seen = BTreeMap<JobId, (u8, bool, u64, u64, i32)>;

impl Handle {
    /// What changes whenever a frame has more to show.
    ///
    /// # Errors
    /// [`Error::NoJob`], [`Error::NoFrame`].
    pub async fn preview_stamp(&self, job: JobId, frame: u32) -> Result<String, Error> {
        let stamp = move |dispatcher: &mut super::dispatch::Dispatcher| {
            let found = dispatcher.jobs.get(&job)?;
            Some(look::position(found, frame).map(|position| Moment::stamp_of(found, position)))
        };
        self.look(stamp).await?.ok_or(Error::NoJob(job))?
    }

    /// A view of a frame as it is now, at most [`crate::preview::PIXELS`] large, with its stamp.
    ///
    /// # Errors
    /// [`Error::NoJob`], [`Error::NoFrame`], [`Error::NotShown`].
    pub async fn preview(&self, job: JobId, frame: u32, view: View) -> Result<(String, Arc<Image>), Error> {
        let moment = self.moment(job, frame).await?;
        let stamp = moment.stamp();
        Ok((stamp, self.previews.picture(moment, view, self.store.as_ref(), &self.blobs).await?))
    }

    async fn moment(&self, job: JobId, frame: u32) -> Result<Moment, Error> {
        let moment = self.look(move |dispatcher| {
            let found = dispatcher.jobs.get(&job)?;
            Some(look::position(found, frame).map(|position| Moment::of(found, frame, position)))
        });
        moment.await?.ok_or(Error::NoJob(job))?
    }

    /// The jobs that changed since `seen`, newest first, at most `most` of them; the rest comes the next time. With it, what is seen now.
    ///
    /// # Errors
    /// Only [`Error::Stopped`].
    pub(crate) async fn changed(&self, mut seen: Seen, most: usize) -> Result<(Seen, Vec<JobSummary>), Error> {
        self.look(move |dispatcher| {
            let mut changed = Vec::new();
            for (id, job) in dispatcher.jobs.iter().rev() {
                let now = (job.state as u8, job.paused, job.units_done(), job.samples_done(), job.record.priority);
                if seen.get(id) != Some(&now) && changed.len() < most {
                    seen.insert(*id, now);
                    changed.push(look::summary(job));
                }
            }
            seen.retain(|id, _| dispatcher.jobs.contains_key(id));
            (seen, changed)
        })
        .await
    }

    /// All that a new watcher need not be told, for it has read the list.
    ///
    /// # Errors
    /// Only [`Error::Stopped`].
    pub(crate) async fn seen(&self) -> Result<Seen, Error> {
        Ok(self.changed(Seen::new(), usize::MAX).await?.0)
    }
}
