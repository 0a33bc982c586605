//! One order for a header's attributes.
//!
//! The library keeps the attributes it does not know in a hash map and writes them in that map's order, which changes from run to
//! run. The order is free in the format; sorted by name is what the reference implementation writes.
//!
//! # Source
//! "OpenEXR File Layout", Academy Software Foundation: header = attributes, each name, 0, type, 0, size (i32), value; then 0.

use ::exr::error::Error;

/// Magic number and version.
const PREAMBLE: usize = 8;

/// Sorts the attributes of a single-part file by name. Sizes stay, so every offset in the file stays true.
///
/// # Errors
/// If the bytes are no such file.
pub(super) fn sort_attributes(file: &mut [u8]) -> Result<(), Error> {
    let broken = || Error::Invalid("header of a file just written".into());
    let mut attributes: Vec<(&[u8], &[u8])> = Vec::new();
    let mut rest = file.get(PREAMBLE..).ok_or_else(broken)?;
    loop {
        let (name, length) = attribute(rest).ok_or_else(broken)?;
        if name.is_empty() {
            break;
        }
        attributes.push((name, &rest[..length]));
        rest = &rest[length..];
    }
    attributes.sort_by_key(|(name, _)| *name);
    let sorted = attributes.iter().flat_map(|(_, bytes)| bytes.iter().copied()).collect::<Vec<u8>>();
    file[PREAMBLE..PREAMBLE + sorted.len()].copy_from_slice(&sorted);
    Ok(())
}

/// Name of the attribute at the start, empty for the end of the header, and its length in bytes. `None` if the bytes end before it.
fn attribute(bytes: &[u8]) -> Option<(&[u8], usize)> {
    let name = until_zero(bytes)?;
    if name.is_empty() {
        return Some((name, 1));
    }
    let kind = until_zero(&bytes[name.len() + 1..])?;
    let value = name.len() + 1 + kind.len() + 1 + 4;
    let size = bytes.get(value - 4..value)?.try_into().ok().map(i32::from_le_bytes)?;
    let end = value.checked_add(usize::try_from(size).ok()?)?;
    (end <= bytes.len()).then_some((name, end))
}

fn until_zero(bytes: &[u8]) -> Option<&[u8]> {
    bytes.iter().position(|b| *b == 0).map(|end| &bytes[..end])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(names: &[&str]) -> Vec<u8> {
        let mut bytes = vec![9; PREAMBLE];
        for name in names {
            bytes.extend(name.bytes().chain([0]).chain(*b"string\0"));
            bytes.extend((name.len() as i32).to_le_bytes());
            bytes.extend(name.to_uppercase().bytes());
        }
        bytes.extend([0, 7, 7]);
        bytes
    }

    #[test]
    fn attributes_are_sorted_whole_and_nothing_else_moves() {
        let mut bytes = file(&["zip", "a", "channels", "b"]);
        sort_attributes(&mut bytes).unwrap();
        assert_eq!(bytes, file(&["a", "b", "channels", "zip"]));
    }

    #[test]
    fn what_is_no_header_is_refused() {
        let whole = file(&["zip", "a"]);
        let header = whole.len() - 2;
        for length in 0..header {
            assert!(sort_attributes(&mut whole[..length].to_vec()).is_err(), "cut at {length}");
        }
        let mut negative = whole.clone();
        let size = PREAMBLE + "zip\0string\0".len();
        negative[size..size + 4].copy_from_slice(&(-1i32).to_le_bytes());
        assert!(sort_attributes(&mut negative).is_err());
    }
}
