//! Random secrets: drawn once, shown once, kept as a hash.

use std::fmt;

use base64::Engine;
use base64::engine::general_purpose::URL_SAFE_NO_PAD;
use sha2::{Digest, Sha256};

/// Random bytes of a secret: 256 bits.
const BYTES: usize = 32;
/// Longest text that is looked at as a secret [bytes]: tokens of identity providers are longer than ours.
pub(crate) const LONGEST: usize = 16 << 10;

/// Something that whoever holds it is let in with. It never shows itself in logs.
#[derive(Clone, PartialEq, Eq)]
pub struct Secret(String);

/// Why there is no secret.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SecretError {
    /// The system gave no random numbers.
    #[error("the system gave no random numbers")]
    NoRandomness,
    /// Something else than one line of printable characters.
    #[error("found {0}, expected one line of at most {LONGEST} printable ASCII characters")]
    Malformed(&'static str),
}

impl Secret {
    /// A new one of 256 random bits. `prefix` tells people, and programs that look for leaked secrets, what it is.
    ///
    /// # Errors
    /// If the system gives no random numbers.
    pub fn draw(prefix: &str) -> Result<Self, SecretError> {
        let mut bytes = [0; BYTES];
        let provider = rustls::crypto::ring::default_provider();
        provider.secure_random.fill(&mut bytes).map_err(|_| SecretError::NoRandomness)?;
        Ok(Self(format!("{prefix}{}", URL_SAFE_NO_PAD.encode(bytes))))
    }

    /// Reads one that somebody was given, with or without a line's end.
    ///
    /// # Errors
    /// If it can be none.
    pub fn parse(text: &str) -> Result<Self, SecretError> {
        let text = text.trim();
        if text.is_empty() {
            return Err(SecretError::Malformed("nothing"));
        }
        if text.len() > LONGEST {
            return Err(SecretError::Malformed("more"));
        }
        if !text.bytes().all(|byte| byte.is_ascii_graphic()) {
            return Err(SecretError::Malformed("other characters"));
        }
        Ok(Self(text.to_owned()))
    }

    /// The secret itself: for the one who is to have it, and for nobody else.
    pub fn expose(&self) -> &str {
        &self.0
    }

    /// What is kept of it: SHA-256 in hexadecimal digits. With 256 random bits nothing slower is needed.
    pub fn hash(&self) -> String {
        hash(&self.0)
    }
}

/// SHA-256 of a text in hexadecimal digits.
pub(crate) fn hash(text: &str) -> String {
    Sha256::digest(text.as_bytes()).iter().map(|byte| format!("{byte:02x}")).collect()
}

impl fmt::Debug for Secret {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Secret(…)")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn secrets_differ_and_hide() {
        let (one, other) = (Secret::draw("gft_").unwrap(), Secret::draw("gft_").unwrap());
        assert_ne!(one, other);
        assert_eq!(one.expose().len(), 4 + 43);
        assert_eq!(format!("{one:?}"), "Secret(…)");
        assert_eq!(Secret::parse(&format!("  {}\n", one.expose())).unwrap(), one);
        assert_eq!(one.hash().len(), 64);
        assert_ne!(one.hash(), other.hash());
    }

    #[test]
    fn the_hash_is_sha_256() {
        assert_eq!(hash("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
    }

    #[test]
    fn what_is_no_secret_is_refused() {
        for bad in ["", " \n", "two words", "a\nb", "ä", &"x".repeat(LONGEST + 1)] {
            assert!(Secret::parse(bad).is_err(), "{bad:?}");
        }
    }
}
