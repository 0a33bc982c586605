//! The windows of a job whose moments are reconstructed together: a window is solved when all its moments are rendered, and a moment is
//! assembled when all windows over it are solved.

use std::ops::Range;

use gradfarm_core::plan::Plan;
use gradfarm_core::reconstruction::SolveReport;
use gradfarm_core::reconstruction::window::Windows;
use gradfarm_proto::Digest;

use super::action::{Action, Errand, News};
use super::state::FrameState;
use super::{Change, Job};

/// What a window says of one of its moments, multiplied by what it counts there: its name among the blobs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ShareRecord {
    /// Digest of its compressed form.
    pub blob: Digest,
    /// Size before compression [bytes].
    pub size: u64,
}

/// A window that is solved and stored.
#[derive(Clone, Debug, PartialEq)]
pub struct SolvedWindow {
    /// One share for each of its moments, in order.
    pub shares: Vec<ShareRecord>,
    /// How the solve went.
    pub report: SolveReport,
    /// Reading results and adding them up [s].
    pub stitch: f64,
    /// Solving [s].
    pub reconstruct: f64,
}

/// Where a window stands.
#[derive(Clone, Debug, PartialEq)]
pub enum WindowState {
    /// Not all its moments are rendered.
    Waiting,
    /// It is being solved.
    Solving,
    /// It is solved.
    Solved(SolvedWindow),
    /// A tile of one of its moments was given up: it is not solved, and its moments are reconstructed one by one.
    Broken,
}

impl WindowState {
    /// Name in reports and JSON.
    pub fn name(&self) -> &'static str {
        match self {
            WindowState::Waiting => "waiting",
            WindowState::Solving => "solving",
            WindowState::Solved(_) => "solved",
            WindowState::Broken => "broken",
        }
    }
}

/// All windows of a job.
#[derive(Clone, Debug, PartialEq)]
pub struct JobWindows {
    /// Which moments each covers.
    pub layout: Windows,
    /// Where each stands.
    pub states: Vec<WindowState>,
}

impl JobWindows {
    /// The windows of a plan over so many moments, none of them begun; `None` where frames are reconstructed one by one.
    pub(super) fn waiting(plan: &Plan, moments: u32) -> Option<Self> {
        let temporal = plan.temporal?;
        let layout = Windows::new(moments, temporal.window, temporal.stride);
        Some(Self { layout, states: vec![WindowState::Waiting; layout.len() as usize] })
    }

    /// Whether a moment waits for no window: all over it are solved, or one never will be.
    fn are_settled_over(&self, position: u32) -> bool {
        let state = |window: u32| &self.states[window as usize];
        self.is_broken_over(position) || self.layout.over(position).all(|window| matches!(state(window), WindowState::Solved(_)))
    }

    /// Whether a window over a moment will not be solved.
    pub(super) fn is_broken_over(&self, position: u32) -> bool {
        self.layout.over(position).any(|window| self.states[window as usize] == WindowState::Broken)
    }

    /// Marks the windows over a moment that cannot be solved.
    pub(super) fn break_over(&mut self, position: u32) -> Vec<u32> {
        let hit: Vec<u32> = self.layout.over(position).filter(|w| self.states[*w as usize] != WindowState::Broken).collect();
        hit.iter().for_each(|window| self.states[*window as usize] = WindowState::Broken);
        hit
    }

    /// Nothing is being solved any more.
    pub(super) fn stop(&mut self) {
        self.states.iter_mut().filter(|state| **state == WindowState::Solving).for_each(|state| *state = WindowState::Waiting);
    }
}

impl Job {
    /// The windows, where moments are reconstructed together.
    pub fn windows(&self) -> Option<&JobWindows> {
        self.windows.as_ref()
    }

    /// Whether all units of a moment are there while windows over it are not solved.
    pub fn is_rendered(&self, position: u32) -> bool {
        self.windows.is_some() && self.has_all_units(position)
    }

    /// Whether all units of a moment are there.
    pub(super) fn is_in(&self, position: u32) -> bool {
        let over = matches!(self.frames[position as usize].state, FrameState::Assembling | FrameState::Done | FrameState::Failed);
        over || self.has_all_units(position)
    }

