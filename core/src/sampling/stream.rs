//! Counter-based random numbers: a number is a pure function of (seed, frame, pixel, sample index, dimension).
//!
//! Replay, temporal correlation, independence of tiling and restart all follow from this. The first dimensions, where
//! stratification pays, are Owen-scrambled Sobol' points, shuffled anew for each pair of dimensions; the others are hashed.

/// Which number of a sample: fixed places, so that no number depends on how many were drawn before it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Dimension(u32);

impl Dimension {
    /// Position inside the pixel. A pair.
    pub const PIXEL: Dimension = Dimension(0);
    /// Position on the lens. A pair.
    pub const LENS: Dimension = Dimension(2);
    const FIRST_VERTEX: u32 = 4;
    const PER_VERTEX: u32 = 8;

    #[inline]
    fn vertex(index: usize, place: u32) -> Dimension {
        Dimension(Self::FIRST_VERTEX + (index as u32).wrapping_mul(Self::PER_VERTEX) + place)
    }

    /// Point on a light, at the vertex of this index. A pair.
    #[inline]
    pub fn light_point(vertex: usize) -> Dimension {
        Self::vertex(vertex, 0)
    }

    /// Direction sampled from the material. A pair.
    #[inline]
    pub fn direction(vertex: usize) -> Dimension {
        Self::vertex(vertex, 2)
    }

    /// Choice among lights.
    #[inline]
    pub fn light_choice(vertex: usize) -> Dimension {
        Self::vertex(vertex, 4)
    }

    /// Choice among the lobes of a material.
    #[inline]
    pub fn lobe(vertex: usize) -> Dimension {
        Self::vertex(vertex, 5)
    }

    /// The i-th number of the leg that leads to the vertex of this index. The first is stratified like the others.
    #[inline]
    pub fn leg(vertex: usize, i: u32) -> Dimension {
        if i == 0 { Self::vertex(vertex, 7) } else { Dimension(LEGS | (vertex as u32) << 12 | (i & 0xfff)) }
    }

    /// Russian roulette on the shift to the neighbour of this index.
    #[inline]
    pub fn shift(neighbour: usize) -> Dimension {
        Dimension(SHIFTS | neighbour as u32)
    }

    /// Russian roulette.
    #[inline]
    pub fn roulette(vertex: usize) -> Dimension {
        Self::vertex(vertex, 6)
    }
}

/// Dimensions from here on decide about shifts.
const SHIFTS: u32 = 1 << 30;
/// Dimensions from here on belong to legs that need more than one number.
const LEGS: u32 = 1 << 31;

/// Names one sample of one pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SampleKey {
    /// Seed of the job.
    pub seed: u64,
    /// Key of the frame: half A of frame t uses t, half B t + 1, so that neighbouring frames share seeds ([`Moment`](crate::lattice::Moment)).
    pub frame: u32,
    /// Pixel column.
    pub x: u32,
    /// Pixel row.
    pub y: u32,
    /// Index of the sample within its half, below 2³¹; for a sample whose number a guide decides, plus [`SampleKey::GUIDED`].
    pub index: u32,
}

impl SampleKey {
    /// Samples whose number a guide decides have their indices from here on: another region, stratified by itself and independent of
    /// the first, so that the two never meet, however many samples either has.
    pub const GUIDED: u32 = 1 << 31;
}

/// All numbers of one sample. Stateless: asking twice gives the same number.
#[derive(Clone, Copy, Debug, Default)]
pub struct SampleStream {
    pixel: u64,
    sample: u64,
    index: u32,
    /// `index` with its bits reversed.
    reversed: u32,
}

/// Dimensions below this are stratified over the samples of a pixel: pixel, lens, and the first two vertices.
const STRATIFIED: u32 = Dimension::FIRST_VERTEX + 2 * Dimension::PER_VERTEX;
/// The Sobol' table covers indices below this; beyond, numbers are hashed.
const SOBOL_INDICES: u32 = 1 << 16;

