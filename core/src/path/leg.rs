//! What lies between two vertices: media that dim light and surfaces that let some of it pass.
//!
//! A scene without either is *clear*: its legs are single rays that cost one branch each.

use super::vertex::Vertex;
use crate::geometry::SurfacePoint;
use crate::light::LightPoint;
use crate::math::{Ray, Vec3, segment, spawn};
use crate::medium::MediumId;
use crate::scene::Scene;
use crate::spectrum::Spectrum;

/// Light and walks on their way along a leg.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Passage {
    /// Fraction of light that gets through [1]; times the scattering coefficient [m⁻¹] where the leg ends inside a medium, and times
    /// the opacity where it ends on a surface with holes.
    pub value: Spectrum,
    /// Density with which a walk along this leg ends where it did: [m⁻¹] inside a medium, else a probability.
    pub density: f32,
}

impl Passage {
    /// Nothing lies between.
    pub const CLEAR: Passage = Passage { value: Spectrum::WHITE, density: 1.0 };
    /// Nothing gets through.
    pub const BLOCKED: Passage = Passage { value: Spectrum::BLACK, density: 0.0 };

    /// Whether anything gets through.
    #[inline]
    pub fn is_open(&self) -> bool {
        self.density > 0.0
    }

    /// The factor on the throughput of a walk that took this leg.
    #[inline]
    pub fn weight(&self) -> Spectrum {
        self.value / self.density
    }

    #[inline]
    fn times(&mut self, value: Spectrum, density: f32) {
        self.value *= value;
        self.density *= density;
    }
}

/// Where a leg ends, in terms that a neighbouring ray can follow.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Stop {
    /// On a surface, after passing this many surfaces with holes. Boundaries that are nothing but holes do not count.
    Surface {
        /// How many.
        passed: u16,
    },
    /// Inside a medium, this far from the start [m].
    Medium {
        /// How far.
        distance: f32,
    },
    /// Nowhere: it leaves the scene.
    Escaped,
}

/// A leg of a base path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Leg {
    /// What it is worth.
    pub passage: Passage,
    /// Where it ends.
    pub stop: Stop,
}

impl Leg {
    /// A leg through empty space to the first surface.
    pub const CLEAR: Leg = Leg { passage: Passage::CLEAR, stop: Stop::Surface { passed: 0 } };
}

/// What a leg arrives at.
#[derive(Clone, Copy, Debug)]
pub enum Arrival {
    /// A surface.
    Surface(Landing),
    /// A point inside a medium.
    Medium(Collision),
    /// Nothing.
    Escaped,
}

/// Where a leg meets a surface.
#[derive(Clone, Copy, Debug)]
pub struct Landing {
    /// The surface.
    pub surface: SurfacePoint,
    /// The media before and behind it.
    pub media: [MediumId; 2],
    /// How much of it is there, in (0, 1].
    pub opacity: f32,
}

/// Where a leg ends inside a medium.
#[derive(Clone, Copy, Debug)]
pub struct Collision {
    /// World position.
    pub position: Vec3,
    /// Distance from the start of the leg [m].
    pub distance: f32,
    /// The medium.
    pub medium: MediumId,
}

/// Surfaces with holes, and boundaries, that one leg passes at most; light beyond is lost.
const CROSSINGS: u32 = 1024;

/// A way through boundaries and media, under construction.
struct Way {
    ray: Ray,
    medium: MediumId,
    travelled: f32,
    passed: u16,
    passage: Passage,
}

impl Way {
    fn new(ray: &Ray, medium: MediumId) -> Way {
        Way { ray: *ray, medium, travelled: 0.0, passed: 0, passage: Passage::CLEAR }
    }

    /// Passes this much of the present medium.
    fn pass(&mut self, scene: &Scene, distance: f32) {
        if let Some(medium) = scene.medium(self.medium) {
            let transmittance = medium.transmittance(distance);
            self.passage.times(transmittance, medium.pass_density(transmittance));
        }
    }

    /// Collides with the present medium after this distance; `None` in vacuum.
    fn collide(&mut self, scene: &Scene, distance: f32) -> Option<Arrival> {
        let (value, density) = {
            let medium = scene.medium(self.medium)?;
            medium.collision(medium.transmittance(distance))
        };
        self.passage.times(value, density);
        let position = self.ray.origin + self.ray.direction * distance;
        Some(Arrival::Medium(Collision { position, distance: self.travelled + distance, medium: self.medium }))
    }

    /// Goes on behind a surface, of which it met a hole.
    fn cross(&mut self, scene: &Scene, surface: &SurfacePoint) {
        let direction = self.ray.direction;
        self.medium = behind(scene, surface, direction, self.medium);
        self.travelled += surface.t;
        self.ray = spawn(surface.position, surface.error, surface.normal, direction);
    }

