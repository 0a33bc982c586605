//! Transforms as written: a list of operations, the first applied first.

use glam::{DMat4, DQuat, DVec3, DVec4};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A list of operations, the first applied first. The empty list changes nothing.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(transparent)]
pub struct Transform(pub Vec<Operation>);

/// One operation.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Operation {
    /// Moves by [x, y, z] metres.
    Translate([f64; 3]),
    /// Turns around an axis through the origin.
    Rotate(Rotation),
    /// Scales along x, y and z.
    Scale([f64; 3]),
    /// Puts the frame at `origin` with +Z towards `target`.
    LookAt(LookAt),
    /// Any affine matrix, four rows of four; the last row is [0, 0, 0, 1].
    Matrix([[f64; 4]; 4]),
    /// Turns by a quaternion [x, y, z, w] of any length but 0.
    Quaternion([f64; 4]),
    /// Into the frame of an animation's node: its own transform, then its parent's, and so on.
    Node(String),
}

/// A turn, counter-clockwise as seen when the axis points at you.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Rotation {
    /// Axis; any length but 0.
    pub axis: [f64; 3],
    /// Angle [degrees].
    pub degrees: f64,
}

/// The frame at `origin` whose +Z points at `target` and whose +Y leans towards `up`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LookAt {
    /// Where the frame's origin goes [m].
    pub origin: [f64; 3],
    /// The point that +Z points at [m]; not `origin`.
    pub target: [f64; 3],
    /// The direction that +Y leans towards; not along the line of sight.
    #[serde(default = "LookAt::default_up")]
    pub up: [f64; 3],
}

impl LookAt {
    fn default_up() -> [f64; 3] {
        [0.0, 1.0, 0.0]
    }
}

impl Transform {
    /// Whether there is no operation.
    pub fn is_identity(&self) -> bool {
        self.0.is_empty()
    }

    /// The names of the nodes that it goes through.
    pub fn nodes(&self) -> impl Iterator<Item = &str> {
        self.0.iter().filter_map(|operation| match operation {
            Operation::Node(name) => Some(name.as_str()),
            _ => None,
        })
    }

    /// A single matrix, or nothing where it changes nothing.
    pub fn from_matrix(matrix: DMat4) -> Transform {
        if matrix == DMat4::IDENTITY {
            return Transform::default();
        }
        Transform(vec![Operation::Matrix([0, 1, 2, 3].map(|row| matrix.row(row).to_array()))])
    }

    /// The matrix of the whole list, acting on column vectors. Degenerate operations give non-finite numbers, which checking refuses.
    pub fn matrix(&self) -> DMat4 {
        self.0.iter().fold(DMat4::IDENTITY, |before, operation| operation.matrix() * before)
    }
}

impl Operation {
    /// Its matrix, acting on column vectors. That of a node depends on the time; it is not a number here.
    pub fn matrix(&self) -> DMat4 {
        match self {
            Operation::Translate(by) => DMat4::from_translation(DVec3::from(*by)),
            Operation::Rotate(rotation) => rotation.matrix(),
            Operation::Scale(by) => DMat4::from_scale(DVec3::from(*by)),
            Operation::LookAt(look) => look.matrix(),
            Operation::Matrix(rows) => DMat4::from_cols_array_2d(rows).transpose(),
            Operation::Quaternion(quaternion) => DMat4::from_quat(unit(*quaternion)),
            Operation::Node(_) => DMat4::NAN,
        }
    }
}

impl Rotation {
    /// Rodrigues' rotation, with sine and cosine from `libm` so that every machine gets the same bits.
    fn matrix(&self) -> DMat4 {
        let axis = DVec3::from(self.axis);
        let axis = axis / axis.length();
        let angle = self.degrees * (std::f64::consts::PI / 180.0);
        let (sin, cos) = (libm::sin(angle), libm::cos(angle));
        let turn = |v: DVec3| v * cos + axis.cross(v) * sin + axis * (axis.dot(v) * (1.0 - cos));
        from_columns(turn(DVec3::X), turn(DVec3::Y), turn(DVec3::Z), DVec3::ZERO)
    }
}

impl LookAt {
    fn matrix(&self) -> DMat4 {
        let origin = DVec3::from(self.origin);
        let sight = DVec3::from(self.target) - origin;
        let sight = sight / sight.length();
        let left = DVec3::from(self.up).cross(sight);
        let left = left / left.length();
        from_columns(left, sight.cross(left), sight, origin)
    }
}

fn unit(quaternion: [f64; 4]) -> DQuat {
    let quaternion = DQuat::from_array(quaternion);
    quaternion * quaternion.length().recip()
}

fn from_columns(x: DVec3, y: DVec3, z: DVec3, origin: DVec3) -> DMat4 {
    DMat4::from_cols(x.extend(0.0), y.extend(0.0), z.extend(0.0), DVec4::from((origin, 1.0)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn apply(operations: Vec<Operation>, point: [f64; 3]) -> [f64; 3] {
        Transform(operations).matrix().transform_point3(DVec3::from(point)).into()
    }

    fn close(a: [f64; 3], b: [f64; 3]) {
        assert!(a.iter().zip(&b).all(|(a, b)| (a - b).abs() < 1e-12), "{a:?} is not {b:?}");
    }

    #[test]
    fn the_first_operation_is_applied_first() {
        let scale_then_move = vec![Operation::Scale([2.0, 2.0, 2.0]), Operation::Translate([1.0, 0.0, 0.0])];
        close(apply(scale_then_move, [1.0, 1.0, 1.0]), [3.0, 2.0, 2.0]);
    }

    #[test]
    fn a_quarter_turn_around_y_takes_z_to_x() {
        let turn = vec![Operation::Rotate(Rotation { axis: [0.0, 2.0, 0.0], degrees: 90.0 })];
        close(apply(turn, [0.0, 0.0, 1.0]), [1.0, 0.0, 0.0]);
    }

    #[test]
    fn look_at_sees_the_target_straight_ahead_and_left_on_plus_x() {
        let look = Operation::LookAt(LookAt { origin: [0.0, 1.0, 5.0], target: [0.0, 1.0, 0.0], up: [0.0, 1.0, 0.0] });
        close(apply(vec![look.clone()], [0.0, 0.0, 5.0]), [0.0, 1.0, 0.0]);
        // Looking along −Z of the world with +Y up, the left hand is at −X.
        close(apply(vec![look], [1.0, 0.0, 0.0]), [-1.0, 1.0, 5.0]);
    }

    #[test]
    fn a_matrix_is_written_by_rows() {
        let rows = [[1.0, 0.0, 0.0, 4.0], [0.0, 1.0, 0.0, 5.0], [0.0, 0.0, 1.0, 6.0], [0.0, 0.0, 0.0, 1.0]];
        close(apply(vec![Operation::Matrix(rows)], [0.0; 3]), [4.0, 5.0, 6.0]);
    }
}
