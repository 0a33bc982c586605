//! Whether frames are reconstructed together, and by which windows.

use super::{Plan, PlanError, ReconstructionKind, Request, Technique, Temporal, Timeline};

/// Samples per pixel must be a multiple of this: two copies of two halves each.
const GRAIN: u32 = 4;

/// Checks when frames are; `None` where nothing moves, for then all frames are the same.
pub(super) fn timeline(asked: Option<Timeline>, moving: bool, reasons: &mut Vec<String>) -> Result<Option<Timeline>, PlanError> {
    let timeline = asked.unwrap_or_default();
    let out_of_range = |what, found: String, expected: &str| Err(PlanError::OutOfRange { what, found, expected: expected.to_string() });
    if !(timeline.fps.is_finite() && timeline.fps > 0.0) {
        return out_of_range("frames per second", timeline.fps.to_string(), "a finite number above 0, such as 24");
    }
    if !(0.0..=1.0).contains(&timeline.shutter) {
        return out_of_range("shutter", timeline.shutter.to_string(), "the share of a frame's time that it is open, 0 to 1");
    }
    if !(1..=Timeline::MOST_INSTANTS).contains(&timeline.instants) {
        return out_of_range("instants", timeline.instants.to_string(), &format!("1 to {}", Timeline::MOST_INSTANTS));
    }
    if !moving {
        return Ok(None);
    }
    reasons.push(match timeline.instants() {
        1 => format!("{} frames per second, each a single instant: no motion blur", timeline.fps),
        n => format!(
            "{} frames per second, the shutter open for {} of each: motion is sampled at {n} instants",
            timeline.fps, timeline.shutter
        ),
    });
    Ok(Some(timeline))
}

/// Whether frames are reconstructed together: where they can be, unless somebody asked for the contrary.
pub(super) fn temporal(
    request: &Request,
    technique: Technique,
    samples: u32,
    moving: bool,
    reasons: &mut Vec<String>,
) -> Result<Option<Temporal>, PlanError> {
    let asked = request.temporal == Some(true);
    if request.temporal == Some(false) || request.frames <= 1 && !asked {
        return Ok(None);
    }
    if let Some((missing, try_instead)) = hindrance(request, technique, samples, moving) {
        if asked {
            return Err(PlanError::Missing { choice: "reconstructing frames together".to_string(), missing, try_instead });
        }
        reasons.push(format!("frames are reconstructed one by one: doing it together needs {missing}"));
        return Ok(None);
    }
    let default = Temporal::default();
    let window = request.window.unwrap_or(default.window);
    let stride = request.stride.unwrap_or(default.stride.min(window));
    let pixel_by_pixel = technique == Technique::Gpt;
    if request.motion == Some(true) && !pixel_by_pixel {
        return Err(PlanError::Missing {
            choice: "following what moves".to_string(),
            missing: format!("pixels that draw their own paths, which technique {} does not let them", technique.name()),
            try_instead: format!("technique {}", Technique::Gpt.name()),
        });
    }
    let temporal = Temporal { window, stride, motion: request.motion.unwrap_or(default.motion && pixel_by_pixel) };
    let range = |what, found: u32, most: u32| match found {
        found if (1..=most).contains(&found) => Ok(()),
        found => Err(PlanError::OutOfRange { what, found: found.to_string(), expected: format!("1 to {most} moments") }),
    };
    range("window", window, Temporal::MOST)?;
    range("stride", stride, window)?;
    reasons.push(format!(
        "frames are reconstructed together, in windows of {window} moments every {stride}: half B of a moment and half A of the next share \
         their seeds, so their difference tells how the image changes and costs nothing"
    ));
    if temporal.motion {
        reasons.push("differences in time follow what moves".to_string());
    }
    Ok(Some(temporal))
}