    /// Stops at a surface of which this much is there.
    fn land(&mut self, scene: &Scene, surface: SurfacePoint, opacity: f32) -> Arrival {
        self.passage.times(Spectrum::grey(opacity), opacity);
        let media = scene.media_at(&surface).unwrap_or([self.medium; 2]);
        Arrival::Surface(Landing { surface: SurfacePoint { t: self.travelled + surface.t, ..surface }, media, opacity })
    }
}

/// The medium beyond a surface for light of this direction.
#[inline]
fn behind(scene: &Scene, surface: &SurfacePoint, direction: Vec3, before: MediumId) -> MediumId {
    match scene.media_at(surface) {
        Some([outside, inside]) => {
            if direction.dot(surface.normal) > 0.0 {
                outside
            } else {
                inside
            }
        }
        None => before,
    }
}

/// Walks along a ray of unit direction until something stops it. `draw` gives the i-th number of this leg, in [0, 1).
#[inline(always)]
pub fn walk(scene: &Scene, ray: &Ray, medium: MediumId, draw: impl Fn(u32) -> f32) -> (Leg, Arrival) {
    if scene.is_clear() { clear(scene, ray) } else { walk_through(scene, ray, medium, draw) }
}

#[inline(always)]
fn clear(scene: &Scene, ray: &Ray) -> (Leg, Arrival) {
    match scene.trace(ray) {
        Some(surface) => (Leg::CLEAR, Arrival::Surface(Landing { surface, media: [MediumId::VACUUM; 2], opacity: 1.0 })),
        None => (Leg { stop: Stop::Escaped, ..Leg::CLEAR }, Arrival::Escaped),
    }
}

fn walk_through(scene: &Scene, ray: &Ray, medium: MediumId, draw: impl Fn(u32) -> f32) -> (Leg, Arrival) {
    let mut way = Way::new(ray, medium);
    for crossing in 0..CROSSINGS {
        let surface = scene.trace(&way.ray);
        let reach = surface.map_or(f32::MAX, |surface| surface.t);
        if let Some(medium) = scene.medium(way.medium) {
            let distance = medium.sample(draw(2 * crossing));
            if distance < reach
                && let Some(arrival) = way.collide(scene, distance)
            {
                let stop = Stop::Medium { distance: way.travelled + distance };
                return (Leg { passage: way.passage, stop }, arrival);
            }
            way.pass(scene, reach);
        }
        let Some(surface) = surface else { return (Leg { passage: way.passage, stop: Stop::Escaped }, Arrival::Escaped) };
        let opacity = scene.opacity(&surface);
        if opacity >= 1.0 || (opacity > 0.0 && draw(2 * crossing + 1) < opacity) {
            let arrival = way.land(scene, surface, opacity);
            return (Leg { passage: way.passage, stop: Stop::Surface { passed: way.passed } }, arrival);
        }
        way.passage.times(Spectrum::grey(1.0 - opacity), 1.0 - opacity);
        way.passed += u16::from(!scene.is_hole(&surface));
        way.cross(scene, &surface);
    }
    (Leg { passage: way.passage, stop: Stop::Escaped }, Arrival::Escaped)
}

/// Follows a ray of unit direction to where a neighbouring one stopped. `None` where it cannot stop like that.
#[inline]
pub fn follow(scene: &Scene, ray: &Ray, medium: MediumId, stop: Stop) -> Option<(Passage, Arrival)> {
    if scene.is_clear() {
        let (leg, arrival) = clear(scene, ray);
        return (leg.stop == stop).then_some((leg.passage, arrival));
    }
    let mut way = Way::new(ray, medium);
    for _ in 0..CROSSINGS {
        let surface = scene.trace(&way.ray);
        let reach = surface.map_or(f32::MAX, |surface| surface.t);
        if let Stop::Medium { distance } = stop
            && distance - way.travelled < reach
        {
            let arrival = way.collide(scene, distance - way.travelled)?;
            return Some((way.passage, arrival));
        }
        way.pass(scene, reach);
        let Some(surface) = surface else { return (stop == Stop::Escaped).then_some((way.passage, Arrival::Escaped)) };
        let opacity = scene.opacity(&surface);
        let hole = scene.is_hole(&surface);
        if stop == (Stop::Surface { passed: way.passed }) && !hole {
            let arrival = way.land(scene, surface, opacity);
            return Some((way.passage, arrival));
        }
        if opacity >= 1.0 {
            return None;
        }
        way.passage.times(Spectrum::grey(1.0 - opacity), 1.0 - opacity);
        way.passed += u16::from(!hole);
        way.cross(scene, &surface);
    }
    None
}

