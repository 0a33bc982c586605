//! Where finished frames go: images with numbers, movies, animated PNG, contact sheets. All are checked before any work.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};

use bytes::Bytes;
use gradfarm_core::output::apng::Apng;
use gradfarm_core::output::png;
use gradfarm_core::output::sheet::ContactSheet;
use tempfile::NamedTempFile;

use super::error::Error;
use super::files::{FrameTarget, Target};
use crate::movie::ffmpeg::{Container, Encoding, Ffmpeg};
use crate::service::Frames;

/// What to write.
#[derive(Clone, Debug, clap::Args)]
#[command(next_help_heading = "Output")]
pub(super) struct OutputOptions {
    /// What to write, by its name; may be given several times. OUT.exr: the image, with a PNG beside it; out.%04d.exr: one for each frame;
    /// out.mp4 or out.webm: a movie, by ffmpeg; out.png: an animated PNG, of a single frame a still one
    #[arg(short, long, value_name = "OUT")]
    output: Vec<PathBuf>,
    /// Write small pictures of all frames on one page to this file
    #[arg(long, value_name = "SHEET.png")]
    contact_sheet: Option<PathBuf>,
    /// Most pictures in a row of the contact sheet
    #[arg(long, value_name = "N", default_value_t = ContactSheet::COLUMNS, value_parser = clap::value_parser!(u32).range(1..=64))]
    columns: u32,
}

/// What was asked for, found to be possible.
#[derive(Clone, Debug)]
pub(super) struct Outputs {
    outputs: Vec<Output>,
}

#[derive(Clone, Debug)]
enum Output {
    /// EXR files, with PNG files beside them.
    Images(FrameTarget, PathBuf),
    /// PNG, animated if there are several frames.
    Png(Target),
    /// By ffmpeg.
    Movie(Target, Ffmpeg),
    /// On one page, with so many in a row.
    Sheet(Target, u32),
}

impl OutputOptions {
    /// Checks that everything can be written; `None` where nothing is to be.
    ///
    /// # Errors
    /// [`Error::Usage`] for names that say nothing, folders that take no file, and movies without ffmpeg.
    pub(super) fn check(&self) -> Result<Option<Outputs>, Error> {
        let mut outputs = self.output.iter().map(|path| output(path)).collect::<Result<Vec<_>, _>>()?;
        if let Some(path) = &self.contact_sheet {
            if extension(path) != "png" {
                return Err(Error::Usage(format!("{} should end in .png", path.display())));
            }
            outputs.push(Output::Sheet(Target::check(path)?, self.columns));
        }
        Ok((!outputs.is_empty()).then_some(Outputs { outputs }))
    }

    /// The same where something must be written.
    ///
    /// # Errors
    /// As [`check`](Self::check), and if nothing is to be written.
    pub(super) fn check_some(&self) -> Result<Outputs, Error> {
        self.check()?.ok_or_else(|| Error::Usage("nothing would be written: expected -o with a file, such as -o image.exr".to_owned()))
    }
}

fn output(path: &Path) -> Result<Output, Error> {
    match (extension(path).as_str(), Container::of(path)) {
        ("exr", _) => {
            let target = FrameTarget::check(path)?;
            Target::check(&target.path(0).with_extension("png"))?;
            Ok(Output::Images(target, path.to_path_buf()))
        }
        ("png", _) => Ok(Output::Png(whole(path)?)),
        (_, Some(container)) => {
            let target = whole(path)?;
            let instead = path.with_extension("png");
            let missing =
                |missing| Error::Usage(format!("{}: {missing}; -o {} needs nothing but gradfarm", path.display(), instead.display()));
            Ok(Output::Movie(target, Ffmpeg::find(container).map_err(missing)?))
        }
        _ => Err(Error::Usage(format!(
            "{} should end in .exr (the PNG is written beside it), in .png, or in .mp4 or .webm for a movie",
            path.display()
        ))),
    }
}

