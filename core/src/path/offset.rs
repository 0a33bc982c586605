//! The shifted camera subpath: geometry and Jacobian, nothing of contributions or densities.

use super::leg::Passage;
use super::vertex::Vertex;
use crate::math::Vec3;

/// Why a shift has no answer. Not an error: the offset path then counts with contribution and density zero.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ShiftFailure {
    /// An offset ray met nothing where the base ray met something, or the reverse.
    Escaped,
    /// The reconnecting segment is blocked.
    Occluded,
    /// The offset cannot scatter as the base did.
    LobeMismatch,
    /// The copied refraction is totally reflected.
    TotalReflection,
    /// The shift back would be of another kind.
    Irreversible,
}

/// How the offset path ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OffsetEnd {
    /// From this vertex of the base path on, both are one.
    Rejoined {
        /// Index of the first shared vertex, ≥ 1.
        at: usize,
    },
    /// There is no offset vertex of this index.
    Failed {
        /// Index of the first vertex that is missing.
        at: usize,
        /// Why.
        why: ShiftFailure,
    },
    /// It ran beside the base path to its end.
    Followed {
        /// Whether both left the scene with the last step.
        escaped: bool,
    },
}

/// One step of the offset path.
#[derive(Clone, Copy, Debug)]
pub struct OffsetStep {
    /// Unit world direction.
    pub wi: Vec3,
    /// Factor on |∂T/∂x| by this step, in solid angle at its vertex, > 0 [1].
    pub jacobian: f64,
    /// What lies along it.
    pub passage: Passage,
}

/// The offset path, up to where it rejoins the base path. Scratch, like the base path.
#[derive(Clone, Debug)]
pub struct OffsetSubpath {
    /// What lies along the leg from the camera.
    pub camera: Passage,
    /// Vertex k is the shifted vertex k of the base path.
    pub vertices: Vec<Vertex>,
    /// Step k leads from offset vertex k.
    pub steps: Vec<OffsetStep>,
    /// Light-emitting surface points met at offset vertices, by vertex.
    pub emitters: Vec<Option<crate::light::LightPoint>>,
    /// How it ends.
    pub end: OffsetEnd,
    /// Rays traced for it.
    pub rays: u32,
}

impl Default for OffsetSubpath {
    fn default() -> Self {
        Self {
            camera: Passage::CLEAR,
            vertices: Vec::new(),
            steps: Vec::new(),
            emitters: Vec::new(),
            end: OffsetEnd::Followed { escaped: false },
            rays: 0,
        }
    }
}

impl OffsetSubpath {
    /// Empties it.
    pub fn clear(&mut self) {
        self.camera = Passage::CLEAR;
        self.vertices.clear();
        self.steps.clear();
        self.emitters.clear();
        self.end = OffsetEnd::Followed { escaped: false };
        self.rays = 0;
    }
}
