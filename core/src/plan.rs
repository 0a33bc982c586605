//! The plan of a job: which technique, shift, planes and reconstruction, resolved from what the scene calls for and what was asked.

mod exposure;
mod guide;
mod moments;
mod passes;
mod resolve;
mod stop;
mod switched;
mod temporal;
mod timeline;

pub use crate::accuracy::Stop;
pub use crate::reconstruction::ReconstructionKind;
pub use crate::shift::ShiftKind;
pub use guide::{Guide, TileGuide};
pub use passes::{Pass, Slice};
pub use resolve::{PlanError, resolve};
pub use timeline::{Temporal, Timeline};

use crate::effects::Effect;
use crate::film::PlaneKind;
use crate::lattice::{Extent, Half, Moment, Offset, SampleRange, Tile};

/// A plan never asks for more links than films have room for.
const _: () = assert!(crate::scene::limits::LINKS == PlaneKind::SLOTS as u32);

/// The technique by the name that people use for it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Technique {
    /// Path tracing with next-event estimation: the path integrator without gradients.
    Pt,
    /// Gradient-domain path tracing: the same paths, shifted to the four neighbours.
    Gpt,
    /// Path reusing in the gradient domain: groups of pixels share all their paths (Bauszat et al. 2017).
    Reuse,
    /// Generalised gradients: the paths of `Gpt`, shifted to similar pixels nearby (Manzi et al. 2014).
    Graph,
}

impl Technique {
    /// Every technique.
    pub const ALL: [Technique; 4] = [Technique::Pt, Technique::Gpt, Technique::Reuse, Technique::Graph];

    /// Its name on the command line and on the wire.
    pub fn name(self) -> &'static str {
        match self {
            Technique::Pt => "pt",
            Technique::Gpt => "gpt",
            Technique::Reuse => "reuse",
            Technique::Graph => "graph",
        }
    }

    /// Whether it can simulate an effect.
    pub fn carries(self, effect: Effect) -> bool {
        match self {
            // Paths from the camera find light by chance or by choosing its point: a mirror hides both ways to a light without extent.
            Technique::Pt | Technique::Gpt | Technique::Reuse | Technique::Graph => effect != Effect::LostCaustics,
        }
    }

    /// Whether it measures gradients.
    pub fn measures_gradients(self) -> bool {
        self != Technique::Pt
    }

    /// Whether a reconstruction can use what it measures.
    pub fn takes(self, reconstruction: ReconstructionKind) -> bool {
        match reconstruction {
            ReconstructionKind::None | ReconstructionKind::Auto => true,
            ReconstructionKind::Graph => self == Technique::Graph,
            _ => matches!(self, Technique::Gpt | Technique::Reuse),
        }
    }

    /// Whether it estimates the difference across a step of the lattice at the step's base pixel.
    fn measures(self, step: Offset) -> bool {
        match self {
            Technique::Pt | Technique::Graph => false,
            Technique::Gpt => true,
            // A group has both directions of a difference at once.
            Technique::Reuse => step.step > 0,
        }
    }

    /// Whether pixels may have different numbers of samples: each is then measured by itself.
    pub fn takes_rounds(self) -> bool {
        matches!(self, Technique::Pt | Technique::Gpt)
    }
}

/// A named choice: the inverse of `name()` for techniques and reconstructions.
pub fn by_name<T: Copy>(all: &[T], name: impl Fn(T) -> &'static str, wanted: &str) -> Option<T> {
    all.iter().copied().find(|item| name(*item) == wanted)
}

/// What a person asks for; `None` leaves the choice to the plan.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Request {
    /// Technique, or `None` for `auto`.
    pub technique: Option<Technique>,
    /// Reconstruction, or `None` for `auto`.
    pub reconstruction: Option<ReconstructionKind>,
    /// Samples per pixel, or `None` for the default of 64; the most where an error or a time is asked for, then 65 536 by default.
    pub samples: Option<u32>,
    /// Film size, or `None` for the scene's own.
    pub extent: Option<Extent>,
    /// Seed of all randomness.
    pub seed: u64,
    /// Weight of the primal in the reconstruction, or `None` for the one that the measured noise calls for.
    pub alpha: Option<f32>,
    /// Whether negative values of the finished image become zero, which biases it.
    pub clamp: bool,
    /// Longest path in edges (1 = directly visible emitters only), or `None` for the scene's own.
    pub max_depth: Option<u32>,
    /// Shift, or `None` for `auto`.
    pub shift: Option<ShiftKind>,
    /// Least probability with which Russian roulette lets a shift happen, in (0, 1], or `None` for the default.
    pub shift_survival: Option<f32>,
    /// Edge of the groups of pixels that reuse one another's paths [pixels], or `None` for the default.
    pub reuse_edge: Option<u32>,
    /// Most links of a pixel to similar ones, or `None` for the default.
    pub links: Option<u32>,
    /// Rounds in which samples are placed; 1 places them evenly. `None` for the default.
    pub rounds: Option<u32>,
    /// When a frame stops before it has all its samples.
    pub stop: Stop,
    /// How many frames are asked for; 0 counts as one.
    pub frames: u32,
    /// When frames of an animated scene are, and how they are exposed; `None` for the default.
    pub timeline: Option<Timeline>,
    /// Whether frames are reconstructed together, or `None` for `auto`.
    pub temporal: Option<bool>,
    /// Moments of a window, or `None` for the default.
    pub window: Option<u32>,
    /// Moments from window to window, or `None` for the default.
    pub stride: Option<u32>,
    /// Whether temporal differences follow what moves, or `None` for the default.
    pub motion: Option<bool>,
}