    /// Whether a moment waits for nothing but to be assembled.
    pub(super) fn is_complete(&self, position: u32) -> bool {
        self.has_all_units(position) && self.windows.as_ref().is_none_or(|windows| windows.are_settled_over(position))
    }

    /// What windows over a moment say of it, in their order, with how they went.
    pub fn shares(&self, position: u32) -> Vec<(ShareRecord, &SolvedWindow)> {
        let Some(windows) = self.windows.as_ref().filter(|windows| !windows.is_broken_over(position)) else { return Vec::new() };
        let share = |window: u32| match &windows.states[window as usize] {
            WindowState::Solved(solved) => {
                let place = position - windows.layout.moments(window).start;
                solved.shares.get(place as usize).map(|share| (*share, solved))
            }
            WindowState::Waiting | WindowState::Solving | WindowState::Broken => None,
        };
        windows.layout.over(position).filter_map(share).collect()
    }

    /// Takes up the windows among these that are complete and not begun.
    pub(super) fn begin_windows(&mut self, among: Range<u32>) -> Vec<Action> {
        let Some(windows) = &self.windows else { return Vec::new() };
        let (layout, states) = (windows.layout, &windows.states);
        let due = |window: &u32| states[*window as usize] == WindowState::Waiting && layout.moments(*window).all(|p| self.is_in(p));
        let due: Vec<u32> = among.filter(due).collect();
        let mut actions = Vec::new();
        if let Some(windows) = &mut self.windows {
            for window in due {
                windows.states[window as usize] = WindowState::Solving;
                actions.extend([Action::Do(Errand::Window { window }), Action::Tell(News::Window(window))]);
            }
        }
        actions
    }

    /// All units of a moment are there.
    pub(super) fn moment_rendered(&mut self, position: u32) -> Vec<Action> {
        let Some(windows) = &self.windows else { return self.finish_frame(position) };
        let over = windows.layout.over(position);
        let mut actions = vec![Action::Tell(News::Frame(position))];
        actions.extend(self.begin_windows(over));
        if self.is_complete(position) {
            actions.extend(self.finish_frame(position));
        }
        actions
    }

    /// A window is solved: moments that waited for nothing else are assembled.
    pub(super) fn window_solved(&mut self, window: u32, solved: SolvedWindow) -> Vec<Action> {
        let Some(windows) = &mut self.windows else { return Vec::new() };
        let moments = windows.layout.moments(window);
        windows.states[window as usize] = WindowState::Solved(solved.clone());
        let kept = Change::Window { job: self.record.id, window, solved: Box::new(solved) };
        let mut actions = vec![Action::Keep(kept), Action::Tell(News::Window(window))];
        for position in moments {
            if self.is_complete(position) {
                actions.extend(self.finish_frame(position));
            }
        }
        actions
    }

    /// These windows will not be solved: of their moments all but one, which is seen to elsewhere, are assembled if they wait for nothing else.
    pub(super) fn assemble_under(&mut self, broken: Vec<u32>, but: u32) -> Vec<Action> {
        let Some(layout) = self.windows.as_ref().map(|windows| windows.layout) else { return Vec::new() };
        let mut actions = Vec::new();
        for window in broken {
            actions.push(Action::Tell(News::Window(window)));
            for moment in layout.moments(window) {
                if moment != but && self.is_complete(moment) && !self.is_measured_now(moment) {
                    actions.extend(self.finish_frame(moment));
                }
            }
        }
        actions
    }

    /// Lets windows begin again whose moments lack nothing any more; the moments under them.
    pub(super) fn mend_windows(&mut self) -> std::collections::BTreeSet<u32> {
        let Some(windows) = &mut self.windows else { return std::collections::BTreeSet::new() };
        let mut mended = std::collections::BTreeSet::new();
        for window in 0..windows.layout.len() {
            let moments = windows.layout.moments(window);
            let whole = moments.clone().all(|position| self.frames[position as usize].failed_units == 0);
            if whole && windows.states[window as usize] == WindowState::Broken {
                windows.states[window as usize] = WindowState::Waiting;
                mended.extend(moments);
            }
        }
        mended
    }
}
