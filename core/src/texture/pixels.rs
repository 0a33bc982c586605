//! Images in memory, as textures and environments look them up.

/// The texels of an image, row by row from the top, four channels each; alpha is 1 where the file has none.
#[derive(Clone, Debug, PartialEq)]
pub struct Pixels {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Texels: `width · height` of them.
    pub texels: Texels,
}

/// How texels are held: bytes stay bytes, so that a large texture stays small.
#[derive(Clone, Debug, PartialEq)]
pub enum Texels {
    /// As stored, still encoded.
    Bytes(Vec<[u8; 4]>),
    /// Numbers in [0, 1] from 16 bits, still encoded.
    Words(Vec<[u16; 4]>),
    /// Linear, and of any size.
    Floats(Vec<[f32; 4]>),
}

impl Texels {
    /// Number of texels.
    pub fn len(&self) -> usize {
        match self {
            Texels::Bytes(texels) => texels.len(),
            Texels::Words(texels) => texels.len(),
            Texels::Floats(texels) => texels.len(),
        }
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// The sRGB curve from stored numbers in [0, 1] to light (IEC 61966-2-1).
pub fn srgb_to_linear(stored: f32) -> f32 {
    if stored <= 0.04045 { stored / 12.92 } else { libm::powf((stored + 0.055) / 1.055, 2.4) }
}
