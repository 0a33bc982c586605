//! Mitsuba 0.x's `<animation>`: transforms at times, between which turns, moves and scales are interpolated each by itself.
//!
//! # Source
//! Shoemake and Duff, "Matrix Animation and Polar Decomposition", Graphics Interface 1992; Mitsuba 0.6 takes matrices apart so.

use glam::{DMat3, DMat4, DQuat, DVec3};

use super::super::xml::Element;
use super::context::Context;
use crate::scene::animate::Frames;
use crate::scene::description::{Interpolation, Node, Operation, Track, Transform, Value};
use crate::scene::error::{Error, ErrorKind};

impl<'a> Context<'a> {
    /// Puts a thing into a node of its own, which moves as an element says.
    ///
    /// # Errors
    /// No transforms, or times in no order.
    pub(super) fn moving(&mut self, element: &'a Element) -> Result<Transform, Error> {
        let (mut times, mut scales, mut turns, mut moves) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        let mut sheared = false;
        for child in &element.children {
            if child.tag != "transform" {
                return Err(self.unsupported(child, "<transform time=\"…\">"));
            }
            let time = self.one_number(child, self.required(child, "time")?)?;
            if !(time >= 0.0 && times.last().is_none_or(|last| *last < time)) {
                return Err(child.fault(ErrorKind::Invalid, format!("time {time}"), "times from 0 on, each later than the one before"));
            }
            let operations = child.children.iter().map(|operation| self.operation(operation)).collect::<Result<_, _>>()?;
            let matrix = Transform(operations).matrix();
            let parts = parts(DMat3::from_mat4(matrix)).filter(|_| matrix.is_finite());
            let (turn, stretch) = parts
                .ok_or_else(|| child.fault(ErrorKind::Invalid, "a transform that flattens space or overflows", "one that can be undone"))?;
            let scale = DVec3::new(stretch.x_axis.x, stretch.y_axis.y, stretch.z_axis.z);
            sheared |= !stretch.abs_diff_eq(DMat3::from_diagonal(scale), 1e-6 * scale.abs().max_element());
            times.push(time);
            scales.push(scale.to_array());
            turns.push(turn.to_array());
            moves.push(matrix.w_axis.truncate().to_array());
        }
        let (Some(scale), Some(turn), Some(place)) = (scales.first(), turns.first(), moves.first()) else {
            return Err(element.fault(ErrorKind::Malformed, "no <transform>", "one at least"));
        };
        if sheared {
            self.note(element, "its shear is left out, as Mitsuba leaves it out");
        }
        let to_parent = Transform(vec![Operation::Scale(*scale), Operation::Quaternion(*turn), Operation::Translate(*place)]);
        let name = format!("motion {}", self.animation.nodes.len() + 1);
        self.animation.nodes.insert(name.clone(), Node { parent: None, to_parent });
        let mut track = |step: &str, values: Vec<Value>| {
            if values.windows(2).any(|pair| pair[0] != pair[1]) {
                let target = format!("animation.nodes.{name}.to_parent{step}");
                let interpolation = Interpolation::Linear;
                self.animation.tracks.push(Track { target, times: times.clone(), values, interpolation, tangents: None, repeat: false });
            }
        };
        track("[0].scale", scales.iter().map(|value| Value::List(value.to_vec())).collect());
        track("[1].quaternion", turns.iter().map(|value| Value::List(value.to_vec())).collect());
        track("[2].translate", moves.iter().map(|value| Value::List(value.to_vec())).collect());
        Ok(Transform(vec![Operation::Node(name)]))
    }

    /// The matrix of a transform; of one that moves, its first.
    pub(super) fn first(&self, transform: &Transform) -> DMat4 {
        let mut transform = transform.clone();
        Frames::new(&self.animation.nodes).resolve(&mut transform);
        transform.matrix()
    }

    /// Reads `to_world` where nothing may move.
    ///
    /// # Errors
    /// An `<animation>`.
    pub(super) fn resting(&mut self, element: &'a Element) -> Result<Transform, Error> {
        let to_world = self.placing(element)?;
        if to_world.nodes().next().is_some() {
            return Err(self.unsupported(element, "a to_world that does not move"));
        }
        Ok(to_world)
    }
}

/// A matrix as a turn after a symmetric stretch; a matrix that mirrors as one that stretches by negative numbers. `None` where it is flat.
fn parts(matrix: DMat3) -> Option<(DQuat, DMat3)> {
    let determinant = matrix.determinant();
    if determinant == 0.0 || !determinant.is_finite() {
        return None;
    }
    let mut turn = matrix;
    // Newton's iteration converges quadratically once it is near; far scales need a few halvings before.
    for _ in 0..100 {
        let next = (turn + turn.inverse().transpose()) * 0.5;
        if !next.is_finite() {
            return None;
        }
        let done = next.abs_diff_eq(turn, 1e-15);
        turn = next;
        if done {
            break;
        }
    }
    if determinant < 0.0 {
        turn = -turn;
    }
    Some((DQuat::from_mat3(&turn).normalize(), turn.transpose() * matrix))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn matrices_are_taken_apart() {
        let turn = DQuat::from_xyzw(0.1, -0.7, 0.3, 0.4).normalize();
        for scale in [DVec3::ONE, DVec3::new(2.0, 0.01, 300.0), DVec3::new(-1.0, -2.0, -3.0)] {
            let (found, stretch) = parts(DMat3::from_quat(turn) * DMat3::from_diagonal(scale)).unwrap();
            assert!(found.dot(turn).abs() > 1.0 - 1e-12, "{found} is not {turn}");
            assert!(stretch.abs_diff_eq(DMat3::from_diagonal(scale), 1e-9), "{stretch}");
        }
        assert!(parts(DMat3::ZERO).is_none());
    }
}
