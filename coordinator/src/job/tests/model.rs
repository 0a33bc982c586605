//! Every history of a small job: two or three units, two workers, leases that are lost, run out, come back or fail, results that come twice and
//! late, restarts from what was committed, cancelling. Not some of them at random, but all in which at most one attempt comes to nothing.

use std::hash::{Hash, Hasher};

use futures::FutureExt;
use stateright::{Checker, Model, Property};

use super::*;

/// A job of so many units of one frame, of which each is granted so often at most.
#[derive(Clone, Debug)]
struct Small {
    record: JobRecord,
    workers: [WorkerId; 2],
    grants: u32,
}

/// All there is at a moment: memory, store, and what workers may still send.
#[derive(Debug)]
struct World {
    job: Job,
    store: Memory,
    granted: Vec<(u32, u32, WorkerId)>,
    counted: BTreeMap<u32, (u32, Digest)>,
    /// A result came when its unit was somebody else's, or the job over.
    superseded: bool,
    broken: Option<String>,
}

impl Clone for World {
    fn clone(&self) -> Self {
        Self {
            job: self.job.clone(),
            store: self.store.fork(),
            granted: self.granted.clone(),
            counted: self.counted.clone(),
            superseded: self.superseded,
            broken: self.broken.clone(),
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Happening {
    Lease(usize),
    Deliver(usize),
    Renew(usize),
    Return(usize),
    Fail(usize),
    Lose(usize),
    Expire,
    Assemble(bool),
    Retry,
    Cancel,
    Restart,
}

impl World {
    /// Whatever a later step can depend on, and what is looked for.
    fn key(&self) -> String {
        let units: Vec<_> = self.job.units.all().collect();
        let job = format!("{:?} {:?} {:?} {}", self.job.state, units, self.job.frames, self.job.started.is_some());
        format!("{job} {:?} {:?} {:?} {}", self.granted, self.counted, self.broken, self.superseded)
    }
}

impl Hash for World {
    fn hash<H: Hasher>(&self, state: &mut H) {
        self.key().hash(state);
    }
}

impl PartialEq for World {
    fn eq(&self, other: &Self) -> bool {
        self.key() == other.key()
    }
}

const NOW: Timestamp = Timestamp::from_millis(1_000_000);

impl World {
    fn stored(&self) -> StoredJob {
        self.store.jobs().now_or_never().unwrap().unwrap().remove(0)
    }

    fn apply(&mut self, event: Event, now: Timestamp) -> Vec<Action> {
        let before = self.job.state;
        let retried = matches!(event, Event::Retried { .. });
        let actions = apply(&mut self.job, event, now);
        let changes: Vec<Change> =
            actions.iter().filter_map(|a| if let Action::Keep(change) = a { Some(change.clone()) } else { None }).collect();
        let committed = self.store.commit(&changes).now_or_never().unwrap();
        let mut faults = vec![committed.err().map(|error| error.to_string()), invariants::check(&self.job).err()];
        if before.is_final() && !retried {
            faults.push((self.job.state != before).then(|| format!("{before:?} became {:?}", self.job.state)));
            faults.push(actions.iter().any(|a| matches!(a, Action::Grant { .. })).then(|| "I9: a grant after the end".into()));
        }
        if before == JobState::Cancelled && self.job.state != before {
            faults.push(Some("I9: cancelled is not for ever".into()));
        }
        for (unit, (epoch, content)) in &self.counted {
            let held = self.job.unit(*unit).map(|u| (u.epoch, u.state));
            let stands = matches!(held, Some((e, UnitState::Done { content: c, .. })) if (e, c) == (*epoch, *content));
            faults.push((!stands).then(|| format!("I2: unit {unit} is {held:?} and was done")));
        }
        self.broken = self.broken.take().or_else(|| faults.into_iter().flatten().next());
        actions
    }
}

impl Model for Small {
    type State = World;
    type Action = Happening;

    fn init_states(&self) -> Vec<World> {
        let (job, actions) = submit(self.record.clone()).unwrap();
        let store = Memory::new();
        let changes: Vec<Change> =
            actions.into_iter().filter_map(|a| if let Action::Keep(change) = a { Some(change) } else { None }).collect();
        store.commit(&changes).now_or_never().unwrap().unwrap();
        vec![World { job, store, granted: Vec::new(), counted: BTreeMap::new(), superseded: false, broken: None }]
    }

    fn actions(&self, world: &World, happenings: &mut Vec<Happening>) {
        happenings.extend([Happening::Lease(0), Happening::Lease(1), Happening::Lose(0), Happening::Lose(1), Happening::Expire]);
        for grant in 0..world.granted.len() {
            happenings.extend([Happening::Deliver(grant), Happening::Renew(grant), Happening::Return(grant), Happening::Fail(grant)]);
        }
        happenings.extend([true, false].map(Happening::Assemble));
        happenings.extend([Happening::Retry, Happening::Cancel, Happening::Restart]);
    }

    fn next_state(&self, world: &World, happening: Happening) -> Option<World> {
        let mut world = world.clone();
        let until = NOW + TTL;
        let actions = match happening {
            Happening::Lease(worker) => {
                let worker = self.workers[worker];
                let unit = world.job.next_for(worker, &self.workers)?;
                if world.job.unit(unit)?.epoch >= self.grants {
                    return None;
                }
                world.apply(Event::Leased { unit, worker, until }, NOW)
            }
            Happening::Deliver(grant) => {
                let (unit, epoch, worker) = world.granted[grant];
                let (due, result) = (world.job.awaits(unit, epoch), result(unit, false));
                let again = world.job.has_taken(unit, epoch, result.content);
                let actions = world.apply(Event::Delivered { unit, epoch, worker, result }, NOW);
                let accepted = actions.contains(&Action::Answer(Answer::Accepted));
                let counts = actions.iter().any(|a| matches!(a, Action::Keep(Change::Delivered { .. })));
                if accepted != (due || again) || counts != due {
                    world.broken = Some(format!("I3: unit {unit} under epoch {epoch}: due {due}, accepted {accepted}, counts {counts}"));
                }
                if counts && world.counted.insert(unit, (epoch, result.content)).is_some() {
                    world.broken = Some(format!("unit {unit} counts twice"));
                }
                world.superseded |= !accepted;
                actions
            }
            Happening::Renew(grant) => {
                let (unit, epoch, worker) = world.granted[grant];
                world.apply(Event::Renewed { unit, epoch, worker, until }, NOW)
            }
            Happening::Return(grant) => {
                let (unit, epoch, worker) = world.granted[grant];
                world.apply(Event::Returned { unit, epoch, worker }, NOW)
            }
            Happening::Fail(grant) => {
                let (unit, epoch, worker) = world.granted[grant];
                world.apply(Event::Failed { unit, epoch, worker, reason: "no memory".into() }, NOW)
            }
            Happening::Lose(worker) => world.apply(Event::Lost { worker: self.workers[worker] }, NOW),
            Happening::Expire => world.apply(Event::Expired, until),
            Happening::Assemble(works) => {
                let outcome = if works { Ok(assembled(world.job.frames[0].units)) } else { Err("disk full".into()) };
                world.apply(Event::Assembled { frame: 0, outcome }, NOW)
            }
            Happening::Retry => world.apply(Event::Retried { frame: None }, NOW),
            Happening::Cancel => world.apply(Event::Cancelled, NOW),
            Happening::Restart => {
                let (job, _) = Job::restore(world.stored(), NOW, TTL).unwrap();
                let told = |job: &Job| (job.state, job.error.clone(), job.frames.iter().map(|f| (f.state, f.units)).collect::<Vec<_>>());
                if told(&job) != told(&world.job) {
                    world.broken = Some(format!("a restart makes {:?} of {:?}", told(&job), told(&world.job)));
                }
                // Of a job that is done nothing is held in memory; what workers may send for it is superseded, which was seen already.
                job.units.all().next()?;
                world.job = job;
                Vec::new()
            }
        };
        for action in actions {
            if let Action::Grant { unit, epoch, worker } = action {
                if world.granted.iter().any(|(u, e, _)| (*u, *e) == (unit, epoch)) {
                    world.broken = Some(format!("I1: unit {unit} is granted twice under epoch {epoch}"));
                }
                world.granted.push((unit, epoch, worker));
                world.granted.sort_unstable();
            }
        }
        Some(world)
    }

    /// One attempt at most comes to nothing: more of them only count further.
    fn within_boundary(&self, world: &World) -> bool {
        world.job.units.all().map(|(_, unit)| unit.failures + unit.losses).sum::<u32>() <= 1
    }

    fn properties(&self) -> Vec<Property<Self>> {
        vec![
            Property::always("the invariants hold", |_, world: &World| world.broken.is_none()),
            Property::sometimes("the job is done", |_, world: &World| world.job.state == JobState::Done),
            Property::sometimes("the job is cancelled", |_, world: &World| world.job.state == JobState::Cancelled),
            Property::sometimes("the job fails", |_, world: &World| world.job.state == JobState::Failed),
            Property::sometimes("a result comes too late", |_, world: &World| world.superseded),
        ]
    }
}

fn check(width: u32, grants: u32) -> usize {
    let record = JobRecord { plan: plan(width, 4, 16), frame_count: 1, moments: single(3..4), ..record("model") };
    let small = Small { record, workers: [WorkerId::from_bytes([1; 16]), WorkerId::from_bytes([2; 16])], grants };
    let checked = small.checker().threads(2).spawn_bfs().join();
    checked.assert_no_discovery("the invariants hold");
    for example in ["the job is done", "the job is cancelled", "the job fails", "a result comes too late"] {
        checked.assert_any_discovery(example);
    }
    checked.unique_state_count()
}

#[test]
fn no_history_of_two_units_breaks_an_invariant() {
    let states = check(8, 2);
    assert!(states > 1000, "{states} states");
}

#[test]
fn no_history_of_three_units_breaks_an_invariant() {
    let states = check(12, 1);
    assert!(states > 500, "{states} states");
}
