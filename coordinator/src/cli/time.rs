//! The options of time that `render`, `submit` and `plan` share: which frames, when they are, how they are exposed and reconstructed.

use std::ops::Range;

use gradfarm_core::plan::{Request, Temporal, Timeline};
use gradfarm_core::scene::SceneDescription;

use crate::service::Frames;

/// What to ask of frames.
#[derive(Clone, Debug, Default, clap::Args)]
#[command(next_help_heading = "Animation")]
pub(super) struct TimeOptions {
    /// Frames, such as 0..48 (48 is left out), 0..=47 or 12 [default: the whole animation; frame 0 of a scene that rests]
    #[arg(long, value_name = "A..B", value_parser = frames)]
    frames: Option<FrameRange>,
    /// Frames per second: frame f is the time f / FPS [default: 24]
    #[arg(long, value_name = "FPS", value_parser = fps)]
    fps: Option<f64>,
    /// Share of a frame's time in which the shutter is open, 0 to 1; 0 shows no motion blur [default: 0]
    #[arg(long, value_name = "SHARE", value_parser = shutter)]
    shutter: Option<f64>,
    /// Instants at which an open shutter sees the scene [default: 16]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=i64::from(Timeline::MOST_INSTANTS)))]
    instants: Option<u32>,
    /// Reconstruct frames together, in windows [default: where scene and technique allow it]
    #[arg(long, overrides_with = "no_temporal")]
    temporal: bool,
    /// Reconstruct every frame by itself
    #[arg(long, overrides_with = "temporal")]
    no_temporal: bool,
    /// Moments of a window that is reconstructed as a whole [default: 10]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=i64::from(Temporal::MOST)))]
    window: Option<u32>,
    /// Moments from the start of one window to that of the next [default: 5]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=i64::from(Temporal::MOST)))]
    stride: Option<u32>,
    /// Whether differences in time follow what moves [default: on]
    #[arg(long, value_name = "on|off", value_parser = switch)]
    motion_vectors: Option<bool>,
}

/// Frame numbers as they were asked for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct FrameRange(Range<u32>);

impl FrameRange {
    /// As jobs have them.
    pub(super) fn frames(&self) -> Frames {
        Frames { first: self.0.start, count: self.0.len() as u32 }
    }
}

impl TimeOptions {
    /// Adds what was asked for to a request.
    pub(super) fn ask(&self, request: Request) -> Request {
        let default = Timeline::default();
        let asked = self.fps.is_some() || self.shutter.is_some() || self.instants.is_some();
        let timeline = Timeline {
            fps: self.fps.unwrap_or(default.fps),
            shutter: self.shutter.unwrap_or(default.shutter),
            instants: self.instants.unwrap_or(default.instants),
        };
        Request {
            frames: self.frames.as_ref().map_or(0, |frames| frames.0.len() as u32),
            timeline: asked.then_some(timeline),
            temporal: (self.temporal || self.no_temporal).then_some(self.temporal),
            window: self.window,
            stride: self.stride,
            motion: self.motion_vectors,
            ..request
        }
    }

    /// The frames that were asked for, or those of the scene.
    pub(super) fn frames(&self, scene: &SceneDescription, request: &Request) -> Frames {
        match &self.frames {
            Some(range) => range.frames(),
            None => Frames::of(scene, request.timeline),
        }
    }
}

/// Reads frame numbers: `0..48` without 48, `0..=47` with 47, or one number.
///
/// # Errors
/// What was expected.
pub(super) fn frames(text: &str) -> Result<FrameRange, String> {
    let expected = || "expected frames such as 0..48, 0..=47 or 12".to_owned();
    let number = |text: &str| text.trim().parse::<u32>().map_err(|_| expected());
    let range = match text.split_once("..") {
        None => {
            let frame = number(text)?;
            frame..frame.checked_add(1).ok_or_else(expected)?
        }
        Some((first, last)) => match last.strip_prefix('=') {
            Some(last) => number(first)?..number(last)?.checked_add(1).ok_or_else(expected)?,
            None => number(first)?..number(last)?,
        },
    };
    if range.is_empty() {
        return Err(format!("there is no frame from {} to before {}, {}", range.start, range.end, expected()));
    }
    if range.len() > Frames::MOST as usize {
        return Err(format!("{} frames, at most {} are allowed", range.len(), Frames::MOST));
    }
    Ok(FrameRange(range))
}

fn fps(text: &str) -> Result<f64, String> {
    let fps = text.parse::<f64>().ok().filter(|fps| fps.is_finite() && *fps > 0.0);
    fps.ok_or_else(|| "expected frames per second above 0, such as 24 or 29.97".to_owned())
}

fn shutter(text: &str) -> Result<f64, String> {
    let share = text.parse::<f64>().ok().filter(|share| (0.0..=1.0).contains(share));
    share.ok_or_else(|| "expected the share of a frame's time that the shutter is open, 0 to 1, such as 0.5".to_owned())
}

fn switch(text: &str) -> Result<bool, String> {
    match text {
        "on" => Ok(true),
        "off" => Ok(false),
        _ => Err("expected on or off".to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;
    use proptest::prelude::*;

    #[derive(Parser)]
    struct Line {
        #[command(flatten)]
        time: TimeOptions,
    }

    fn asked(words: &[&str]) -> Request {
        let words = std::iter::once("gradfarm").chain(words.iter().copied());
        Line::try_parse_from(words).unwrap().time.ask(Request::default())
    }

    #[test]
    fn ranges_are_read_as_they_are_meant() {
        let read = |text: &str| frames(text).map(|range| (range.0.start, range.0.end));
        assert_eq!((read("0..48"), read("0..=47"), read("12"), read(" 3 .. 5")), (Ok((0, 48)), Ok((0, 48)), Ok((12, 13)), Ok((3, 5))));
        for (bad, part) in
            [("5..5", "no frame from 5"), ("9..3", "no frame"), ("a..3", "0..48"), ("-1", "0..48"), ("0..4294967295", "at most")]
        {
            assert!(read(bad).unwrap_err().contains(part), "{bad}");
        }
    }

    proptest! {
        #[test]
        fn any_text_is_a_range_or_an_error(text in ".{0,20}", a in 0u32..1000, b in 0u32..1000) {
            let _ = frames(&text);
            prop_assert_eq!(frames(&format!("{a}..{b}")).is_ok(), a < b);
            prop_assert_eq!(frames(&format!("{a}..={b}")).is_ok(), a <= b);
        }
    }

    #[test]
    fn time_is_asked_for_as_a_whole() {
        assert_eq!(asked(&[]), Request::default());
        let request =
            asked(&["--frames", "0..=9", "--fps", "30", "--shutter", "0.5", "--motion-vectors", "off", "--no-temporal", "--window=4"]);
        assert_eq!(request.timeline, Some(Timeline { fps: 30.0, shutter: 0.5, instants: Timeline::INSTANTS }));
        assert_eq!((request.frames, request.temporal, request.motion, request.window), (10, Some(false), Some(false), Some(4)));
        assert_eq!(asked(&["--temporal"]).temporal, Some(true));
    }
}
