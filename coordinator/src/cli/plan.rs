//! `gradfarm plan`: what would be done with a scene, and why, without doing it.

use std::collections::BTreeMap;
use std::path::PathBuf;

use gradfarm_core::effects::{self, Effects};
use gradfarm_core::plan::{self, Plan as CorePlan};
use gradfarm_core::scene::SceneDescription;
use serde::Serialize;

use super::error::Error;
use super::options::RenderOptions;
use super::terminal;
use crate::api::json::PlanView;

/// Arguments of `gradfarm plan`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  gradfarm plan tests/scenes/cornell-box.json
  gradfarm plan scene.xml --technique gpt --json")]
pub(super) struct Plan {
    /// The scene: gradfarm JSON, Mitsuba XML, glTF or pbrt
    scene: PathBuf,
    #[command(flatten)]
    options: RenderOptions,
    /// Print one JSON object instead
    #[arg(long)]
    json: bool,
}

impl Plan {
    /// Reads the scene, makes the plan and prints it.
    pub(super) fn run(&self) -> Result<(), Error> {
        let scene = super::scene::read(&self.scene)?;
        let mut plan = plan::resolve(&scene.description, &self.options.request_for(&scene.description))?;
        let moments = plan.moments(&scene.description, self.options.frames(&scene.description).range())?;
        plan.tell_moments(&moments);
        if self.json {
            terminal::json(&answer(&plan, &effects::analyse(&scene.description)))
        } else {
            self.print(&plan, &scene.description)
        }
    }

    fn print(&self, plan: &CorePlan, scene: &SceneDescription) -> Result<(), Error> {
        let files = match scene.assets().len() {
            0 => String::new(),
            1 => ", 1 file beside it".to_owned(),
            n => format!(", {n} files beside it"),
        };
        terminal::line(format_args!("scene           {}{files}", self.scene.display()))?;
        terminal::line(format_args!("film            {} × {} pixels", plan.extent.width, plan.extent.height))?;
        terminal::line(format_args!("technique       {}", plan.technique.name()))?;
        let alpha = plan.alpha.map_or_else(|| "by noise".to_owned(), |alpha| alpha.to_string());
        terminal::line(format_args!(
            "reconstruction  {} (alpha {alpha}){}",
            plan.reconstruction.name(),
            if plan.clamp { ", negative values set to zero" } else { "" }
        ))?;
        terminal::line(format_args!("samples         {} per pixel, in runs of {}", plan.samples, plan.batch))?;
        if plan.rounds_double() {
            terminal::line(format_args!(
                "rounds          {} at most, each as long as all before it: a quarter of it for every pixel, the rest on average where the \
                 noise is",
                plan.rounds
            ))?;
        } else if plan.rounds > 1 {
            let even = plan.even_before(plan.rounds);
            let guided = plan.samples - even;
            terminal::line(format_args!(
                "rounds          {}: {even} samples for every pixel, {guided} on average where the noise is",
                plan.rounds
            ))?;
        }
        terminal::line(format_args!("paths           up to {} edges, roulette after {}", plan.max_depth, plan.roulette_depth))?;
        if plan.technique.measures_gradients() {
            terminal::line(format_args!("shift           {} (connectable from roughness {} on)", plan.shift.name(), plan.shift_threshold))?;
        }
        terminal::line(format_args!("seed            {}", plan.seed))?;
        terminal::line("the scene calls for")?;
        let effects = effects::analyse(scene);
        for (effect, _) in effects.iter() {
            terminal::line(format_args!("  - {effect}: {}", effects.told(effect)))?;
        }
        terminal::line("therefore")?;
        for reason in &plan.reasons {
            terminal::line(format_args!("  - {reason}"))?;
        }
        Ok(())
    }
}

/// What programs read.
#[derive(Serialize)]
struct Answer<'a> {
    #[serde(flatten)]
    plan: PlanView,
    /// What calls for each effect.
    effects: BTreeMap<&'static str, &'a [String]>,
}

fn answer<'a>(plan: &CorePlan, effects: &'a Effects) -> Answer<'a> {
    Answer { plan: plan.into(), effects: effects.iter().map(|(effect, because)| (effect.name(), because)).collect() }
}