/// What frames lack to be reconstructed together, and what to try.
fn hindrance(request: &Request, technique: Technique, samples: u32, moving: bool) -> Option<(String, String)> {
    let kinds = || ReconstructionKind::ALL.into_iter().filter(|kind| kind.takes_windows()).map(ReconstructionKind::name);
    let told = |missing: &str, try_instead: &str| Some((missing.to_string(), try_instead.to_string()));
    if !moving {
        return told("a scene that is animated: one that rests is one moment", "an animated scene");
    }
    if !matches!(technique, Technique::Gpt | Technique::Reuse) {
        return told("differences between neighbouring pixels", &format!("technique {}", Technique::Gpt.name()));
    }
    if let Some(kind) = request.reconstruction.filter(|kind| *kind != ReconstructionKind::Auto && !kind.takes_windows()) {
        let missing = format!("a reconstruction that knows time, which {} does not", kind.name());
        return told(&missing, &format!("reconstruction {}", kinds().collect::<Vec<_>>().join(" or ")));
    }
    if request.rounds.is_some_and(|rounds| rounds > 1) {
        return told("the same number of samples in every pixel", "one round");
    }
    if request.stop.has_checks() {
        return told("a number of samples that is known from the start", "a number of samples instead of an error or a time");
    }
    if !samples.is_multiple_of(GRAIN) {
        return told(
            &format!("samples in two copies of two halves, which {samples} do not make"),
            &format!("a multiple of {GRAIN} samples"),
        );
    }
    None
}

/// Samples per unit of work, so that a moment has an even number of equal passes: every other one is a copy by itself.
pub(super) fn batch(samples: u32, temporal: Option<Temporal>) -> u32 {
    if temporal.is_none() {
        return Plan::BATCH;
    }
    let copy = samples / 2;
    (1..=Plan::BATCH / 2).rev().map(|half| 2 * half).find(|batch| copy.is_multiple_of(*batch)).unwrap_or(2)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moments_have_an_even_number_of_equal_passes() {
        for samples in (4..400).step_by(4) {
            let batch = batch(samples, Some(Temporal::default()));
            assert!(batch.is_multiple_of(2) && batch <= Plan::BATCH, "{samples}: {batch}");
            assert!(samples.is_multiple_of(batch) && (samples / batch).is_multiple_of(2), "{samples}: {batch}");
        }
        assert_eq!((batch(64, Some(Temporal::default())), batch(7, None)), (16, Plan::BATCH));
    }

    #[test]
    fn frames_go_together_where_they_can() {
        let told = |request: &Request, samples, moving| {
            let mut reasons = Vec::new();
            let temporal = temporal(request, Technique::Gpt, samples, moving, &mut reasons);
            (temporal, reasons.join("; "))
        };
        let batch = Request { frames: 24, ..Request::default() };
        assert_eq!(told(&batch, 64, true).0, Ok(Some(Temporal::default())));
        let (alone, why) = told(&batch, 66, true);
        assert!(alone == Ok(None) && why.contains("two copies of two halves"), "{why}");
        assert_eq!(told(&Request { temporal: Some(false), ..batch.clone() }, 64, true).0, Ok(None));
        assert_eq!(told(&Request { frames: 1, ..batch.clone() }, 64, true).0, Ok(None));
        let asked = Request { temporal: Some(true), ..batch.clone() };
        let fault = told(&asked, 64, false).0.unwrap_err().to_string();
        assert!(fault.contains("needs a scene that is animated"), "{fault}");
        let fault = told(&Request { reconstruction: Some(ReconstructionKind::Nfor), ..asked.clone() }, 64, true).0.unwrap_err().to_string();
        assert!(fault.contains("nfor does not") && fault.contains("l2"), "{fault}");
        let narrow = told(&Request { window: Some(3), ..batch.clone() }, 64, true).0;
        assert_eq!(narrow, Ok(Some(Temporal { window: 3, stride: 3, motion: true })));
        assert!(told(&Request { window: Some(3), stride: Some(4), ..batch }, 64, true).0.is_err());
    }

    #[test]
    fn times_are_checked() {
        let told = |timeline| timeline_told(timeline).map(|(_, why)| why).map_err(|fault| fault.to_string());
        let sound = Timeline { shutter: 0.5, ..Timeline::default() };
        assert!(told(sound).is_ok_and(|why| why.contains("16 instants")));
        for (bad, part) in [
            (Timeline { fps: f64::NAN, ..sound }, "frames per second: found NaN"),
            (Timeline { shutter: 1.5, ..sound }, "shutter: found 1.5"),
            (Timeline { instants: 0, ..sound }, "instants: found 0, expected 1 to 256"),
        ] {
            assert!(told(bad).unwrap_err().contains(part), "{part}");
        }
    }

    fn timeline_told(asked: Timeline) -> Result<(Option<Timeline>, String), PlanError> {
        let mut reasons = Vec::new();
        timeline(Some(asked), true, &mut reasons).map(|timeline| (timeline, reasons.join("; ")))
    }
}
