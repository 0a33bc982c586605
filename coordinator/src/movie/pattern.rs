//! Names of files with a place for the frame's number, such as `frame.%04d.exr`.

use std::path::{Path, PathBuf};

/// Most digits that a name may ask for.
const DIGITS: u32 = 10;

/// The name of a file, as it was asked for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum FileName {
    /// One file.
    Single(PathBuf),
    /// A file for each frame.
    Numbered(FramePattern),
}

/// A name with one place for the number of a frame.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FramePattern {
    folder: PathBuf,
    before: String,
    /// Digits at least; zeros fill them.
    digits: usize,
    after: String,
}

impl FileName {
    /// Reads a path whose last part may hold one `%d`, or `%04d` for at least four digits; `%%` is a percent sign.
    ///
    /// # Errors
    /// What was found after a percent sign, and what was expected.
    pub fn parse(path: &Path) -> Result<Self, String> {
        let Some(name) = path.file_name().filter(|name| name.to_string_lossy().contains('%')) else {
            return Ok(Self::Single(path.to_path_buf()));
        };
        let told = |found: String| format!("{}: {found}; {EXPECTED}", path.display());
        let name = name.to_str().ok_or_else(|| told("the name is not UTF-8".to_owned()))?;
        let mut texts = vec![String::new()];
        let mut digits = None;
        let mut rest = name;
        while let Some((text, after)) = rest.split_once('%') {
            let last = texts.len() - 1;
            texts[last].push_str(text);
            if let Some(after) = after.strip_prefix('%') {
                texts[last].push('%');
                rest = after;
                continue;
            }
            let (number, after) = after.split_once('d').ok_or_else(|| told(format!("found `%{after}`")))?;
            let width = if number.is_empty() { Some(1) } else { width(number) };
            let width = width.ok_or_else(|| told(format!("found `%{number}d`")))?;
            if digits.replace(width).is_some() {
                return Err(told("found more than one place for the number".to_owned()));
            }
            texts.push(String::new());
            rest = after;
        }
        if let Some(last) = texts.last_mut() {
            last.push_str(rest);
        }
        let folder = path.parent().unwrap_or(Path::new("")).to_path_buf();
        let mut texts = texts.into_iter();
        let before = texts.next().unwrap_or_default();
        Ok(match digits {
            Some(digits) => Self::Numbered(FramePattern { folder, before, digits, after: texts.next().unwrap_or_default() }),
            None => Self::Single(folder.join(before)),
        })
    }
}

/// What a name may hold.
const EXPECTED: &str = "expected exactly one %d, or such as %04d, for the frame's number, and %% for a percent sign";

/// The number of digits in `04`: a zero, then 1 to 10.
fn width(text: &str) -> Option<usize> {
    let digits = text.strip_prefix('0')?;
    let plain = digits.bytes().all(|byte| byte.is_ascii_digit());
    let digits: u32 = digits.parse().ok().filter(|digits| plain && (1..=DIGITS).contains(digits))?;
    Some(digits as usize)
}

impl FramePattern {
    /// The file of a frame.
    pub fn path(&self, frame: u32) -> PathBuf {
        let Self { folder, before, digits, after } = self;
        folder.join(format!("{before}{frame:0digits$}{after}"))
    }

    /// The pattern that a single name suggests: `a.exr` becomes `a.%04d.exr`.
    pub fn suggested(path: &Path) -> PathBuf {
        let plain = |part: &std::ffi::OsStr| part.to_string_lossy().replace('%', "%%");
        let stem = path.file_stem().map(plain).unwrap_or_default();
        let extension = path.extension().map(|extension| format!(".{}", plain(extension))).unwrap_or_default();
        path.with_file_name(format!("{stem}.%04d{extension}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn pattern(text: &str) -> FramePattern {
        match FileName::parse(Path::new(text)).unwrap() {
            FileName::Numbered(pattern) => pattern,
            FileName::Single(path) => panic!("{} is a single name", path.display()),
        }
    }

    #[test]
    fn numbers_stand_where_they_should() {
        for (text, frame, path) in [
            ("out/frame.%04d.exr", 7, "out/frame.0007.exr"),
            ("%d.exr", 0, "0.exr"),
            ("a%%b%02d.exr", 123, "a%b123.exr"),
            ("%01d", u32::MAX, "4294967295"),
            ("50%/a%010d", 5, "50%/a0000000005"),
        ] {
            assert_eq!(pattern(text).path(frame), Path::new(path), "{text}");
        }
        for (text, path) in [("a.exr", "a.exr"), ("50%/a.exr", "50%/a.exr"), ("50%%.exr", "50%.exr"), ("%d/a.exr", "%d/a.exr")] {
            assert_eq!(FileName::parse(Path::new(text)), Ok(FileName::Single(path.into())), "{text}");
        }
        assert_eq!(FramePattern::suggested(Path::new("x/50%.exr")), Path::new("x/50%%.%04d.exr"));
        assert_eq!(FramePattern::suggested(Path::new("a.5%")), Path::new("a.%04d.5%%"));
        assert_eq!(pattern("x/50%%.%04d.exr").path(1), Path::new("x/50%.0001.exr"));
    }

    #[test]
    fn other_places_are_refused() {
        for (text, found) in [
            ("a%d%d.exr", "more than one"),
            ("a%4d.exr", "`%4d`"),
            ("a%00d.exr", "`%00d`"),
            ("a%0+4d.exr", "`%0+4d`"),
            ("a%011d", "`%011d`"),
            ("50%.exr", "`%.exr`"),
            ("a%", "`%`"),
            ("a%s-%d", "`%s-%d`"),
        ] {
            let fault = FileName::parse(Path::new(text)).unwrap_err();
            assert!(fault.contains(found) && fault.contains("%04d"), "{text}: {fault}");
        }
    }

    proptest! {
        #[test]
        fn any_name_is_a_pattern_or_single_or_an_error(text in "[%d0-9a/é.]{0,16}", frame: u32) {
            if let Ok(FileName::Numbered(pattern)) = FileName::parse(Path::new(&text)) {
                let other = frame ^ 1;
                prop_assert_ne!(pattern.path(frame), pattern.path(other));
                prop_assert!(pattern.path(frame).to_str().unwrap().contains(&frame.to_string()));
            }
        }

        #[test]
        fn every_single_name_suggests_a_pattern(text in "[^/\0]{1,12}", frame: u32) {
            prop_assume!(text != "." && text != "..");
            let suggested = FramePattern::suggested(Path::new(&text));
            prop_assert!(matches!(FileName::parse(&suggested), Ok(FileName::Numbered(_))), "{}", suggested.display());
        }
    }
}
