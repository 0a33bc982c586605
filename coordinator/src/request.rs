//! What a person may ask of the renderer, as text: read the same way from the command line and from HTTP.

use gradfarm_core::lattice::Extent;
use gradfarm_core::plan::{ReconstructionKind, ShiftKind, Technique, by_name};
use gradfarm_core::scene::limits::{FILM_PIXELS, FILM_SIDE};

/// The name that leaves a choice to the plan.
pub const AUTO: &str = "auto";

/// The names of every technique, `auto` first.
pub fn technique_names() -> impl Iterator<Item = &'static str> {
    std::iter::once(AUTO).chain(Technique::ALL.map(Technique::name))
}

/// The names of every reconstruction, `auto` first.
pub fn reconstruction_names() -> impl Iterator<Item = &'static str> {
    std::iter::once(AUTO).chain(ReconstructionKind::ALL.map(ReconstructionKind::name).into_iter().filter(|name| *name != AUTO))
}

/// The names of every shift, `auto` first.
pub fn shift_names() -> impl Iterator<Item = &'static str> {
    std::iter::once(AUTO).chain(ShiftKind::ALL.map(ShiftKind::name))
}

/// A technique by name; `None` for `auto`.
///
/// # Errors
/// The names that there are.
pub fn technique(name: &str) -> Result<Option<Technique>, String> {
    choice(&Technique::ALL, Technique::name, name)
}

/// A reconstruction by name; `None` for `auto`.
///
/// # Errors
/// The names that there are.
pub fn reconstruction(name: &str) -> Result<Option<ReconstructionKind>, String> {
    choice(&ReconstructionKind::ALL, ReconstructionKind::name, name)
}

/// A shift by name; `None` for `auto`.
///
/// # Errors
/// The names that there are.
pub fn shift(name: &str) -> Result<Option<ShiftKind>, String> {
    choice(&ShiftKind::ALL, ShiftKind::name, name)
}

fn choice<T: Copy>(all: &[T], name_of: fn(T) -> &'static str, name: &str) -> Result<Option<T>, String> {
    if name == AUTO {
        return Ok(None);
    }
    by_name(all, name_of, name).map(Some).ok_or_else(|| {
        let names: Vec<&str> = all.iter().map(|item| name_of(*item)).filter(|name| *name != AUTO).collect();
        format!("expected {AUTO} or one of {}", names.join(", "))
    })
}

/// A film size such as `640x480` [pixels].
///
/// # Errors
/// What was expected, with the bounds that scenes keep too.
pub fn size(text: &str) -> Result<Extent, String> {
    let edge = |part: &str| part.parse::<u32>().ok().filter(|edge| (1..=FILM_SIDE).contains(edge));
    let expected = || format!("expected WIDTHxHEIGHT with edges of 1 to {FILM_SIDE} pixels, such as 640x480");
    let (width, height) = text.split_once(['x', 'X', '×']).ok_or_else(expected)?;
    let extent = Extent { width: edge(width).ok_or_else(expected)?, height: edge(height).ok_or_else(expected)? };
    if extent.pixels() as u64 > FILM_PIXELS {
        return Err(format!("{} pixels, expected at most {FILM_PIXELS}", extent.pixels()));
    }
    Ok(extent)
}

/// The other way.
pub fn size_text(extent: Extent) -> String {
    format!("{}x{}", extent.width, extent.height)
}

/// Whether a number can be the weight of the primal in the reconstruction.
///
/// # Errors
/// What was expected.
pub fn check_alpha(alpha: f32) -> Result<f32, String> {
    if alpha.is_finite() && alpha > 0.0 { Ok(alpha) } else { Err("expected a finite number above 0, such as 0.2".to_owned()) }
}

/// Whether a number can be the least probability of a shift.
///
/// # Errors
/// What was expected.
pub fn check_survival(survival: f32) -> Result<f32, String> {
    if survival > 0.0 && survival <= 1.0 { Ok(survival) } else { Err("expected a number above 0, at most 1, such as 0.1".to_owned()) }
}

/// Whether a number can be an error to reach.
///
/// # Errors
/// What was expected.
pub fn check_error(error: f64) -> Result<f64, String> {
    if error.is_finite() && error > 0.0 { Ok(error) } else { Err("expected a relMSE above 0, such as 0.01".to_owned()) }
}

/// Whether a number can be the time of a frame.
///
/// # Errors
/// What was expected.
pub fn check_seconds(seconds: f64) -> Result<f64, String> {
    if seconds.is_finite() && seconds > 0.0 { Ok(seconds) } else { Err("expected a number of seconds above 0, such as 30".to_owned()) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_and_back() {
        for item in Technique::ALL {
            assert_eq!(technique(item.name()), Ok(Some(item)));
        }
        for item in ReconstructionKind::ALL.into_iter().filter(|kind| *kind != ReconstructionKind::Auto) {
            assert_eq!(reconstruction(item.name()), Ok(Some(item)));
        }
        assert_eq!(reconstruction("auto"), Ok(None));
        for item in ShiftKind::ALL {
            assert_eq!(shift(item.name()), Ok(Some(item)));
        }
        assert_eq!(technique("auto"), Ok(None));
        assert_eq!(technique("magic").unwrap_err(), "expected auto or one of pt, gpt, reuse, graph");
    }

    #[test]
    fn sizes_and_weights_are_bounded() {
        let extent = Extent { width: 640, height: 48 };
        assert_eq!(size("640x48"), Ok(extent));
        assert_eq!(size(&size_text(extent)), Ok(extent));
        for bad in ["", "640", "0x5", "x", "640x", "70000x2", "65536x65536", "-1x4", "4x4x4", "1e3x4"] {
            assert!(size(bad).is_err(), "{bad}");
        }
        for bad in [0.0, -1.0, f32::NAN, f32::INFINITY] {
            assert!(check_alpha(bad).is_err(), "{bad}");
            assert!(bad == 1.0 || check_survival(bad).is_err(), "{bad}");
        }
    }
}
