//! The graphics state: what directives set for all that follows, and the blocks that bring back what was before.

use std::collections::{BTreeMap, BTreeSet};

use glam::{DMat4, DVec3};

use super::spectrum::Space;
use crate::scene::description::Colour;

/// Deepest nesting of attribute blocks.
pub(super) const BLOCKS: usize = 1 << 12;

/// The light that shapes give off.
#[derive(Clone, Debug)]
pub(super) struct AreaLight {
    /// Radiance, without `power`.
    pub(super) radiance: Colour,
    /// An image that the radiance is multiplied with.
    pub(super) image: Option<String>,
    /// Power of each shape [W] that overrides the size of the radiance.
    pub(super) power: Option<f64>,
    pub(super) two_sided: bool,
}

/// What directives set for all that follows.
#[derive(Clone, Debug)]
pub(super) struct Attributes {
    /// From the frame of what follows to the world; before the camera, from the world to the camera.
    pub(super) ctm: DMat4,
    /// Name of the material in the description; the default one while `None`.
    pub(super) material: Option<String>,
    pub(super) light: Option<AreaLight>,
    pub(super) reverse: bool,
    pub(super) inside: Option<String>,
    pub(super) outside: Option<String>,
    pub(super) space: Space,
    /// Whether transforms are heard: not after `ActiveTransform EndTime`.
    pub(super) active: bool,
}

/// The attributes and the blocks that they came from.
#[derive(Clone, Debug)]
pub(super) struct State {
    attributes: Attributes,
    blocks: Vec<Attributes>,
    systems: BTreeMap<String, DMat4>,
    /// Media that were left out.
    forgotten: BTreeSet<String>,
}

impl Default for State {
    fn default() -> State {
        let attributes = Attributes {
            ctm: DMat4::IDENTITY,
            material: None,
            light: None,
            reverse: false,
            inside: None,
            outside: None,
            space: Space::Srgb,
            active: true,
        };
        State { attributes, blocks: Vec::new(), systems: BTreeMap::new(), forgotten: BTreeSet::new() }
    }
}

impl std::ops::Deref for State {
    type Target = Attributes;
    fn deref(&self) -> &Attributes {
        &self.attributes
    }
}

impl std::ops::DerefMut for State {
    fn deref_mut(&mut self) -> &mut Attributes {
        &mut self.attributes
    }
}

impl State {
    /// Whether a block is open.
    pub(super) fn is_inside(&self) -> bool {
        !self.blocks.is_empty()
    }

    /// Opens a block; false where they are nested too deep.
    pub(super) fn begin(&mut self) -> bool {
        self.blocks.push(self.attributes.clone());
        self.blocks.len() <= BLOCKS
    }

    /// Closes a block; false where none is open.
    pub(super) fn end(&mut self) -> bool {
        match self.blocks.pop() {
            Some(before) => {
                self.attributes = before;
                true
            }
            None => false,
        }
    }

    /// The present attributes, to be kept across the end of a block of transforms.
    pub(super) fn clone_attributes(&self) -> Attributes {
        self.attributes.clone()
    }

    /// Everything but the transform from `kept`: old blocks of transforms bring back nothing else.
    pub(super) fn keep_but_transform(&mut self, kept: Attributes) {
        self.attributes = Attributes { ctm: self.attributes.ctm, active: self.attributes.active, ..kept };
    }

    /// The world begins: its frame is that of what follows.
    pub(super) fn begin_world(&mut self) {
        self.attributes.ctm = DMat4::IDENTITY;
        self.attributes.active = true;
    }

    /// Puts a transform before those so far: it is applied first.
    pub(super) fn concat(&mut self, matrix: DMat4) {
        if self.attributes.active {
            self.attributes.ctm *= matrix;
        }
    }

    /// Replaces the transform.
    pub(super) fn set(&mut self, matrix: DMat4) {
        if self.attributes.active {
            self.attributes.ctm = matrix;
        }
    }

    /// Gives the present frame a name.
    pub(super) fn keep_system(&mut self, name: &str, matrix: DMat4) {
        self.systems.insert(name.to_string(), matrix);
    }

    /// Notes a medium that is left out.
    pub(super) fn forget_medium(&mut self, name: &str) {
        self.forgotten.insert(name.to_string());
    }

    /// Whether a medium was left out.
    pub(super) fn is_forgotten(&self, name: &str) -> bool {
        self.forgotten.contains(name)
    }

    /// A frame by its name.
    pub(super) fn system(&self, name: &str) -> Option<DMat4> {
        self.systems.get(name).copied()
    }
}

/// `LookAt`: from the world to a camera that looks along +Z with +X to the right and +Y up, all left-handed. `None` where the line of
/// sight has no length or lies along `up`.
pub(super) fn look_at([ex, ey, ez, lx, ly, lz, ux, uy, uz]: [f64; 9]) -> Option<DMat4> {
    let eye = DVec3::new(ex, ey, ez);
    let sight = (DVec3::new(lx, ly, lz) - eye).try_normalize()?;
    let right = DVec3::new(ux, uy, uz).try_normalize()?.cross(sight).try_normalize()?;
    let up = sight.cross(right);
    let camera = DMat4::from_cols(right.extend(0.0), up.extend(0.0), sight.extend(0.0), eye.extend(1.0));
    Some(camera.inverse()).filter(|matrix| matrix.is_finite())
}

/// `Rotate angle x y z`, counter-clockwise by right-handed count.
pub(super) fn rotation([degrees, x, y, z]: [f64; 4]) -> Option<DMat4> {
    let axis = DVec3::new(x, y, z).try_normalize()?;
    let (sin, cos) = libm::sincos(degrees.to_radians());
    let turn = |v: DVec3| v * cos + axis.cross(v) * sin + axis * (axis.dot(v) * (1.0 - cos));
    let columns = [turn(DVec3::X), turn(DVec3::Y), turn(DVec3::Z)].map(|column| column.extend(0.0));
    Some(DMat4::from_cols(columns[0], columns[1], columns[2], glam::DVec4::W))
}
