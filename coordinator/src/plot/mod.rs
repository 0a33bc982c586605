//! Plots as SVG: curves with bands and levels over logarithmic axes, readable on light and on dark ground.
//!
//! `Plot` says what is to be seen, `draw` puts it on paper, `axis` labels powers of ten, `theme` has the colours,
//! `accuracy` is the plot of a frame's error.

mod accuracy;
mod axis;
mod draw;
mod theme;

pub use accuracy::accuracy;

/// A plot over two logarithmic axes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Plot {
    /// What stands above it.
    pub title: String,
    /// What the horizontal axis measures, with its unit.
    pub x: String,
    /// What the vertical axis measures, with its unit.
    pub y: String,
    /// Curves; each gets the next colour unless it shares one.
    pub series: Vec<Series>,
    /// Horizontal lines.
    pub levels: Vec<Level>,
    /// Points with a text beside them.
    pub marks: Vec<Mark>,
}

/// A curve. Points that have no logarithm are left out.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Series {
    /// Its name in the legend; a curve without a name is not listed.
    pub name: String,
    /// (x, y), both > 0.
    pub points: Vec<(f64, f64)>,
    /// (x, low, high) of a band around it; may be empty.
    pub band: Vec<(f64, f64, f64)>,
    /// How it is drawn.
    pub stroke: Stroke,
    /// Which colour of the palette; `None` takes the series' own place.
    pub colour: Option<usize>,
}

/// How a curve is drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Stroke {
    /// A line through dots.
    #[default]
    Line,
    /// Dots alone.
    Dots,
    /// A broken line: what was not measured.
    Dashed,
}

/// A horizontal line.
#[derive(Clone, Debug, PartialEq)]
pub struct Level {
    /// What it stands for.
    pub name: String,
    /// Where, > 0.
    pub y: f64,
}

/// A point with a text.
#[derive(Clone, Debug, PartialEq)]
pub struct Mark {
    /// Where, > 0.
    pub x: f64,
    /// Where, > 0.
    pub y: f64,
    /// What it says.
    pub text: String,
}

/// Why a plot could not be drawn.
#[derive(Debug, thiserror::Error)]
pub enum PlotError {
    /// There is no point with a logarithm on both axes.
    #[error("there is nothing to plot: no point whose values are both above 0")]
    Empty,
    /// The drawing failed.
    #[error("the plot could not be drawn: {0}")]
    Drawing(String),
}

impl Plot {
    /// Width of the picture [pixels].
    pub const WIDTH: u32 = 760;
    /// Height of the picture [pixels].
    pub const HEIGHT: u32 = 460;

    /// The picture: one self-contained SVG element that may also stand inside HTML.
    ///
    /// # Errors
    /// If there is nothing to plot.
    pub fn to_svg(&self) -> Result<String, PlotError> {
        draw::svg(self)
    }
}

/// A number on an axis or a label: plain between a thousandth and ten thousand, else a power of ten.
pub fn number(value: f64) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    let exponent = value.abs().log10().floor();
    if (-3.0..4.0).contains(&exponent) {
        let digits = (2.0 - exponent).clamp(0.0, 5.0) as usize;
        let text = format!("{value:.digits$}");
        return if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text };
    }
    let mantissa = value / 10f64.powf(exponent);
    let power = format!("10{}", superscript(exponent as i32));
    if (mantissa - 1.0).abs() < 5e-3 { power } else { format!("{}·{power}", number((mantissa * 100.0).round() / 100.0)) }
}

fn superscript(exponent: i32) -> String {
    let raised = |digit: char| match digit {
        '-' => '⁻',
        '1' => '¹',
        '2' => '²',
        '3' => '³',
        digit => digit.to_digit(10).and_then(|d| char::from_u32(0x2070 + d)).unwrap_or(digit),
    };
    exponent.to_string().chars().map(raised).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn curve() -> Plot {
        Plot {
            title: "Error <and> cost".into(),
            x: "seconds [s]".into(),
            y: "relMSE [1]".into(),
            series: vec![
                Series {
                    name: "measured".into(),
                    points: vec![(1.0, 0.1), (2.0, 0.05), (40.0, 0.003), (0.0, 1.0), (3.0, f64::NAN)],
                    band: vec![(1.0, 0.05, 0.2), (2.0, 0.04, 0.07), (40.0, 0.002, 0.004)],
                    ..Series::default()
                },
                Series { name: "law".into(), points: vec![(1.0, 0.1), (60.0, 0.002)], stroke: Stroke::Dashed, ..Series::default() },
            ],
            levels: vec![Level { name: "target".into(), y: 0.01 }],
            marks: vec![Mark { x: 12.0, y: 0.01, text: "10⁻²: 12 s".into() }],
        }
    }

    #[test]
    fn a_plot_holds_what_it_was_given() {
        let svg = curve().to_svg().unwrap();
        assert!(svg.starts_with("<svg") && svg.trim_end().ends_with("</svg>"));
        for part in ["Error &lt;and&gt; cost", "seconds [s]", "relMSE [1]", "measured", "law", "target", "10⁻²: 12 s"] {
            assert!(svg.contains(part), "{part} is missing from {svg}");
        }
        assert!(svg.contains("prefers-color-scheme: dark"));
        assert!(svg.contains("<polygon"), "the band");
        assert!(!svg.contains("NaN") && !svg.contains("inf"));
        assert_eq!(svg.matches("<svg").count(), 1);
    }

    #[test]
    fn a_single_point_is_enough_and_none_is_not() {
        let point = Plot { series: vec![Series { points: vec![(3.0, 0.02)], ..Series::default() }], ..Plot::default() };
        assert!(point.to_svg().unwrap().contains("<circle"));
        let nothing = Plot { series: vec![Series { points: vec![(3.0, 0.0), (-1.0, 1.0)], ..Series::default() }], ..Plot::default() };
        assert!(matches!(nothing.to_svg(), Err(PlotError::Empty)));
    }

    #[test]
    fn numbers_are_short() {
        for (value, text) in [
            (0.0, "0"),
            (0.01, "0.01"),
            (12.0, "12"),
            (0.00123, "0.00123"),
            (1234.5, "1234"),
            (1e-4, "10⁻⁴"),
            (2.5e6, "2.5·10⁶"),
            (1.0, "1"),
        ] {
            assert_eq!(number(value), text);
        }
    }
}
