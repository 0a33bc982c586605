//! The files of a scene: meshes and images, beside it in its folder or made by an importer. Their names are relative and stay inside the folder.

use std::collections::BTreeMap;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::error::{Error, ErrorKind};
use super::limits;

/// Where a scene's files come from: a folder, or a worker's store.
pub trait Assets: Sync {
    /// The bytes of the file that the scene calls `name`.
    ///
    /// # Errors
    /// The name is not a plain relative one, or no such file can be read.
    fn open(&self, name: &str) -> Result<Vec<u8>, Error>;
}

/// Assets of a scene that has none.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoAssets;

impl Assets for NoAssets {
    fn open(&self, name: &str) -> Result<Vec<u8>, Error> {
        Err(Error::new(ErrorKind::Unreadable, name, "", "no files at all beside this scene", "the file"))
    }
}

/// Assets in a folder. Nothing outside it is ever read, not even through a symbolic link.
#[derive(Clone, Debug)]
pub struct DirectoryAssets {
    root: PathBuf,
}

impl DirectoryAssets {
    /// Assets in `root`.
    pub fn new(root: impl Into<PathBuf>) -> DirectoryAssets {
        DirectoryAssets { root: root.into() }
    }

    /// The folder.
    pub fn root(&self) -> &Path {
        &self.root
    }

    /// The real path of a file inside the folder, with symbolic links followed.
    ///
    /// # Errors
    /// The name is not a plain relative one, leads out of the folder, or names nothing.
    pub fn locate(&self, name: &str) -> Result<PathBuf, Error> {
        check_name(name).map_err(|expected| Error::new(ErrorKind::OutsideFolder, name, "", format!("{name:?}"), expected))?;
        let unreadable = |path: &Path, fault: &std::io::Error| {
            Error::new(ErrorKind::Unreadable, name, "", format!("{fault} ({})", path.display()), "a readable file")
        };
        let root = self.root.canonicalize().map_err(|fault| unreadable(&self.root, &fault))?;
        let path = root.join(name);
        let path = path.canonicalize().map_err(|fault| unreadable(&path, &fault))?;
        if !path.starts_with(&root) {
            let found = format!("a link to {}", path.display());
            return Err(Error::new(ErrorKind::OutsideFolder, name, "", found, format!("a file inside {}", root.display())));
        }
        Ok(path)
    }
}

impl Assets for DirectoryAssets {
    fn open(&self, name: &str) -> Result<Vec<u8>, Error> {
        read_bounded(&self.locate(name)?, name)
    }
}

/// Files that an importer made out of others, by the names that the description gives them.
pub type MadeAssets = BTreeMap<String, Vec<u8>>;

/// Assets of a scene as read from disk: what its importer made, held in memory, before the files in its folder. Clones share the memory.
#[derive(Clone, Debug)]
pub struct SceneAssets {
    made: Arc<MadeAssets>,
    folder: DirectoryAssets,
}

impl SceneAssets {
    /// What an importer made, in front of the files of `folder`.
    pub fn new(folder: DirectoryAssets, made: MadeAssets) -> SceneAssets {
        SceneAssets { made: Arc::new(made), folder }
    }

    /// What an importer made; empty for native scenes.
    pub fn made(&self) -> &MadeAssets {
        &self.made
    }

    /// The folder that everything else comes from.
    pub fn folder(&self) -> &DirectoryAssets {
        &self.folder
    }
}

impl Assets for SceneAssets {
    fn open(&self, name: &str) -> Result<Vec<u8>, Error> {
        match self.made.get(name) {
            Some(bytes) => Ok(bytes.clone()),
            None => self.folder.open(name),
        }
    }
}

/// Reads a whole regular file of at most [`limits::FILE_BYTES`]; `name` is the name that errors carry.
pub(crate) fn read_bounded(path: &Path, name: &str) -> Result<Vec<u8>, Error> {
    let unreadable =
        |fault: std::io::Error| Error::new(ErrorKind::Unreadable, name, "", format!("{fault} ({})", path.display()), "a readable file");
    let file = std::fs::File::open(path).map_err(unreadable)?;
    let metadata = file.metadata().map_err(unreadable)?;
    if !metadata.is_file() {
        return Err(Error::new(ErrorKind::Unreadable, name, "", format!("no regular file ({})", path.display()), "a readable file"));
    }
    if metadata.len() > limits::FILE_BYTES {
        let found = format!("{} bytes", metadata.len());
        return Err(Error::new(ErrorKind::TooLarge, name, "", found, format!("at most {} bytes", limits::FILE_BYTES)));
    }
    let mut bytes = Vec::with_capacity(metadata.len() as usize);
    // The file may grow while it is read: the limit holds all the same.
    file.take(limits::FILE_BYTES).read_to_end(&mut bytes).map_err(unreadable)?;
    Ok(bytes)
}

