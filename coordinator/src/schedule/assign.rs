//! Which job a free worker serves next.

/// What the choice needs to know of a job that has units ready for the worker in question.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Queue {
    /// Higher goes first.
    pub priority: i32,
    /// Whether anybody works on it at this moment.
    pub served: bool,
    /// Whether the worker has its scene.
    pub warm: bool,
}

/// The position of the job to serve, from jobs in the order of their submission that all have a unit for this worker; `None` if
/// there are none.
///
/// The highest priority wins. Within it the oldest job wins if nobody serves it; else the oldest whose scene the worker has; else
/// the oldest.
pub fn choose(queues: &[Queue]) -> Option<usize> {
    let highest = queues.iter().map(|queue| queue.priority).max()?;
    let mut candidates = queues.iter().enumerate().filter(|(_, queue)| queue.priority == highest);
    let (oldest, head) = candidates.next()?;
    if !head.served || head.warm {
        return Some(oldest);
    }
    Some(candidates.find(|(_, queue)| queue.warm).map_or(oldest, |(position, _)| position))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn queue(priority: i32, served: bool, warm: bool) -> Queue {
        Queue { priority, served, warm }
    }

    #[test]
    fn priority_then_age_then_warmth() {
        assert_eq!(choose(&[]), None);
        assert_eq!(choose(&[queue(0, true, true), queue(1, false, false)]), Some(1));
        assert_eq!(choose(&[queue(0, false, false), queue(0, true, true)]), Some(0), "an unserved head never starves");
        assert_eq!(choose(&[queue(0, true, false), queue(0, true, false), queue(0, false, true)]), Some(2));
        assert_eq!(choose(&[queue(0, true, false), queue(0, false, false)]), Some(0));
    }

    proptest! {
        #[test]
        fn no_job_of_higher_priority_is_passed_over(raw in prop::collection::vec((-3i32..3, any::<bool>(), any::<bool>()), 1..20)) {
            let queues: Vec<Queue> = raw.into_iter().map(|(p, s, w)| queue(p, s, w)).collect();
            let chosen = queues[choose(&queues).unwrap()];
            prop_assert!(queues.iter().all(|q| q.priority <= chosen.priority));
            let head = queues.iter().find(|q| q.priority == chosen.priority).unwrap();
            prop_assert!(head.served || head == &chosen);
        }
    }
}
