//! The plan of a job.

use gradfarm_core::plan::{Plan, ReconstructionKind, ShiftKind, Stop, Technique, Temporal, Timeline, by_name};
use gradfarm_core::scene::limits as scene;

use super::ConvertError;
use crate::{limits, v1};

impl From<&Plan> for v1::Plan {
    fn from(plan: &Plan) -> Self {
        Self {
            extent: Some(plan.extent.into()),
            technique: plan.technique.name().to_owned(),
            reconstruction: plan.reconstruction.name().to_owned(),
            samples: plan.samples,
            batch: plan.batch,
            seed: plan.seed,
            alpha: plan.alpha,
            clamp: plan.clamp,
            max_depth: plan.max_depth,
            roulette_depth: plan.roulette_depth,
            shift_threshold: plan.shift_threshold,
            reasons: plan.reasons.clone(),
            shift: plan.shift.name().to_owned(),
            shift_survival: plan.shift_survival,
            reuse_edge: plan.reuse_edge,
            links: plan.links,
            rounds: plan.rounds,
            stop_error: plan.stop.error,
            stop_seconds: plan.stop.seconds,
            curve: plan.stop.curve,
            timeline: plan.timeline.map(|t| v1::Timeline { fps: t.fps, shutter: t.shutter, instants: t.instants }),
            temporal: plan.temporal.map(|t| v1::Temporal { window: t.window, stride: t.stride, motion: t.motion }),
        }
    }
}

impl TryFrom<v1::Plan> for Plan {
    type Error = ConvertError;

    fn try_from(message: v1::Plan) -> Result<Self, ConvertError> {
        let up_to = |field, value: u32, most: u32| {
            if (1..=most).contains(&value) { Ok(value) } else { Err(ConvertError::range(field, value, format!("1 to {most}"))) }
        };
        let counted = |field, value: u32| up_to(field, value, limits::SAMPLES);
        if let Some(alpha) = message.alpha.filter(|alpha| !(alpha.is_finite() && *alpha > 0.0)) {
            return Err(ConvertError::range("plan.alpha", alpha, "a finite number above 0"));
        }
        if !(message.shift_threshold.is_finite() && message.shift_threshold >= 0.0) {
            return Err(ConvertError::range("plan.shift_threshold", message.shift_threshold, "a finite number, 0 or above"));
        }
        if !(message.shift_survival > 0.0 && message.shift_survival <= 1.0) {
            return Err(ConvertError::range("plan.shift_survival", message.shift_survival, "a number above 0, at most 1"));
        }
        if message.reasons.len() > limits::LINES || message.reasons.iter().any(|reason| reason.len() > limits::TEXT) {
            let expected = format!("at most {} lines of at most {} bytes", limits::LINES, limits::TEXT);
            return Err(ConvertError::range("plan.reasons", format!("{} lines", message.reasons.len()), expected));
        }
        let extent = message.extent.ok_or(ConvertError::Missing { field: "plan.extent" })?;
        Ok(Self {
            extent: extent.try_into()?,
            technique: by_name(&Technique::ALL, Technique::name, &message.technique)
                .ok_or_else(|| unknown("plan.technique", &message.technique, &Technique::ALL.map(Technique::name)))?,
            reconstruction: by_name(&ReconstructionKind::ALL, ReconstructionKind::name, &message.reconstruction).ok_or_else(|| {
                unknown("plan.reconstruction", &message.reconstruction, &ReconstructionKind::ALL.map(ReconstructionKind::name))
            })?,
            samples: counted("plan.samples", message.samples)?,
            batch: counted("plan.batch", message.batch)?,
            seed: message.seed,
            alpha: message.alpha,
            clamp: message.clamp,
            max_depth: counted("plan.max_depth", message.max_depth)?,
            roulette_depth: message.roulette_depth,
            shift: by_name(&ShiftKind::ALL, ShiftKind::name, &message.shift)
                .ok_or_else(|| unknown("plan.shift", &message.shift, &ShiftKind::ALL.map(ShiftKind::name)))?,
            shift_threshold: message.shift_threshold,
            shift_survival: message.shift_survival,
            reuse_edge: up_to("plan.reuse_edge", message.reuse_edge, scene::REUSE_EDGE)?,
            links: up_to("plan.links", message.links, scene::LINKS)?,
            rounds: up_to("plan.rounds", message.rounds, scene::ROUNDS)?,
            stop: Stop {
                error: above_zero("plan.stop_error", message.stop_error)?,
                seconds: above_zero("plan.stop_seconds", message.stop_seconds)?,
                curve: message.curve,
            },
            timeline: message.timeline.map(timeline).transpose()?,
            temporal: message.temporal.map(temporal).transpose()?,
            reasons: message.reasons,
        })
    }
}

fn timeline(message: v1::Timeline) -> Result<Timeline, ConvertError> {
    let v1::Timeline { fps, shutter, instants } = message;
    if !(fps.is_finite() && fps > 0.0) {
        return Err(ConvertError::range("plan.timeline.fps", fps, "a finite number above 0"));
    }
    if !(0.0..=1.0).contains(&shutter) {
        return Err(ConvertError::range("plan.timeline.shutter", shutter, "0 to 1"));
    }
    if !(1..=Timeline::MOST_INSTANTS).contains(&instants) {
        return Err(ConvertError::range("plan.timeline.instants", instants, format!("1 to {}", Timeline::MOST_INSTANTS)));
    }
    Ok(Timeline { fps, shutter, instants })
}

