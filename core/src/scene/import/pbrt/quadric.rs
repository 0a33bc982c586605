//! Spheres, disks and cylinders as triangles, where they are cut or stretched.

use crate::geometry::Mesh;
use crate::math::{Vec2, Vec3};

/// Pieces around a full turn.
const AROUND: u32 = 96;
/// Pieces along the profile of a sphere.
const ALONG: u32 = 48;

/// Part of a sphere about the origin: from `z_min` to `z_max`, and around +Z by `phi_max` [degrees] from +X.
pub(super) fn sphere(radius: f64, z_min: f64, z_max: f64, phi_max: f64) -> Mesh {
    let angle = |z: f64| libm::acos((z / radius).clamp(-1.0, 1.0));
    let (least, most) = (angle(z_min.min(z_max)), angle(z_min.max(z_max)));
    let profile: Vec<[f64; 4]> = (0..=ALONG)
        .map(|k| {
            let (sin, cos) = libm::sincos(least + (most - least) * f64::from(k) / f64::from(ALONG));
            [radius * sin, radius * cos, sin, cos]
        })
        .collect();
    revolved(&profile, phi_max)
}

/// A ring in the plane z = `height` with its normal along +Z.
pub(super) fn disk(height: f64, radius: f64, inner: f64, phi_max: f64) -> Mesh {
    revolved(&[[inner, height, 0.0, 1.0], [radius, height, 0.0, 1.0]], phi_max)
}

/// A tube around +Z with normals outwards.
pub(super) fn cylinder(radius: f64, z_min: f64, z_max: f64, phi_max: f64) -> Mesh {
    revolved(&[[radius, z_min, 1.0, 0.0], [radius, z_max, 1.0, 0.0]], phi_max)
}

/// A profile of points and normals, each as distance from the axis and height, turned around +Z.
fn revolved(profile: &[[f64; 4]], phi_max: f64) -> Mesh {
    let turn = phi_max.clamp(0.0, 360.0).to_radians();
    let around = ((f64::from(AROUND) * turn / std::f64::consts::TAU).ceil() as u32).max(1);
    let mut mesh = Mesh::default();
    for (row, [r, z, normal_r, normal_z]) in profile.iter().enumerate() {
        for column in 0..=around {
            let (sin, cos) = libm::sincos(turn * f64::from(column) / f64::from(around));
            mesh.positions.push(Vec3::new((r * cos) as f32, (r * sin) as f32, *z as f32));
            mesh.normals.push(Vec3::new((normal_r * cos) as f32, (normal_r * sin) as f32, *normal_z as f32).normalize_or_zero());
            mesh.uvs.push(Vec2::new(column as f32 / around as f32, row as f32 / (profile.len() - 1) as f32));
        }
    }
    for row in 0..profile.len() as u32 - 1 {
        for column in 0..around {
            let first = row * (around + 1) + column;
            let above = first + around + 1;
            mesh.triangles.extend([[first, first + 1, above + 1], [first, above + 1, above]]);
        }
    }
    // At poles and at the hub of a disk triangles have no area.
    let flat = |mesh: &Mesh, triangle: usize| mesh.area(triangle) <= 0.0;
    let keep: Vec<bool> = (0..mesh.triangles.len()).map(|triangle| !flat(&mesh, triangle)).collect();
    let mut keep = keep.into_iter();
    mesh.triangles.retain(|_| keep.next().unwrap_or(true));
    align(&mut mesh);
    mesh
}

/// Turns triangles round whose front is not where their normals point. pbrt asks the normals, this program the order of the corners.
pub(super) fn align(mesh: &mut Mesh) -> bool {
    let mut turned = false;
    for triangle in 0..mesh.triangles.len() {
        let [a, b, c] = mesh.corners(triangle);
        let shading: Vec3 = mesh.triangles[triangle].iter().filter_map(|corner| mesh.normals.get(*corner as usize)).copied().sum();
        if (b - a).cross(c - a).dot(shading) < 0.0 {
            mesh.triangles[triangle].swap(1, 2);
            turned = true;
        }
    }
    turned
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area(mesh: &Mesh) -> f64 {
        (0..mesh.triangles.len()).map(|triangle| f64::from(mesh.area(triangle))).sum()
    }

    #[test]
    fn areas_and_fronts_are_right() {
        use std::f64::consts::PI;
        let near = |found: f64, expected: f64| assert!((found / expected - 1.0).abs() < 5e-3, "{found} for {expected}");
        near(area(&sphere(2.0, -2.0, 2.0, 360.0)), 16.0 * PI);
        near(area(&sphere(2.0, 0.0, 2.0, 90.0)), 2.0 * PI);
        near(area(&disk(1.0, 2.0, 1.0, 180.0)), 1.5 * PI);
        near(area(&cylinder(1.0, -1.0, 2.0, 360.0)), 6.0 * PI);
        for mesh in [sphere(1.0, -1.0, 1.0, 360.0), cylinder(1.0, 0.0, 1.0, 360.0)] {
            mesh.check().unwrap();
            for triangle in 0..mesh.triangles.len() {
                let [a, b, c] = mesh.corners(triangle);
                let outward = Vec3::new(a.x + b.x + c.x, a.y + b.y + c.y, 0.0);
                assert!((b - a).cross(c - a).dot(outward) >= 0.0, "triangle {triangle}");
            }
        }
        let [a, b, c] = disk(0.0, 1.0, 0.0, 360.0).corners(0);
        assert!((b - a).cross(c - a).z > 0.0);
    }
}
