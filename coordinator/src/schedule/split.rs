//! Cuts a job into units of work: moments × passes × tiles, in one dense numbering that the plan and the tile edge fix.

use std::ops::Range;
use std::sync::Arc;

use gradfarm_core::lattice::{Moment, Tile};
use gradfarm_core::plan::{Pass, Plan, WorkUnit};

/// The units of a job.
///
/// Frames that show the same are one moment, and each moment is rendered once, as the first of its frames: what is called a frame in the
/// farm's books is the one image that all frames of a moment show.
///
/// Unit `((f · passes) + p) · tiles + t` is pass `p` over tile `t` of the job's `f`-th moment: a frame's first pass covers the whole image
/// before its second one starts, so that an early look shows every pixel. Guided passes come last, in the order of their rounds, or, where
/// rounds double, after the even ones of their round; so of a frame's units those that are open are always its first ones. Moments come in the order of time, so the
/// window that is complete next is always the first one that is not.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Split {
    moments: Arc<[Moment]>,
    tiles: Vec<Tile>,
    passes: Vec<Pass>,
    /// For each guide of a frame, how many passes come before its round. The even ones of them steer it.
    steering: Vec<u32>,
    /// For each guide of a frame, the first pass that needs it.
    guided: Vec<u32>,
}

/// Where a unit lies: positions, not frame numbers or pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Place {
    /// Which of the job's moments.
    pub frame: u32,
    /// Which of the frame's passes.
    pub pass: u32,
    /// Which of its tiles.
    pub tile: u32,
}

/// A job of more units than can be numbered in 32 bits, or than a coordinator should hold.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the job falls into {found} units, at most {most} are allowed: use larger tiles, fewer frames or fewer samples")]
pub struct TooManyUnits {
    found: u128,
    most: u32,
}

impl Split {
    /// Most units of one job.
    pub const MOST: u32 = 16 << 20;
    /// Most numbers for units of a job whose frames may stop early: few of them ever become units.
    pub const MOST_NUMBERS: u32 = 1 << 31;

    /// The units of these moments, with tiles of at most `edge × edge` pixels: rounded up to the plan's grain,
    /// so that no group of pixels is rendered for two tiles.
    ///
    /// # Errors
    /// If they are more than [`Split::MOST`], or [`Split::MOST_NUMBERS`] where frames may stop early.
    pub fn new(plan: &Plan, moments: &[Moment], edge: u32) -> Result<Self, TooManyUnits> {
        let edge = edge.div_ceil(plan.grain()).max(1).saturating_mul(plan.grain());
        let columns = u128::from(plan.extent.width.div_ceil(edge)) * u128::from(plan.extent.height.div_ceil(edge));
        let found = columns * u128::from(plan.pass_count()) * moments.len() as u128;
        let most = if plan.stop.ends_early() { Self::MOST_NUMBERS } else { Self::MOST };
        if found > u128::from(most) {
            return Err(TooManyUnits { found, most });
        }
        let passes = plan.passes();
        let steers = |round| passes.partition_point(|pass| pass.samples.end() <= plan.steered_until(round)) as u32;
        let rounds = passes.iter().filter_map(|pass| pass.slice).map(|slice| slice.round).max().unwrap_or(0);
        let steering = (1..=rounds).map(steers).collect();
        let needs = |round| passes.iter().position(|pass| pass.slice.is_some_and(|slice| slice.round >= round)).unwrap_or(passes.len());
        let guided = (1..=rounds).map(|round| needs(round) as u32).collect();
        Ok(Self { moments: moments.into(), tiles: plan.extent.tiles(edge), passes, steering, guided })
    }

    /// Number of moments: frames that are rendered.
    pub fn frames(&self) -> u32 {
        self.moments.len() as u32
    }

    /// The moments, in order.
    pub fn moments(&self) -> &[Moment] {
        &self.moments
    }

    /// The position of the moment that a frame shows, by the frame's number.
    pub fn moment_of(&self, frame: u32) -> Option<u32> {
        let at = self.moments.partition_point(|moment| moment.first <= frame).checked_sub(1)?;
        (frame < self.moments[at].end).then_some(at as u32)
    }

    /// Tiles of every frame, row by row.
    pub fn tiles(&self) -> &[Tile] {
        &self.tiles
    }

    /// Passes over every tile, in the order of their sums.
    pub fn passes(&self) -> &[Pass] {
        &self.passes
    }

    /// How many of a frame's first passes lie within so many samples per pixel.
    pub fn passes_within(&self, samples: u32) -> u32 {
        self.passes.partition_point(|pass| pass.samples.end() <= samples) as u32
    }

    /// Units of one pass over a frame.
    pub fn units_per_pass(&self) -> u32 {
        self.tiles.len() as u32
    }

