//! Two kinds of workers, told apart by their identifiers: those that are enrolled, and those that are passing.

/// What sort of worker an identifier names.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WorkerKind {
    /// A process that drew its own name: good for as long as it runs.
    Passing,
    /// A worker with a certificate, whose name was given to it and stays.
    Enrolled,
}

impl WorkerKind {
    /// By the version of the UUID: 8 is for those that are enrolled.
    pub fn of(worker: [u8; 16]) -> Self {
        if worker[6] >> 4 == 8 { Self::Enrolled } else { Self::Passing }
    }

    /// The identifier of an enrolled worker with these bits.
    pub fn enrolled(mut bits: [u8; 16]) -> [u8; 16] {
        bits[6] = bits[6] & 0x0f | 0x80;
        bits[8] = bits[8] & 0x3f | 0x80;
        bits
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_that_are_given_are_told_from_names_that_are_drawn() {
        assert_eq!(WorkerKind::of(WorkerKind::enrolled([0xff; 16])), WorkerKind::Enrolled);
        assert_eq!(WorkerKind::of(WorkerKind::enrolled([0; 16])), WorkerKind::Enrolled);
        // A UUID of version 7, as processes draw them.
        let drawn = [1, 0x92, 0x0d, 0x4e, 0x7f, 0x3b, 0x7c, 0xc1, 0x9f, 0x52, 0x0a, 0x3e, 0x5f, 0x3c, 0x2b, 0x11];
        assert_eq!(WorkerKind::of(drawn), WorkerKind::Passing);
    }
}
