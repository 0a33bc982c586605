//! Intel Open Image Denoise, where its library is found at run time: nothing is linked, and without it all else works.
//!
//! The library is looked for where the environment variable `GRADFARM_OIDN` says (the file, or the folder that holds it), else where the
//! system keeps libraries. Its bits depend on the CPU, so frames that it made are not promised to be the same bits elsewhere.
//!
//! # Source
//! The C interface of Open Image Denoise 2, as its manual documents it.
#![allow(unsafe_code)]

use std::ffi::{CStr, OsStr, OsString, c_char, c_int, c_void};
use std::path::Path;

use gradfarm_core::film::Image;
use gradfarm_core::reconstruction::{Denoise, ReconstructionKind, denoiser, install_denoiser};
use libloading::{Library, library_filename};

/// The variable that names the library.
pub const VARIABLE: &str = "GRADFARM_OIDN";

/// `OIDN_DEVICE_TYPE_CPU`.
const CPU: c_int = 1;
/// `OIDN_FORMAT_FLOAT3`.
const FLOAT3: c_int = 3;

/// A device or a filter of the library.
type Handle = *mut c_void;

/// The functions that are called.
struct Functions {
    new_device: unsafe extern "C" fn(c_int) -> Handle,
    release_device: unsafe extern "C" fn(Handle),
    commit_device: unsafe extern "C" fn(Handle),
    device_int: unsafe extern "C" fn(Handle, *const c_char) -> c_int,
    device_error: unsafe extern "C" fn(Handle, *mut *const c_char) -> c_int,
    new_filter: unsafe extern "C" fn(Handle, *const c_char) -> Handle,
    release_filter: unsafe extern "C" fn(Handle),
    set_image: unsafe extern "C" fn(Handle, *const c_char, *mut c_void, c_int, usize, usize, usize, usize, usize),
    set_bool: unsafe extern "C" fn(Handle, *const c_char, bool),
    commit_filter: unsafe extern "C" fn(Handle),
    execute_filter: unsafe extern "C" fn(Handle),
}

/// The library with a device of it.
struct Oidn {
    functions: Functions,
    device: Handle,
    version: c_int,
    /// Keeps the functions where they are.
    _library: Library,
}

// SAFETY: the manual says that all functions may be called from any thread, and that calls on one device are serialised.
unsafe impl Send for Oidn {}
// SAFETY: as above; nothing here is written after construction.
unsafe impl Sync for Oidn {}

/// That `oidn` can be had, if it is asked for: better told before a frame is rendered than after.
///
/// # Errors
/// As [`install`].
pub fn check(kind: ReconstructionKind) -> Result<(), String> {
    if kind == ReconstructionKind::Oidn { install().map(|_| ()) } else { Ok(()) }
}

/// Loads the library and offers it to the reconstructions. Returns what was found, for people, or why nothing was.
///
/// # Errors
/// What was looked for and what stood in the way.
pub fn install() -> Result<String, String> {
    if let Some(found) = denoiser() {
        return Ok(found.name());
    }
    let found = Oidn::load(&place(std::env::var_os(VARIABLE)))?;
    let name = found.name();
    // Of two that come at once the first one's stays: it is the same library.
    let _ = install_denoiser(Box::new(found));
    Ok(name)
}

impl Oidn {
    fn load(file: &OsStr) -> Result<Self, String> {
        let lost =
            |fault: libloading::Error| format!("{}: {fault} (set {VARIABLE} to the library's file or folder)", Path::new(file).display());
        // SAFETY: the library of that name initialises itself without conditions; who sets the variable vouches for the file it names.
        let library = unsafe { Library::new(file) }.map_err(lost)?;
        // SAFETY: the signatures are those of the library's header, version 2, where these names have not changed.
        let functions = unsafe { Functions::of(&library) }.map_err(lost)?;
        // SAFETY: no arguments but a constant of the header; null is checked.
        let device = unsafe { (functions.new_device)(CPU) };
        if device.is_null() {
            return Err(format!("{}: the library has no device for this CPU", Path::new(file).display()));
        }
        // SAFETY: the device is not null, and names are C strings that outlive the calls.
        let version = unsafe {
            (functions.commit_device)(device);
            (functions.device_int)(device, c"version".as_ptr())
        };
        let oidn = Self { functions, device, version, _library: library };
        oidn.check().map(|()| oidn)
    }

    /// What the last calls had to complain of.
    fn check(&self) -> Result<(), String> {
        let mut message: *const c_char = std::ptr::null();
        // SAFETY: the device lives as long as self; the message is the library's and valid until its next call on this thread.
        unsafe {
            if (self.functions.device_error)(self.device, &raw mut message) == 0 {
                return Ok(());
            }
            Err(if message.is_null() { "unknown fault".to_owned() } else { CStr::from_ptr(message).to_string_lossy().into_owned() })
        }
    }
}