    /// For the guide of each round from 1 on, among how many of a frame's first passes are those that steer it: the even ones. Empty where
    /// samples are placed evenly.
    pub fn steering(&self) -> &[u32] {
        &self.steering
    }

    /// Whether a pass steers the guide of this round.
    pub fn steers(&self, pass: u32, round: u32) -> bool {
        let before = round.checked_sub(1).and_then(|at| self.steering.get(at as usize));
        before.is_some_and(|before| pass < *before) && self.passes.get(pass as usize).is_some_and(|pass| pass.slice.is_none())
    }

    /// How many guides the first passes of a frame need.
    pub fn guides_within(&self, passes: u32) -> usize {
        self.guided.partition_point(|first| *first < passes)
    }

    /// The units of a frame, by its position, that can be rendered when the guides of so many rounds are there.
    pub fn open(&self, frame: u32, guides: usize) -> Range<u32> {
        let first = frame * self.units_per_frame();
        let passes = self.guided.get(guides).map_or(self.passes.len(), |pass| *pass as usize);
        first..first + (passes * self.tiles.len()) as u32
    }

    /// Units of one frame.
    pub fn units_per_frame(&self) -> u32 {
        (self.tiles.len() * self.passes.len()) as u32
    }

    /// Units of the job.
    pub fn units(&self) -> u32 {
        self.units_per_frame() * self.frames()
    }

    /// Camera samples of one frame. Guided ones are placed exactly as many as planned, over the frame; each unit counts as the mean.
    pub fn samples_per_frame(&self) -> u64 {
        self.pixels() * self.passes.iter().map(|pass| u64::from(pass.samples.count)).sum::<u64>()
    }

    /// Pixels of a frame.
    pub fn pixels(&self) -> u64 {
        self.tiles.iter().map(|tile| tile.pixels() as u64).sum()
    }

    /// Where a unit lies. The unit must be one of the job's.
    pub fn place(&self, unit: u32) -> Place {
        let (rest, tile) = (unit / self.tiles.len() as u32, unit % self.tiles.len() as u32);
        Place { frame: rest / self.passes.len() as u32, pass: rest % self.passes.len() as u32, tile }
    }

    /// The unit at a place.
    pub fn unit(&self, place: Place) -> u32 {
        (place.frame * self.passes.len() as u32 + place.pass) * self.tiles.len() as u32 + place.tile
    }

    /// What is to be rendered for a unit; for one of a guided pass a guide says the rest.
    pub fn work(&self, unit: u32) -> WorkUnit {
        let place = self.place(unit);
        WorkUnit {
            moment: self.moments[place.frame as usize],
            tile: self.tiles[place.tile as usize],
            samples: self.passes[place.pass as usize].samples,
        }
    }

