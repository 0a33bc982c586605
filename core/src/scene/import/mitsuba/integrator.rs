//! Mitsuba's integrators: what they say of the picture is how far light is followed.

use super::super::xml::Element;
use super::context::Context;
use crate::scene::description::Integrator;
use crate::scene::error::{Error, ErrorKind};
use crate::scene::limits;

/// Integrators that measure what `path` does, in another way.
const OTHERS: [&str; 22] = [
    "volpath",
    "volpathmis",
    "volpath_simple",
    "bdpt",
    "ptracer",
    "prb",
    "prb_basic",
    "prb_projective",
    "prbvolpath",
    "photonmapper",
    "ppm",
    "sppm",
    "mlt",
    "pssmlt",
    "erpt",
    "vpl",
    "gpt",
    "gbdpt",
    "direct_projective",
    "emission_reparam",
    "mcmc",
    "pathmis",
];

/// Integrators around another one, which alone counts.
const AROUND: [&str; 6] = ["aov", "moment", "stokes", "adaptive", "irrcache", "multichannel"];

impl<'a> Context<'a> {
    pub(super) fn integrator(&mut self, element: &'a Element) -> Result<Integrator, Error> {
        let kind = self.kind(element)?;
        if AROUND.contains(&kind) {
            self.note(element, format!("{kind} is left aside: only the integrator inside counts"));
            let inner = self.nested_one(element, "integrator")?;
            element.children.iter().for_each(|child| child.used.set(true));
            let inner = inner.ok_or_else(|| element.fault(ErrorKind::Unsupported, "no integrator inside", "path or one like it"))?;
            return self.integrator(inner);
        }
        let longest = match kind {
            "path" => None,
            // Emitters, and surfaces lit by them.
            "direct" => Some(2),
            "depth" | "ao" | "field" => return Err(self.unsupported(element, "an integrator that measures light, such as path")),
            other if OTHERS.contains(&other) => {
                self.note(element, format!("{other} is not here: `path` measures the same picture"));
                None
            }
            _ => return Err(self.unsupported(element, "path")),
        };
        let max_depth = match (longest, self.integer(element, "max_depth")?) {
            (Some(longest), _) => longest,
            (None, Some(depth)) if depth >= 0 => u32::try_from(depth).unwrap_or(u32::MAX),
            (None, Some(-1) | None) => {
                self.note(element, format!("paths of any length: cut at {} edges", limits::PATH_EDGES));
                limits::PATH_EDGES
            }
            (None, Some(_)) => 0,
        };
        let roulette_depth = match self.integer(element, "rr_depth")? {
            Some(depth) => u32::try_from(depth).unwrap_or(0),
            None => Integrator::default().roulette_depth,
        };
        if self.boolean(element, "hide_emitters")?.unwrap_or(false) {
            return Err(element.fault(ErrorKind::Unsupported, "hide_emitters", "emitters that the camera sees"));
        }
        let ways = [
            "strict_normals",
            "emitter_samples",
            "bsdf_samples",
            "shading_samples",
            "light_image",
            "sample_direct",
            "samples_per_pass",
            "block_size",
        ];
        self.leave(element, &ways, "says how Mitsuba samples")?;
        if kind != "path" {
            // Radii, photons, mutations: how the other integrator works.
            for child in element.children.iter().filter(|child| !child.used.get()) {
                child.used.set(true);
                self.note(child, "says how Mitsuba samples");
            }
        }
        self.finish(element, "max_depth and rr_depth")?;
        Ok(Integrator { max_depth, roulette_depth })
    }
}
