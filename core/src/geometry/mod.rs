//! What rays meet: triangles, spheres, disks, cylinders and instances of groups of them, found through eight-wide bounding volume hierarchies.

mod analytic;
mod bvh;
mod cylinder;
mod disk;
mod mesh;
mod sphere;
mod surface;
#[cfg(test)]
mod tests;
mod triangle;
mod world;

pub use analytic::{Analytic, Form, Place};
pub use bvh::Bounds;
pub use cylinder::Cylinder;
pub use disk::Disk;
pub use mesh::{Mesh, MeshError};
pub use sphere::Sphere;
pub use surface::SurfacePoint;
pub use world::{Group, Hit, Instance, ShapeId, World, WorldBuilder};
