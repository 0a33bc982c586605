//! `gradfarm import`: a scene of any supported format as native JSON, with the files that it needs beside it.

use std::path::{Path, PathBuf};

use gradfarm_core::scene::{Assets, Loaded};

use super::error::Error;
use super::files::Target;
use super::{scene, terminal};

/// Arguments of `gradfarm import`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  gradfarm import scene.xml -o scene.json
  gradfarm import model.glb -o model/scene.json
  gradfarm import scene-v4.pbrt -o scene.json --force

What could not be carried over as it was is told on standard error, one line each. render, submit and plan read every format \
directly; importing is for those who want to go on in gradfarm's own.")]
pub(super) struct Import {
    /// The scene: Mitsuba XML, glTF (.gltf, .glb), pbrt, or gradfarm JSON
    scene: PathBuf,
    /// The native scene to write; meshes and textures go into its folder
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// Replace files that are there already
    #[arg(long)]
    force: bool,
}

impl Import {
    /// Reads the scene, checks that everything may be written, writes it and says what.
    pub(super) fn run(&self) -> Result<(), Error> {
        if self.output.extension().is_none_or(|extension| !extension.eq_ignore_ascii_case("json")) {
            return Err(Error::Usage(format!("{} should end in .json", self.output.display())));
        }
        let output = Target::check(&self.output)?;
        let loaded = scene::read(&self.scene)?;
        let json = loaded.description.to_json();
        self.may_replace(&self.output, json.as_bytes())?;
        let written = self.write_assets(&loaded)?;
        output.write(json.as_bytes())?;
        let scene = &loaded.description;
        let shapes = scene.shapes.len() + scene.groups.values().map(Vec::len).sum::<usize>();
        terminal::line(format_args!(
            "{}: {shapes} shapes, {} materials, {} textures, {} lights; {} written beside it; {} in the report",
            self.output.display(),
            scene.materials.len(),
            scene.textures.len(),
            scene.lights.len() + scene.environment.iter().count() + scene.shapes.iter().filter(|shape| shape.emission.is_some()).count(),
            counted(written, "file"),
            counted(loaded.report.len(), "line"),
        ))
    }

    /// Puts the files of the scene beside the output; those that are there already with the same bytes stay. Returns how many were written.
    /// Nothing is written before all of them were found to be allowed.
    fn write_assets(&self, loaded: &Loaded) -> Result<usize, Error> {
        let folder = self.output.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let mut missing = Vec::new();
        for name in loaded.description.assets() {
            let path = folder.join(&name);
            let bytes = loaded.assets.open(&name)?;
            if self.may_replace(&path, &bytes)? {
                missing.push((name, path));
            }
        }
        for (name, path) in &missing {
            let failed = |source| Error::Write { path: path.clone(), source };
            if let Some(folder) = path.parent() {
                std::fs::create_dir_all(folder).map_err(failed)?;
            }
            Target::check(path)?.write(&loaded.assets.open(name)?)?;
        }
        Ok(missing.len())
    }

    /// Whether a file is to be written: not if it is there with the same bytes.
    fn may_replace(&self, path: &Path, bytes: &[u8]) -> Result<bool, Error> {
        match std::fs::read(path) {
            Ok(there) if there == bytes => Ok(false),
            Ok(_) if !self.force => Err(Error::Usage(format!("{} is there already; --force replaces it", path.display()))),
            _ => Ok(true),
        }
    }
}

fn counted(count: usize, what: &str) -> String {
    if count == 1 { format!("1 {what}") } else { format!("{count} {what}s") }
}
