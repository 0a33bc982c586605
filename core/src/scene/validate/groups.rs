//! Groups that place groups: no circles, no towers, no explosion of copies.

use std::collections::BTreeMap;

use super::super::description::{Geometry, SceneDescription, Shape};
use super::super::error::{Error, ErrorKind};
use super::super::limits;

/// What one group holds once everything in it is placed.
#[derive(Clone, Copy)]
struct Contents {
    shapes: u64,
    depth: u32,
}

/// Refuses circles, nesting deeper than [`limits::GROUP_DEPTH`] and more than [`limits::PLACED_SHAPES`] shapes in all.
/// Every name is known to exist.
pub(super) fn check(scene: &SceneDescription, file: &str) -> Result<(), Error> {
    let mut known = BTreeMap::new();
    for name in scene.groups.keys() {
        contents(scene, file, name, &mut Vec::new(), &mut known)?;
    }
    let placed = count(&scene.shapes, &known).shapes;
    if placed > limits::PLACED_SHAPES {
        let expected = format!("at most {} once every instance is counted", limits::PLACED_SHAPES);
        return Err(Error::new(ErrorKind::TooLarge, file, "shapes", format!("{placed} shapes"), expected));
    }
    Ok(())
}

/// Walks into `name` with `trail` above it. The trail is bounded by the depth limit, so the walk cannot overflow the stack.
fn contents<'a>(
    scene: &'a SceneDescription,
    file: &str,
    name: &'a str,
    trail: &mut Vec<&'a str>,
    known: &mut BTreeMap<&'a str, Contents>,
) -> Result<(), Error> {
    if known.contains_key(name) {
        return Ok(());
    }
    if let Some(start) = trail.iter().position(|above| *above == name) {
        let circle = [&trail[start..], &[name]].concat().join(" → ");
        let expected = "groups that do not place themselves";
        return Err(Error::new(ErrorKind::Invalid, file, &format!("groups.{name}"), format!("the circle {circle}"), expected));
    }
    trail.push(name);
    let too_deep = |depth: usize| {
        let expected = format!("groups nested at most {} deep", limits::GROUP_DEPTH);
        Error::new(ErrorKind::TooLarge, file, &format!("groups.{name}"), format!("groups nested {depth} deep"), expected)
    };
    if trail.len() > limits::GROUP_DEPTH as usize {
        return Err(too_deep(trail.len()));
    }
    let shapes = scene.groups.get(name).map(Vec::as_slice).unwrap_or_default();
    for shape in shapes {
        if let Geometry::Instance(instance) = &shape.geometry {
            contents(scene, file, &instance.of, trail, known)?;
        }
    }
    trail.pop();
    let contents = count(shapes, known);
    if contents.depth > limits::GROUP_DEPTH {
        return Err(too_deep(contents.depth as usize));
    }
    known.insert(name, contents);
    Ok(())
}

/// Sums up a list of shapes whose groups are all known.
fn count(shapes: &[Shape], known: &BTreeMap<&str, Contents>) -> Contents {
    let mut sum = Contents { shapes: 0, depth: 1 };
    for shape in shapes {
        let inner = match &shape.geometry {
            Geometry::Instance(instance) => known.get(instance.of.as_str()).copied().unwrap_or(Contents { shapes: 1, depth: 0 }),
            _ => Contents { shapes: 1, depth: 0 },
        };
        sum.shapes = sum.shapes.saturating_add(inner.shapes);
        sum.depth = sum.depth.max(inner.depth + 1);
    }
    sum
}
