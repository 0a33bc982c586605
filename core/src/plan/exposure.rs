//! What a moment is rendered from: the instants that its shutter sees, and the moment before where motion is followed.

use super::Plan;
use crate::lattice::Moment;
use crate::scene::{Error, Exposure, Stage};

impl Plan {
    /// The scenes that a moment is rendered from. A plan without a timeline sees the scene as it is at 0 s.
    ///
    /// # Errors
    /// As [`Stage::scene`].
    pub fn exposure(&self, stage: &Stage, moment: Moment) -> Result<Exposure, Error> {
        let Some(timeline) = &self.timeline else { return stage.exposure(&[0.0], None) };
        let follows = self.temporal.is_some_and(|temporal| temporal.motion);
        let before = moment.first.checked_sub(1).filter(|_| follows).map(|frame| timeline.seconds(frame, self.seed)[0]);
        stage.exposure(&timeline.seconds(moment.first, self.seed), before)
    }
}