    /// Camera samples of a unit; of a guided one, as many as it has on average.
    pub fn samples(&self, unit: u32) -> u64 {
        let work = self.work(unit);
        work.tile.pixels() as u64 * u64::from(work.samples.count)
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use gradfarm_core::lattice::Extent;
    use gradfarm_core::plan::{ReconstructionKind, ShiftKind, Stop, Technique};
    use proptest::prelude::*;

    /// A plan over a film of the given size.
    pub(crate) fn plan(width: u32, height: u32, samples: u32) -> Plan {
        Plan {
            extent: Extent { width, height },
            technique: Technique::Gpt,
            reconstruction: ReconstructionKind::L2,
            samples,
            batch: Plan::BATCH,
            seed: 7,
            alpha: Some(0.2),
            clamp: false,
            max_depth: 8,
            roulette_depth: 4,
            shift: ShiftKind::Hybrid,
            shift_threshold: 0.001,
            shift_survival: 1.0,
            reuse_edge: 6,
            links: 8,
            rounds: 1,
            stop: Stop::default(),
            timeline: None,
            temporal: None,
            reasons: vec!["made for a test".into()],
        }
    }

    /// Moments of one frame each.
    pub(crate) fn single(frames: Range<u32>) -> Vec<Moment> {
        frames.map(Moment::of).collect()
    }

    #[test]
    fn frames_find_their_moment() {
        let moments = [Moment { first: 4, end: 9 }, Moment::of(9), Moment { first: 10, end: 12 }];
        let split = Split::new(&plan(8, 8, 4), &moments, 8).unwrap();
        assert_eq!(
            (3..13).map(|frame| split.moment_of(frame)).collect::<Vec<_>>(),
            [None, Some(0), Some(0), Some(0), Some(0), Some(0), Some(1), Some(2), Some(2), None]
        );
        assert_eq!(split.work(0).moment, moments[0]);
        assert_eq!(split.units(), 3, "a moment is rendered once");
    }

    proptest! {
        #[test]
        fn units_cover_every_sample_of_every_pixel_once(
            width in 1u32..40, height in 1u32..40, samples in 1u32..70, frames in 1u32..4, edge in 1u32..50,
        ) {
            let split = Split::new(&plan(width, height, samples), &single(5..5 + frames), edge).unwrap();
            let mut seen = vec![0u32; (width * height * frames) as usize];
            let mut total = 0;
            for unit in 0..split.units() {
                prop_assert_eq!(split.unit(split.place(unit)), unit);
                let work = split.work(unit);
                total += split.samples(unit);
                for y in work.tile.y..work.tile.y + work.tile.height {
                    for x in work.tile.x..work.tile.x + work.tile.width {
                        let pixel = &mut seen[(((work.moment.first - 5) * height + y) * width + x) as usize];
                        prop_assert_eq!(*pixel, work.samples.first, "ranges come in order");
                        *pixel = work.samples.end();
                    }
                }
            }
            prop_assert!(seen.iter().all(|&n| n == samples));
            prop_assert_eq!(total, split.samples_per_frame() * u64::from(frames));
        }
    }

    #[test]
    fn tiles_do_not_cut_groups() {
        let plan = Plan { technique: Technique::Reuse, reuse_edge: 6, ..plan(40, 30, 4) };
        let split = Split::new(&plan, &single(0..1), 16).unwrap();
        assert!(split.tiles().iter().all(|tile| tile.x.is_multiple_of(18) && tile.y.is_multiple_of(18)));
        assert_eq!(split.tiles().iter().map(|tile| tile.pixels()).sum::<usize>(), 40 * 30);
    }

    #[test]
    fn guided_units_open_round_by_round() {
        let plan = Plan { rounds: 3, ..plan(8, 8, 96) };
        let split = Split::new(&plan, &single(0..2), 4).unwrap();
        assert_eq!(split.steering().len(), 2);
        assert!(split.open(0, 0).len() < split.open(0, 1).len() && split.open(0, 1).len() < split.open(0, 2).len());
        for frame in 0..2 {
            let all = frame * split.units_per_frame()..(frame + 1) * split.units_per_frame();
            assert_eq!(split.open(frame, 2), all);
            for unit in all {
                let slice = split.passes()[split.place(unit).pass as usize].slice;
                let needed = slice.map_or(0, |slice| slice.round as usize);
                assert!((0..3).all(|guides| split.open(frame, guides).contains(&unit) == (needed <= guides)));
            }
        }
        for (round, steering) in (1..).zip(split.steering()) {
            let samples: u32 = split.passes()[..*steering as usize].iter().map(|pass| pass.samples.count).sum();
            assert_eq!(samples, plan.even_before(round));
            assert!((0..split.passes().len() as u32).all(|pass| split.steers(pass, round) == (pass < *steering)));
        }
        assert_eq!([0, 4, 5, split.passes().len() as u32].map(|passes| split.guides_within(passes)), [0, 0, 1, 2]);
        let even = Split::new(&Plan { rounds: 1, ..plan }, &single(0..2), 4).unwrap();
        assert!(even.steering().is_empty() && even.open(1, 0).end == even.units());
    }

    #[test]
    fn rounds_that_double_open_one_after_the_other() {
        let stop = Stop { error: Some(0.01), ..Stop::default() };
        let split = Split::new(&Plan { rounds: 9, stop, ..plan(8, 8, 300) }, &single(0..1), 4).unwrap();
        // Four even passes, then one and three, two and six, and the even ones of the next doubling.
        let passes = split.passes().len() as u32;
        assert_eq!((passes, split.steering()), (19, &[4, 8, 16][..2]));
        let open = [0, 1, 2].map(|guides| split.open(0, guides).len() as u32 / split.units_per_pass());
        assert_eq!(open, [5, 10, passes]);
        assert_eq!([5, 6, 10, 11, passes].map(|passes| split.guides_within(passes)), [0, 1, 1, 2, 2]);
        let steered = |round| (0..passes).filter(|pass| split.steers(*pass, round)).collect::<Vec<_>>();
        assert_eq!((steered(1), steered(2)), (vec![0, 1, 2, 3], vec![0, 1, 2, 3, 4]));
        assert!(steered(0).is_empty() && steered(3).is_empty());
    }

    #[test]
    fn a_job_of_too_many_units_is_refused() {
        let error = Split::new(&plan(60_000, 4_000, 1 << 30), &single(0..1000), 1).unwrap_err();
        assert!(error.to_string().contains("larger tiles"), "{error}");
        let stop = Stop { error: Some(0.01), ..Stop::default() };
        let open_ended = Plan { stop, ..plan(1920, 1080, 65_536) };
        let split = Split::new(&open_ended, &single(0..100), 32).unwrap();
        assert!(split.units() > Split::MOST && split.passes_within(32) == 2 && split.passes_within(33) == 2);
        assert!(Split::new(&open_ended, &single(0..10_000), 32).is_err());
    }
}
