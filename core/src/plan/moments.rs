//! Which frames show the same scene: runs of them are moments, and each moment is rendered once.

use std::ops::Range;

use super::{Plan, Timeline};
use crate::lattice::Moment;
use crate::scene::{Error, SceneDescription};

impl Timeline {
    /// The frames in which an animation runs from its first key to its last one: those of a loop follow each other without a doubled frame.
    /// A scene that rests has frame 0.
    pub fn frames_of(&self, scene: &SceneDescription) -> Range<u32> {
        // A key that lies on a frame but for rounding lies on it.
        let close = 1e-6;
        let Some([first, last]) = scene.animation.as_ref().and_then(|animation| animation.span()) else { return 0..1 };
        let first = (first * self.fps + close).floor().clamp(0.0, f64::from(u32::MAX - 1)) as u32;
        let end = (last * self.fps - close).ceil().clamp(0.0, f64::from(u32::MAX)) as u32;
        first..end.max(first + 1)
    }
}

impl Plan {
    /// The moments of these frames, in order.
    ///
    /// Two frames that follow each other are of one moment if and only if the scene is the same, number by number, at all instants that
    /// their shutters see. The image of a frame depends on nothing but that, the plan and the moment's own random numbers, so showing the
    /// image of a moment in all its frames is exact.
    ///
    /// # Errors
    /// A value between keys that leaves its domain.
    pub fn moments(&self, scene: &SceneDescription, frames: Range<u32>) -> Result<Vec<Moment>, Error> {
        let Some(timeline) = &self.timeline else { return Ok(vec![Moment { first: frames.start, end: frames.end }]) };
        let mut moments: Vec<Moment> = Vec::new();
        let mut before: Option<Seen> = None;
        for frame in frames {
            let mut seen = Seen { scene, seconds: timeline.seconds(frame, self.seed), stills: Vec::new() };
            let same = match &mut before {
                Some(before) => before.equals(&mut seen)?,
                None => false,
            };
            match moments.last_mut().filter(|_| same) {
                Some(moment) => moment.end = frame + 1,
                None => moments.push(Moment::of(frame)),
            }
            before = Some(seen);
        }
        Ok(moments)
    }
}

impl Plan {
    /// Says among the reasons how many frames show how many moments, why that is exact, and why moments are rendered whole.
    pub fn tell_moments(&mut self, moments: &[Moment]) {
        let frames: u64 = moments.iter().map(|moment| u64::from(moment.end.wrapping_sub(moment.first))).sum();
        if frames > moments.len() as u64 {
            let shown =
                if moments.len() == 1 { "one moment, rendered".to_owned() } else { format!("{} moments, each rendered", moments.len()) };
            self.reasons.push(format!(
                "{frames} frames show {shown} once: frames are one moment where the scene is the same, number by number, at all instants \
                 that their shutters see, and an image depends on nothing else"
            ));
        }
        if moments.len() > 1 {
            self.reasons.push(match self.max_depth {
                1 => "every moment is rendered whole: its paths end at what the camera sees, and cost a ray each".to_owned(),
                most => format!(
                    "every moment is rendered whole: paths of up to {most} edges may carry light from what changes to any pixel, and \
                     nothing proves of a tile that none does"
                ),
            });
        }
    }
}

/// What the shutter of a frame sees, as far as it was asked for.
struct Seen<'a> {
    scene: &'a SceneDescription,
    seconds: Vec<f64>,
    stills: Vec<SceneDescription>,
}

impl Seen<'_> {
    /// Whether another frame sees the same at all instants. What moves mostly differs at the first one already.
    fn equals(&mut self, other: &mut Self) -> Result<bool, Error> {
        for instant in 0..self.seconds.len() {
            if self.still(instant)? != other.still(instant)? {
                return Ok(false);
            }
        }
        Ok(true)
    }

    fn still(&mut self, instant: usize) -> Result<&SceneDescription, Error> {
        while self.stills.len() <= instant {
            self.stills.push(self.scene.at(self.seconds[self.stills.len()])?);
        }
        Ok(&self.stills[instant])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::{Request, resolve};

    /// A light that moves from 0.5 s to 1 s and rests before and after.
    fn scene(animation: &str) -> SceneDescription {
        let text = format!(
            r#"{{"version": 1, "camera": {{"perspective": {{"to_world": [], "fov": 40}}}},
                "lights": [{{"point": {{"position": [0, 1, 2], "intensity": 3}}}}]{animation}}}"#
        );
        SceneDescription::from_json(&text, "scene").unwrap()
    }

    const TRACK: &str = r#", "animation": {"tracks": [{"target": "lights[0].point.position", "times": [0.5, 1.0],
        "values": [[0, 1, 2], [1, 1, 2]]}]}"#;

    fn moments(scene: &SceneDescription, timeline: Timeline, frames: Range<u32>) -> Vec<(u32, u32)> {
        let request = Request { timeline: Some(timeline), frames: frames.len() as u32, ..Request::default() };
        let plan = resolve(scene, &request).unwrap();
        plan.moments(scene, frames).unwrap().iter().map(|moment| (moment.first, moment.end)).collect()
    }

    #[test]
    fn frames_that_show_the_same_are_one_moment() {
        let four = Timeline { fps: 4.0, ..Timeline::default() };
        let moving = scene(TRACK);
        assert_eq!(moments(&moving, four, 0..8), [(0, 3), (3, 4), (4, 8)]);
        assert_eq!(moments(&moving, four, 5..8), [(5, 8)]);
        // With the shutter open frame 2 sees the first of the motion.
        let open = Timeline { shutter: 1.0, instants: 3, ..four };
        assert_eq!(moments(&moving, open, 0..8), [(0, 2), (2, 3), (3, 4), (4, 8)]);
        assert_eq!(moments(&scene(""), four, 7..1000), [(7, 1000)]);
    }

    #[test]
    fn the_plan_says_what_is_rendered_once_and_why_the_rest_is_not() {
        let told = |scene: &SceneDescription, max_depth| {
            let timeline = Some(Timeline { fps: 4.0, ..Timeline::default() });
            let mut plan = resolve(scene, &Request { timeline, frames: 8, max_depth, ..Request::default() }).unwrap();
            let (moments, before) = (plan.moments(scene, 0..8).unwrap(), plan.reasons.len());
            plan.tell_moments(&moments);
            plan.reasons.split_off(before)
        };
        let moving = told(&scene(TRACK), Some(5));
        assert!(moving[0].starts_with("8 frames show 3 moments, each rendered once"), "{moving:?}");
        assert!(moving[1].contains("rendered whole") && moving[1].contains("up to 5 edges"), "{moving:?}");
        assert!(told(&scene(TRACK), Some(1))[1].contains("a ray each"));
        let resting = told(&scene(""), None);
        assert!(resting.len() == 1 && resting[0].starts_with("8 frames show one moment, rendered once"), "{resting:?}");
    }

    #[test]
    fn an_animation_has_its_frames() {
        let frames = |fps| Timeline { fps, ..Timeline::default() }.frames_of(&scene(TRACK));
        assert_eq!((frames(4.0), frames(24.0), frames(1.0), frames(3.0)), (2..4, 12..24, 0..1, 1..3));
        assert_eq!(Timeline::default().frames_of(&scene("")), 0..1);
    }
}
