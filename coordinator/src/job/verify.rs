//! Units that are rendered twice, by different workers: which they are, and what follows from what the workers say.
//!
//! A result for such a unit is not counted at once. It becomes a witness, and the unit goes to another worker. It is done when two different
//! workers gave the same content; whoever said otherwise is named. So a result that counts never has to be taken back for having been the
//! one that differed.

use gradfarm_proto::Digest;

use super::action::{Action, Answer};
use super::evidence::{Attempt, Ending};
use super::identity::WorkerId;
use super::record::{Change, DeliveredRecord};
use super::{Job, JobId};
use crate::clock::Timestamp;

/// Results for one unit that are compared at most before it is given up.
const MOST_WITNESSES: usize = 3;

/// What a worker gave for a unit that others render, too.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Witness {
    /// Under which epoch.
    pub epoch: u32,
    /// Who.
    pub worker: WorkerId,
    /// Digest of the result's encoding.
    pub content: Digest,
}

/// What follows from one more result for a unit that is compared.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Finding {
    /// It counts. These workers gave something else before.
    Counts(Vec<WorkerId>),
    /// Another worker has to say more.
    Open,
    /// Nobody agrees with anybody.
    Hopeless,
}

/// Compares a result with those before.
///
/// Only agreement of different workers can show that somebody else was wrong. Where one worker is all there is, it is compared with itself.
pub(super) fn compare(before: &[Witness], worker: WorkerId, content: Digest) -> Finding {
    let differing = || {
        let mut liars: Vec<WorkerId> = before.iter().filter(|w| w.content != content).map(|w| w.worker).collect();
        liars.sort_unstable();
        liars.dedup();
        liars
    };
    let agrees = |other: &&Witness| other.content == content;
    if before.iter().filter(agrees).any(|other| other.worker != worker) {
        return Finding::Counts(differing());
    }
    let alone = before.iter().all(|other| other.worker == worker);
    if alone && before.iter().any(|other| agrees(&other)) {
        return Finding::Counts(if before.iter().all(|other| agrees(&other)) { Vec::new() } else { vec![worker] });
    }
    if before.len() + 1 >= MOST_WITNESSES { Finding::Hopeless } else { Finding::Open }
}

/// Whether a unit of a job belongs to the share that is rendered twice. The same for ever: it depends on their names alone.
pub(super) fn is_chosen(job: JobId, unit: u32, share: f64) -> bool {
    if share <= 0.0 {
        return false;
    }
    let mut hasher = blake3::Hasher::new();
    hasher.update(&job.to_bytes()).update(&unit.to_le_bytes());
    let bytes = hasher.finalize();
    let number = bytes.as_bytes()[..8].iter().fold(0u64, |number, byte| number << 8 | u64::from(*byte));
    (number >> 11) as f64 / (1u64 << 53) as f64 <= share
}

impl Job {
    /// Whether a unit is rendered by two workers.
    pub fn is_verified(&self, unit: u32) -> bool {
        is_chosen(self.record.id, unit, self.record.needs.verify)
    }

    /// What workers gave for a unit so far, where that is compared.
    pub fn witnesses(&self, unit: u32) -> &[Witness] {
        self.witnesses.get(&unit).map_or(&[], Vec::as_slice)
    }

    /// Takes one more result for a unit that is compared: what is to be done, and whether it counts.
    pub(super) fn hear_witness(
        &mut self,
        unit: u32,
        epoch: u32,
        worker: WorkerId,
        result: &DeliveredRecord,
        now: Timestamp,
    ) -> (Vec<Action>, bool) {
        let content = result.content;
        let finding = compare(self.witnesses(unit), worker, content);
        let differed = |w: &Witness| {
            let reason = format!("its result was {}, others had another one", w.content);
            Attempt { worker: w.worker, epoch: w.epoch, at: now, ending: Ending::Differed, reason }
        };
        match finding {
            Finding::Counts(liars) => {
                let odd: Vec<Witness> = self.witnesses(unit).iter().filter(|w| w.content != content).copied().collect();
                let mut actions: Vec<Action> = odd.iter().map(|w| self.attempted(unit, differed(w))).collect();
                actions.extend(liars.into_iter().map(|liar| Action::Distrust { worker: liar, unit }));
                self.witnesses.remove(&unit);
                (actions, true)
            }
            Finding::Open | Finding::Hopeless => {
                let witness = Witness { epoch, worker, content };
                self.witnesses.entry(unit).or_default().push(witness);
                self.units.release(unit);
                let mut actions =
                    vec![Action::Keep(Change::Witness { job: self.record.id, unit, witness }), Action::Answer(Answer::Accepted)];
                if finding == Finding::Hopeless {
                    let all = self.witnesses(unit).to_vec();
                    actions.extend(all.iter().map(|w| self.attempted(unit, differed(w))));
                    actions.extend(self.give_up(unit, "workers gave different results for it", now));
                }
                (actions, false)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_share_is_chosen_by_name_alone() {
        let job = JobId::fresh();
        let chosen = (0..10_000).filter(|unit| is_chosen(job, *unit, 0.1)).count();
        assert!((900..1100).contains(&chosen), "{chosen} of 10,000");
        assert!((0..100).all(|unit| is_chosen(job, unit, 1.0) && !is_chosen(job, unit, 0.0)));
        assert!((0..100).all(|unit| is_chosen(job, unit, 0.5) == is_chosen(job, unit, 0.5)));
        assert!(
            (0..1000).filter(|unit| is_chosen(job, *unit, 0.1)).all(|unit| is_chosen(job, unit, 0.2)),
            "a larger share holds the smaller"
        );
    }

    #[test]
    fn two_different_workers_decide_and_the_odd_one_is_named() {
        let [a, b, c] = [(); 3].map(|()| WorkerId::fresh());
        let [right, wrong] = [Digest::of(b"right"), Digest::of(b"wrong")];
        let witness = |worker, content| Witness { epoch: 1, worker, content };
        assert_eq!(compare(&[], a, right), Finding::Open);
        assert_eq!(compare(&[witness(a, right)], b, right), Finding::Counts(vec![]));
        assert_eq!(compare(&[witness(a, wrong)], b, right), Finding::Open);
        assert_eq!(compare(&[witness(a, wrong), witness(b, right)], c, right), Finding::Counts(vec![a]));
        assert_eq!(compare(&[witness(a, wrong), witness(b, right)], a, right), Finding::Counts(vec![a]), "bad memory");
        assert_eq!(compare(&[witness(a, wrong), witness(b, right)], a, wrong), Finding::Hopeless, "nobody wins by insisting");
        assert_eq!(compare(&[witness(a, right)], a, right), Finding::Counts(vec![]), "alone it is compared with itself");
        assert_eq!(compare(&[witness(a, right)], a, wrong), Finding::Open);
        assert_eq!(compare(&[witness(a, wrong), witness(a, right)], a, right), Finding::Counts(vec![a]));
    }
}
