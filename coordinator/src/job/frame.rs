//! A frame of a job, and where its time went.

use gradfarm_core::accuracy::{Estimate, Point, Reason};
use gradfarm_core::film::Statistics;

use super::state::FrameState;
use crate::clock::Timestamp;

/// Where the time went [s].
///
/// `load`, `compile` and `render` are sums over the workers' threads; the others are spans on the coordinator's clock.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Seconds {
    /// Fetching scenes and assets.
    pub load: f64,
    /// Compiling scenes.
    pub compile: f64,
    /// Tracing, summed over threads.
    pub render: f64,
    /// From the first lease to the last accepted result.
    pub render_span: f64,
    /// Reading results and adding them up.
    pub stitch: f64,
    /// Reconstruction.
    pub reconstruct: f64,
    /// Encoding and storing the files.
    pub write: f64,
}

impl std::ops::AddAssign for Seconds {
    fn add_assign(&mut self, other: Self) {
        self.load += other.load;
        self.compile += other.compile;
        self.render += other.render;
        self.render_span += other.render_span;
        self.stitch += other.stitch;
        self.reconstruct += other.reconstruct;
        self.write += other.write;
    }
}

/// How far a frame has come.
#[derive(Clone, Debug, PartialEq)]
pub struct Frame {
    /// Where it stands.
    pub state: FrameState,
    /// When its first unit was leased.
    pub started: Option<Timestamp>,
    /// Units that are done.
    pub units: u32,
    /// Camera samples that are done.
    pub samples: u64,
    /// Where the time went.
    pub seconds: Seconds,
    /// Estimated relMSE of the finished image.
    pub estimated_relmse: Option<f64>,
    /// Which reconstruction was chosen for it and why, where the plan leaves that to the film.
    pub choice: Option<String>,
    /// Counters summed over its units, once assembled.
    pub statistics: Statistics,
    /// Samples per pixel up to which it is being rendered; where it has stopped, those of its image.
    pub goal: u32,
    /// Why it goes no further, where it might have.
    pub stopped: Option<Reason>,
    /// Units that were given up: the image is made without them.
    pub failed_units: u32,
    /// Units whose results came from a worker that was found to give wrong ones, and were not checked.
    pub suspect_units: u32,
    /// Why it could not be assembled.
    pub failure: Option<String>,
    /// Its error at so many samples, as often as it was measured, by samples.
    pub points: Vec<Point>,
}

impl Frame {
    /// A frame that nothing was done for, to be rendered to so many samples per pixel at first.
    pub fn waiting(goal: u32) -> Self {
        Self {
            state: FrameState::Waiting,
            started: None,
            units: 0,
            samples: 0,
            seconds: Seconds::default(),
            estimated_relmse: None,
            choice: None,
            statistics: Statistics::default(),
            goal,
            stopped: None,
            failed_units: 0,
            suspect_units: 0,
            failure: None,
            points: Vec::new(),
        }
    }

    /// The point that an image with this error makes, which was there at `now`; adding up and reconstructing took `check` seconds.
    pub fn point(&self, error: Estimate, check: f64, now: Timestamp) -> Point {
        Point {
            samples: self.goal,
            cpu_seconds: self.seconds.render,
            wall_seconds: self.started.map_or(0.0, |started| now.seconds_since(started)),
            check_seconds: check,
            error,
        }
    }
}
