//! Descriptions over time: what a moving scene is at one instant, as a description in which nothing moves.
//!
//! A part of the description that a track moves is written as JSON, the numbers are put in their places, and it is read again: so
//! whatever is a number can move, and what comes out has passed the same reader as what people write.

use std::collections::BTreeMap;

use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::Value as Json;

use super::description::{Camera, Geometry, MeshInline, SceneDescription, Shape, Transform};
use super::error::{Error, ErrorKind};
use super::validate;
use target::{Element, Step};

mod deform;
mod motion;
mod node;
pub(super) mod target;
#[cfg(test)]
mod tests;
pub(super) mod track;

pub(super) use deform::check as check_deformation;
pub(super) use motion::Motion;
pub(super) use node::Frames;

/// The name that errors carry.
const DESCRIPTION: &str = "scene";

impl SceneDescription {
    /// Whether anything changes with time.
    pub fn is_animated(&self) -> bool {
        self.animation.as_ref().is_some_and(|animation| !animation.tracks.is_empty())
    }

    /// Whether it is the same at all times as written: no animation, no mesh that is blended or hung on joints.
    pub(super) fn is_still(&self) -> bool {
        let formed = |shape: &Shape| matches!(&shape.geometry, Geometry::Mesh(mesh) if mesh.morph.is_some() || mesh.skin.is_some());
        self.animation.is_none() && !self.groups.values().flatten().chain(&self.shapes).any(formed)
    }

    /// The scene as it is at a time [s]: values filled in, nodes resolved, meshes in their form of the instant, and no animation left.
    ///
    /// Equal instants give equal descriptions. A scene without animation comes back as it is.
    ///
    /// # Errors
    /// A time that is not finite; nodes, keys, forms or joints that are at fault; values between keys that leave their domain, with track and path.
    pub fn at(&self, seconds: f64) -> Result<SceneDescription, Error> {
        if !seconds.is_finite() {
            return Err(Error::new(ErrorKind::Invalid, DESCRIPTION, "animation", format!("the time {seconds} s"), "a finite time"));
        }
        validate::sources(self, DESCRIPTION)?;
        let mut still = SceneDescription { animation: None, ..self.clone() };
        let pose = Pose::new(self, DESCRIPTION)?;
        let frames = pose.put(&mut still, seconds)?;
        validate::instant(&pose, &still, DESCRIPTION, seconds)?;
        deform::bake(&mut still, &frames)?;
        Ok(still)
    }
}

/// The parts of a description that change, ready to be put into their place at any time.
pub(super) struct Pose<'a> {
    scene: &'a SceneDescription,
    file: &'a str,
    /// In the order of the description, nodes first.
    parts: BTreeMap<Element, Part>,
}

/// One part that changes.
#[derive(Default)]
struct Part {
    /// As JSON, large arrays left out; where tracks move it.
    template: Json,
    /// Its tracks by number, and where in the part they write.
    tracks: Vec<(usize, Vec<Step>)>,
}