fn temporal(message: v1::Temporal) -> Result<Temporal, ConvertError> {
    let v1::Temporal { window, stride, motion } = message;
    if !(1..=Temporal::MOST).contains(&window) {
        return Err(ConvertError::range("plan.temporal.window", window, format!("1 to {}", Temporal::MOST)));
    }
    if !(1..=window).contains(&stride) {
        return Err(ConvertError::range("plan.temporal.stride", stride, format!("1 to {window}")));
    }
    Ok(Temporal { window, stride, motion })
}

fn above_zero(field: &'static str, value: Option<f64>) -> Result<Option<f64>, ConvertError> {
    match value {
        Some(value) if !(value.is_finite() && value > 0.0) => Err(ConvertError::range(field, value, "a finite number above 0")),
        sound => Ok(sound),
    }
}

fn unknown(field: &'static str, found: &str, known: &[&str]) -> ConvertError {
    ConvertError::range(field, format!("{:?}", found.chars().take(80).collect::<String>()), format!("one of {}", known.join(", ")))
}

#[cfg(test)]
mod tests {
    use super::*;
    use gradfarm_core::lattice::Extent;
    use proptest::prelude::*;

    fn plan() -> Plan {
        Plan {
            extent: Extent { width: 40, height: 30 },
            technique: Technique::Gpt,
            reconstruction: ReconstructionKind::L2,
            samples: 64,
            batch: Plan::BATCH,
            seed: u64::MAX - 3,
            alpha: Some(0.2),
            clamp: false,
            max_depth: 12,
            roulette_depth: 5,
            shift: ShiftKind::Hybrid,
            shift_threshold: 0.001,
            shift_survival: 1.0,
            reuse_edge: 6,
            links: 8,
            rounds: 1,
            stop: Stop::default(),
            timeline: None,
            temporal: None,
            reasons: vec!["gradients: asked for".into()],
        }
    }

    proptest! {
        #[test]
        fn round_trip(technique in 0..Technique::ALL.len(), reconstruction in 0..ReconstructionKind::ALL.len(), shift in 0..ShiftKind::ALL.len(), samples in 1u32..1 << 20, seed: u64, alpha in prop::option::of(1e-6f32..1e6), clamp: bool, error in prop::option::of(1e-9f64..1.0)) {
            let mut plan = plan();
            plan.technique = Technique::ALL[technique];
            plan.reconstruction = ReconstructionKind::ALL[reconstruction];
            plan.shift = ShiftKind::ALL[shift];
            (plan.samples, plan.seed, plan.alpha, plan.clamp) = (samples, seed, alpha, clamp);
            (plan.shift_survival, plan.reuse_edge, plan.links, plan.rounds) = (0.25, 5, 7, 3);
            plan.stop = Stop { error, seconds: error.map(|e| e * 1e3), curve: seed % 2 == 0 };
            plan.timeline = error.map(|e| Timeline { fps: 1.0 + e, shutter: e, instants: 1 + samples % 256 });
            plan.temporal = alpha.map(|_| Temporal { window: 10, stride: 1 + samples % 10, motion: clamp });
            prop_assert_eq!(Plan::try_from(v1::Plan::from(&plan)), Ok(plan));
        }
    }

    #[test]
    fn nonsense_is_named() {
        let spoil = |change: fn(&mut v1::Plan)| {
            let mut message = v1::Plan::from(&plan());
            change(&mut message);
            Plan::try_from(message).unwrap_err().to_string()
        };
        assert_eq!(spoil(|p| p.extent = None), "plan.extent is missing");
        assert_eq!(spoil(|p| p.technique = "magic".into()), "plan.technique is \"magic\", expected one of pt, gpt, reuse, graph");
        assert_eq!(
            spoil(|p| p.shift = "magic".into()),
            "plan.shift is \"magic\", expected one of hybrid, reconnection, replay, replay-reconnection, composable"
        );
        assert!(spoil(|p| p.shift_survival = 0.0).starts_with("plan.shift_survival is 0"));
        assert!(spoil(|p| p.links = 1000).starts_with("plan.links is 1000"));
        assert!(spoil(|p| p.alpha = Some(f32::NAN)).starts_with("plan.alpha is NaN"));
        assert!(spoil(|p| p.stop_error = Some(f64::NAN)).starts_with("plan.stop_error is NaN"));
        assert!(spoil(|p| p.stop_seconds = Some(0.0)).starts_with("plan.stop_seconds is 0"));
        assert!(
            spoil(|p| p.timeline = Some(v1::Timeline { fps: f64::INFINITY, shutter: 0.5, instants: 4 }))
                .starts_with("plan.timeline.fps is inf")
        );
        assert!(
            spoil(|p| p.timeline = Some(v1::Timeline { fps: 24.0, shutter: 0.5, instants: 1000 }))
                .starts_with("plan.timeline.instants is 1000")
        );
        assert!(spoil(|p| p.temporal = Some(v1::Temporal { window: 4, stride: 5, motion: true })).starts_with("plan.temporal.stride is 5"));
        assert!(spoil(|p| p.samples = 0).starts_with("plan.samples is 0"));
        assert!(spoil(|p| p.batch = 0).starts_with("plan.batch is 0"));
        assert!(spoil(|p| p.reasons = vec![String::new(); 1000]).starts_with("plan.reasons is 1000 lines"));
    }
}
