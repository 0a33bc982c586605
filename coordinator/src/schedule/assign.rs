//! Which job a free worker serves next.

use std::cmp::Ordering;

/// What the choice needs to know of a job that has units waiting for a worker.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Queue {
    /// Higher goes first.
    pub priority: i32,
    /// Virtual time of its project; less goes first.
    pub share: f64,
    /// Whether anybody works on it at this moment.
    pub served: bool,
}

impl Queue {
    /// Who goes first: higher priority, then the project that has had less. Jobs that are equal in both are served by age.
    pub fn order(&self, other: &Self) -> Ordering {
        other.priority.cmp(&self.priority).then(self.share.total_cmp(&other.share))
    }
}

/// The position of the job to serve, and what it offers, from jobs in the order of [`Queue::order`] and then of their submission. `offer` says
/// what a job has for the worker, if anything: the limits of job and project are its matter. `warm` says whether the worker has a job's scene.
///
/// Among those that come first together the oldest with an offer wins if nobody serves it; else the oldest whose scene the worker has; else the
/// oldest. Something is offered to the worker if any job has something for it.
pub fn choose<T>(queues: &[Queue], warm: impl Fn(usize) -> bool, mut offer: impl FnMut(usize) -> Option<T>) -> Option<(usize, T)> {
    let mut head: Option<(usize, T)> = None;
    for (position, queue) in queues.iter().enumerate() {
        if let Some((first, _)) = &head {
            if queues[*first].order(queue) != Ordering::Equal {
                break;
            }
            if !warm(position) {
                continue;
            }
        }
        let Some(found) = offer(position) else { continue };
        if head.is_some() || !queue.served || warm(position) {
            return Some((position, found));
        }
        head = Some((position, found));
    }
    head
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn first(jobs: &[(i32, f64, bool, bool)]) -> Option<usize> {
        let queues: Vec<Queue> =
            jobs.iter().map(|(priority, share, served, _)| Queue { priority: *priority, share: *share, served: *served }).collect();
        choose(&queues, |k| jobs[k].3, |_| Some(())).map(|(position, ())| position)
    }

    #[test]
    fn priority_then_share_then_age_then_warmth() {
        assert_eq!(first(&[]), None);
        assert_eq!(first(&[(1, 9.0, false, false), (0, 0.0, true, true)]), Some(0));
        assert_eq!(first(&[(0, 1.0, true, false), (0, 2.0, false, true)]), Some(0), "a share is worth more than a scene");
        assert_eq!(first(&[(0, 0.0, false, false), (0, 0.0, true, true)]), Some(0), "an unserved head never starves");
        assert_eq!(first(&[(0, 0.0, true, false), (0, 0.0, true, false), (0, 0.0, false, true)]), Some(2));
        assert_eq!(first(&[(0, 0.0, true, false), (0, 0.0, false, false)]), Some(0));
    }

    proptest! {
        #[test]
        fn no_job_of_higher_priority_is_passed_over_and_nobody_idles(
            raw in prop::collection::vec((-3i32..3, 0u8..3, any::<bool>(), any::<bool>(), any::<bool>()), 1..20),
        ) {
            let mut jobs: Vec<(Queue, bool, bool)> =
                raw.into_iter().map(|(priority, share, served, warm, has)| (Queue { priority, share: f64::from(share), served }, warm, has)).collect();
            jobs.sort_by(|a, b| a.0.order(&b.0));
            let queues: Vec<Queue> = jobs.iter().map(|job| job.0).collect();
            let chosen = choose(&queues, |k| jobs[k].1, |k| jobs[k].2.then_some(k));
            prop_assert_eq!(chosen.is_some(), jobs.iter().any(|job| job.2), "who can work does");
            let Some((position, offered)) = chosen else { return Ok(()) };
            prop_assert_eq!(position, offered);
            let with_offer = jobs.iter().filter(|job| job.2);
            for (queue, ..) in with_offer.clone() {
                prop_assert!(queue.order(&queues[position]) != Ordering::Less, "priority, then share");
            }
            let head = with_offer.clone().find(|job| job.0.order(&queues[position]) == Ordering::Equal).unwrap();
            prop_assert!(head.0.served || head.0 == queues[position], "an unserved oldest job is never passed over");
        }
    }
}
