//! Colour spaces of FLIP: linear RGB, the opponent space YCxCz in which the eye's contrast sensitivity is known, and CIELAB.

/// Three values of one colour; which space they belong to is said where they are used.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Tristimulus(pub(super) [f32; 3]);

/// Linear sRGB primaries to CIE XYZ, D65, rows of the matrix (IEC 61966-2-1, with the digits of the paper's supplement).
const TO_XYZ: [[f32; 3]; 3] = [
    [10_135_552.0 / 24_577_794.0, 8_788_810.0 / 24_577_794.0, 4_435_075.0 / 24_577_794.0],
    [2_613_072.0 / 12_288_897.0, 8_788_810.0 / 12_288_897.0, 887_015.0 / 12_288_897.0],
    [1_425_312.0 / 73_733_382.0, 8_788_810.0 / 73_733_382.0, 70_074_185.0 / 73_733_382.0],
];

/// The inverse.
const FROM_XYZ: [[f32; 3]; 3] =
    [[3.241_003_3, -1.537_399, -0.498_615_86], [-0.969_224_3, 1.875_93, 0.041_554_24], [0.055_639_42, -0.204_011_2, 1.057_149]];

fn times(m: &[[f32; 3]; 3], v: [f32; 3]) -> [f32; 3] {
    m.map(|row| row[0] * v[0] + row[1] * v[1] + row[2] * v[2])
}

/// XYZ of RGB white: what colours are seen relative to.
fn white() -> [f32; 3] {
    times(&TO_XYZ, [1.0; 3])
}

fn relative_to_white(rgb: Tristimulus) -> [f32; 3] {
    let (xyz, white) = (times(&TO_XYZ, rgb.0), white());
    std::array::from_fn(|c| xyz[c] / white[c])
}

/// Linear RGB to YCxCz.
pub(super) fn opponent(rgb: Tristimulus) -> Tristimulus {
    let [x, y, z] = relative_to_white(rgb);
    Tristimulus([116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)])
}

/// The achromatic value Y of YCxCz as a grey in [0, 1].
pub(super) fn grey(y: f32) -> f32 {
    (y + 16.0) / 116.0
}

/// YCxCz to CIELAB with Hunt's adjustment: colours look paler where they are darker. Colours that no monitor shows are clamped first.
pub(super) fn hunt_lab(opponent: Tristimulus) -> Tristimulus {
    let [y, cx, cz] = opponent.0;
    let (white, grey) = (white(), grey(y));
    let xyz = [(grey + cx / 500.0) * white[0], grey * white[1], (grey - cz / 200.0) * white[2]];
    hunt(lab(Tristimulus(times(&FROM_XYZ, xyz).map(|v| v.clamp(0.0, 1.0)))))
}

fn lab(rgb: Tristimulus) -> [f32; 3] {
    const DELTA: f32 = 6.0 / 29.0;
    let [x, y, z] =
        relative_to_white(rgb).map(|t| if t > DELTA * DELTA * DELTA { libm::cbrtf(t) } else { t / (3.0 * DELTA * DELTA) + 4.0 / 29.0 });
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

fn hunt([l, a, b]: [f32; 3]) -> Tristimulus {
    Tristimulus([l, 0.01 * l * a, 0.01 * l * b])
}

/// Distance of two colours: city block in lightness, Euclidean in hue and chroma; made for large differences.
///
/// # Source
/// Abasi, Tehran and Fairchild, "Distance metrics for very large color differences", Color Research and Application 45(2), 2020.
pub(super) fn hyab(p: Tristimulus, q: Tristimulus) -> f32 {
    let [l, a, b]: [f32; 3] = std::array::from_fn(|c| p.0[c] - q.0[c]);
    l.abs() + (a * a + b * b).sqrt()
}

/// The largest distance there is, that between green and blue, to the given exponent.
pub(super) fn largest_difference(exponent: f32) -> f32 {
    let primary = |rgb| hunt(lab(Tristimulus(rgb)));
    libm::powf(hyab(primary([0.0, 1.0, 0.0]), primary([0.0, 0.0, 1.0])), exponent)
}
