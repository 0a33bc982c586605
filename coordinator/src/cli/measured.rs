//! Measurements from files: a primal and its differences, in one OpenEXR file of several layers or in one file each.

use std::path::{Path, PathBuf};

use gradfarm_core::film::{Features, Image};
use gradfarm_core::lattice::Extent;
use gradfarm_core::output::{Error as ExrError, exr};

use super::error::Error;

/// Endings of the names under which gradient-domain renderers write the primal, the differences and directly visible light.
const PRIMAL: [&str; 2] = ["primal", "throughput"];
const DX: [&str; 1] = ["dx"];
const DY: [&str; 1] = ["dy"];
const DIRECT: [&str; 1] = ["direct"];
/// Endings that such files have besides: the name before them is what the set goes by.
const OTHERS: [&str; 4] = ["final", "L1", "L2", "variance"];

/// Where measurements stand.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Places {
    /// The primal.
    pub primal: PathBuf,
    /// I(x+1, y) − I(x, y).
    pub dx: PathBuf,
    /// I(x, y+1) − I(x, y).
    pub dy: PathBuf,
    /// Directly visible light, which is added at the end.
    pub direct: Option<PathBuf>,
    /// Variances.
    pub variance: Option<PathBuf>,
    /// Albedo, normal, depth.
    pub features: Option<PathBuf>,
}

/// Measurements of one image.
#[derive(Clone, Debug)]
pub(super) struct Measured {
    /// Without directly visible light, where that is known. RGB.
    pub primal: Image,
    /// RGB.
    pub dx: Image,
    /// RGB.
    pub dy: Image,
    /// Directly visible light. RGB.
    pub direct: Option<Image>,
    /// Variances of the primal (RGB), of dx and of dy (summed over RGB), where all of them are known.
    pub variance: Option<[Image; 3]>,
    /// What is seen first.
    pub features: Option<Features>,
    /// What a person should know about the files.
    pub notes: Vec<String>,
}

impl Places {
    /// The files that one name stands for: of a multi-layer file itself, else those of the same name with other endings.
    ///
    /// # Errors
    /// If there is no such set of files.
    pub(super) fn named(name: &Path) -> Result<Self, Error> {
        let text = name.to_string_lossy();
        let stem = text.strip_suffix(".exr").unwrap_or(&text);
        let endings = PRIMAL.iter().chain(&DX).chain(&DY).chain(&DIRECT).chain(&OTHERS);
        let prefix = endings.into_iter().find_map(|ending| stem.strip_suffix(&format!("-{ending}"))).unwrap_or(stem);
        let sought = |endings: &[&str]| -> Vec<PathBuf> { endings.iter().map(|ending| format!("{prefix}-{ending}.exr").into()).collect() };
        let first = |endings: &[&str]| sought(endings).into_iter().find(|path| path.is_file());
        if let (Some(primal), Some(dx), Some(dy)) = (first(&PRIMAL), first(&DX), first(&DY)) {
            return Ok(Self { primal, dx, dy, direct: first(&DIRECT), variance: first(&["variance"]), features: None });
        }
        if name.is_file() {
            let file = || name.to_path_buf();
            return Ok(Self {
                primal: file(),
                dx: file(),
                dy: file(),
                direct: Some(file()),
                variance: Some(file()),
                features: Some(file()),
            });
        }
        let missing: Vec<String> = [&PRIMAL[..1], &DX, &DY]
            .into_iter()
            .filter(|endings| first(endings).is_none())
            .flat_map(sought)
            .map(|path| path.display().to_string())
            .collect();
        Err(Error::Usage(format!(
            "{} is no file, and of the files that it could stand for there is no {}: expected an OpenEXR file with the layers primal, dx and dy, or one file for each",
            name.display(),
            missing.join(", no ")
        )))
    }

    /// Reads all of it.
    ///
    /// # Errors
    /// If a file cannot be read or has no such layer, or sizes differ; naming file, layer, what was found and what was expected.
    pub(super) fn read(&self) -> Result<Measured, Error> {
        let mut files = Files::default();
        let mut primal = files.rgb(&self.primal, "primal")?;
        let extent = primal.extent();
        let dx = files.same_size(&self.dx, "dx", extent)?;
        let dy = files.same_size(&self.dy, "dy", extent)?;
        let direct = match &self.direct {
            // A file of several layers need not have this one; a file of its own is named for it.
            Some(path) if *path == self.primal => files.optional(path, "direct", extent)?,
            Some(path) => Some(files.same_size(path, "direct", extent)?),
            None => None,
        };
        let mut notes = Vec::new();
        if let Some(direct) = direct.as_ref().filter(|_| self.direct.as_ref() == Some(&self.primal)) {
            // In one file the primal is the picture that path tracing shows, with everything in it.
            primal.data_mut().iter_mut().zip(direct.data()).for_each(|(p, d)| *p -= d);
        }
        for (layer, image, at_border) in [("dx", &dx, last_column as fn(&Image) -> bool), ("dy", &dy, last_row)] {
            if at_border(image) {
                let beyond = if layer == "dx" { "column" } else { "row" };
                notes.push(format!(
                    "{layer} is not zero in its last {beyond}, beyond which there is no pixel: what stands there is not used"
                ));
            }
        }
        let variance = match &self.variance {
            Some(path) => files.variances(path, extent, *path == self.primal)?,
            None => None,
        };
        let features = match &self.features {
            Some(path) => files.features(path, extent, *path == self.primal)?,
            None => None,
        };
        Ok(Measured { primal, dx, dy, direct, variance, features, notes })
    }
}

