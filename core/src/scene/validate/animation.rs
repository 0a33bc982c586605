//! Animation: names, circles, keys, and every moving part at every key.

use super::super::animate::target::Element;
use super::super::animate::{Pose, track};
use super::super::description::{Animation, Interpolation, SceneDescription, Track};
use super::super::error::{Error, ErrorKind};
use super::super::limits;
use super::{Check, one_of};

impl Check<'_> {
    /// Checks a scene that moves: its nodes and tracks, then the scene as it starts, then whatever changes at each key.
    pub(super) fn animated(&self, scene: &SceneDescription, animation: &Animation) -> Result<(), Error> {
        self.moves(scene, animation)?;
        let pose = Pose::new(scene, self.file)?;
        let mut still = SceneDescription { animation: None, ..scene.clone() };
        let mut times: Vec<f64> =
            animation.tracks.iter().flat_map(|track| track.times.iter().copied().chain(track::extremes(track))).collect();
        times.sort_by(f64::total_cmp);
        times.dedup();
        let first = times.first().copied().unwrap_or(0.0);
        pose.put(&mut still, first)?;
        super::still(self, &still)?;
        for seconds in times {
            pose.put(&mut still, seconds)?;
            Check { meshes: false, ..*self }.parts(&pose, &still, seconds)?;
        }
        Ok(())
    }

    /// Checks nodes and tracks by themselves.
    pub(super) fn moves(&self, scene: &SceneDescription, animation: &Animation) -> Result<(), Error> {
        self.nodes(animation)?;
        self.tracks(&animation.tracks)?;
        self.nodes_in_use(scene, animation)
    }

    /// Checks what changes, as it is at one instant.
    pub(super) fn parts(&self, pose: &Pose<'_>, still: &SceneDescription, seconds: f64) -> Result<(), Error> {
        let mut surfaces = false;
        for element in pose.parts() {
            let path = element.path();
            match element {
                Element::Node(_) => Ok(()),
                Element::Camera => self.camera(&still.camera),
                Element::Texture(_) | Element::Medium(_) | Element::Material(_) if std::mem::replace(&mut surfaces, true) => Ok(()),
                Element::Texture(_) | Element::Medium(_) | Element::Material(_) => self.surfaces(still),
                Element::Environment => still.environment.as_ref().map_or(Ok(()), |environment| self.environment(environment)),
                Element::Light(index) => self.light(&path, &still.lights[*index]),
                Element::Shape(index) => self.shape(&path, &still.shapes[*index], still, false),
                Element::Group(name, index) => {
                    still.groups.get(name).map_or(Ok(()), |shapes| self.shape(&path, &shapes[*index], still, true))
                }
            }
            .map_err(|fault| pose.blame(fault, element, seconds))?;
        }
        Ok(())
    }

    fn nodes(&self, animation: &Animation) -> Result<(), Error> {
        let nodes = &animation.nodes;
        if nodes.len() > limits::NODES {
            let found = format!("{} nodes", nodes.len());
            return Err(self.fault(ErrorKind::TooLarge, "animation.nodes", found, format!("at most {}", limits::NODES)));
        }
        for (name, node) in nodes {
            let path = format!("animation.nodes.{name}");
            if node.to_parent.nodes().next().is_some() {
                return self.invalid(&format!("{path}.to_parent"), "a node", "no node here: name it as `parent`");
            }
            for (index, operation) in node.to_parent.0.iter().enumerate() {
                let matrix = operation.matrix();
                if !matrix.is_finite() || matrix.row(3).to_array() != [0.0, 0.0, 0.0, 1.0] {
                    let expected = "finite numbers, an axis, and a line of sight not along `up`";
                    return self.invalid(&format!("{path}.to_parent[{index}]"), format!("{operation:?}"), expected);
                }
            }
            let mut trail = vec![name];
            let mut above = node.parent.as_ref();
            while let Some(parent) = above {
                let Some(next) = nodes.get(parent) else {
                    let path = format!("animation.nodes.{}.parent", trail[trail.len() - 1]);
                    return Err(self.fault(ErrorKind::UnknownName, &path, format!("{parent:?}"), one_of("node", nodes.keys())));
                };
                trail.push(parent);
                if parent == name {
                    let circle = trail.iter().map(|name| name.as_str()).collect::<Vec<_>>().join(" → ");
                    return self.invalid(&format!("{path}.parent"), format!("the circle {circle}"), "nodes that do not hang on themselves");
                }
                if trail.len() > limits::NODE_DEPTH {
                    let expected = format!("nodes at most {} deep", limits::NODE_DEPTH);
                    return Err(self.fault(ErrorKind::TooLarge, &format!("{path}.parent"), "nodes deeper than that", expected));
                }
                above = next.parent.as_ref();
            }
        }
        Ok(())
    }

    /// Whether every node that a `to_world` names is there.
    fn nodes_in_use(&self, scene: &SceneDescription, animation: &Animation) -> Result<(), Error> {
        let kind = match scene.camera {
            super::Camera::Perspective(_) => "perspective",
            super::Camera::Orthographic(_) => "orthographic",
        };
        let camera = [(format!("camera.{kind}"), scene.camera.to_world())].into_iter();
        let shapes = scene.shapes.iter().enumerate().map(|(k, shape)| (format!("shapes[{k}]"), &shape.to_world));
        let lights = scene.lights.iter().enumerate().map(|(k, light)| (format!("lights[{k}]"), light.to_world()));
        let groups = scene
            .groups
            .iter()
            .flat_map(|(name, shapes)| shapes.iter().enumerate().map(move |(k, shape)| (format!("groups.{name}[{k}]"), &shape.to_world)));
        for (path, to_world) in camera.chain(shapes).chain(lights).chain(groups) {
            if let Some(name) = to_world.nodes().find(|name| !animation.nodes.contains_key(*name)) {
                let expected = one_of("node", animation.nodes.keys());
                return Err(self.fault(ErrorKind::UnknownName, &format!("{path}.to_world"), format!("the node {name:?}"), expected));
            }
        }
        Ok(())
    }

    fn tracks(&self, tracks: &[Track]) -> Result<(), Error> {
        let mut numbers = 0usize;
        let mut targets = std::collections::BTreeMap::new();
        for (index, track) in tracks.iter().enumerate() {
            let path = format!("animation.tracks[{index}]");
            self.track(&path, track)?;
            if let Some(other) = targets.insert(track.target.as_str(), index) {
                let found = format!("{:?}, which tracks[{other}] moves", track.target);
                return self.invalid(&format!("{path}.target"), found, "a target of its own");
            }
            let lists = track.tangents.iter().flat_map(|tangents| [&tangents.incoming, &tangents.outgoing]).chain([&track.values]);
            numbers = lists.flatten().fold(numbers, |sum, value| sum.saturating_add(value.numbers().len()));
        }
        if numbers > limits::KEY_NUMBERS {
            let expected = format!("at most {}", limits::KEY_NUMBERS);
            return Err(self.fault(ErrorKind::TooLarge, "animation.tracks", format!("{numbers} numbers in keys"), expected));
        }
        Ok(())
    }

    fn track(&self, path: &str, track: &Track) -> Result<(), Error> {
        let keys = track.times.len();
        if keys == 0 {
            return self.invalid(&format!("{path}.times"), "no keys", "at least one");
        }
        let mut before = None;
        for (key, time) in track.times.iter().enumerate() {
            if !(*time >= 0.0 && time.is_finite() && before.is_none_or(|before| before < *time)) {
                return self.invalid(&format!("{path}.times[{key}]"), time, "a finite time from 0 on, later than the key before");
            }
            before = Some(*time);
        }
        if track.tangents.is_some() && track.interpolation != Interpolation::Cubic {
            return self.invalid(&format!("{path}.tangents"), "tangents", "none unless `interpolation` is \"cubic\"");
        }
        let turn = track::is_turn(track);
        let form = track.values.first().map(std::mem::discriminant);
        let width = track.values.first().map_or(0, |value| value.numbers().len());
        let mut lists = vec![("values", &track.values)];
        if let Some(tangents) = &track.tangents {
            lists.extend([("tangents.incoming", &tangents.incoming), ("tangents.outgoing", &tangents.outgoing)]);
        }
        for (field, list) in lists {
            if list.len() != keys {
                return self.invalid(&format!("{path}.{field}"), format!("{} values", list.len()), format!("{keys}, one for each time"));
            }
            for (key, value) in list.iter().enumerate() {
                let path = format!("{path}.{field}[{key}]");
                if Some(std::mem::discriminant(value)) != form || value.numbers().len() != width || width == 0 {
                    return self.invalid(&path, format!("{value:?}"), "values of one form: numbers, or lists of the same length");
                }
                if !value.numbers().iter().all(|x| x.is_finite()) {
                    return self.invalid(&path, format!("{:?}", value.numbers()), "finite numbers");
                }
                let length = value.numbers().iter().map(|x| x * x).sum::<f64>();
                if turn && (width != 4 || (field == "values" && !(length > 0.0 && length.is_finite()))) {
                    return self.invalid(&path, format!("{:?}", value.numbers()), "a quaternion [x, y, z, w] that is not zero");
                }
            }
        }
        Ok(())
    }
}
