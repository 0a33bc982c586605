//! How noisy one sample of each pixel is: what decides where further samples are placed.

use super::fold::{FoldError, FrameFold};
use super::image::Image;
use super::plane::PlaneKind;
use crate::lattice::{Half, Offset};

/// What one half of a film tells about the noise of its pixels. All images have one channel; variances are of *one sample*, not of a mean.
#[derive(Clone, Debug, PartialEq)]
pub struct Noise {
    /// Radiance with directly visible emission, mean of RGB.
    pub grey: Image,
    /// Variance of the primal, summed over RGB.
    pub primal: Image,
    /// Variance of what the pixel's own base paths add to the differences to its neighbours, summed over RGB and directions. Zero where
    /// the technique measures none.
    pub gradients: Image,
}

impl FrameFold {
    /// The noise of each half, from the sums so far.
    ///
    /// # Errors
    /// If a pixel was never measured.
    pub fn noise(&self) -> Result<[Noise; 2], FoldError> {
        self.check_complete()?;
        Ok(Half::ALL.map(|half| self.noise_of(half)))
    }

    fn noise_of(&self, half: Half) -> Noise {
        let counts = self.counts(half);
        let (mut grey, mut primal, mut gradients) =
            (Image::new(self.extent(), 1), Image::new(self.extent(), 1), Image::new(self.extent(), 1));
        for kind in [PlaneKind::Primal(half), PlaneKind::Direct(half)] {
            for values in self.mean(kind).into_iter().flat_map(|image| (0..3).map(|c| image.plane(c))) {
                grey.data_mut().iter_mut().zip(values).for_each(|(sum, v)| *sum += v / 3.0);
            }
        }
        if let (Some(means), Some(squares)) = (self.mean(PlaneKind::Primal(half)), self.mean(PlaneKind::PrimalSquared(half))) {
            add_variance(&mut primal, means, squares, &counts);
        }
        for offset in Offset::IMAGE {
            let (means, squares) = (PlaneKind::Gradient(half, offset), PlaneKind::GradientSquared(half, offset));
            if let (Some(means), Some(squares)) = (self.mean(means), self.mean(squares)) {
                add_variance(&mut gradients, means, squares, &counts);
            }
        }
        Noise { grey, primal, gradients }
    }
}

/// Adds the variance of one sample, summed over channels: (E[x²] − E[x]²) · n / (n − 1). `squares` may hold each channel's or their sum.
fn add_variance(sum: &mut Image, means: &Image, squares: &Image, counts: &Image) {
    for (i, sum) in sum.data_mut().iter_mut().enumerate() {
        let n = f64::from(counts.data()[i]);
        if n < 2.0 {
            continue;
        }
        let squared: f64 = (0..means.channels()).map(|c| f64::from(means.plane(c)[i])).map(|m| m * m).sum();
        let square: f64 = (0..squares.channels()).map(|c| f64::from(squares.plane(c)[i])).sum();
        *sum += ((square - squared).max(0.0) * n / (n - 1.0)) as f32;
    }
}