impl<'a> Pose<'a> {
    /// Finds what tracks move and what stands in nodes. `file` is the name that errors carry.
    ///
    /// # Errors
    /// A target that names nothing.
    pub(super) fn new(scene: &'a SceneDescription, file: &'a str) -> Result<Pose<'a>, Error> {
        let mut parts: BTreeMap<Element, Part> = BTreeMap::new();
        for element in hung(scene) {
            parts.entry(element).or_default();
        }
        for (index, track) in scene.animation.iter().flat_map(|animation| &animation.tracks).enumerate() {
            let found = target::find(scene, &track.target).and_then(|(element, rest)| Some((element, target::steps(rest)?)));
            let Some((element, steps)) = found else {
                let path = format!("animation.tracks[{index}].target");
                return Err(Error::new(ErrorKind::UnknownName, file, &path, format!("{:?}", track.target), target::PARTS));
            };
            parts.entry(element).or_default().tracks.push((index, steps));
        }
        let mut pose = Pose { scene, file, parts: BTreeMap::new() };
        for (element, part) in &mut parts {
            if !part.tracks.is_empty() {
                part.template = pose.template(element);
            }
        }
        pose.parts = parts;
        Ok(pose)
    }

    /// The parts that change, without the nodes.
    pub(super) fn parts(&self) -> impl Iterator<Item = &Element> {
        self.parts.keys().filter(|element| !matches!(element, Element::Node(_)))
    }

    /// Puts all that changes into `still`, a copy of the scene, as it is at a time; skins and morphs are not applied yet.
    ///
    /// # Errors
    /// A value that does not fit where its track puts it.
    pub(super) fn put(&self, still: &mut SceneDescription, seconds: f64) -> Result<Frames, Error> {
        let animation = self.scene.animation.as_ref();
        let mut nodes = animation.map(|animation| animation.nodes.clone()).unwrap_or_default();
        for (element, part) in &self.parts {
            if let Element::Node(name) = element
                && let Some(node) = nodes.get_mut(name)
            {
                *node = self.read(part, element, seconds)?;
            }
        }
        let frames = Frames::new(&nodes);
        let scene = self.scene;
        for (element, part) in &self.parts {
            match element {
                Element::Node(_) => {}
                Element::Camera => still.camera = frames.camera(self.now(part, element, &scene.camera, seconds)?),
                Element::Texture(name) => replace(&mut still.textures, name, self.read(part, element, seconds)?),
                Element::Medium(name) => replace(&mut still.media, name, self.read(part, element, seconds)?),
                Element::Material(name) => replace(&mut still.materials, name, self.read(part, element, seconds)?),
                Element::Environment => still.environment = Some(self.read(part, element, seconds)?),
                Element::Light(index) => {
                    let mut light = self.now(part, element, &scene.lights[*index], seconds)?;
                    frames.resolve(light.to_world_mut());
                    still.lights[*index] = light;
                }
                Element::Shape(index) => self.shape(&mut still.shapes[*index], &scene.shapes[*index], (part, element), &frames, seconds)?,
                Element::Group(name, index) => {
                    if let (Some(shapes), Some(written)) = (still.groups.get_mut(name), scene.groups.get(name)) {
                        self.shape(&mut shapes[*index], &written[*index], (part, element), &frames, seconds)?;
                    }
                }
            }
        }
        Ok(frames)
    }

    /// A shape as it is now; the large arrays of its mesh stay where they are.
    fn shape(
        &self,
        still: &mut Shape,
        written: &Shape,
        (part, element): (&Part, &Element),
        frames: &Frames,
        seconds: f64,
    ) -> Result<(), Error> {
        if part.tracks.is_empty() {
            still.to_world = written.to_world.clone();
        } else {
            let mut now: Shape = self.read(part, element, seconds)?;
            if let (Geometry::Mesh(now), Geometry::Mesh(still)) = (&mut now.geometry, &mut still.geometry) {
                fill(now, still);
            }
            *still = now;
        }
        frames.resolve(&mut still.to_world);
        Ok(())
    }

    /// A part as it is now.
    fn now<T: Clone + DeserializeOwned>(&self, part: &Part, element: &Element, written: &T, seconds: f64) -> Result<T, Error> {
        if part.tracks.is_empty() { Ok(written.clone()) } else { self.read(part, element, seconds) }
    }

    /// A part that tracks move, as they put it.
    fn read<T: DeserializeOwned>(&self, part: &Part, element: &Element, seconds: f64) -> Result<T, Error> {
        let tracks = self.scene.animation.as_ref().map(|animation| animation.tracks.as_slice()).unwrap_or_default();
        let mut json = part.template.clone();
        for (index, steps) in &part.tracks {
            let track = &tracks[*index];
            let value = track::value(track, seconds);
            target::put(&mut json, steps, &value).map_err(|found| {
                let path = format!("animation.tracks[{index}].target");
                let expected = "numbers of the form that stands in the description";
                Error::new(ErrorKind::Invalid, self.file, &path, format!("{:?}: {found}", track.target), expected)
            })?;
        }
        serde_path_to_error::deserialize(json).map_err(|fault| {
            let inner = fault.path().to_string();
            let path = if inner == "." { element.path() } else { format!("{}.{inner}", element.path()) };
            let message = fault.inner().to_string();
            let (found, expected) = message.split_once(", expected ").unwrap_or((&message, "numbers that may move"));
            self.blame(Error::new(ErrorKind::Malformed, self.file, &path, found, expected), element, seconds)
        })
    }

    /// The same fault with the track that is at fault, and the time.
    pub(super) fn blame(&self, fault: Error, element: &Element, seconds: f64) -> Error {
        let tracks = self.scene.animation.as_ref().map(|animation| animation.tracks.as_slice()).unwrap_or_default();
        let place = &fault.place.path;
        let own = || self.parts.get(element).into_iter().flat_map(|part| part.tracks.iter().map(|(index, _)| *index));
        let near = |index: &usize| tracks[*index].target.starts_with(place.as_str()) || place.starts_with(&tracks[*index].target);
        let place = match own().find(near).or_else(|| own().next()) {
            Some(index) => format!("animation.tracks[{index}], {place}"),
            None => place.clone(),
        };
        Error::new(fault.kind, &fault.place.file, &place, format!("{} at {seconds} s", fault.found), fault.expected)
    }

    fn template(&self, element: &Element) -> Json {
        let scene = self.scene;
        match element {
            Element::Node(name) => scene.animation.as_ref().map_or(Json::Null, |animation| json(&animation.nodes.get(name))),
            Element::Camera => json(&scene.camera),
            Element::Texture(name) => json(&scene.textures.get(name)),
            Element::Medium(name) => json(&scene.media.get(name)),
            Element::Material(name) => json(&scene.materials.get(name)),
            Element::Environment => json(&scene.environment),
            Element::Light(index) => json(&scene.lights[*index]),
            Element::Shape(index) => json(&hollow(&scene.shapes[*index])),
            Element::Group(name, index) => json(&scene.groups.get(name).map(|shapes| hollow(&shapes[*index]))),
        }
    }
}

