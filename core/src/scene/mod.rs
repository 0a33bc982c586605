//! Scenes: what a person wrote (`description`), where its files lie (`assets`), what is wrong with it (`error`), and what it compiles to.
//!
//! A scene enters here as text. It leaves as a checked [`SceneDescription`] or a compiled [`Scene`]; nothing below sees an unchecked one.

mod animate;
pub mod assets;
mod compile;
pub mod description;
pub mod error;
mod exposure;
mod image;
mod import;
pub mod limits;
mod mesh;
pub mod read;
mod runtime;
mod stage;
#[cfg(test)]
mod tests;
mod validate;

pub use assets::{Assets, DirectoryAssets, MadeAssets, NoAssets, SceneAssets};
pub use description::SceneDescription;
pub use error::{Error, ErrorKind};
pub use exposure::{Exposure, Instants};
pub use read::{Loaded, load};
pub use runtime::{Boundary, Scene, Shape};
pub use stage::Stage;