/// Everything that the bits of a frame depend on besides the scene. Two equal plans over equal scenes give equal images.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// Film size.
    pub extent: Extent,
    /// Technique.
    pub technique: Technique,
    /// Reconstruction.
    pub reconstruction: ReconstructionKind,
    /// Samples per pixel, both halves together, ≥ 1; their mean over the film where there are several rounds. The most where `stop` may
    /// end a frame before.
    pub samples: u32,
    /// Samples per unit of work. It fixes the shape of the sums, so it depends on nothing but this version of the code.
    pub batch: u32,
    /// Seed of all randomness.
    pub seed: u64,
    /// Weight of the primal in the reconstruction, > 0; `None` for the one that the measured noise calls for.
    pub alpha: Option<f32>,
    /// Whether negative values of the finished image become zero, which biases it.
    pub clamp: bool,
    /// Longest path in edges: 1 shows emitters only, 2 adds one bounce.
    pub max_depth: u32,
    /// Edges after which Russian roulette starts.
    pub roulette_depth: u32,
    /// Shift.
    pub shift: ShiftKind,
    /// Roughness at and above which a vertex counts as connectable for shifts (0.001 in Kettunen et al. 2015).
    pub shift_threshold: f32,
    /// Least probability with which Russian roulette lets a shift happen, in (0, 1]; 1 shifts always.
    pub shift_survival: f32,
    /// Edge of the groups of pixels that reuse one another's paths [pixels], where the technique does that.
    pub reuse_edge: u32,
    /// Most links of a pixel to similar ones, where the technique measures along links.
    pub links: u32,
    /// Rounds in which samples are placed; 1 places them evenly.
    pub rounds: u32,
    /// When a frame stops before it has all its samples.
    pub stop: Stop,
    /// When frames are, where the scene is animated.
    pub timeline: Option<Timeline>,
    /// How moments are reconstructed together, if they are.
    pub temporal: Option<Temporal>,
    /// Why each choice was made, for people.
    pub reasons: Vec<String>,
}

impl Plan {
    /// Samples per unit of work.
    pub const BATCH: u32 = 16;

    /// The planes that each block carries.
    pub fn layout(&self) -> Vec<PlaneKind> {
        let mut layout = PlaneKind::layout(self.technique.measures_gradients());
        layout.retain(|kind| match kind {
            PlaneKind::Gradient(_, step) | PlaneKind::GradientSquared(_, step) => self.technique.measures(*step),
            _ => true,
        });
        if self.technique == Technique::Graph {
            layout.extend(PlaneKind::links(self.links.min(u32::from(PlaneKind::SLOTS)) as u8));
        }
        if self.temporal.is_some_and(|temporal| temporal.motion) {
            layout.push(PlaneKind::Motion);
        }
        if self.rounds > 1 {
            layout.extend(Half::ALL.map(PlaneKind::Count));
        }
        layout
    }

    /// Tiles whose edges are multiples of this are cheapest to render: no group of pixels is then rendered twice [pixels].
    pub fn grain(&self) -> u32 {
        if self.technique == Technique::Reuse { self.reuse_edge.max(1) } else { 1 }
    }

    /// The runs of samples that each tile is rendered in, where samples are placed evenly; [`Plan::passes`] in any case.
    pub fn sample_ranges(&self) -> Vec<SampleRange> {
        SampleRange::batches(self.samples, self.batch)
    }
}

/// A unit of work: the pure function [`render_unit`](crate::render::render_unit) maps it to a block.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct WorkUnit {
    /// Which frames it is for.
    pub moment: Moment,
    /// Pixels.
    pub tile: Tile,
    /// Samples of each pixel.
    pub samples: SampleRange,
}
