//! What a scene consists of, by content: the description and the files it refers to.

use std::collections::BTreeMap;

use bytes::Bytes;
use prost::Message;

use crate::digest::{Digest, ParseDigestError};
use crate::{limits, v1};

/// A scene by content. The digest of its encoding names the scene: equal manifests compile to equal scenes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Manifest {
    /// Digest of the description's JSON text.
    pub description: Digest,
    /// Digest of each file, by the relative name that the description uses.
    pub assets: BTreeMap<String, Digest>,
}

/// Bytes that are no manifest.
#[derive(Debug, thiserror::Error)]
pub enum ManifestError {
    /// Not the message at all.
    #[error("not a scene manifest: {0}")]
    Decode(#[from] prost::DecodeError),
    /// A field that should be a digest is none.
    #[error("scene manifest: {0}")]
    Digest(#[from] ParseDigestError),
    /// Names unsorted, repeated or too long, or too many of them.
    #[error("scene manifest: asset {index} ({name:?}) is out of order, repeated, or longer than {} bytes", limits::ASSET_NAME)]
    Name {
        /// Position.
        index: usize,
        /// Its beginning.
        name: String,
    },
    /// Too many assets.
    #[error("scene manifest lists {found} assets, at most {} are allowed", limits::ASSETS)]
    TooMany {
        /// How many.
        found: usize,
    },
}

impl Manifest {
    /// The one encoding of this manifest.
    pub fn encode(&self) -> Bytes {
        let assets = self.assets.iter().map(|(name, digest)| v1::AssetEntry { name: name.clone(), digest: digest.to_bytes() });
        v1::SceneManifest { description: self.description.to_bytes(), assets: assets.collect() }.encode_to_vec().into()
    }

    /// Digest of the encoding.
    pub fn digest(&self) -> Digest {
        Digest::of(&self.encode())
    }

    /// Reads an encoding.
    ///
    /// # Errors
    /// If the bytes are not what [`encode`](Self::encode) writes.
    pub fn decode(bytes: Bytes) -> Result<Self, ManifestError> {
        let message = v1::SceneManifest::decode(bytes)?;
        if message.assets.len() > limits::ASSETS {
            return Err(ManifestError::TooMany { found: message.assets.len() });
        }
        let mut assets = BTreeMap::new();
        for (index, asset) in message.assets.into_iter().enumerate() {
            let in_order = assets.last_key_value().is_none_or(|(last, _)| *last < asset.name);
            if !in_order || asset.name.len() > limits::ASSET_NAME {
                return Err(ManifestError::Name { index, name: asset.name.chars().take(80).collect() });
            }
            assets.insert(asset.name, Digest::try_from(asset.digest.as_ref())?);
        }
        Ok(Self { description: Digest::try_from(message.description.as_ref())?, assets })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn round_trip_and_order() {
        let digest = |s: &str| Digest::of(s.as_bytes());
        let manifest = Manifest {
            description: digest("scene"),
            assets: [("meshes/b.ply", "b"), ("meshes/a.ply", "a")].map(|(name, content)| (name.to_owned(), digest(content))).into(),
        };
        let encoded = manifest.encode();
        assert_eq!(Manifest::decode(encoded.clone()).unwrap(), manifest);
        let mut message = v1::SceneManifest::decode(encoded).unwrap();
        message.assets.swap(0, 1);
        assert!(matches!(Manifest::decode(message.encode_to_vec().into()), Err(ManifestError::Name { index: 1, .. })));
        assert!(Manifest::decode(Bytes::from_static(&[0xff, 0xff])).is_err());
    }
}
