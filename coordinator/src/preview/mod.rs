//! Pictures of frames while they are made, for people who look: primal, differences, reconstruction and error as far as they are known.
//!
//! Nothing here is part of a result. A picture is small (at most [`PIXELS`]), made off the async threads, one at a time, and kept until the
//! frame has more to show or other pictures need the room.

mod picture;
mod sketch;
mod view;

use std::collections::VecDeque;
use std::sync::Arc;

use bytes::Bytes;
use gradfarm_core::film::Image;
use gradfarm_core::output::exr;
use gradfarm_proto::{block, limits};
use tokio::sync::Mutex;

pub use picture::reduce;
pub use view::View;

use crate::assemble::SoFar;
use crate::error::Error;
use crate::job::{FileKind, FrameState, Job, JobId};
use crate::schedule::Split;
use crate::store::{Blobs, Store};
use sketch::Sketch;

/// Most pixels of a picture; larger frames are shown smaller by a whole factor.
pub const PIXELS: usize = 1 << 20;
/// Frames whose sums are kept.
const SKETCHES: usize = 2;
/// Pictures that are kept.
const PICTURES: usize = 8;

/// A frame as it is at one moment.
#[derive(Clone, Debug)]
pub(crate) struct Moment {
    job: JobId,
    number: u32,
    position: u32,
    units: u32,
    done: bool,
    split: Split,
    so_far: SoFar,
}

impl Moment {
    /// Takes down how far a frame is, by its number and position.
    pub(crate) fn of(job: &Job, number: u32, position: u32) -> Self {
        let frame = &job.frames[position as usize];
        Self {
            job: job.record.id,
            number,
            position,
            units: frame.units,
            done: frame.state == FrameState::Done,
            split: job.split.clone(),
            so_far: SoFar::of(job, position),
        }
    }

    /// Changes whenever the frame has more to show.
    pub(crate) fn stamp(&self) -> String {
        stamp(self.units, self.done)
    }

    /// The same of a frame by its position.
    pub(crate) fn stamp_of(job: &Job, position: u32) -> String {
        let frame = &job.frames[position as usize];
        stamp(frame.units, frame.state == FrameState::Done)
    }
}

fn stamp(units: u32, done: bool) -> String {
    format!("{units}-{}", if done { "done" } else { "open" })
}

/// Which picture of which state of a frame.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Key {
    job: JobId,
    position: u32,
    units: u32,
    done: bool,
    view: View,
}

/// Makes pictures and keeps the latest.
#[derive(Debug, Default)]
pub(crate) struct Previews {
    /// Locked while a picture is made: the others wait, and often find it done.
    kept: Mutex<Kept>,
}

#[derive(Debug, Default)]
struct Kept {
    sketches: VecDeque<Sketch>,
    pictures: VecDeque<(Key, Arc<Image>)>,
}

impl Previews {
    /// A view of a frame, RGB, or one channel for the error.
    ///
    /// # Errors
    /// [`Error::NotShown`] if it is not known yet or never will be; if what was stored cannot be read.
    pub(crate) async fn picture(&self, moment: Moment, view: View, store: &dyn Store, blobs: &Blobs) -> Result<Arc<Image>, Error> {
        let key = Key { job: moment.job, position: moment.position, units: moment.units, done: moment.done, view };
        let mut kept = self.kept.lock().await;
        if let Some((_, picture)) = kept.pictures.iter().find(|(known, _)| *known == key) {
            return Ok(picture.clone());
        }
        let picture = Arc::new(if moment.done {
            finished(&moment, view, store, blobs).await?
        } else if view == View::Reconstructed {
            let absent = || not_shown(&moment, view, "there once every tile has results");
            if moment.so_far.pixels() > PIXELS {
                return Err(not_shown(&moment, view, "there once the frame is done, for it is large"));
            }
            moment.so_far.clone().reconstruct(store, blobs).await.ok_or_else(absent)?
        } else {
            kept.sketched(&moment, view, store, blobs).await?
        });
        kept.pictures.retain(|(known, _)| (known.job, known.position, known.view) != (key.job, key.position, key.view));
        kept.pictures.truncate(PICTURES - 1);
        kept.pictures.push_front((key, picture.clone()));
        Ok(picture)
    }
}

impl Kept {
    /// A view from what workers delivered so far; only what is new is read.
    async fn sketched(&mut self, moment: &Moment, view: View, store: &dyn Store, blobs: &Blobs) -> Result<Image, Error> {
        let at = self.sketches.iter().position(|sketch| sketch.is_of(moment.job, moment.position));
        let known = at.and_then(|at| self.sketches.remove(at));
        let mut sketch = known.unwrap_or_else(|| Sketch::new(moment.job, moment.position, moment.so_far.extent()));
        let per_frame = moment.split.units_per_frame();
        let first = per_frame * moment.position;
        for (unit, result) in store.results(moment.job, first..first + per_frame).await? {
            if sketch.has(unit) {
                continue;
            }
            let bytes: Bytes = blobs.get(result.blob).await?;
            let added = tokio::task::spawn_blocking(move || {
                match block::decode(&bytes, result.content, result.size, limits::BLOCK) {
                    Ok(block) => sketch.add(unit, &block),
                    // It will fail the frame, too, and be told there.
                    Err(fault) => tracing::warn!(unit, %fault, "left out of a preview"),
                }
                sketch
            });
            sketch = added.await.map_err(|_| Error::Stopped)?;
        }
        let image = sketch.image(view);
        self.sketches.truncate(SKETCHES - 1);
        self.sketches.push_front(sketch);
        image.ok_or_else(|| not_shown(moment, view, view.needs()))
    }
}

/// A view from the files of a finished frame.
async fn finished(moment: &Moment, view: View, store: &dyn Store, blobs: &Blobs) -> Result<Image, Error> {
    let file = store.file(moment.job, moment.position, FileKind::Exr).await?;
    let file = file.ok_or(Error::NotReady { job: moment.job, frame: moment.number, kind: FileKind::Exr })?;
    let bytes = blobs.get(file.blob).await?;
    let read = tokio::task::spawn_blocking(move || exr::read_layer(&bytes, view.layer()).map(|image| reduce(&image, PIXELS)));
    let read = read.await.map_err(|_| Error::Stopped)?;
    read.map_err(|_| not_shown(moment, view, "in files of techniques that measure it"))
}

fn not_shown(moment: &Moment, view: View, needs: &'static str) -> Error {
    Error::NotShown { job: moment.job, frame: moment.number, view: view.name(), needs }
}
