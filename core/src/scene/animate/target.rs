//! Targets of tracks: which part of the description a path names, and where in it the numbers stand.

use serde_json::Value as Json;

use crate::scene::description::{SceneDescription, Value};

/// A part of the description that is read and written as a whole.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(in crate::scene) enum Element {
    Node(String),
    Camera,
    Texture(String),
    Medium(String),
    Material(String),
    Group(String, usize),
    Shape(usize),
    Light(usize),
    Environment,
}

impl Element {
    /// Its path in the description.
    pub(in crate::scene) fn path(&self) -> String {
        match self {
            Element::Node(name) => format!("animation.nodes.{name}"),
            Element::Camera => "camera".to_string(),
            Element::Texture(name) => format!("textures.{name}"),
            Element::Medium(name) => format!("media.{name}"),
            Element::Material(name) => format!("materials.{name}"),
            Element::Group(name, index) => format!("groups.{name}[{index}]"),
            Element::Shape(index) => format!("shapes[{index}]"),
            Element::Light(index) => format!("lights[{index}]"),
            Element::Environment => "environment".to_string(),
        }
    }
}

/// What parts a path may begin with.
pub(in crate::scene) const PARTS: &str = "a number under `camera`, `textures.NAME`, `media.NAME`, `materials.NAME`, `groups.NAME[k]`, \
    `shapes[k]`, `lights[k]`, `environment` or `animation.nodes.NAME` that the scene has";

/// The part of the scene that a path begins with, and the rest of the path. `None` where the scene has no such part.
pub(in crate::scene) fn find<'a>(scene: &SceneDescription, path: &'a str) -> Option<(Element, &'a str)> {
    if let Some(rest) = path.strip_prefix("camera") {
        return starts_step(rest).then_some((Element::Camera, rest));
    }
    if let Some(rest) = path.strip_prefix("environment") {
        return (starts_step(rest) && scene.environment.is_some()).then_some((Element::Environment, rest));
    }
    if let Some(rest) = path.strip_prefix("shapes") {
        let (index, rest) = index(rest)?;
        return (index < scene.shapes.len() && starts_step(rest)).then_some((Element::Shape(index), rest));
    }
    if let Some(rest) = path.strip_prefix("lights") {
        let (index, rest) = index(rest)?;
        return (index < scene.lights.len() && starts_step(rest)).then_some((Element::Light(index), rest));
    }
    if let Some(rest) = path.strip_prefix("groups.") {
        let (name, rest) = named(scene.groups.keys(), rest)?;
        let (index, rest) = index(rest)?;
        let count = scene.groups.get(&name).map_or(0, Vec::len);
        return (index < count && starts_step(rest)).then_some((Element::Group(name, index), rest));
    }
    if let Some(rest) = path.strip_prefix("animation.nodes.") {
        return named(scene.animation.as_ref()?.nodes.keys(), rest).map(|(name, rest)| (Element::Node(name), rest));
    }
    if let Some(rest) = path.strip_prefix("textures.") {
        return named(scene.textures.keys(), rest).map(|(name, rest)| (Element::Texture(name), rest));
    }
    if let Some(rest) = path.strip_prefix("media.") {
        return named(scene.media.keys(), rest).map(|(name, rest)| (Element::Medium(name), rest));
    }
    let rest = path.strip_prefix("materials.")?;
    named(scene.materials.keys(), rest).map(|(name, rest)| (Element::Material(name), rest))
}

fn starts_step(rest: &str) -> bool {
    rest.starts_with(['.', '['])
}

/// The longest of the names that the path begins with: names may hold dots and brackets themselves.
fn named<'a, 'n>(names: impl Iterator<Item = &'n String>, path: &'a str) -> Option<(String, &'a str)> {
    let fits = |name: &&String| path.strip_prefix(name.as_str()).is_some_and(starts_step);
    let name = names.filter(fits).max_by_key(|name| name.len())?;
    Some((name.clone(), &path[name.len()..]))
}

/// `[12]` and what follows.
fn index(path: &str) -> Option<(usize, &str)> {
    let (number, rest) = path.strip_prefix('[')?.split_once(']')?;
    Some((number.parse().ok()?, rest))
}

/// One step of a path inside an element.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(in crate::scene) enum Step {
    Field(String),
    Index(usize),
}

/// `.to_world[0].translate` as steps; `None` where that is no path.
pub(in crate::scene) fn steps(mut path: &str) -> Option<Vec<Step>> {
    let mut steps = Vec::new();
    while !path.is_empty() {
        if let Some(field) = path.strip_prefix('.') {
            let end = field.find(['.', '[']).unwrap_or(field.len());
            if end == 0 {
                return None;
            }
            steps.push(Step::Field(field[..end].to_string()));
            path = &field[end..];
        } else {
            let (number, rest) = index(path)?;
            steps.push(Step::Index(number));
            path = rest;
        }
    }
    (!steps.is_empty()).then_some(steps)
}

/// Writes numbers where the steps lead. A field that is left out, since it has its default, is put there.
///
/// # Errors
/// What stands at the first step that leads nowhere.
pub(in crate::scene) fn put(element: &mut Json, steps: &[Step], value: &Value) -> Result<(), String> {
    let Some((last, way)) = steps.split_last() else { return Err("the path of a whole part".to_string()) };
    let mut place = element;
    for step in way {
        place = match step {
            Step::Field(name) => place.get_mut(name.as_str()),
            Step::Index(index) => place.get_mut(*index),
        }
        .ok_or_else(|| nothing(step))?;
    }
    let before = match last {
        Step::Field(name) => place.as_object_mut().ok_or_else(|| nothing(last))?.insert(name.clone(), json(value)),
        Step::Index(index) => Some(std::mem::replace(place.get_mut(*index).ok_or_else(|| nothing(last))?, json(value))),
    };
    match before {
        Some(before) if !fits(&before, value) => Err(form(&before, value)),
        _ => Ok(()),
    }
}

fn nothing(step: &Step) -> String {
    match step {
        Step::Field(name) => format!("no `{name}` there"),
        Step::Index(index) => format!("no [{index}] there"),
    }
}

fn json(value: &Value) -> Json {
    match value {
        Value::Number(number) => Json::from(*number),
        Value::List(list) => Json::from(list.clone()),
    }
}

/// Whether numbers may stand where `before` stood: numbers for numbers, lists for lists as long. A colour may be one number or three,
/// and numbers may take the place of a texture.
fn fits(before: &Json, value: &Value) -> bool {
    let numbers = |list: &Vec<Json>| list.iter().all(Json::is_number);
    match (before, value) {
        (Json::Number(_), Value::Number(_)) => true,
        (Json::Number(_), Value::List(list)) => list.len() == 3,
        (Json::Array(before), Value::List(list)) => numbers(before) && before.len() == list.len(),
        (Json::Array(before), Value::Number(_)) => numbers(before) && before.len() == 3,
        (Json::Object(before), _) => before.len() == 1 && before.contains_key("texture"),
        _ => false,
    }
}

fn form(before: &Json, value: &Value) -> String {
    let there = match before {
        Json::Number(_) => "a number".to_string(),
        Json::Array(list) if list.iter().all(Json::is_number) => format!("a list of {}", list.len()),
        _ => "something that is no number".to_string(),
    };
    let given = match value {
        Value::Number(_) => "a number".to_string(),
        Value::List(list) => format!("a list of {}", list.len()),
    };
    format!("{given} for {there}")
}
