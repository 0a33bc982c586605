//! Output files: whether they can be written is found out before any work, and they appear whole or not at all.

use std::io::Write;
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;

use super::error::Error;
use crate::movie::pattern::{FileName, FramePattern};

/// A file that will be written when the work is done.
#[derive(Clone, Debug)]
pub(super) struct Target {
    path: PathBuf,
}

/// An image and the preview beside it.
#[derive(Clone, Debug)]
pub(super) struct ImageTarget {
    /// The image.
    pub exr: Target,
    /// The same for quick viewers.
    pub png: Target,
}

/// A file, or one for each frame.
#[derive(Clone, Debug)]
pub(super) struct FrameTarget {
    name: FileName,
}

impl Target {
    /// Checks that `path` may be written: its folder exists and takes a new file, and it is no folder itself.
    ///
    /// # Errors
    /// [`Error::Usage`] naming the folder or file, and what is wrong with it.
    pub(super) fn check(path: &Path) -> Result<Self, Error> {
        if path.is_dir() {
            return Err(Error::Usage(format!("{} is a folder, expected the name of a file", path.display())));
        }
        let folder = folder_of(path);
        if !folder.is_dir() {
            return Err(Error::Usage(format!("{} cannot be written: the folder {} does not exist", path.display(), folder.display())));
        }
        // Permissions alone do not tell (read-only file systems, quotas): only making a file does.
        let refused = |source: std::io::Error| {
            Error::Usage(format!("{} cannot be written: the folder {} takes no new file ({source})", path.display(), folder.display()))
        };
        tempfile::Builder::new().prefix(".gradfarm-").tempfile_in(folder).map_err(refused)?.close().map_err(refused)?;
        Ok(Self { path: path.to_path_buf() })
    }

    /// Checks an image file and the preview beside it: `a.exr` and `a.png`.
    ///
    /// # Errors
    /// As [`check`](Self::check), and if the name does not end in `.exr`.
    pub(super) fn check_image(path: &Path) -> Result<ImageTarget, Error> {
        if path.extension().is_none_or(|extension| !extension.eq_ignore_ascii_case("exr")) {
            return Err(Error::Usage(format!("{} should end in .exr; the PNG is written beside it", path.display())));
        }
        Ok(ImageTarget { exr: Self::check(path)?, png: Self::check(&path.with_extension("png"))? })
    }

    /// The path as it was given.
    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// Writes the file: first under another name in the same folder, then renamed, so that nobody ever sees a part of it.
    ///
    /// # Errors
    /// [`Error::Write`].
    pub(super) fn write(&self, bytes: &[u8]) -> Result<(), Error> {
        self.try_write(bytes).map_err(|source| Error::Write { path: self.path.clone(), source })
    }

    fn try_write(&self, bytes: &[u8]) -> std::io::Result<()> {
        let mut file = self.try_begin()?;
        file.write_all(bytes)?;
        self.try_finish(file)
    }

    /// A file under another name in the same folder, for what is written piece by piece.
    ///
    /// # Errors
    /// [`Error::Write`].
    pub(super) fn begin(&self) -> Result<NamedTempFile, Error> {
        self.try_begin().map_err(|source| Error::Write { path: self.path.clone(), source })
    }

    /// Gives the finished file its name.
    ///
    /// # Errors
    /// [`Error::Write`].
    pub(super) fn finish(&self, file: NamedTempFile) -> Result<(), Error> {
        self.try_finish(file).map_err(|source| Error::Write { path: self.path.clone(), source })
    }

    fn try_begin(&self) -> std::io::Result<NamedTempFile> {
        let mut builder = tempfile::Builder::new();
        builder.prefix(".gradfarm-");
        // Temporary files are private by default; an image should be as readable as the user's other files.
        #[cfg(unix)]
        builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
        builder.tempfile_in(folder_of(&self.path))
    }

    fn try_finish(&self, file: NamedTempFile) -> std::io::Result<()> {
        file.as_file().sync_all()?;
        file.persist(&self.path).map(drop).map_err(|fault| fault.error)
    }
}

impl FrameTarget {
    /// Checks that the file may be written, or those of all frames: a name with one `%d` or such as `%04d` stands for a file each.
    ///
    /// # Errors
    /// [`Error::Usage`] as [`Target::check`], and for any other percent sign.
    pub(super) fn check(path: &Path) -> Result<Self, Error> {
        let name = FileName::parse(path).map_err(Error::Usage)?;
        let target = Self { name };
        Target::check(&target.path(0))?;
        Ok(target)
    }

    /// Checks that there is a file for each of so many frames.
    ///
    /// # Errors
    /// [`Error::Usage`] with a name that would do.
    pub(super) fn check_count(&self, count: u32) -> Result<(), Error> {
        match &self.name {
            FileName::Single(path) if count > 1 => Err(Error::Usage(format!(
                "{} is one file and there are {count} frames: {} would be a file for each, --frames takes fewer",
                path.display(),
                FramePattern::suggested(path).display()
            ))),
            _ => Ok(()),
        }
    }

    /// Whether each frame has a file of its own.
    pub(super) fn is_numbered(&self) -> bool {
        matches!(self.name, FileName::Numbered(_))
    }

    /// The path of a frame's file.
    pub(super) fn path(&self, frame: u32) -> PathBuf {
        match &self.name {
            FileName::Single(path) => path.clone(),
            FileName::Numbered(pattern) => pattern.path(frame),
        }
    }

    /// Writes the file of a frame.
    ///
    /// # Errors
    /// [`Error::Write`].
    pub(super) fn write(&self, frame: u32, bytes: &[u8]) -> Result<(), Error> {
        Target { path: self.path(frame) }.write(bytes)
    }

    /// Writes what stands beside the file of a frame under the same name but for its end.
    ///
    /// # Errors
    /// [`Error::Write`].
    pub(super) fn write_beside(&self, frame: u32, extension: &str, bytes: &[u8]) -> Result<(), Error> {
        Target { path: self.path(frame).with_extension(extension) }.write(bytes)
    }
}

fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_missing_folder_is_found_before_anything_is_written() {
        let folder = tempfile::tempdir().unwrap();
        let fault = Target::check(&folder.path().join("nowhere/a.exr")).unwrap_err();
        assert!(fault.to_string().contains("nowhere does not exist"), "{fault}");
        let fault = Target::check(folder.path()).unwrap_err();
        assert!(fault.to_string().contains("is a folder"), "{fault}");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
    }

    #[test]
    fn files_are_replaced_whole_and_nothing_is_left_beside_them() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.exr");
        let target = Target::check(&path).unwrap();
        target.write(b"old").unwrap();
        target.write(b"new one").unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), b"new one");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn every_frame_has_a_file_of_its_own() {
        let folder = tempfile::tempdir().unwrap();
        let target = FrameTarget::check(&folder.path().join("a.%03d.exr")).unwrap();
        assert!(target.check_count(9).is_ok() && target.is_numbered());
        target.write(7, b"seven").unwrap();
        target.write_beside(7, "png", b"beside").unwrap();
        assert_eq!(std::fs::read(folder.path().join("a.007.exr")).unwrap(), b"seven");
        assert_eq!(std::fs::read(folder.path().join("a.007.png")).unwrap(), b"beside");
        let single = FrameTarget::check(&folder.path().join("b.exr")).unwrap();
        assert!(single.check_count(1).is_ok());
        let fault = single.check_count(2).unwrap_err().to_string();
        assert!(fault.contains("there are 2 frames") && fault.contains("b.%04d.exr"), "{fault}");
    }
}
