//! Surfaces that are refined into triangles: Loop's subdivision, and bilinear patches.
//!
//! # Source
//! Loop, "Smooth Subdivision Surfaces Based on Triangles", University of Utah, 1987. The masks of vertices and of the limit are those of
//! pbrt: β = 3/16 at vertices of three neighbours, 3/(8n) at others.

use std::collections::BTreeMap;

use crate::geometry::Mesh;
use crate::math::{Vec2, Vec3};

/// Most triangles of a refined mesh.
pub(super) const TRIANGLES: usize = 1 << 23;

/// Pieces of a bent patch along each side.
const GRID: u32 = 8;

/// Refines a mesh `levels` times and moves its vertices to the limit surface. Normals are left to whoever reads it.
///
/// # Errors
/// What it would become, if that is more than [`TRIANGLES`].
pub(super) fn refine(mut mesh: Mesh, levels: u32) -> Result<Mesh, String> {
    let becomes = 4u64.checked_pow(levels).and_then(|times| times.checked_mul(mesh.triangles.len() as u64)).unwrap_or(u64::MAX);
    if becomes > TRIANGLES as u64 {
        return Err(format!("{} triangles refined {levels} times", mesh.triangles.len()));
    }
    mesh.normals.clear();
    mesh.uvs.clear();
    for _ in 0..levels {
        mesh = refined(&mesh);
    }
    let rings = Rings::of(&mesh);
    mesh.positions = rings.moved(&mesh, |valence| 1.0 / (valence as f32 + 3.0 / (8.0 * beta(valence))), 0.2);
    Ok(mesh)
}

/// The weight of each of a vertex's neighbours.
fn beta(valence: usize) -> f32 {
    if valence == 3 { 3.0 / 16.0 } else { 3.0 / (8.0 * valence as f32) }
}

/// Edges by their two vertices, the lesser first, with the vertices across them.
type Edges = BTreeMap<(u32, u32), Vec<u32>>;

/// The neighbours of every vertex.
struct Rings {
    edges: Edges,
    /// Neighbours of each vertex.
    around: Vec<Vec<u32>>,
    /// The two neighbours along the border, for vertices on it.
    border: Vec<Vec<u32>>,
}

impl Rings {
    fn of(mesh: &Mesh) -> Rings {
        let mut edges = Edges::new();
        for [a, b, c] in &mesh.triangles {
            for (from, to, across) in [(a, b, c), (b, c, a), (c, a, b)] {
                edges.entry((*from.min(to), *from.max(to))).or_default().push(*across);
            }
        }
        let mut around = vec![Vec::new(); mesh.positions.len()];
        let mut border = vec![Vec::new(); mesh.positions.len()];
        for ((a, b), across) in &edges {
            for (vertex, other) in [(*a, *b), (*b, *a)] {
                around[vertex as usize].push(other);
                if across.len() == 1 {
                    border[vertex as usize].push(other);
                }
            }
        }
        Rings { edges, around, border }
    }

    /// Every vertex, drawn towards its neighbours by `weight` each, or towards those along the border by `edge` each.
    fn moved(&self, mesh: &Mesh, weight: impl Fn(usize) -> f32, edge: f32) -> Vec<Vec3> {
        let drawn = |vertex: usize, neighbours: &[u32], weight: f32| {
            let sum: Vec3 = neighbours.iter().map(|neighbour| mesh.positions[*neighbour as usize]).sum();
            mesh.positions[vertex] * (1.0 - weight * neighbours.len() as f32) + sum * weight
        };
        (0..mesh.positions.len())
            .map(|vertex| match (self.border[vertex].len(), self.around[vertex].len()) {
                (_, 0) => mesh.positions[vertex],
                (0, valence) => drawn(vertex, &self.around[vertex], weight(valence)),
                (2, _) => drawn(vertex, &self.border[vertex], edge),
                // More than two borders meet here: the vertex is a corner and stays.
                _ => mesh.positions[vertex],
            })
            .collect()
    }
}

fn refined(mesh: &Mesh) -> Mesh {
    let rings = Rings::of(mesh);
    let mut positions = rings.moved(mesh, beta, 0.125);
    let mut middle = BTreeMap::new();
    for ((a, b), across) in &rings.edges {
        let ends = mesh.positions[*a as usize] + mesh.positions[*b as usize];
        let point = match across[..] {
            [c, d] => ends * 0.375 + (mesh.positions[c as usize] + mesh.positions[d as usize]) * 0.125,
            _ => ends * 0.5,
        };
        middle.insert((*a, *b), positions.len() as u32);
        positions.push(point);
    }
    let between = |a: u32, b: u32| middle.get(&(a.min(b), a.max(b))).copied().unwrap_or(a);
    let mut triangles = Vec::with_capacity(mesh.triangles.len() * 4);
    for [a, b, c] in &mesh.triangles {
        let (ab, bc, ca) = (between(*a, *b), between(*b, *c), between(*c, *a));
        triangles.extend([[*a, ab, ca], [ab, *b, bc], [ca, bc, *c], [ab, bc, ca]]);
    }
    Mesh { positions, triangles, ..Mesh::default() }
}

