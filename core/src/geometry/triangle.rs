//! Four triangles at a time, watertight: a ray through a shared edge or vertex meets at least one of the triangles around it.
//!
//! # Source
//! Woop, Benthin and Wald, "Watertight Ray/Triangle Intersection", JCGT 2(1), 2013.

use crate::math::{Ray, Vec3, Vec4};

/// Up to four triangles by coordinate.
#[derive(Clone, Copy, Debug)]
#[repr(align(16))]
pub(crate) struct Packet {
    /// `corners[axis][corner]`, four lanes.
    corners: [[Vec4; 3]; 3],
    /// Identifiers. Corners of unused lanes are not numbers: no comparison holds there.
    pub(crate) ids: [u32; 4],
}

impl Packet {
    /// Of at most four triangles, each with its identifier.
    pub(crate) fn new(triangles: &[([Vec3; 3], u32)]) -> Self {
        let mut packet = Packet { corners: [[Vec4::NAN; 3]; 3], ids: [u32::MAX; 4] };
        for (lane, (corners, id)) in triangles.iter().enumerate() {
            packet.ids[lane] = *id;
            for (corner, p) in corners.iter().enumerate() {
                for axis in 0..3 {
                    packet.corners[axis][corner][lane] = p[axis];
                }
            }
        }
        packet
    }
}

/// The axes of the ray's frame, by the longest component of its direction and whether that is negative: winding is kept.
const AXES: [[[usize; 3]; 2]; 3] = [[[1, 2, 0], [2, 1, 0]], [[2, 0, 1], [0, 2, 1]], [[0, 1, 2], [1, 0, 2]]];

/// A ray sheared so that it runs along +z.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sheared {
    axes: [usize; 3],
    shear: [Vec4; 3],
    origin: [Vec4; 3],
}

/// Where a packet was met.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PacketHit {
    pub(crate) t: f32,
    pub(crate) id: u32,
    /// Barycentric weights of corners 1 and 2.
    pub(crate) barycentric: [f32; 2],
}

impl Sheared {
    #[inline]
    pub(crate) fn new(ray: &Ray) -> Self {
        let (o, d) = (ray.origin.to_array(), ray.direction.to_array());
        let longest = match d.map(f32::abs) {
            [x, y, z] if x > y && x > z => 0,
            [_, y, z] if y > z => 1,
            _ => 2,
        };
        let axes = AXES[longest][usize::from(d[longest] < 0.0)];
        let [x, y, z] = axes;
        let scale = 1.0 / d[z];
        Self {
            axes,
            shear: [Vec4::splat(d[x] * scale), Vec4::splat(d[y] * scale), Vec4::splat(scale)],
            origin: [Vec4::splat(o[x]), Vec4::splat(o[y]), Vec4::splat(o[z])],
        }
    }

    /// The corners in the ray's own frame, by coordinate; the ray runs along z.
    #[inline(always)]
    fn project(&self, packet: &Packet) -> ([Vec4; 3], [Vec4; 3], [Vec4; 3]) {
        let [kx, ky, kz] = self.axes;
        let (px, py, pz) = (&packet.corners[kx], &packet.corners[ky], &packet.corners[kz]);
        let mut x = [Vec4::ZERO; 3];
        let mut y = [Vec4::ZERO; 3];
        let mut z = [Vec4::ZERO; 3];
        for corner in 0..3 {
            z[corner] = pz[corner] - self.origin[2];
            x[corner] = (px[corner] - self.origin[0]) - self.shear[0] * z[corner];
            y[corner] = (py[corner] - self.origin[1]) - self.shear[1] * z[corner];
        }
        (x, y, z)
    }

    /// Edge functions, their sum and distance times that sum, per lane, and the lanes whose inside test holds.
    #[inline(always)]
    fn edges(&self, packet: &Packet) -> Option<([Vec4; 3], Vec4, Vec4, u32)> {
        let (x, y, z) = self.project(packet);
        let mut u = x[2] * y[1] - y[2] * x[1];
        let mut v = x[0] * y[2] - y[0] * x[2];
        let mut w = x[1] * y[0] - y[1] * x[0];
        let zero = Vec4::ZERO;
        // Edge functions of both signs: a miss, whatever a zero among them stands for.
        let mut inside = (u.min(v).min(w).cmpge(zero) | u.max(v).max(w).cmple(zero)).bitmask();
        if inside == 0 {
            return None;
        }
        let on_edge = inside & (u.cmpeq(zero) | v.cmpeq(zero) | w.cmpeq(zero)).bitmask();
        if on_edge != 0 {
            (inside, [u, v, w]) = decide(inside, on_edge, [u, v, w], &x, &y);
        }
        let determinant = u + v + w;
        inside &= determinant.cmpne(zero).bitmask();
        let distance = (u * z[0] + v * z[1] + w * z[2]) * self.shear[2];
        Some(([u, v, w], determinant, distance, inside))
    }

    /// The nearest hit with 0 < t ≤ `reach`; of equal distances the lowest identifier, so that the answer does not depend on the tree.
    #[inline(always)]
    pub(crate) fn closest(&self, packet: &Packet, reach: f32) -> Option<PacketHit> {
        let (edges, determinant, distance, mut inside) = self.edges(packet)?;
        let t = distance / determinant;
        inside &= (t.cmpgt(Vec4::ZERO) & t.cmple(Vec4::splat(reach))).bitmask();
        if inside == 0 {
            return None;
        }
        let distances = t.to_array();
        let mut lane = inside.trailing_zeros() as usize & 3;
        inside &= inside - 1;
        while inside != 0 {
            let other = inside.trailing_zeros() as usize & 3;
            inside &= inside - 1;
            if (distances[other], packet.ids[other]) < (distances[lane], packet.ids[lane]) {
                lane = other;
            }
        }
        let inverse = 1.0 / determinant[lane];
        Some(PacketHit { t: distances[lane], id: packet.ids[lane], barycentric: [edges[1][lane] * inverse, edges[2][lane] * inverse] })
    }

    /// Whether any lane is met with 0 < t ≤ `reach`.
    #[inline(always)]
    pub(crate) fn any(&self, packet: &Packet, reach: f32) -> bool {
        let Some((_, determinant, distance, inside)) = self.edges(packet) else { return false };
        let t = distance / determinant;
        inside & (t.cmpgt(Vec4::ZERO) & t.cmple(Vec4::splat(reach))).bitmask() != 0
    }
}

/// Decides the side of edges that f32 puts the ray on: in f64 the products are exact. Gives the lanes whose inside test holds.
#[cold]
fn decide(mut inside: u32, on_edge: u32, [mut u, mut v, mut w]: [Vec4; 3], x: &[Vec4; 3], y: &[Vec4; 3]) -> (u32, [Vec4; 3]) {
    for lane in 0..4 {
        if on_edge >> lane & 1 == 1 {
            let cross =
                |i: usize, j: usize| (f64::from(x[i][lane]) * f64::from(y[j][lane]) - f64::from(y[i][lane]) * f64::from(x[j][lane])) as f32;
            let edges = [cross(2, 1), cross(0, 2), cross(1, 0)];
            if edges.iter().any(|e| *e < 0.0) && edges.iter().any(|e| *e > 0.0) {
                inside &= !(1 << lane);
            }
            [u[lane], v[lane], w[lane]] = edges;
        }
    }
    (inside, [u, v, w])
}
