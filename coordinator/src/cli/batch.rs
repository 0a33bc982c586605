//! How far the frames of a job are, in few words.

use std::collections::BTreeMap;
use std::ops::Range;

use crate::job::{FrameState, WindowState};

/// The states of a run of frames.
#[derive(Clone, Debug)]
pub(super) struct Batch {
    first: u32,
    states: Vec<Option<FrameState>>,
    /// The frames of windows that are being solved, by the number of the window.
    solving: BTreeMap<u32, Range<u32>>,
}

impl Batch {
    /// Frames of which nothing is known yet.
    pub(super) fn new(frames: Range<u32>) -> Self {
        Self { first: frames.start, states: vec![None; frames.len()], solving: BTreeMap::new() }
    }

    /// These frames changed their state.
    pub(super) fn set(&mut self, frames: Range<u32>, state: FrameState) {
        for frame in frames {
            if let Some(known) = frame.checked_sub(self.first).and_then(|at| self.states.get_mut(at as usize)) {
                *known = Some(state);
            }
        }
    }

    /// A window over these frames changed its state.
    pub(super) fn set_window(&mut self, window: u32, frames: Range<u32>, state: &str) {
        if state == WindowState::Solving.name() {
            self.solving.insert(window, frames);
        } else {
            self.solving.remove(&window);
        }
    }

    /// What is being done: of a single frame its state, of several how many are done and which are worked on.
    pub(super) fn told(&self) -> String {
        let [only] = self.states[..] else {
            let done = self.run_of(&[FrameState::Done]).1;
            let (working, _) = self.run_of(&[FrameState::Rendering, FrameState::Assembling]);
            let working = working.map(|frames| format!(", {frames}")).unwrap_or_default();
            let solving = self.solving.values().next();
            let solving =
                solving.map(|frames| format!(", solving {}–{} together", frames.start, frames.end.max(1) - 1)).unwrap_or_default();
            return format!("{done} of {} frames{working}{solving}", self.states.len());
        };
        only.map_or("preparing", FrameState::name).to_owned()
    }

    /// The first run of frames in one of these states, as people write it, and how many there are in all.
    fn run_of(&self, states: &[FrameState]) -> (Option<String>, usize) {
        let is = |known: &Option<FrameState>| known.is_some_and(|state| states.contains(&state));
        let count = self.states.iter().filter(|known| is(known)).count();
        let first = self.states.iter().position(is);
        let told = first.map(|at| {
            let length = self.states[at..].iter().take_while(|known| is(known)).count();
            let number = self.first + at as u32;
            let state = self.states[at].map_or("", FrameState::name);
            let last = if length > 1 { format!("–{}", number + length as u32 - 1) } else { String::new() };
            let more = if count > length { " …" } else { "" };
            format!("{state} {number}{last}{more}")
        });
        (told, count)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_frame_has_a_state_and_several_have_numbers() {
        let mut one = Batch::new(3..4);
        assert_eq!(one.told(), "preparing");
        one.set(3..4, FrameState::Assembling);
        one.set(4..9, FrameState::Done);
        assert_eq!(one.told(), "assembling");
        let mut many = Batch::new(10..20);
        assert_eq!(many.told(), "0 of 10 frames");
        many.set(10..14, FrameState::Done);
        many.set(14..15, FrameState::Rendering);
        assert_eq!(many.told(), "4 of 10 frames, rendering 14");
        many.set(14..17, FrameState::Rendering);
        assert_eq!(many.told(), "4 of 10 frames, rendering 14–16");
        many.set(18..19, FrameState::Rendering);
        assert_eq!(many.told(), "4 of 10 frames, rendering 14–16 …");
        many.set_window(1, 12..17, "solving");
        assert_eq!(many.told(), "4 of 10 frames, rendering 14–16 …, solving 12–16 together");
        many.set_window(1, 12..17, "solved");
        many.set(0..100, FrameState::Done);
        assert_eq!(many.told(), "10 of 10 frames");
    }
}
