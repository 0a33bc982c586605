//! Pictures of frames while they are made: for the eye as PNG, for measuring as portable float maps.

use axum::extract::rejection::QueryRejection;
use axum::extract::{Query, State};
use axum::http::{HeaderMap, StatusCode, header};
use axum::response::{IntoResponse, Response};
use gradfarm_core::film::Image;
use gradfarm_core::output::png;
use serde::Deserialize;

use super::frames::{Address, parse};
use super::problem::Problem;
use crate::preview::{PIXELS, View, reduce};
use crate::service::Handle;

/// What to show, and how.
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(super) struct Options {
    /// `primal`, `dx`, `dy`, `reconstructed` or `error`.
    view: Option<String>,
    /// Brighter by so many stops; PNG only.
    exposure: Option<f32>,
    /// Most pixels.
    most: Option<usize>,
}

/// How a picture is written down.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Format {
    Png,
    Pfm,
}

/// `GET /jobs/{job}/frames/{frame}/preview.png`: sRGB; differences around middle grey.
pub(super) async fn png(service: State<Handle>, address: Address, options: Asked, headers: HeaderMap) -> Result<Response, Problem> {
    answer(service, address, options, &headers, Format::Png).await
}

/// `GET /jobs/{job}/frames/{frame}/preview.pfm`: linear values, RGB in 32-bit floats, rows bottom to top.
pub(super) async fn pfm(service: State<Handle>, address: Address, options: Asked, headers: HeaderMap) -> Result<Response, Problem> {
    answer(service, address, options, &headers, Format::Pfm).await
}

type Asked = Result<Query<Options>, QueryRejection>;

async fn answer(
    State(service): State<Handle>,
    address: Address,
    options: Asked,
    headers: &HeaderMap,
    format: Format,
) -> Result<Response, Problem> {
    let Query(options) = options?;
    let (job, frame) = parse(address)?;
    let name = options.view.as_deref().unwrap_or(View::Primal.name());
    let view = View::by_name(name)
        .ok_or_else(|| Problem::field("view", format!("view is {name:?}, expected one of {}", View::ALL.map(View::name).join(", "))))?;
    let exposure = options.exposure.unwrap_or(0.0);
    if exposure.is_nan() || exposure.abs() > 64.0 {
        return Err(Problem::field("exposure", format!("exposure is {exposure}, expected −64 to 64 stops")));
    }
    let most = options.most.unwrap_or(PIXELS);
    if !(1..=PIXELS).contains(&most) {
        return Err(Problem::field("most", format!("most is {most}, expected 1 to {PIXELS} pixels")));
    }
    let tag = |stamp: &str| format!("\"{stamp}-{name}-{exposure}-{most}-{format:?}\"");
    let known = headers.get(header::IF_NONE_MATCH).and_then(|value| value.to_str().ok()).unwrap_or_default();
    let seen = tag(&service.preview_stamp(job, frame).await?);
    if known.split(',').any(|one| one.trim().trim_start_matches("W/") == seen) {
        return Ok((StatusCode::NOT_MODIFIED, [(header::ETAG, seen), (header::CACHE_CONTROL, "no-cache".to_owned())]).into_response());
    }
    let (stamp, picture) = service.preview(job, frame, view).await?;
    let encoded = tokio::task::spawn_blocking(move || {
        let picture = reduce(&picture, most);
        match format {
            Format::Png => png::encode(&for_the_eye(picture, view, exposure), 1.0),
            Format::Pfm => Ok(float_map(&picture)),
        }
    });
    let bytes = encoded.await.map_err(|fault| Problem::internal(&fault))?.map_err(|fault| Problem::internal(&fault))?;
    let media_type = match format {
        Format::Png => "image/png",
        Format::Pfm => "image/x-portable-floatmap",
    };
    let headers = [
        (header::CONTENT_TYPE, media_type.to_owned()),
        (header::ETAG, tag(&stamp)),
        (header::CACHE_CONTROL, "private, no-cache".to_owned()),
    ];
    Ok((headers, bytes).into_response())
}

/// Exposed; differences have signs, and middle grey is their zero.
fn for_the_eye(mut image: Image, view: View, exposure: f32) -> Image {
    let gain = 2.0_f32.powf(exposure);
    let zero = if matches!(view, View::Dx | View::Dy) { 0.5 } else { 0.0 };
    image.data_mut().iter_mut().for_each(|value| *value = *value * gain + zero);
    image
}

/// A portable float map: a header of three lines, then the rows from the bottom; a negative scale says that the least byte comes first.
fn float_map(image: &Image) -> Vec<u8> {
    let extent = image.extent();
    let mut bytes = format!("PF\n{} {}\n-1.0\n", extent.width, extent.height).into_bytes();
    bytes.reserve(12 * extent.pixels());
    for y in (0..extent.height).rev() {
        for x in 0..extent.width {
            for channel in 0..3 {
                let value = image.at(x, y, if image.channels() == 3 { channel } else { 0 });
                bytes.extend(value.to_le_bytes());
            }
        }
    }
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;
    use gradfarm_core::lattice::Extent;

    #[test]
    fn float_maps_begin_at_the_bottom() {
        let mut image = Image::new(Extent { width: 1, height: 2 }, 1);
        image.data_mut().copy_from_slice(&[1.0, 2.0]);
        let bytes = float_map(&image);
        let header = b"PF\n1 2\n-1.0\n";
        assert!(bytes.starts_with(header));
        assert_eq!(bytes[header.len()..header.len() + 4], 2.0_f32.to_le_bytes());
        assert_eq!(bytes.len(), header.len() + 24);
    }
}
