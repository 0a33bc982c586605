//! Animated PNG: eight bits of sRGB a frame, without loss, for every browser.

use std::io::Write;

use super::Error;
use crate::lattice::Extent;

/// Writes an animation frame by frame. It runs for ever.
pub struct Apng<W: Write> {
    writer: ::png::Writer<W>,
    /// Frames that are still to come.
    missing: u32,
}

impl<W: Write> Apng<W> {
    /// Starts an animation of so many frames, so many of them a second.
    ///
    /// # Errors
    /// If there are no frames or no pixels, or the writer fails.
    pub fn new(out: W, extent: Extent, frames: u32, fps: f64) -> Result<Self, Error> {
        let mut encoder = ::png::Encoder::new(out, extent.width, extent.height);
        encoder.set_color(::png::ColorType::Rgb);
        encoder.set_depth(::png::BitDepth::Eight);
        encoder.set_source_srgb(::png::SrgbRenderingIntent::RelativeColorimetric);
        encoder.set_animated(frames, 0)?;
        let (numerator, denominator) = delay(fps);
        encoder.set_frame_delay(numerator, denominator)?;
        Ok(Self { writer: encoder.write_header()?, missing: frames })
    }

    /// Adds the next frame: red, green and blue of each pixel, row by row.
    ///
    /// # Errors
    /// If it has another size, is one too many, or the writer fails.
    pub fn frame(&mut self, pixels: &[u8]) -> Result<(), Error> {
        self.writer.write_image_data(pixels)?;
        self.missing = self.missing.saturating_sub(1);
        Ok(())
    }

    /// Ends the file.
    ///
    /// # Errors
    /// If frames are missing, or the writer fails.
    pub fn finish(self) -> Result<(), Error> {
        match self.missing {
            0 => Ok(self.writer.finish()?),
            missing => Err(Error::Frames { missing }),
        }
    }
}

/// The time of a frame as a fraction of a second in 16 bits above and below, at least a 65 535th and at most 65 535 s.
fn delay(fps: f64) -> (u16, u16) {
    let most = f64::from(u16::MAX);
    // The largest round numerator whose denominator fits: 24 → 1000 / 24000, 23.976 → 1000 / 23976.
    let scale = [1000.0, 100.0, 10.0, 1.0].into_iter().find(|scale| scale * fps <= most).unwrap_or(1.0);
    if fps >= 1.0 {
        return (scale as u16, (scale * fps).round().min(most) as u16);
    }
    ((1000.0 / fps).round().clamp(1.0, most) as u16, 1000)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_come_back_with_their_time() {
        let extent = Extent { width: 3, height: 2 };
        let frame = |k: u8| (0..18).map(|i| i * 3 + k).collect::<Vec<u8>>();
        let mut file = Vec::new();
        let mut movie = Apng::new(&mut file, extent, 3, 24.0).unwrap();
        (0..3).for_each(|k| movie.frame(&frame(k)).unwrap());
        movie.finish().unwrap();
        let mut reader = ::png::Decoder::new(std::io::Cursor::new(&file)).read_info().unwrap();
        let told = reader.info().animation_control().copied().unwrap();
        assert_eq!((told.num_frames, told.num_plays), (3, 0));
        for k in 0..3 {
            let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
            reader.next_frame(&mut bytes).unwrap();
            assert_eq!(bytes, frame(k));
            let control = reader.info().frame_control().unwrap();
            assert_eq!((control.delay_num, control.delay_den), (1000, 24000));
        }
    }

    #[test]
    fn what_does_not_fit_is_refused() {
        let extent = Extent { width: 3, height: 2 };
        assert!(Apng::new(Vec::new(), extent, 0, 24.0).is_err());
        let mut movie = Apng::new(Vec::new(), extent, 1, 24.0).unwrap();
        assert!(movie.frame(&[0; 5]).is_err());
        let mut short = Apng::new(Vec::new(), extent, 2, 24.0).unwrap();
        short.frame(&[0; 18]).unwrap();
        assert!(short.finish().is_err());
    }

    #[test]
    fn times_are_close_whatever_is_asked() {
        for fps in [0.02, 0.5, 1.0, 12.5, 23.976, 24.0, 59.94, 60.0, 240.0, 1000.0, 60_000.0] {
            let (numerator, denominator) = delay(fps);
            let got = f64::from(denominator) / f64::from(numerator);
            assert!((got / fps - 1.0).abs() < 1e-3, "{fps}: {numerator}/{denominator}");
        }
    }
}