impl SampleStream {
    /// Opens the stream of a sample.
    pub fn open(key: SampleKey) -> Self {
        let job = mix(key.seed ^ 0x5851_f42d_4c95_7f2d).wrapping_add(u64::from(key.frame).wrapping_mul(GOLDEN));
        let region = u64::from(key.index / SampleKey::GUIDED) << 63;
        let pixel = mix(mix(job) ^ (u64::from(key.x) | u64::from(key.y) << 32) ^ region);
        let index = key.index % SampleKey::GUIDED;
        let sample = mix(pixel.wrapping_add(u64::from(index).wrapping_mul(GOLDEN)));
        Self { pixel, sample, index, reversed: index.reverse_bits() }
    }

    /// One number in [0, 1).
    #[inline]
    pub fn number(&self, dimension: Dimension) -> f32 {
        if self.is_stratified(dimension) {
            let seed = self.seed(dimension);
            return unit(scramble(self.shuffled(seed), (seed >> 32) as u32).reverse_bits());
        }
        unit(self.hashed(dimension.0) as u32)
    }

    /// Two numbers in [0, 1)².
    #[inline]
    pub fn pair(&self, dimension: Dimension) -> [f32; 2] {
        if self.is_stratified(dimension) {
            let seed = self.seed(dimension);
            let index = self.shuffled(seed);
            let first = scramble(index, (seed >> 32) as u32);
            let second = scramble(sobol_second(index), mix(seed) as u32);
            // Both at once: the processor has no instruction for it.
            let both = (u64::from(first) | u64::from(second) << 32).reverse_bits();
            return [unit((both >> 32) as u32), unit(both as u32)];
        }
        let bits = self.hashed(dimension.0);
        [unit(bits as u32), unit((bits >> 32) as u32)]
    }

    #[inline]
    fn is_stratified(&self, dimension: Dimension) -> bool {
        dimension.0 < STRATIFIED && self.index < SOBOL_INDICES
    }

    /// The key of a dimension, the same for all samples of a pixel.
    #[inline]
    fn seed(&self, dimension: Dimension) -> u64 {
        mix(self.pixel ^ u64::from(dimension.0 + 1).wrapping_mul(GOLDEN))
    }

    /// The index, permuted so that aligned blocks of 2ᵐ below 2¹⁶ map onto aligned blocks: prefixes stay stratified, pairs of
    /// dimensions lose their correlation.
    #[inline]
    fn shuffled(&self, seed: u64) -> u32 {
        scramble(self.reversed, seed as u32).reverse_bits() & (SOBOL_INDICES - 1)
    }

    #[inline]
    fn hashed(&self, dimension: u32) -> u64 {
        mix(self.sample.wrapping_add(u64::from(dimension).wrapping_mul(GOLDEN)))
    }
}

/// 2⁶⁴ / φ, the increment of a Weyl sequence.
const GOLDEN: u64 = 0x9e37_79b9_7f4a_7c15;

