//! What a window says of a moment, how windows are blended, and the frame that follows.

use super::super::{ErrorEstimate, ReconstructError, Reconstructed, ReconstructionKind, SolveReport, zip};
use super::moment::MomentFilm;
use crate::film::Image;

/// What one window solved for in one moment, or a part of that: images without directly visible emission. RGB.
#[derive(Clone, Debug, PartialEq)]
pub struct Share {
    /// The image.
    pub image: Image,
    /// The images of the two independent copies, where there are two.
    pub copies: Option<[Image; 2]>,
    /// What a reconstruction without bias makes of each copy, where the images above are biased.
    pub unbiased: Option<[Image; 2]>,
}

impl Share {
    /// Multiplies all images by what the window counts for the moment.
    pub fn scale(&mut self, weight: f32) {
        for image in self.images_mut() {
            image.data_mut().iter_mut().for_each(|v| *v *= weight);
        }
    }

    /// Adds what another window says of the same moment.
    ///
    /// # Errors
    /// If it does not have the same images.
    pub fn add(&mut self, other: &Share) -> Result<(), ReconstructError> {
        let (mine, theirs) = (self.images(), other.images());
        if self.image.extent() != other.image.extent() {
            return Err(ReconstructError::Sizes { found: other.image.extent(), expected: self.image.extent() });
        }
        if mine.len() != theirs.len() {
            return Err(ReconstructError::Shares { found: theirs.len(), expected: mine.len() });
        }
        for (mine, theirs) in self.images_mut().into_iter().zip(theirs) {
            for (a, b) in mine.data_mut().iter_mut().zip(theirs.data()) {
                *a += b;
            }
        }
        Ok(())
    }

    /// All images as one of 3, 9 or 15 channels, to be stored: the image, the copies' and the unbiased ones.
    pub fn to_planes(&self) -> Image {
        let images = self.images();
        let data: Vec<f32> = images.iter().flat_map(|image| image.data()).copied().collect();
        Image::from_planes(self.image.extent(), 3 * images.len(), data).unwrap_or_else(|| Image::new(self.image.extent(), 3))
    }

    /// Undoes [`to_planes`](Self::to_planes). `None` for an image of other numbers of channels.
    pub fn from_planes(planes: &Image) -> Option<Share> {
        let extent = planes.extent();
        let pixels = extent.pixels();
        let image = |k: usize| Image::from_planes(extent, 3, planes.data().get(3 * k * pixels..3 * (k + 1) * pixels)?.to_vec());
        let pair = |first: usize| Some([image(first)?, image(first + 1)?]);
        let (copies, unbiased) = match planes.channels() {
            3 => (None, None),
            9 => (Some(pair(1)?), None),
            15 => (Some(pair(1)?), Some(pair(3)?)),
            _ => return None,
        };
        let image = image(0)?;
        Some(Share { image, copies, unbiased })
    }

    fn images(&self) -> Vec<&Image> {
        let pairs = self.copies.iter().chain(&self.unbiased).flatten();
        std::iter::once(&self.image).chain(pairs).collect()
    }

    fn images_mut(&mut self) -> Vec<&mut Image> {
        let pairs = self.copies.iter_mut().chain(&mut self.unbiased).flatten();
        std::iter::once(&mut self.image).chain(pairs).collect()
    }
}

/// Adds up what all windows over a moment say of it, each already multiplied by its weight, from the first window to the last. `None` without any.
///
/// # Errors
/// If they do not have the same images.
pub fn blend(shares: impl IntoIterator<Item = Share>) -> Result<Option<Share>, ReconstructError> {
    let mut shares = shares.into_iter();
    let Some(mut sum) = shares.next() else { return Ok(None) };
    for share in shares {
        sum.add(&share)?;
    }
    Ok(Some(sum))
}

/// The frame of a moment from the blended image: adds directly visible emission, and tells the error by the two copies as that of a single
/// frame is told by its halves.
///
/// # Errors
/// If the moment has another size.
pub fn finish(share: Share, film: &MomentFilm, kind: ReconstructionKind, report: SolveReport) -> Result<Reconstructed, ReconstructError> {
    if share.image.extent() != film.extent() {
        return Err(ReconstructError::Sizes { found: share.image.extent(), expected: film.extent() });
    }
    let lit = |image: &Image, direct: &Image| zip(image, direct, |p, d| p + d);
    let image = lit(&share.image, &film.mean(|copy| copy.direct().clone()));
    let both = |images: Option<[Image; 2]>| match film.copies() {
        [a, b] => images.map(|[u, v]| [lit(&u, a.direct()), lit(&v, b.direct())]),
        _ => None,
    };
    let (halves, unbiased) = (both(share.copies), both(share.unbiased));
    let error = match (&halves, film.copies()) {
        (Some(halves), [a, b]) => Some(ErrorEstimate::new(&image, halves, unbiased.as_ref(), [a.samples(), b.samples()])),
        _ => None,
    };
    Ok(Reconstructed { image, primal: film.primal(), halves, error, report, kind, why: None })
}