impl Functions {
    /// # Safety
    /// The library must be Open Image Denoise, version 2.
    unsafe fn of(library: &Library) -> Result<Self, libloading::Error> {
        // SAFETY: each name has the type that the header gives it.
        unsafe {
            Ok(Self {
                new_device: *library.get(b"oidnNewDevice\0")?,
                release_device: *library.get(b"oidnReleaseDevice\0")?,
                commit_device: *library.get(b"oidnCommitDevice\0")?,
                device_int: *library.get(b"oidnGetDeviceInt\0")?,
                device_error: *library.get(b"oidnGetDeviceError\0")?,
                new_filter: *library.get(b"oidnNewFilter\0")?,
                release_filter: *library.get(b"oidnReleaseFilter\0")?,
                set_image: *library.get(b"oidnSetSharedFilterImage\0")?,
                set_bool: *library.get(b"oidnSetFilterBool\0")?,
                commit_filter: *library.get(b"oidnCommitFilter\0")?,
                execute_filter: *library.get(b"oidnExecuteFilter\0")?,
            })
        }
    }
}

impl Denoise for Oidn {
    fn name(&self) -> String {
        format!("Open Image Denoise {}.{}.{}", self.version / 10_000, self.version / 100 % 100, self.version % 100)
    }

    fn denoise(&self, colour: &Image, albedo: &Image, normal: &Image) -> Result<Image, String> {
        let extent = colour.extent();
        let (width, height) = (extent.width as usize, extent.height as usize);
        let mut inputs = [(c"color", interleaved(colour)), (c"albedo", interleaved(albedo)), (c"normal", interleaved(normal))];
        let mut output = vec![0.0f32; 3 * width * height];
        let f = &self.functions;
        // SAFETY: the device is valid. Every image is a live buffer of width × height × 3 floats without gaps, which is what format, size and
        // zero strides say; the filter is released before any of them goes.
        unsafe {
            let filter = (f.new_filter)(self.device, c"RT".as_ptr());
            if filter.is_null() {
                return self.check().and(Err("no filter".to_owned()));
            }
            for (name, values) in &mut inputs {
                (f.set_image)(filter, name.as_ptr(), values.as_mut_ptr().cast(), FLOAT3, width, height, 0, 0, 0);
            }
            (f.set_image)(filter, c"output".as_ptr(), output.as_mut_ptr().cast(), FLOAT3, width, height, 0, 0, 0);
            (f.set_bool)(filter, c"hdr".as_ptr(), true);
            (f.commit_filter)(filter);
            (f.execute_filter)(filter);
            (f.release_filter)(filter);
        }
        self.check()?;
        let plane = |c: usize| output.iter().skip(c).step_by(3);
        let planar = (0..3).flat_map(plane).copied().collect();
        Image::from_planes(extent, 3, planar).ok_or_else(|| "size".to_owned())
    }
}

impl Drop for Oidn {
    fn drop(&mut self) {
        // SAFETY: the device was made by this library and is released once.
        unsafe { (self.functions.release_device)(self.device) };
    }
}

/// Where the library is: a name alone is looked for by the system.
fn place(variable: Option<OsString>) -> OsString {
    let name = library_filename("OpenImageDenoise");
    match variable {
        Some(path) if Path::new(&path).is_dir() => Path::new(&path).join(name).into_os_string(),
        Some(path) => path,
        None => name,
    }
}

fn interleaved(image: &Image) -> Vec<f32> {
    let [r, g, b] = [0, 1, 2].map(|c| image.plane(c));
    r.iter().zip(g).zip(b).flat_map(|((r, g), b)| [*r, *g, *b]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use gradfarm_core::lattice::Extent;

    #[test]
    fn what_is_not_there_is_named() {
        let fault = Oidn::load(&place(Some("/nowhere/lib.so".into()))).err().unwrap();
        assert!(fault.contains("/nowhere/lib.so") && fault.contains(VARIABLE), "{fault}");
        assert_eq!(place(None), library_filename("OpenImageDenoise"));
        assert!(place(Some("/".into())).to_string_lossy().starts_with("/libOpenImageDenoise"));
        assert_eq!(check(ReconstructionKind::L2), Ok(()));
    }

    /// Needs the library, which few machines have.
    #[test]
    fn a_noisy_plane_becomes_smooth() {
        let found = match Oidn::load(&place(std::env::var_os(VARIABLE))) {
            Ok(found) => found,
            Err(fault) => {
                eprintln!("skipped: {fault}");
                return;
            }
        };
        assert!(found.name().starts_with("Open Image Denoise 2."), "{}", found.name());
        let extent = Extent { width: 40, height: 24 };
        let mut state = 1u32;
        let mut next = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) as f32 / (1 << 24) as f32
        };
        let noisy = Image::from_planes(extent, 3, (0..3 * extent.pixels()).map(|_| 0.5 + next()).collect()).unwrap();
        let flat = Image::from_planes(extent, 3, vec![0.5; 3 * extent.pixels()]).unwrap();
        let smooth = found.denoise(&noisy, &flat, &flat).unwrap();
        let spread = |image: &Image| image.data().iter().map(|v| (v - 1.0) * (v - 1.0)).sum::<f32>() / image.data().len() as f32;
        assert!(spread(&smooth) < 0.1 * spread(&noisy), "{} of {}", spread(&smooth), spread(&noisy));
    }
}