/// A bijective mixer of 64 bits.
///
/// # Source
/// Stafford's variant 13 of the MurmurHash3 finaliser, as used in SplitMix64 (Steele et al., OOPSLA 2014).
#[inline]
fn mix(mut z: u64) -> u64 {
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// The upper 24 bits as a number in [0, 1).
#[inline]
fn unit(bits: u32) -> f32 {
    (bits >> 8) as f32 * (1.0 / 16_777_216.0)
}

/// Nested uniform scrambling of a binary fraction whose bits are reversed, the first one lowest: the flip of each bit depends
/// on the bits before it.
///
/// # Source
/// Burley, "Practical Hash-based Owen Scrambling", JCGT 9(4), 2020, after Laine and Karras, EGSR 2011; constants by Vegdahl.
#[inline]
fn scramble(fraction: u32, seed: u32) -> u32 {
    let mut x = fraction;
    x ^= x.wrapping_mul(0x3d20_adea);
    x = x.wrapping_add(seed);
    x = x.wrapping_mul((seed >> 16) | 1);
    x ^= x.wrapping_mul(0x0552_6c56);
    x ^ x.wrapping_mul(0x53a2_2864)
}

/// Second dimension of the Sobol' sequence with its bits reversed, by table over the two bytes of the index. The first dimension
/// is the index itself.
#[inline]
fn sobol_second(index: u32) -> u32 {
    SOBOL_LOW[(index & 0xff) as usize] ^ SOBOL_HIGH[(index >> 8 & 0xff) as usize]
}

static SOBOL_LOW: [u32; 256] = sobol_table(0);
static SOBOL_HIGH: [u32; 256] = sobol_table(8);

const fn sobol_table(shift: u32) -> [u32; 256] {
    let mut table = [0u32; 256];
    let mut byte = 0;
    while byte < 256 {
        let mut bits = (byte as u32) << shift;
        let mut direction = 1u32 << 31;
        let mut value = 0;
        while bits != 0 {
            if bits & 1 == 1 {
                value ^= direction;
            }
            bits >>= 1;
            direction ^= direction >> 1;
        }
        table[byte] = value.reverse_bits();
        byte += 1;
    }
    table
}

#[cfg(test)]
mod tests {
    use super::*;

    fn key(index: u32) -> SampleKey {
        SampleKey { seed: 7, frame: 3, x: 11, y: 5, index }
    }

    #[test]
    fn numbers_are_pure_functions_of_their_key() {
        let a = SampleStream::open(key(4));
        let first = a.pair(Dimension::direction(9));
        let _ = a.number(Dimension::roulette(2));
        assert_eq!(first, a.pair(Dimension::direction(9)));
        assert_ne!(first, SampleStream::open(key(5)).pair(Dimension::direction(9)));
        let other = SampleStream::open(SampleKey { x: 12, ..key(4) });
        assert_ne!(a.pair(Dimension::PIXEL), other.pair(Dimension::PIXEL));
    }

    #[test]
    fn stratified_pairs_form_a_net() {
        // Each elementary interval of area 1/64 holds exactly one of 64 points: the property survives scrambling and shuffling.
        for dimension in [Dimension::PIXEL, Dimension::light_point(0), Dimension::direction(1)] {
            for (split, region) in (0..=6u32).flat_map(|split| [(split, 0), (split, SampleKey::GUIDED)]) {
                let mut cells = [0u8; 64];
                for index in 64..128 {
                    let [u, v] = SampleStream::open(key(region + index)).pair(dimension);
                    let column = (u * (1 << split) as f32) as usize;
                    let row = (v * (1 << (6 - split)) as f32) as usize;
                    cells[row * (1 << split) + column] += 1;
                }
                assert!(cells.iter().all(|&n| n == 1), "{dimension:?} split {split}");
            }
        }
    }

    #[test]
    fn guided_samples_have_numbers_of_their_own() {
        for dimension in [Dimension::PIXEL, Dimension::direction(7)] {
            let numbers =
                |region: u32| -> Vec<[f32; 2]> { (0..256).map(|index| SampleStream::open(key(region + index)).pair(dimension)).collect() };
            let (even, guided) = (numbers(0), numbers(SampleKey::GUIDED));
            assert!(even.iter().all(|pair| !guided.contains(pair)), "{dimension:?}");
        }
    }

    #[test]
    fn numbers_are_uniform_and_uncorrelated() {
        let n = 20_000u32;
        let pairs = [
            (Dimension::PIXEL, Dimension::LENS),
            (Dimension::direction(0), Dimension::light_point(1)),
            (Dimension::direction(5), Dimension::direction(6)),
        ];
        for (a, b) in pairs {
            let (mut sum, mut cross) = (0.0f64, 0.0f64);
            for pixel in 0..n {
                let stream = SampleStream::open(SampleKey { seed: 1, frame: 0, x: pixel, y: 0, index: 3 });
                let (u, v) = (f64::from(stream.pair(a)[0]), f64::from(stream.pair(b)[1]));
                sum += u;
                cross += (u - 0.5) * (v - 0.5);
            }
            let n = f64::from(n);
            assert!((sum / n - 0.5).abs() < 4.0 * (1.0 / 12.0f64 / n).sqrt());
            assert!((cross / n).abs() < 4.0 / 12.0 / n.sqrt());
        }
    }
}
