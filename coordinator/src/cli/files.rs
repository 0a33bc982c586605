//! Output files: whether they can be written is found out before any work, and they appear whole or not at all.

use std::io::Write;
use std::path::{Path, PathBuf};

use super::error::Error;

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
        let mut builder = tempfile::Builder::new();
        builder.prefix(".gradfarm-");
        // Temporary files are private by default; an image should be as readable as the user's other files.
        #[cfg(unix)]
        builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
        let mut file = builder.tempfile_in(folder_of(&self.path))?;
        file.write_all(bytes)?;
        file.as_file().sync_all()?;
        file.persist(&self.path).map(drop).map_err(|fault| fault.error)
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
}
