//! Mitsuba 3 as a peer in studies: started as a Python program where its package is found, on scenes in its own format.

use std::path::{Path, PathBuf};
use std::process::Stdio;

use gradfarm_core::film::Image;
use gradfarm_core::lattice::Extent;
use gradfarm_core::output::exr;

use super::error::Error;

/// Mitsuba 3, found on this machine.
#[derive(Clone, Debug)]
pub(super) struct Mitsuba {
    python: PathBuf,
    /// As it tells it.
    pub(super) version: String,
    /// How it computes.
    pub(super) variant: &'static str,
}

/// Variants from fast to slow: the first needs LLVM's library, which may be missing or of a version that does not fit.
const VARIANTS: [&str; 2] = ["llvm_ad_rgb", "scalar_rgb"];

/// Tells the version if the variant that is given can render.
const TRIAL: &str = r#"
import sys
import mitsuba as mi
mi.set_variant(sys.argv[1])
scene = mi.cornell_box()
scene["sensor"]["film"]["width"] = scene["sensor"]["film"]["height"] = 4
mi.Bitmap(mi.render(mi.load_dict(scene), spp=1))
print(mi.__version__)
"#;

/// Renders once to warm up, and once by the clock; tells the seconds. Arguments: variant, scene, samples, seed, width, height, output.
const PROGRAM: &str = r#"
import sys, time
import mitsuba as mi
mi.set_variant(sys.argv[1])
scene, samples, seed, width, height, output = sys.argv[2], *map(int, sys.argv[3:7]), sys.argv[7]
loaded = mi.load_file(scene)
params = mi.traverse(loaded)
size = [key for key in params.keys() if key.endswith("film.size")][0]
params[size] = [width, height]
params.update()
def render(spp, seed):
    image = mi.render(loaded, spp=spp, seed=seed)
    return mi.Bitmap(image).convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float32, srgb_gamma=False)
render(1, seed + 1)
start = time.perf_counter()
bitmap = render(samples, seed)
seconds = time.perf_counter() - start
bitmap.write(output)
print(seconds)
"#;

impl Mitsuba {
    /// Looks for Python with the package `mitsuba`; the environment variable `GRADFARM_PYTHON` names another Python.
    pub(super) fn find() -> Option<Self> {
        let python = std::env::var_os("GRADFARM_PYTHON").map_or_else(|| PathBuf::from("python3"), PathBuf::from);
        VARIANTS.into_iter().find_map(|variant| {
            let told = std::process::Command::new(&python)
                .args(["-c", TRIAL, variant])
                .stdin(Stdio::null())
                .stderr(Stdio::null())
                .output()
                .ok()
                .filter(|output| output.status.success())?;
            let version = String::from_utf8_lossy(&told.stdout).trim().to_owned();
            Some(Self { python: python.clone(), version, variant })
        })
    }

    /// Whether a scene is in its format.
    pub(super) fn reads(scene: &Path) -> bool {
        scene.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("xml"))
    }

    /// Renders a scene with its own integrator: the image and the seconds that took, loading left out.
    ///
    /// # Errors
    /// If the program fails or writes no image of that size.
    pub(super) fn render(&self, scene: &Path, samples: u32, seed: u64, size: Extent) -> Result<(Image, f64), Error> {
        let failed = |what: String| Error::Failed(format!("mitsuba on {}: {what}", scene.display()));
        let folder = tempfile::tempdir().map_err(|source| Error::Write { path: std::env::temp_dir(), source })?;
        let output = folder.path().join("image.exr");
        // Its seeds have 32 bits.
        let numbers = [samples.to_string(), (seed as u32 >> 1).to_string(), size.width.to_string(), size.height.to_string()];
        let done = std::process::Command::new(&self.python)
            .args(["-c", PROGRAM, self.variant])
            .arg(scene)
            .args(numbers)
            .arg(&output)
            .stdin(Stdio::null())
            .output()
            .map_err(|fault| failed(fault.to_string()))?;
        if !done.status.success() {
            let told = String::from_utf8_lossy(&done.stderr);
            return Err(failed(told.lines().last().unwrap_or("it failed and said nothing").to_owned()));
        }
        let told = String::from_utf8_lossy(&done.stdout);
        let seconds = told.split_whitespace().last().and_then(|word| word.parse().ok());
        let seconds = seconds.ok_or_else(|| failed(format!("it told `{}`, expected seconds", told.trim())))?;
        let bytes = std::fs::read(&output).map_err(|fault| failed(fault.to_string()))?;
        let image = exr::read_rgb(&bytes).map_err(|fault| failed(fault.to_string()))?;
        if image.extent() != size {
            return Err(failed(format!("it rendered {} × {} pixels", image.extent().width, image.extent().height)));
        }
        Ok((image, seconds))
    }
}
