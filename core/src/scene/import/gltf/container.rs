//! The bytes of a glTF file: the binary container (GLB), `data:` addresses, and files beside the scene.

use std::collections::BTreeMap;
use std::rc::Rc;

use super::document::Buffer;
use crate::scene::assets::Assets;
use crate::scene::error::{Error, ErrorKind};

/// What a GLB file starts with.
pub(in crate::scene) const MAGIC: &[u8] = b"glTF";

/// Splits a file into its JSON and, for GLB, its binary chunk. A file that does not start with [`MAGIC`] is all JSON.
///
/// # Errors
/// A container of another version, or chunks that reach past its end.
pub(super) fn split<'a>(bytes: &'a [u8], file: &str) -> Result<(&'a [u8], Option<&'a [u8]>), Error> {
    if !bytes.starts_with(MAGIC) {
        return Ok((bytes, None));
    }
    let malformed = |found: String, expected: &str| Error::new(ErrorKind::Malformed, file, "GLB header", found, expected);
    let word = |at: usize| bytes.get(at..at + 4).and_then(|word| word.try_into().ok()).map(u32::from_le_bytes);
    match word(4) {
        Some(2) => {}
        Some(version) => return Err(malformed(format!("version {version}"), "2")),
        None => return Err(malformed(format!("{} bytes", bytes.len()), "a header of 12 bytes")),
    }
    let length = word(8).unwrap_or(0) as usize;
    if length > bytes.len() {
        return Err(malformed(format!("a length of {length} in a file of {} bytes", bytes.len()), "a whole file"));
    }
    let (mut json, mut binary) = (None, None);
    let mut at = 12;
    while at + 8 <= length {
        let (size, kind) = (word(at).unwrap_or(0) as usize, word(at + 4).unwrap_or(0));
        let end = (at + 8).saturating_add(size);
        let Some(chunk) = bytes[..length].get(at + 8..end) else {
            return Err(malformed(format!("a chunk of {size} bytes at byte {at}"), "chunks that end before the file does"));
        };
        match &kind.to_le_bytes() {
            b"JSON" if json.is_none() => json = Some(chunk),
            b"BIN\0" if binary.is_none() => binary = Some(chunk),
            // Chunks of other kinds are for extensions, and to be skipped.
            _ => {}
        }
        at = end.next_multiple_of(4);
    }
    match json {
        Some(json) => Ok((json, binary)),
        None => Err(malformed("no JSON chunk".to_string(), "one")),
    }
}

/// The bytes of every buffer. Buffers of the same file share them.
pub(super) struct Buffers(Vec<Rc<[u8]>>);

impl Buffers {
    /// Reads all buffers.
    ///
    /// # Errors
    /// A buffer that cannot be found, lies outside the folder, or is shorter than it says.
    pub(super) fn read(buffers: &[Buffer], binary: Option<&[u8]>, file: &str, assets: &dyn Assets) -> Result<Buffers, Error> {
        let mut files: BTreeMap<&str, Rc<[u8]>> = BTreeMap::new();
        let mut read = Vec::new();
        for (index, buffer) in buffers.iter().enumerate() {
            let path = format!("buffers[{index}]");
            let fault = |found: String, expected: &str| Error::new(ErrorKind::Malformed, file, &path, found, expected);
            let bytes: Rc<[u8]> = match &buffer.uri {
                Some(uri) => match files.get(uri.as_str()) {
                    Some(bytes) => bytes.clone(),
                    None => {
                        let bytes: Rc<[u8]> = match data(uri).map_err(|found| fault(found, "data:…;base64,…"))? {
                            Some(bytes) => bytes.into(),
                            None => assets.open(&file_name(uri))?.into(),
                        };
                        files.insert(uri, bytes.clone());
                        bytes
                    }
                },
                None if index == 0 => binary.ok_or_else(|| fault("no uri".to_string(), "a uri, or a GLB file with a binary chunk"))?.into(),
                None => return Err(fault("no uri".to_string(), "a uri")),
            };
            if bytes.len() < buffer.byte_length {
                let found = format!("{} bytes", bytes.len());
                return Err(fault(found, &format!("byteLength of them: {}", buffer.byte_length)));
            }
            read.push(bytes);
        }
        Ok(Buffers(read))
    }

    /// The bytes of one buffer.
    pub(super) fn get(&self, index: usize) -> Option<&[u8]> {
        self.0.get(index).map(|bytes| &**bytes)
    }
}