fn json(part: &impl Serialize) -> Json {
    serde_json::to_value(part).unwrap_or(Json::Null)
}

fn replace<T>(map: &mut BTreeMap<String, T>, name: &str, now: T) {
    if let Some(place) = map.get_mut(name) {
        *place = now;
    }
}

/// The parts that stand in nodes or hang on them.
fn hung(scene: &SceneDescription) -> Vec<Element> {
    let mut elements = Vec::new();
    let in_node = |to_world: &Transform| to_world.nodes().next().is_some();
    if in_node(scene.camera.to_world()) {
        elements.push(Element::Camera);
    }
    elements.extend((0..scene.shapes.len()).filter(|k| in_node(&scene.shapes[*k].to_world)).map(Element::Shape));
    elements.extend((0..scene.lights.len()).filter(|k| in_node(scene.lights[*k].to_world())).map(Element::Light));
    for (name, shapes) in &scene.groups {
        elements.extend((0..shapes.len()).filter(|k| in_node(&shapes[*k].to_world)).map(|k| Element::Group(name.clone(), k)));
    }
    elements
}

/// A shape without the large arrays of its mesh. What tracks can move in a mesh are the weights of its forms.
fn hollow(shape: &Shape) -> Shape {
    let geometry = match &shape.geometry {
        Geometry::Mesh(mesh) => {
            let mut rest = MeshInline::default();
            if let Some(morph) = &mesh.morph {
                rest.morph = Some(super::description::Morph { weights: morph.weights.clone(), targets: Vec::new() });
            }
            Geometry::Mesh(rest)
        }
        other => other.clone(),
    };
    Shape { geometry, ..light_copy(shape) }
}

/// A copy of a shape but for its geometry.
fn light_copy(shape: &Shape) -> Shape {
    Shape {
        name: shape.name.clone(),
        geometry: Geometry::Rectangle,
        to_world: shape.to_world.clone(),
        material: shape.material.clone(),
        emission: shape.emission.clone(),
        interior: shape.interior.clone(),
        exterior: shape.exterior.clone(),
        flip_normals: shape.flip_normals,
    }
}

/// Takes the large arrays from a mesh into one that was read without them.
fn fill(now: &mut MeshInline, still: &mut MeshInline) {
    let weights = now.morph.take().map(|morph| morph.weights);
    *now = std::mem::take(still);
    if let (Some(morph), Some(weights)) = (&mut now.morph, weights) {
        morph.weights = weights;
    }
}

impl Frames {
    /// A camera in the frame of its node. Scales of nodes are taken out: a camera has none.
    fn camera(&self, mut camera: Camera) -> Camera {
        let to_world = camera.to_world_mut();
        if to_world.nodes().next().is_some() {
            self.resolve(to_world);
            if let Some(rigid) = node::rigid(to_world.matrix()) {
                *to_world = Transform::from_matrix(rigid);
            }
        }
        camera
    }
}