/// The file that was read last, so that one of many layers is read once.
#[derive(Default)]
struct Files {
    last: Option<(PathBuf, Vec<u8>)>,
}

impl Files {
    fn bytes(&mut self, path: &Path) -> Result<&[u8], Error> {
        if self.last.as_ref().is_none_or(|(last, _)| last != path) {
            let bytes = std::fs::read(path).map_err(|fault| Error::Usage(format!("{}: {fault}", path.display())))?;
            self.last = Some((path.to_path_buf(), bytes));
        }
        Ok(self.last.as_ref().map_or(&[], |(_, bytes)| bytes))
    }

    /// A layer by its name; where there is none, the file's own image, unless that is the image which is to be made.
    fn rgb(&mut self, path: &Path, layer: &str) -> Result<Image, Error> {
        let bytes = self.bytes(path)?;
        let unreadable = |fault: ExrError| Error::Usage(format!("{}, layer {layer}: {fault}", path.display()));
        let image = match exr::read_layer(bytes, layer) {
            Ok(image) => image,
            Err(missing) if exr::layers(bytes).is_ok_and(|layers| layers.len() == 1) => {
                exr::read_rgb(bytes).map_err(|_| unreadable(missing))?
            }
            Err(missing) => return Err(unreadable(missing)),
        };
        match image.channels() {
            3 => Ok(image),
            found => Err(Error::Usage(format!("{}, layer {layer}: found {found} channel, expected 3 (R, G, B)", path.display()))),
        }
    }

    fn same_size(&mut self, path: &Path, layer: &str, extent: Extent) -> Result<Image, Error> {
        let image = self.rgb(path, layer)?;
        check_size(path, layer, &image, extent)?;
        Ok(image)
    }

    fn optional(&mut self, path: &Path, layer: &str, extent: Extent) -> Result<Option<Image>, Error> {
        self.layer(path, layer, extent, true)
    }

    /// A layer of any number of channels; `None` if it may be missing and is.
    fn layer(&mut self, path: &Path, layer: &str, extent: Extent, may_miss: bool) -> Result<Option<Image>, Error> {
        match exr::read_layer(self.bytes(path)?, layer) {
            Ok(image) => {
                check_size(path, layer, &image, extent)?;
                Ok(Some(image))
            }
            Err(ExrError::MissingChannels { .. }) if may_miss => Ok(None),
            Err(fault) => Err(Error::Usage(format!("{}, layer {layer}: {fault}", path.display()))),
        }
    }

    /// Variances of the primal, dx and dy: layers `variance`, `variance-dx`, `variance-dy`.
    fn variances(&mut self, path: &Path, extent: Extent, may_miss: bool) -> Result<Option<[Image; 3]>, Error> {
        let mut layers = Vec::with_capacity(3);
        for layer in ["variance", "variance-dx", "variance-dy"] {
            layers.extend(self.layer(path, layer, extent, may_miss)?);
        }
        let Ok([primal, dx, dy]) = <[Image; 3]>::try_from(layers) else { return Ok(None) };
        Ok(Some([spread(&primal), summed(&dx), summed(&dy)]))
    }

    fn features(&mut self, path: &Path, extent: Extent, may_miss: bool) -> Result<Option<Features>, Error> {
        let mut layers = Vec::with_capacity(3);
        for (layer, expected) in [("albedo", 3), ("normal", 3), ("depth", 1)] {
            let Some(image) = self.layer(path, layer, extent, may_miss)? else { return Ok(None) };
            let found = image.channels();
            if found != expected {
                return Err(Error::Usage(format!("{}, layer {layer}: found {found} channels, expected {expected}", path.display())));
            }
            layers.push(image);
        }
        Ok(<[Image; 3]>::try_from(layers).ok().map(|[albedo, normal, depth]| Features { albedo, normal, depth }))
    }
}

fn check_size(path: &Path, layer: &str, image: &Image, expected: Extent) -> Result<(), Error> {
    let found = image.extent();
    if found == expected {
        return Ok(());
    }
    let size = |extent: Extent| format!("{}×{}", extent.width, extent.height);
    Err(Error::Usage(format!("{}, layer {layer}: found {}, expected {} as the primal has", path.display(), size(found), size(expected))))
}

/// Whether anything stands where there is no difference to the next column.
fn last_column(image: &Image) -> bool {
    let width = image.extent().width as usize;
    image.data().chunks(width).any(|row| row.last().is_some_and(|v| *v != 0.0))
}

/// Whether anything stands where there is no difference to the next row.
fn last_row(image: &Image) -> bool {
    let (width, pixels) = (image.extent().width as usize, image.extent().pixels());
    (0..image.channels()).any(|c| image.plane(c)[pixels - width..].iter().any(|v| *v != 0.0))
}

/// Three channels; one is shared out among them, so that the sum stays.
fn spread(image: &Image) -> Image {
    let mut out = Image::new(image.extent(), 3);
    let channels = image.channels();
    for c in 0..3 {
        let share = if channels == 3 { 1.0 } else { 1.0 / 3.0 };
        out.plane_mut(c).iter_mut().zip(image.plane(c.min(channels - 1))).for_each(|(out, v)| *out = share * v);
    }
    out
}

/// One channel: the sum of all.
fn summed(image: &Image) -> Image {
    let mut out = Image::new(image.extent(), 1);
    for c in 0..image.channels() {
        out.plane_mut(0).iter_mut().zip(image.plane(c)).for_each(|(out, v)| *out += v);
    }
    out
}