/// A file for all frames together, whose name has no place for a number.
fn whole(path: &Path) -> Result<Target, Error> {
    if FrameTarget::check(path)?.is_numbered() {
        let exr = path.with_extension("exr");
        return Err(Error::Usage(format!(
            "{} holds all frames, its name takes no number; -o {} writes a PNG beside each image",
            path.display(),
            exr.display()
        )));
    }
    Target::check(path)
}

fn extension(path: &Path) -> String {
    path.extension().map(|extension| extension.to_string_lossy().to_ascii_lowercase()).unwrap_or_default()
}

impl Outputs {
    /// Checks that there is room for so many frames.
    ///
    /// # Errors
    /// [`Error::Usage`] if a single file would have to hold several images, with a name that would do.
    pub(super) fn check_count(&self, count: u32) -> Result<(), Error> {
        self.outputs.iter().try_for_each(|output| match output {
            Output::Images(target, _) => target.check_count(count),
            Output::Png(_) | Output::Movie(..) | Output::Sheet(..) => Ok(()),
        })
    }

    /// Gets ready for these frames, so many a second.
    ///
    /// # Errors
    /// If a single file would have to hold several images; if ffmpeg does not start.
    pub(super) fn open(self, frames: Frames, fps: f64) -> Result<FrameWriter, Error> {
        self.check_count(frames.count)?;
        let names = self.outputs.iter().map(Output::name).collect();
        let mut images = Vec::new();
        let mut reels = Vec::new();
        for output in self.outputs {
            match output {
                Output::Images(target, _) => images.push(target),
                Output::Png(target) => {
                    reels.push(Reel { film: Film::Png { still: frames.count == 1, apng: None }, file: target.begin()?, target })
                }
                Output::Movie(target, ffmpeg) => {
                    let file = target.begin()?;
                    let movie = ffmpeg.start(fps, file.path()).map_err(Error::Failed)?;
                    reels.push(Reel { film: Film::Movie(Box::new(movie)), file, target });
                }
                Output::Sheet(target, columns) => {
                    reels.push(Reel { film: Film::Sheet { columns, sheet: None }, file: target.begin()?, target })
                }
            }
        }
        Ok(FrameWriter { frames, fps, names, images, reels, next: frames.first, early: BTreeMap::new() })
    }
}

impl Output {
    fn name(&self) -> PathBuf {
        match self {
            Self::Images(_, path) => path.clone(),
            Self::Png(target) | Self::Movie(target, _) | Self::Sheet(target, _) => target.path().to_path_buf(),
        }
    }
}

/// Takes finished frames, in any order.
#[derive(Debug)]
pub(super) struct FrameWriter {
    frames: Frames,
    fps: f64,
    names: Vec<PathBuf>,
    images: Vec<FrameTarget>,
    reels: Vec<Reel>,
    /// The frame that comes next on the reels.
    next: u32,
    /// PNG files of frames that came before their turn.
    early: BTreeMap<u32, Bytes>,
}

/// A file that holds all frames, in order.
#[derive(Debug)]
struct Reel {
    film: Film,
    target: Target,
    file: NamedTempFile,
}

enum Film {
    Png { still: bool, apng: Option<Box<Apng<File>>> },
    Movie(Box<Encoding>),
    Sheet { columns: u32, sheet: Option<ContactSheet> },
}

impl std::fmt::Debug for Film {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Png { .. } => "Png",
            Self::Movie(_) => "Movie",
            Self::Sheet { .. } => "Sheet",
        })
    }
}

impl FrameWriter {
    /// The frames that are to come.
    pub(super) fn frames(&self) -> Frames {
        self.frames
    }

    /// Whether EXR files are written at all.
    pub(super) fn takes_exr(&self) -> bool {
        !self.images.is_empty()
    }