/// Whether `name` is a plain relative file name on every system: parts joined by `/`, none of them empty, `.` or `..`.
///
/// # Errors
/// What was expected, in words.
pub fn check_name(name: &str) -> Result<(), &'static str> {
    let expected = "a relative name inside the scene's folder, such as models/column.obj";
    let bad_part = |part: &str| part.is_empty() || part == "." || part == "..";
    let forbidden = |c: char| c == '\\' || c == ':' || c.is_control();
    if name.len() > limits::NAME_BYTES || name.contains(forbidden) || name.split('/').any(bad_part) { Err(expected) } else { Ok(()) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_that_leave_the_folder_are_refused_before_any_file_is_touched() {
        for name in ["", "/etc/passwd", "../a", "a/../b", "a//b", "./a", "C:a", "C:\\a", "a\\b", "a\nb", "a/"] {
            assert!(check_name(name).is_err(), "{name:?}");
        }
        for name in ["a", "a/b.obj", "ä b/c..d", "..a"] {
            assert!(check_name(name).is_ok(), "{name:?}");
        }
    }

    #[test]
    fn a_file_in_the_folder_is_read_and_one_outside_is_not() {
        let folder = tempfile::tempdir().unwrap();
        let inside = folder.path().join("scene");
        std::fs::create_dir(&inside).unwrap();
        std::fs::write(inside.join("a.obj"), b"v 0 0 0").unwrap();
        std::fs::write(folder.path().join("secret"), b"x").unwrap();
        let assets = DirectoryAssets::new(&inside);
        assert_eq!(assets.open("a.obj").unwrap(), b"v 0 0 0");
        assert_eq!(assets.open("b.obj").unwrap_err().kind, ErrorKind::Unreadable);
        assert_eq!(assets.open("../secret").unwrap_err().kind, ErrorKind::OutsideFolder);
    }

    #[test]
    fn what_an_importer_made_comes_before_the_folder() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("a.ply"), b"file").unwrap();
        std::fs::write(folder.path().join("b.ply"), b"other").unwrap();
        let made = MadeAssets::from([("a.ply".to_string(), b"made".to_vec())]);
        let assets = SceneAssets::new(DirectoryAssets::new(folder.path()), made);
        assert_eq!(assets.open("a.ply").unwrap(), b"made");
        assert_eq!(assets.open("b.ply").unwrap(), b"other");
        assert_eq!(assets.open("../a.ply").unwrap_err().kind, ErrorKind::OutsideFolder);
        assert_eq!((assets.made().len(), assets.folder().root()), (1, folder.path()));
    }

    #[cfg(unix)]
    #[test]
    fn a_link_may_not_lead_out_of_the_folder() {
        let folder = tempfile::tempdir().unwrap();
        let inside = folder.path().join("scene");
        std::fs::create_dir(&inside).unwrap();
        std::fs::write(folder.path().join("secret"), b"x").unwrap();
        std::fs::write(inside.join("real"), b"y").unwrap();
        std::os::unix::fs::symlink(folder.path().join("secret"), inside.join("out")).unwrap();
        std::os::unix::fs::symlink("real", inside.join("in")).unwrap();
        let assets = DirectoryAssets::new(&inside);
        assert_eq!(assets.open("out").unwrap_err().kind, ErrorKind::OutsideFolder);
        assert_eq!(assets.open("in").unwrap(), b"y");
    }

    #[test]
    fn a_folder_is_not_a_file() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::create_dir(folder.path().join("a.obj")).unwrap();
        let error = DirectoryAssets::new(folder.path()).open("a.obj").unwrap_err();
        assert_eq!(error.kind, ErrorKind::Unreadable);
    }
}
