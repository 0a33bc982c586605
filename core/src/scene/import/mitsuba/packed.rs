//! Meshes out of `.serialized` files: each that is used becomes a file of its own.

use super::super::xml::Element;
use super::context::Context;
use crate::scene::error::{Error, ErrorKind};
use crate::scene::limits;
use crate::scene::mesh::{ply_binary, serialized};

impl Context<'_> {
    /// Unpacks mesh number `index` of a file. Gives the name of the made file, and whether the mesh shows its faces.
    pub(super) fn unpacked(&mut self, element: &Element, file: &str, index: usize) -> Result<(String, bool), Error> {
        let made = format!("{file}.{index}.ply");
        let found = |fault: Error| element.fault(fault.kind, fault.to_string(), "a .serialized file beside the scene");
        let bytes = self.assets.open(file).map_err(found)?;
        let unpacked = serialized::parse(&bytes, index, file)?;
        if !self.made.contains_key(&made) {
            let bytes = ply_binary::write(&unpacked.mesh);
            let all = self.made.values().map(|bytes| bytes.len() as u64).sum::<u64>() + bytes.len() as u64;
            if all > limits::FILE_BYTES {
                let expected = format!("at most {} bytes of unpacked meshes", limits::FILE_BYTES);
                return Err(element.fault(ErrorKind::TooLarge, format!("{all} bytes"), expected));
            }
            self.made.insert(made.clone(), bytes);
        }
        Ok((made, unpacked.faceted))
    }
}