/// The bytes of a `data:` address; `None` for any other.
///
/// # Errors
/// What stands there instead of base64.
pub(super) fn data(uri: &str) -> Result<Option<Vec<u8>>, String> {
    let Some(rest) = uri.strip_prefix("data:") else { return Ok(None) };
    let Some((kind, text)) = rest.split_once(',') else { return Err("a data address without a comma".to_string()) };
    if !kind.ends_with(";base64") {
        return Err(format!("a data address of kind {:?}", kind.chars().take(64).collect::<String>()));
    }
    base64(text.as_bytes()).map(Some)
}

fn base64(text: &[u8]) -> Result<Vec<u8>, String> {
    let text = text.strip_suffix(b"==").or_else(|| text.strip_suffix(b"=")).unwrap_or(text);
    let mut bytes = Vec::with_capacity(text.len() / 4 * 3 + 2);
    let (mut bits, mut held) = (0u32, 0);
    for (at, letter) in text.iter().enumerate() {
        let value = match letter {
            b'A'..=b'Z' => letter - b'A',
            b'a'..=b'z' => letter - b'a' + 26,
            b'0'..=b'9' => letter - b'0' + 52,
            b'+' | b'-' => 62,
            b'/' | b'_' => 63,
            _ => return Err(format!("{:?} as letter {at} of base64", char::from(*letter))),
        };
        bits = bits << 6 | u32::from(value);
        held += 6;
        if held >= 8 {
            held -= 8;
            bytes.push((bits >> held) as u8);
        }
    }
    Ok(bytes)
}

/// The file name that an address means: `%20` and its like decoded.
pub(super) fn file_name(uri: &str) -> String {
    let bytes = uri.as_bytes();
    let mut name = Vec::with_capacity(bytes.len());
    let mut at = 0;
    while at < bytes.len() {
        let code = bytes.get(at + 1..at + 3).and_then(|code| std::str::from_utf8(code).ok());
        match code.and_then(|code| u8::from_str_radix(code, 16).ok()).filter(|_| bytes[at] == b'%') {
            Some(byte) => {
                name.push(byte);
                at += 3;
            }
            None => {
                name.push(bytes[at]);
                at += 1;
            }
        }
    }
    String::from_utf8_lossy(&name).into_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_is_read_and_its_faults_are_named() {
        assert_eq!(data("data:application/octet-stream;base64,AAECAw==").unwrap().unwrap(), [0, 1, 2, 3]);
        assert_eq!(data("data:;base64,/+8=").unwrap().unwrap(), [0xff, 0xef]);
        assert_eq!(data("box.bin").unwrap(), None);
        assert!(data("data:;base64,A*").unwrap_err().contains("'*'"));
        assert!(data("data:text/plain,abc").unwrap_err().contains("text/plain"));
    }

    #[test]
    fn names_are_decoded() {
        assert_eq!(file_name("a%20b%2Fc.png"), "a b/c.png");
        assert_eq!(file_name("100%"), "100%");
        assert_eq!(file_name("%zz%4"), "%zz%4");
    }

    #[test]
    fn a_container_is_split_and_lies_about_sizes_are_found() {
        let glb = |version: u32, chunks: &[(&[u8; 4], &[u8])]| {
            let mut bytes = b"glTF".to_vec();
            bytes.extend(version.to_le_bytes());
            bytes.extend([0; 4]);
            for (kind, chunk) in chunks {
                bytes.extend((chunk.len() as u32).to_le_bytes());
                bytes.extend(**kind);
                bytes.extend(*chunk);
            }
            let length = bytes.len() as u32;
            bytes[8..12].copy_from_slice(&length.to_le_bytes());
            bytes
        };
        let whole = glb(2, &[(b"JSON", b"{}  "), (b"BIN\0", &[1, 2, 3, 4])]);
        assert_eq!(split(&whole, "t.glb").unwrap(), (&b"{}  "[..], Some(&[1, 2, 3, 4][..])));
        assert_eq!(split(b"{}", "t.gltf").unwrap(), (&b"{}"[..], None));
        assert!(split(&glb(1, &[]), "t.glb").unwrap_err().to_string().contains("version 1"));
        assert!(split(&glb(2, &[]), "t.glb").unwrap_err().to_string().contains("no JSON chunk"));
        for at in 8..whole.len() {
            let mut bytes = whole.clone();
            bytes[at] = 0xff;
            let _ = split(&bytes, "t.glb");
            let _ = split(&whole[..at], "t.glb");
        }
        let mut long = whole.clone();
        long[12..16].copy_from_slice(&0x4000_0000u32.to_le_bytes());
        assert!(split(&long, "t.glb").unwrap_err().to_string().contains("1073741824 bytes"));
    }
}