    /// What is written, as it was asked for.
    pub(super) fn names(&self) -> &[PathBuf] {
        &self.names
    }

    /// The same for people: what stands beside it is named, too.
    pub(super) fn written(&self) -> String {
        let beside = |path: &PathBuf| match extension(path).as_str() {
            "exr" => format!("{} and {}", path.display(), path.with_extension("png").display()),
            _ => path.display().to_string(),
        };
        self.names.iter().map(beside).collect::<Vec<_>>().join(", ")
    }

    /// The EXR file of a frame, where there is one.
    pub(super) fn exr_path(&self, frame: u32) -> Option<PathBuf> {
        self.images.first().map(|target| target.path(frame))
    }

    /// Writes a frame's own files at once, and adds it to what holds all frames when its turn comes.
    ///
    /// # Errors
    /// If a file cannot be written, or ffmpeg fails.
    pub(super) fn write(&mut self, frame: u32, exr: &[u8], png: &Bytes) -> Result<(), Error> {
        for target in &self.images {
            target.write(frame, exr)?;
            target.write_beside(frame, "png", png)?;
        }
        if !self.reels.is_empty() {
            self.early.insert(frame, png.clone());
            while let Some(png) = self.early.remove(&self.next) {
                for reel in &mut self.reels {
                    reel.add(self.frames, self.fps, self.next - self.frames.first, &png)?;
                }
                self.next += 1;
            }
        }
        Ok(())
    }

    /// Ends what holds all frames.
    ///
    /// # Errors
    /// If frames are missing, a file cannot be written, or ffmpeg fails.
    pub(super) fn finish(self) -> Result<(), Error> {
        if !self.reels.is_empty() && self.next != self.frames.range().end {
            return Err(Error::Failed(format!("frame {} never came", self.next)));
        }
        self.reels.into_iter().try_for_each(Reel::finish)
    }
}

impl Reel {
    /// Adds the k-th frame.
    fn add(&mut self, frames: Frames, fps: f64, k: u32, file: &[u8]) -> Result<(), Error> {
        let broken = |fault: gradfarm_core::output::Error| Error::Failed(format!("{}: {fault}", self.target.path().display()));
        match &mut self.film {
            Film::Png { still: true, .. } => {
                let written = self.file.write_all(file);
                written.map_err(|source| Error::Write { path: self.target.path().to_path_buf(), source })
            }
            Film::Png { apng, .. } => {
                let (extent, pixels) = png::decode(file).map_err(broken)?;
                if apng.is_none() {
                    let out = self.file.as_file().try_clone();
                    let out = out.map_err(|source| Error::Write { path: self.target.path().to_path_buf(), source })?;
                    *apng = Some(Box::new(Apng::new(out, extent, frames.count, fps).map_err(broken)?));
                }
                apng.as_mut().map_or(Ok(()), |apng| apng.frame(&pixels)).map_err(broken)
            }
            Film::Movie(movie) => movie.frame(file).map_err(|fault| Error::Failed(format!("{}: {fault}", self.target.path().display()))),
            Film::Sheet { columns, sheet } => {
                let (extent, pixels) = png::decode(file).map_err(broken)?;
                sheet.get_or_insert_with(|| ContactSheet::new(extent, frames.count, *columns)).place(k, &pixels);
                Ok(())
            }
        }
    }