/// Adds the triangles of a bilinear patch with corners p00, p10, p01, p11. Returns whether it was bent and became a grid.
pub(super) fn patch(mesh: &mut Mesh, corners: [u32; 4]) -> bool {
    let [p00, p10, p01, p11] = corners.map(|corner| mesh.positions[corner as usize]);
    let normal = (p10 - p00).cross(p01 - p00);
    let size = (p10 - p00).length().max((p01 - p00).length()).max(f32::MIN_POSITIVE);
    let flat = (p11 - p00).dot(normal.normalize_or_zero()).abs() <= 1e-5 * size;
    let [a, b, c, d] = corners;
    if flat {
        mesh.triangles.extend([[a, b, d], [a, d, c]]);
        return false;
    }
    let first = mesh.positions.len() as u32;
    let blend = |at: [f32; 2], of: &dyn Fn(u32) -> Vec3| {
        let [u, v] = at;
        (of(a) * (1.0 - u) + of(b) * u) * (1.0 - v) + (of(c) * (1.0 - u) + of(d) * u) * v
    };
    let (has_normals, has_uvs) = (!mesh.normals.is_empty(), !mesh.uvs.is_empty());
    for place in 0..(GRID + 1) * (GRID + 1) {
        let at = [place % (GRID + 1), place / (GRID + 1)].map(|step| step as f32 / GRID as f32);
        let point = blend(at, &|corner| mesh.positions[corner as usize]);
        mesh.positions.push(point);
        if has_normals {
            let normal = blend(at, &|corner| mesh.normals.get(corner as usize).copied().unwrap_or(Vec3::ZERO));
            mesh.normals.push(normal.normalize_or_zero());
        }
        if has_uvs {
            let uv = blend(at, &|corner| mesh.uvs.get(corner as usize).map_or(Vec3::ZERO, |uv| uv.extend(0.0)));
            mesh.uvs.push(Vec2::new(uv.x, uv.y));
        }
    }
    for row in 0..GRID {
        for column in 0..GRID {
            let corner = first + row * (GRID + 1) + column;
            let above = corner + GRID + 1;
            mesh.triangles.extend([[corner, corner + 1, above + 1], [corner, above + 1, above]]);
        }
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;

    fn octahedron() -> Mesh {
        let positions = vec![Vec3::X, Vec3::Y, Vec3::Z, Vec3::NEG_X, Vec3::NEG_Y, Vec3::NEG_Z];
        let triangles = vec![[0, 1, 2], [1, 3, 2], [3, 4, 2], [4, 0, 2], [1, 0, 5], [3, 1, 5], [4, 3, 5], [0, 4, 5]];
        Mesh { positions, triangles, ..Mesh::default() }
    }

    #[test]
    fn an_octahedron_becomes_round() {
        let round = refine(octahedron(), 4).unwrap();
        assert_eq!((round.triangles.len(), round.positions.len()), (8 * 256, 4 * 256 + 2));
        let radii: Vec<f32> = round.positions.iter().map(|position| position.length()).collect();
        let (least, most) = radii.iter().fold((f32::MAX, 0.0f32), |(least, most), r| (least.min(*r), most.max(*r)));
        assert!(most / least < 1.25 && most < 0.6, "{least} to {most}");
        // The limit of a vertex of four neighbours: a third of the way that Loop's mask goes on for ever.
        let limit = 1.0 - 4.0 / (4.0 + 3.0 / (8.0 * (3.0 / 32.0)));
        assert!((refine(octahedron(), 0).unwrap().positions[0].x - limit).abs() < 1e-6);
        assert!((round.positions[0].x - limit).abs() < 1e-4, "{} is not the limit {limit}", round.positions[0].x);
    }

    #[test]
    fn a_flat_sheet_stays_flat_and_keeps_its_border() {
        let positions = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].map(|[x, y]| Vec3::new(x, y, 0.0)).to_vec();
        let sheet = Mesh { positions, triangles: vec![[0, 1, 2], [0, 2, 3]], ..Mesh::default() };
        let refined = refine(sheet, 3).unwrap();
        assert!(refined.positions.iter().all(|p| p.z == 0.0 && p.x >= 0.0 && p.x <= 1.0 && p.y >= 0.0 && p.y <= 1.0));
        assert!(refine(octahedron(), 40).unwrap_err().contains("40 times"));
        assert!(refine(octahedron(), u32::MAX).is_err());
    }

    #[test]
    fn patches_are_two_triangles_or_a_grid() {
        let corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.0]].map(Vec3::from).to_vec();
        let mut flat = Mesh { positions: corners.clone(), ..Mesh::default() };
        assert!(!patch(&mut flat, [0, 1, 2, 3]));
        assert_eq!(flat.triangles, [[0, 1, 3], [0, 3, 2]]);
        let mut bent = Mesh { positions: corners, ..Mesh::default() };
        bent.positions[3].z = 1.0;
        assert!(patch(&mut bent, [0, 1, 2, 3]));
        assert_eq!(bent.triangles.len(), 128);
        assert_eq!(bent.positions[4 + 40].to_array(), [0.5, 0.5, 0.25]);
    }
}
