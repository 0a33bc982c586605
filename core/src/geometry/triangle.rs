//! Four triangles at a time, watertight: a ray through a shared edge or vertex meets at least one of the triangles around it.
//!
//! # Source
//! Woop, Benthin and Wald, "Watertight Ray/Triangle Intersection", JCGT 2(1), 2013.

use crate::math::{Ray, Vec3, Vec4};

/// Up to four triangles by coordinate.
#[derive(Clone, Copy, Debug)]
#[repr(align(16))]
pub(crate) struct Packet {
    /// `corners[corner][axis]`, four lanes.
    corners: [[Vec4; 3]; 3],
    /// Identifiers; unused lanes repeat a degenerate triangle.
    pub(crate) ids: [u32; 4],
}

impl Packet {
    /// Of at most four triangles, each with its identifier.
    pub(crate) fn new(triangles: &[([Vec3; 3], u32)]) -> Self {
        let mut packet = Packet { corners: [[Vec4::ZERO; 3]; 3], ids: [u32::MAX; 4] };
        for (lane, (corners, id)) in triangles.iter().enumerate() {
            packet.ids[lane] = *id;
            for (corner, p) in corners.iter().enumerate() {
                for axis in 0..3 {
                    packet.corners[corner][axis][lane] = p[axis];
                }
            }
        }
        packet
    }
}

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
        let d = ray.direction;
        let a = d.abs();
        let z = if a.x > a.y {
            if a.x > a.z { 0 } else { 2 }
        } else if a.y > a.z {
            1
        } else {
            2
        };
        let (mut x, mut y) = ((z + 1) % 3, (z + 2) % 3);
        if d[z] < 0.0 {
            std::mem::swap(&mut x, &mut y);
        }
        let scale = 1.0 / d[z];
        Self {
            axes: [x, y, z],
            shear: [Vec4::splat(d[x] * scale), Vec4::splat(d[y] * scale), Vec4::splat(scale)],
            origin: [Vec4::splat(ray.origin[x]), Vec4::splat(ray.origin[y]), Vec4::splat(ray.origin[z])],
        }
    }

    /// Edge functions, their sum and distance times that sum, per lane, and the lanes whose inside test holds.
    #[inline]
    fn edges(&self, packet: &Packet) -> ([Vec4; 3], Vec4, Vec4, u32) {
        let [kx, ky, kz] = self.axes;
        let mut x = [Vec4::ZERO; 3];
        let mut y = [Vec4::ZERO; 3];
        let mut z = [Vec4::ZERO; 3];
        for corner in 0..3 {
            let c = &packet.corners[corner];
            let depth = c[kz] - self.origin[2];
            x[corner] = (c[kx] - self.origin[0]) - self.shear[0] * depth;
            y[corner] = (c[ky] - self.origin[1]) - self.shear[1] * depth;
            z[corner] = depth * self.shear[2];
        }
        let mut u = x[2] * y[1] - y[2] * x[1];
        let mut v = x[0] * y[2] - y[0] * x[2];
        let mut w = x[1] * y[0] - y[1] * x[0];
        let on_edge = u.cmpeq(Vec4::ZERO).bitmask() | v.cmpeq(Vec4::ZERO).bitmask() | w.cmpeq(Vec4::ZERO).bitmask();
        if on_edge != 0 {
            // On an edge in f32: decide the side in f64, where the products are exact.
            for lane in 0..4 {
                if on_edge >> lane & 1 == 1 {
                    let cross = |i: usize, j: usize| {
                        (f64::from(x[i][lane]) * f64::from(y[j][lane]) - f64::from(y[i][lane]) * f64::from(x[j][lane])) as f32
                    };
                    (u[lane], v[lane], w[lane]) = (cross(2, 1), cross(0, 2), cross(1, 0));
                }
            }
        }
        let zero = Vec4::ZERO;
        let positive = u.cmpge(zero).bitmask() & v.cmpge(zero).bitmask() & w.cmpge(zero).bitmask();
        let negative = u.cmple(zero).bitmask() & v.cmple(zero).bitmask() & w.cmple(zero).bitmask();
        let determinant = u + v + w;
        let inside = (positive | negative) & determinant.cmpne(zero).bitmask();
        let distance = u * z[0] + v * z[1] + w * z[2];
        ([u, v, w], determinant, distance, inside)
    }

    /// The nearest hit with 0 < t ≤ `reach`; of equal distances the lowest identifier, so that the answer does not depend on the tree.
    #[inline]
    pub(crate) fn closest(&self, packet: &Packet, reach: f32) -> Option<PacketHit> {
        let (edges, determinant, distance, mut inside) = self.edges(packet);
        if inside == 0 {
            return None;
        }
        let t = distance / determinant;
        inside &= t.cmpgt(Vec4::ZERO).bitmask() & t.cmple(Vec4::splat(reach)).bitmask();
        let mut best: Option<(f32, u32, usize)> = None;
        while inside != 0 {
            let lane = inside.trailing_zeros() as usize;
            inside &= inside - 1;
            let (t, id) = (t[lane], packet.ids[lane]);
            if best.is_none_or(|(bt, bid, _)| t < bt || (t == bt && id < bid)) {
                best = Some((t, id, lane));
            }
        }
        best.map(|(t, id, lane)| {
            let inverse = 1.0 / determinant[lane];
            PacketHit { t, id, barycentric: [edges[1][lane] * inverse, edges[2][lane] * inverse] }
        })
    }

    /// Whether any lane is met with 0 < t ≤ `reach`.
    #[inline]
    pub(crate) fn any(&self, packet: &Packet, reach: f32) -> bool {
        let (_, determinant, distance, inside) = self.edges(packet);
        if inside == 0 {
            return false;
        }
        let t = distance / determinant;
        inside & t.cmpgt(Vec4::ZERO).bitmask() & t.cmple(Vec4::splat(reach)).bitmask() != 0
    }
}
