//! Content for workers: manifests, descriptions, assets.

use futures::{StreamExt, stream};
use gradfarm_proto::{Digest, limits, v1};
use tonic::Status;

use super::{Messages, status};
use crate::error::Error;
use crate::service::Handle;
use crate::store::BlobError;

/// Sends content by digest, in chunks.
pub(super) async fn fetch(handle: &Handle, request: &v1::FetchAssetRequest) -> Result<Messages<v1::AssetChunk>, Status> {
    let digest = Digest::try_from(request.digest.as_ref()).map_err(|error| Status::invalid_argument(error.to_string()))?;
    let bytes = match handle.get_blob(digest).await {
        Ok(bytes) => bytes,
        Err(Error::Blob(BlobError::Missing(_))) => return Err(Status::not_found(format!("there is no asset {digest}"))),
        Err(error) => return Err(status(error)),
    };
    let chunks = stream::unfold(bytes, |mut rest| async move {
        (!rest.is_empty()).then(|| {
            let chunk = rest.split_to(rest.len().min(limits::CHUNK));
            (Ok(v1::AssetChunk { data: chunk }), rest)
        })
    });
    Ok(chunks.boxed())
}
