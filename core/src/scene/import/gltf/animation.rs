//! Animations: channels of nodes, all animations of the file at once.

use std::collections::{BTreeMap, BTreeSet};

use super::{Importer, Source, titled};
use crate::scene::description::{Interpolation, Tangents, Track, Value};
use crate::scene::error::{Error, ErrorKind};

/// What moves of a node.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Path {
    Translation,
    Rotation,
    Scale,
    Weights,
}

impl Path {
    fn of(name: &str) -> Option<Path> {
        Some(match name {
            "translation" => Path::Translation,
            "rotation" => Path::Rotation,
            "scale" => Path::Scale,
            "weights" => Path::Weights,
            _ => return None,
        })
    }
}

/// Keys of one channel: a track without its target.
pub(super) type Keys = Track;

/// The channels of the file by node and path.
#[derive(Debug, Default)]
pub(super) struct Channels(BTreeMap<(usize, Path), Keys>);

/// The least scale that a moving node has: things that are hidden by a scale of 0 become too small to be seen.
pub(super) const LEAST_SCALE: f64 = 1e-6;

impl Channels {
    /// The keys of a node's path.
    pub(super) fn get(&self, node: usize, path: Path) -> Option<&Keys> {
        self.0.get(&(node, path))
    }

    /// Nodes whose own frames move.
    pub(super) fn turned(&self) -> BTreeSet<usize> {
        self.0.keys().filter(|(_, path)| *path != Path::Weights).map(|(node, _)| *node).collect()
    }
}

impl Importer {
    /// Reads all channels. Of two that move the same thing the first one counts.
    ///
    /// # Errors
    /// Samplers and accessors that are missing or malformed, keys in no order.
    pub(super) fn channels(&mut self, source: &Source<'_>) -> Result<Channels, Error> {
        let mut channels = Channels::default();
        for (a, animation) in source.document.animations.iter().enumerate() {
            let place = titled("animations", a, &animation.name);
            for (c, channel) in animation.channels.iter().enumerate() {
                let path = format!("animations[{a}].channels[{c}]");
                let (Some(node), Some(what)) = (channel.target.node, Path::of(&channel.target.path)) else {
                    self.note(format!("{place}: a channel of {:?} is left out", channel.target.path));
                    continue;
                };
                let moved = source.get(&source.document.nodes, node, &path, "nodes")?;
                if moved.matrix.is_some() && what != Path::Weights {
                    self.note(format!("{place}: a channel of a node with a matrix is left out"));
                    continue;
                }
                if channels.0.contains_key(&(node, what)) {
                    let other = titled("nodes", node, &moved.name);
                    self.note(format!("{place}: its {} of {other} is left out, another channel moves it", channel.target.path));
                    continue;
                }
                let sampler = source.get(&animation.samplers, channel.sampler, &path, "samplers")?;
                let path = format!("animations[{a}].samplers[{}]", channel.sampler);
                let keys = self.keys(source, sampler.input, sampler.output, sampler.interpolation.as_deref(), what, &path)?;
                channels.0.insert((node, what), keys);
            }
        }
        Ok(channels)
    }

    fn keys(
        &mut self,
        source: &Source<'_>,
        input: usize,
        output: usize,
        interpolation: Option<&str>,
        what: Path,
        path: &str,
    ) -> Result<Keys, Error> {
        let interpolation = match interpolation {
            None | Some("LINEAR") => Interpolation::Linear,
            Some("STEP") => Interpolation::Step,
            Some("CUBICSPLINE") => Interpolation::Cubic,
            Some(other) => {
                let found = format!("interpolation {other:?}");
                return Err(source.fault(ErrorKind::Malformed, path, found, "LINEAR, STEP or CUBICSPLINE"));
            }
        };
        let times: Vec<f64> = source.vectors::<1>(input, path)?.into_iter().map(|[time]| f64::from(time)).collect();
        if let Some(key) = (0..times.len()).find(|k| !(times[*k] >= 0.0 && (*k == 0 || times[k - 1] < times[*k]))) {
            let found = format!("key {key} at {} s", times[key]);
            return Err(source.fault(ErrorKind::Malformed, path, found, "times from 0 on, each later than the one before"));
        }
        let per_key = if interpolation == Interpolation::Cubic { 3 } else { 1 };
        let mut flat: Vec<f64> = match what {
            Path::Translation | Path::Scale => source.vectors::<3>(output, path)?.into_flattened(),
            Path::Rotation => source.vectors::<4>(output, path)?.into_flattened(),
            Path::Weights => source.vectors::<1>(output, path)?.into_flattened(),
        }
        .into_iter()
        .map(f64::from)
        .collect();
        let width = flat.len() / (times.len() * per_key);
        if width == 0 || flat.len() != width * times.len() * per_key || (what != Path::Weights && width != what.width()) {
            let found = format!("{} numbers for {} keys", flat.len(), times.len());
            return Err(source.fault(ErrorKind::Malformed, path, found, "as many as the interpolation asks for at each key"));
        }
        if what == Path::Scale && flat.iter().any(|x| x.abs() < LEAST_SCALE) && per_key == 1 {
            self.note(format!("{path}: a scale of 0 counts as {LEAST_SCALE}"));
            flat.iter_mut().filter(|x| x.abs() < LEAST_SCALE).for_each(|x| *x = LEAST_SCALE);
        }
        // In glTF's order at each key: in-tangent, value, out-tangent.
        let part = |which: usize| (0..times.len()).map(|k| Value::List(flat[(k * per_key + which) * width..][..width].to_vec())).collect();
        let tangents = (per_key == 3).then(|| Tangents { incoming: part(0), outgoing: part(2) });
        let values = part(per_key / 2);
        Ok(Track { target: String::new(), times, values, interpolation, tangents, repeat: false })
    }
}

impl Path {
    fn width(self) -> usize {
        if self == Path::Rotation { 4 } else { 3 }
    }
}
