//! Checks a submission before it becomes a job: description, assets, plan, sizes.

use bytes::Bytes;
use gradfarm_core::plan::{self, Plan, Request};
use gradfarm_core::scene::SceneDescription;
use gradfarm_proto::{Digest, Manifest, block, limits};

use super::rules::Rules;
use super::submission::{Frames, Submission};
use crate::error::Error;
use crate::job::{JobId, JobRecord, Needs, Timestamp};
use crate::oidn;
use crate::schedule::Split;
use crate::store::Blobs;

/// Longest name and client token [bytes].
const NAME: usize = 200;
/// Longest edge of a tile [pixels].
const TILE: u32 = 1024;
/// Longest edge of a tile where its leases carry counts of pixels [pixels].
const GUIDED_TILE: u32 = 256;
/// Most counters that a block is expected to carry.
const COUNTERS: usize = limits::LINES;

/// A submission that was found right.
pub(super) struct Checked {
    /// The record of the job to be.
    pub(super) record: JobRecord,
    /// Files that are not stored yet, by content.
    pub(super) missing: Vec<Digest>,
    description: Bytes,
    manifest: Bytes,
}

/// Checks and plans a submission, stores its description and manifest, and writes the record of the job to be.
///
/// # Errors
/// What is wrong with it.
pub(super) async fn admit(submission: Submission, blobs: &Blobs, rules: &Rules, now: Timestamp) -> Result<JobRecord, Error> {
    let Checked { record, missing, description, manifest } = check(submission, blobs, rules, now).await?;
    if !missing.is_empty() {
        return Err(Error::MissingAssets { digests: missing });
    }
    blobs.put(description).await?;
    blobs.put(manifest).await?;
    Ok(record)
}

/// Checks and plans a submission, and stores nothing.
///
/// # Errors
/// What is wrong with it.
pub(super) async fn check(submission: Submission, blobs: &Blobs, rules: &Rules, now: Timestamp) -> Result<Checked, Error> {
    check_fields(&submission)?;
    check_needs(&submission, rules)?;
    let Submission { name, description, assets, request, tile, frames, priority, client_token, needs, verify, paused: _ } = submission;
    let needs = Needs { verify: verify.unwrap_or(rules.verify), ..needs };
    // A long description takes a while to read and check: not on an async thread.
    let planned = tokio::task::spawn_blocking(move || {
        let scene = SceneDescription::from_json(&description, "scene")?;
        let mut plan = plan::resolve(&scene, &Request { frames: frames.count, ..request })?;
        let moments = plan.moments(&scene, frames.range())?;
        plan.tell_moments(&moments);
        oidn::check(plan.reconstruction).map_err(|expected| Error::Invalid { what: "reconstruction", found: "oidn".into(), expected })?;
        Ok::<_, Error>((description, scene.assets(), plan, moments))
    });
    let (description, names, plan, moments) = planned.await.map_err(|_| Error::Stopped)??;
    if plan.rounds > 1 && tile > GUIDED_TILE {
        let expected = format!("1 to {GUIDED_TILE} pixels with several rounds, for a lease carries the counts of its pixels");
        return Err(Error::Invalid { what: "tile", found: tile.to_string(), expected });
    }
    let split = Split::new(&plan, &moments, tile)?;
    check_blocks(&plan, &split)?;
    let unlisted: Vec<String> = names.iter().filter(|name| !assets.contains_key(*name)).cloned().collect();
    if !unlisted.is_empty() {
        return Err(Error::Unlisted { names: unlisted });
    }
    // Files that the description does not name are no part of the scene.
    let assets: std::collections::BTreeMap<String, Digest> =
        names.into_iter().filter_map(|name| assets.get(&name).map(|digest| (name, *digest))).collect();
    let mut missing = Vec::new();
    for digest in assets.values() {
        if !blobs.has(*digest).await? && !missing.contains(digest) {
            missing.push(*digest);
        }
    }
    let description = Bytes::from(description);
    let manifest = Manifest { description: Digest::of(&description), assets }.encode();
    let scene = Digest::of(&manifest);
    let record = JobRecord {
        id: JobId::fresh(),
        name,
        priority,
        created: now,
        client_token,
        scene,
        plan,
        tile,
        first_frame: frames.first,
        frame_count: frames.count,
        moments,
        needs,
    };
    Ok(Checked { record, missing, description, manifest })
}

fn check_fields(submission: &Submission) -> Result<(), Error> {
    let invalid = |what, found: String, expected: String| Err(Error::Invalid { what, found, expected });
    if submission.name.len() > NAME {
        return invalid("name", format!("{} bytes long", submission.name.len()), format!("at most {NAME} bytes"));
    }
    if let Some(token) = &submission.client_token
        && (token.is_empty() || token.len() > NAME)
    {
        return invalid("client token", format!("{} bytes long", token.len()), format!("1 to {NAME} bytes"));
    }
    // PostgreSQL knows no zero in a text.
    for (what, text) in [("name", Some(&submission.name)), ("client token", submission.client_token.as_ref())] {
        if text.is_some_and(|text| text.contains('\0')) {
            return invalid(what, "a text with the character U+0000".into(), "a text without it".into());
        }
    }
    if !(1..=TILE).contains(&submission.tile) {
        return invalid("tile", submission.tile.to_string(), format!("1 to {TILE} pixels"));
    }
    let frames = submission.frames;
    if frames.count == 0 || frames.count > Frames::MOST || frames.first.checked_add(frames.count).is_none() {
        let expected = format!("1 to {} frames, numbered below 2³²", Frames::MOST);
        return invalid("frames", format!("{} from {}", frames.count, frames.first), expected);
    }
    if submission.description.len() as u64 > limits::ASSET {
        return invalid("description", format!("{} bytes long", submission.description.len()), format!("at most {} bytes", limits::ASSET));
    }
    Ok(())
}

fn check_needs(submission: &Submission, rules: &Rules) -> Result<(), Error> {
    let needs = &submission.needs;
    if let Some(unknown) = needs.limits.iter().find(|name| !rules.limits.contains_key(*name)) {
        let known: Vec<&str> = rules.limits.keys().map(String::as_str).collect();
        let expected =
            if known.is_empty() { "none, for this farm has no limits".to_owned() } else { format!("one of {}", known.join(", ")) };
        return Err(Error::Invalid { what: "limit", found: unknown.clone(), expected });
    }
    if needs.most_workers == Some(0) {
        return Err(Error::Invalid { what: "max_workers", found: "0".into(), expected: "1 or more".into() });
    }
    match submission.verify {
        Some(share) if !(0.0..=1.0).contains(&share) => {
            Err(Error::Invalid { what: "verify", found: share.to_string(), expected: "a share from 0 to 1".into() })
        }
        _ => Ok(()),
    }
}

fn check_blocks(plan: &Plan, split: &Split) -> Result<(), Error> {
    let layout = plan.layout();
    let largest = split.tiles().iter().map(|tile| block::encoded_size(*tile, &layout, COUNTERS)).max().unwrap_or(0);
    if largest > limits::BLOCK {
        let expected = format!("tiles whose results take at most {} bytes", limits::BLOCK);
        return Err(Error::Invalid { what: "tile", found: format!("so large that a result takes {largest} bytes"), expected });
    }
    Ok(())
}