/// What light from a light point is worth at a vertex, and how likely a walk gets through to it.
#[inline]
pub fn passage_to_light(scene: &Scene, from: &Vertex, point: &LightPoint) -> Passage {
    let end = (!point.infinite).then_some((point.position, point.error, point.normal));
    if scene.is_clear() {
        let ray = end.map_or_else(|| from.leave(point.position), |end| segment(from.end(), end));
        return if scene.world.occluded(&ray) { Passage::BLOCKED } else { Passage::CLEAR };
    }
    let towards = end.map_or(point.position, |end| end.0 - from.position);
    through(scene, from.end(), from.medium_towards(towards), end, point.position).map_or(Passage::BLOCKED, |way| {
        let mut passage = way.passage;
        let last = scene.medium(way.medium).map(|medium| medium.transmittance(way.rest));
        if let (Some(medium), Some(transmittance)) = (scene.medium(way.medium), last) {
            passage.times(transmittance, medium.pass_density(transmittance));
        }
        passage
    })
}

/// What a straight leg from one vertex to another is worth, its end included.
#[inline]
pub fn passage_between(scene: &Scene, from: &Vertex, to: &Vertex) -> Passage {
    if scene.is_clear() {
        return if scene.world.occluded(&segment(from.end(), to.end())) { Passage::BLOCKED } else { Passage::CLEAR };
    }
    let towards = to.position - from.position;
    let Some(way) = through(scene, from.end(), from.medium_towards(towards), Some(to.end()), towards) else { return Passage::BLOCKED };
    let mut passage = way.passage;
    match (scene.medium(way.medium), to.medium()) {
        (Some(medium), Some(_)) => {
            let (value, density) = medium.collision(medium.transmittance(way.rest));
            passage.times(value, density);
        }
        // Rounding has put the end on the other side of a boundary.
        (None, Some(_)) => return Passage::BLOCKED,
        (Some(medium), None) => {
            let transmittance = medium.transmittance(way.rest);
            passage.times(transmittance, medium.pass_density(transmittance));
        }
        (None, None) => {}
    }
    passage.times(Spectrum::grey(to.opacity), to.opacity);
    passage
}

/// A straight way up to its last stretch, which lies in `medium` and is `rest` long.
struct Open {
    passage: Passage,
    medium: MediumId,
    rest: f32,
}

/// Goes straight from one point to another, or along a direction out of the scene. `None` where something blocks it.
fn through(scene: &Scene, start: (Vec3, f32, Vec3), medium: MediumId, end: Option<(Vec3, f32, Vec3)>, direction: Vec3) -> Option<Open> {
    let (mut from, mut medium) = (start, medium);
    let mut passage = Passage::CLEAR;
    for _ in 0..CROSSINGS {
        let ray = end.map_or_else(|| spawn(from.0, from.1, from.2, direction), |end| segment(from, end));
        let length = ray.direction.length();
        let Some(surface) = scene.trace(&ray) else {
            let rest = if end.is_some() { length } else { f32::MAX };
            return Some(Open { passage, medium, rest });
        };
        let opacity = scene.opacity(&surface);
        if opacity >= 1.0 {
            return None;
        }
        if let Some(medium) = scene.medium(medium) {
            let transmittance = medium.transmittance(surface.t * length);
            passage.times(transmittance, medium.pass_density(transmittance));
        }
        passage.times(Spectrum::grey(1.0 - opacity), 1.0 - opacity);
        medium = behind(scene, &surface, ray.direction, medium);
        from = (surface.position, surface.error, surface.normal);
    }
    None
}

/// Emission and environment seen along a ray of unit direction, dimmed by what lies before them.
#[inline]
pub fn seen(scene: &Scene, ray: &Ray, medium: MediumId) -> Spectrum {
    let mut way = Way::new(ray, medium);
    for _ in 0..CROSSINGS {
        let surface = scene.trace(&way.ray);
        way.pass(scene, surface.map_or(f32::MAX, |surface| surface.t));
        let Some(surface) = surface else {
            return scene
                .lights
                .at_infinity(ray.direction)
                .map_or(Spectrum::BLACK, |point| scene.lights.radiance(&point, ray.origin) * way.passage.value);
        };
        if let Some(point) = scene.light_point(&surface) {
            return scene.lights.radiance(&point, ray.origin) * way.passage.value;
        }
        let opacity = scene.opacity(&surface);
        if opacity >= 1.0 {
            return Spectrum::BLACK;
        }
        way.passage.times(Spectrum::grey(1.0 - opacity), 1.0 - opacity);
        way.cross(scene, &surface);
    }
    Spectrum::BLACK
}