    fn finish(self) -> Result<(), Error> {
        let Self { film, target, file } = self;
        let told = |fault: String| Error::Failed(format!("{}: {fault}", target.path().display()));
        match film {
            Film::Png { apng, .. } => apng.map_or(Ok(()), |apng| apng.finish()).map_err(|fault| told(fault.to_string()))?,
            Film::Movie(movie) => movie.finish().map_err(told)?,
            Film::Sheet { sheet, .. } => {
                let bytes = sheet.map(|sheet| sheet.encode()).transpose().map_err(|fault| told(fault.to_string()))?;
                return target.write(&bytes.unwrap_or_default());
            }
        }
        target.finish(file)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gradfarm_core::film::Image;
    use gradfarm_core::lattice::Extent;

    fn options(output: &[&Path], contact_sheet: Option<&Path>) -> OutputOptions {
        let output = output.iter().map(|path| path.to_path_buf()).collect();
        OutputOptions { output, contact_sheet: contact_sheet.map(Path::to_path_buf), columns: ContactSheet::COLUMNS }
    }

    /// A grey picture of 8 × 6 pixels.
    fn picture(grey: f32) -> Bytes {
        let extent = Extent { width: 8, height: 6 };
        let image = Image::from_planes(extent, 1, vec![grey; extent.pixels()]).unwrap();
        png::encode(&image, 1.0).unwrap().into()
    }

    #[test]
    fn frames_in_any_order_make_files_at_once_and_a_movie_in_order() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        let outputs = options(&[&at("a.%02d.exr"), &at("a.png")], Some(&at("sheet.png"))).check().unwrap().unwrap();
        let mut writer = outputs.open(Frames { first: 5, count: 3 }, 24.0).unwrap();
        for (number, grey) in [(7, 1.0), (5, 0.0), (6, 0.214_041_14)] {
            writer.write(number, &number.to_le_bytes(), &picture(grey)).unwrap();
            assert_eq!(std::fs::read(at(&format!("a.{number:02}.exr"))).unwrap(), number.to_le_bytes());
            assert!(at(&format!("a.{number:02}.png")).exists() && !at("a.png").exists());
        }
        writer.finish().unwrap();
        let sheet = png::decode(&std::fs::read(at("sheet.png")).unwrap()).unwrap();
        assert_eq!(sheet.0, Extent { width: 4 + 2 * 12, height: 4 + 2 * 10 });
        // A still decoder sees the first frame.
        let (extent, pixels) = png::decode(&std::fs::read(at("a.png")).unwrap()).unwrap();
        assert_eq!((extent, pixels[0]), (Extent { width: 8, height: 6 }, 0));
        assert_eq!([sheet.0.index(4, 4), sheet.0.index(16, 4), sheet.0.index(4, 14)].map(|at| sheet.1[3 * at]), [0, 128, 255]);
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 8, "nothing else is left");
    }

    #[test]
    fn what_cannot_be_written_is_told_before_any_work() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        for (name, part) in [
            ("a.jpg", "should end in .exr"),
            ("a", "should end in .exr"),
            ("a.%04d.png", "a.%04d.exr"),
            ("a.%4d.exr", "expected exactly one %d"),
            ("nowhere/a.png", "does not exist"),
        ] {
            let fault = options(&[&at(name)], None).check().unwrap_err().to_string();
            assert!(fault.contains(part), "{name}: {fault}");
        }
        assert!(options(&[], Some(&at("a.exr"))).check().is_err());
        assert!(options(&[], None).check().unwrap().is_none() && options(&[], None).check_some().is_err());
        let single = options(&[&at("a.exr")], None).check_some().unwrap();
        let fault = single.open(Frames { first: 0, count: 2 }, 24.0).unwrap_err().to_string();
        assert!(fault.contains("a.%04d.exr"), "{fault}");
    }

    #[test]
    fn a_single_frame_makes_a_still_picture_and_a_missing_one_no_movie() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.png");
        let open = |count| options(&[&path], None).check_some().unwrap().open(Frames { first: 3, count }, 24.0).unwrap();
        let mut writer = open(1);
        writer.write(3, b"", &picture(0.5)).unwrap();
        writer.finish().unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), picture(0.5));
        let mut writer = open(2);
        writer.write(4, b"", &picture(0.5)).unwrap();
        assert!(writer.finish().unwrap_err().to_string().contains("frame 3 never came"));
        assert_eq!(std::fs::read(&path).unwrap(), picture(0.5), "the old file stays");
    }
}
