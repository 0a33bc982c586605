//! Colours: drawn for light ground, exchanged by a style sheet inside the picture where the reader prefers dark.

use plotters::style::RGBColor;

/// The ground.
pub(super) const PAPER: RGBColor = RGBColor(0xFD, 0xFD, 0xFC);
/// Text and axes.
pub(super) const INK: RGBColor = RGBColor(0x22, 0x28, 0x31);
/// Fine lines.
pub(super) const RULE: RGBColor = RGBColor(0xDA, 0xDD, 0xE1);
/// Levels.
pub(super) const LEVEL: RGBColor = RGBColor(0xB4, 0x2B, 0x2B);

/// Colours of curves, apart for the colour-blind too (Okabe and Ito's, darkened where they are too pale on white).
const CURVES: [RGBColor; 8] = [
    RGBColor(0x00, 0x62, 0xA8),
    RGBColor(0xC7, 0x54, 0x00),
    RGBColor(0x00, 0x80, 0x61),
    RGBColor(0xA8, 0x4B, 0x86),
    RGBColor(0xA0, 0x7A, 0x00),
    RGBColor(0x2B, 0x8F, 0xC7),
    RGBColor(0x6B, 0x6B, 0x6B),
    RGBColor(0x5A, 0x3F, 0xB0),
];

/// What stands for each colour on dark ground.
const DARK: [(RGBColor, RGBColor); 12] = [
    (PAPER, RGBColor(0x14, 0x18, 0x1D)),
    (INK, RGBColor(0xE4, 0xE7, 0xEB)),
    (RULE, RGBColor(0x33, 0x3A, 0x43)),
    (LEVEL, RGBColor(0xFF, 0x7B, 0x72)),
    (CURVES[0], RGBColor(0x5A, 0xB4, 0xF0)),
    (CURVES[1], RGBColor(0xFF, 0x95, 0x47)),
    (CURVES[2], RGBColor(0x35, 0xC9, 0xA0)),
    (CURVES[3], RGBColor(0xE0, 0x8C, 0xC4)),
    (CURVES[4], RGBColor(0xE8, 0xC2, 0x4A)),
    (CURVES[5], RGBColor(0x8A, 0xD0, 0xF5)),
    (CURVES[6], RGBColor(0xB0, 0xB0, 0xB0)),
    (CURVES[7], RGBColor(0xB3, 0xA0, 0xFF)),
];

/// The colour of a curve by its place.
pub(super) fn curve(place: usize) -> RGBColor {
    CURVES[place % CURVES.len()]
}

/// The style sheet; its rules reach only what is inside elements of class `gradfarm-plot`.
pub(super) fn style() -> String {
    let hex = |colour: RGBColor| format!("#{:02X}{:02X}{:02X}", colour.0, colour.1, colour.2);
    let rule = |(light, dark): &(RGBColor, RGBColor)| {
        let (light, dark) = (hex(*light), hex(*dark));
        format!(".gradfarm-plot [fill=\"{light}\"]{{fill:{dark}}}.gradfarm-plot [stroke=\"{light}\"]{{stroke:{dark}}}")
    };
    let rules: String = DARK.iter().map(rule).collect();
    format!("<style>@media (prefers-color-scheme: dark){{{rules}}}</style>")
}
