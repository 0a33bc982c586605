//! Units of work, and the names of their leases.

use bytes::Bytes;
use gradfarm_core::lattice::Moment;
use gradfarm_core::plan::WorkUnit;

use super::ConvertError;
use crate::v1;

/// A lease by name: job, unit and epoch.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct LeaseName {
    /// UUID of the job.
    pub job: [u8; 16],
    /// Dense index of the unit within the job.
    pub unit: u32,
    /// Counts the grants of this unit.
    pub epoch: u32,
}

impl From<LeaseName> for v1::LeaseRef {
    fn from(name: LeaseName) -> Self {
        Self { job: Bytes::copy_from_slice(&name.job), unit: name.unit, epoch: name.epoch }
    }
}

impl TryFrom<v1::LeaseRef> for LeaseName {
    type Error = ConvertError;

    fn try_from(message: v1::LeaseRef) -> Result<Self, ConvertError> {
        let job = uuid("lease.job", &message.job)?;
        Ok(Self { job, unit: message.unit, epoch: message.epoch })
    }
}

/// The lease of a message that must carry one.
///
/// # Errors
/// If it is missing or malformed.
pub fn lease_ref(message: Option<v1::LeaseRef>) -> Result<LeaseName, ConvertError> {
    message.ok_or(ConvertError::Missing { field: "lease" })?.try_into()
}

/// The 16 bytes of a UUID.
///
/// # Errors
/// If there are more or fewer.
pub fn uuid(field: &'static str, bytes: &[u8]) -> Result<[u8; 16], ConvertError> {
    bytes.try_into().map_err(|_| ConvertError::range(field, format!("{} bytes", bytes.len()), "16 bytes of a UUID"))
}

impl From<WorkUnit> for v1::WorkUnit {
    fn from(unit: WorkUnit) -> Self {
        Self {
            first_frame: unit.moment.first,
            end_frame: unit.moment.end,
            tile: Some(unit.tile.into()),
            samples: Some(unit.samples.into()),
        }
    }
}

impl TryFrom<v1::WorkUnit> for WorkUnit {
    type Error = ConvertError;

    fn try_from(message: v1::WorkUnit) -> Result<Self, ConvertError> {
        Ok(Self {
            moment: moment(message.first_frame, message.end_frame)?,
            tile: message.tile.ok_or(ConvertError::Missing { field: "unit.tile" })?.try_into()?,
            samples: message.samples.ok_or(ConvertError::Missing { field: "unit.samples" })?.try_into()?,
        })
    }
}

/// Frames from one to the one before another; the last frame there is ends at 0.
fn moment(first: u32, end: u32) -> Result<Moment, ConvertError> {
    if end > first || (end == 0 && first == u32::MAX) {
        return Ok(Moment { first, end });
    }
    Err(ConvertError::range("unit.end_frame", end, format!("a frame after {first}")))
}

#[cfg(test)]
mod tests {
    use super::*;
    use gradfarm_core::lattice::{SampleRange, Tile};
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn round_trip(job: [u8; 16], unit: u32, epoch: u32, frame: u32, x in 0u32..999, count in 1u32..99) {
            let name = LeaseName { job, unit, epoch };
            prop_assert_eq!(lease_ref(Some(name.into())), Ok(name));
            let unit = WorkUnit { moment: Moment::of(frame), tile: Tile { x, y: 1, width: 5, height: 6 }, samples: SampleRange { first: 16, count } };
            prop_assert_eq!(WorkUnit::try_from(v1::WorkUnit::from(unit)), Ok(unit));
        }
    }

    #[test]
    fn missing_parts_are_named() {
        assert_eq!(lease_ref(None), Err(ConvertError::Missing { field: "lease" }));
        let short = v1::LeaseRef { job: Bytes::from_static(&[1; 15]), unit: 0, epoch: 0 };
        assert_eq!(lease_ref(Some(short)).unwrap_err().to_string(), "lease.job is 15 bytes, expected 16 bytes of a UUID");
        let unit = v1::WorkUnit { first_frame: 0, end_frame: 1, tile: None, samples: None };
        assert_eq!(WorkUnit::try_from(unit), Err(ConvertError::Missing { field: "unit.tile" }));
        let unit = v1::WorkUnit { first_frame: 3, end_frame: 3, tile: None, samples: None };
        assert_eq!(WorkUnit::try_from(unit).unwrap_err().to_string(), "unit.end_frame is 3, expected a frame after 3");
    }
}
