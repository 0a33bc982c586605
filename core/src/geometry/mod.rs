//! What rays meet: triangles, spheres and instances of groups of them, found through eight-wide bounding volume hierarchies.

mod bvh;
mod mesh;
mod sphere;
mod surface;
#[cfg(test)]
mod tests;
mod triangle;
mod world;

pub use bvh::Bounds;
pub use mesh::{Mesh, MeshError};
pub use sphere::Sphere;
pub use surface::SurfacePoint;
pub use world::{Group, Hit, Instance, ShapeId, World, WorldBuilder};
