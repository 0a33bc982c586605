//! `gradfarm view`: an image in the terminal, two pixels a character.

use std::fmt::Write;
use std::path::PathBuf;

use gradfarm_core::film::Image;
use gradfarm_core::lattice::Extent;
use gradfarm_core::output::{exr, png};

use super::error::Error;
use super::terminal;

/// Arguments of `gradfarm view`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  gradfarm view cornell.exr
  gradfarm view cornell.exr --exposure 2 --width 60
  gradfarm view cornell.exr --layer dx --exposure 3
  gradfarm view frame.png --colour none > preview.txt")]
pub(super) struct View {
    /// The image: EXR, or PNG as this program writes it
    #[arg(value_name = "IMAGE")]
    image: PathBuf,
    /// Layer of an EXR file [default: the image itself]; signed layers, such as dx, are shown around middle grey
    #[arg(long, value_name = "NAME", default_value = "")]
    layer: String,
    /// Brighter by so many stops; negative is darker
    #[arg(long, value_name = "STOPS", default_value_t = 0.0, allow_negative_numbers = true, value_parser = stops)]
    exposure: f32,
    /// Characters across [default: the terminal's, at most 120]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(2..=1000))]
    width: Option<u16>,
    /// How to colour [default: what the terminal says it can]
    #[arg(long, value_name = "HOW")]
    colour: Option<Colour>,
}

/// What a terminal can show.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Colour {
    /// 24 bits a pixel
    True,
    /// The palette of 256
    #[value(name = "256")]
    Palette,
    /// Characters of different weight
    None,
}

/// Characters across where nobody says how many there is room for.
const USUAL: u16 = 80;
/// Most characters across unless more are asked for.
const MOST: u16 = 120;
/// From empty to full.
const RAMP: &[u8] = b" .:-=+*#%@";

fn stops(text: &str) -> Result<f32, String> {
    text.parse().ok().filter(|stops: &f32| stops.abs() <= 64.0).ok_or_else(|| "expected a number of stops, −64 to 64".to_owned())
}

impl View {
    /// Reads the image and prints it.
    pub(super) fn run(&self) -> Result<(), Error> {
        let unreadable = |fault: &dyn std::fmt::Display| Error::Usage(format!("{}: {fault}", self.image.display()));
        let bytes = std::fs::read(&self.image).map_err(|fault| unreadable(&fault))?;
        let colour = self.colour.unwrap_or_else(|| Colour::of(&Terminal::here()));
        let across = u32::from(self.width.unwrap_or_else(|| Terminal::here().width.unwrap_or(USUAL).min(MOST)));
        let small = if bytes.starts_with(b"\x89PNG") {
            let (extent, pixels) = png::decode(&bytes).map_err(|fault| unreadable(&fault))?;
            let linear = |k: usize, c: usize| png::linear(pixels[3 * k + c]);
            Small::of(extent, across, |k, c| linear(k, c) * self.gain())
        } else {
            let image = exr::read_layer(&bytes, &self.layer).map_err(|fault| match exr::layers(&bytes) {
                Ok(layers) if !layers.contains(&self.layer) => unreadable(&format!("no layer {:?}; there are {layers:?}", self.layer)),
                _ => unreadable(&fault),
            })?;
            // Differences have signs: middle grey is their 0. An image has at most noise below it.
            let zero = if !self.layer.is_empty() && is_signed(&image) { 0.5 } else { 0.0 };
            let plane = |c: usize| image.plane(if image.channels() == 3 { c } else { 0 });
            Small::of(image.extent(), across, |k, c| zero + plane(c)[k] * self.gain())
        };
        terminal::line(small.print(colour))
    }

    fn gain(&self) -> f32 {
        self.exposure.exp2()
    }
}

fn is_signed(image: &Image) -> bool {
    (0..image.channels()).any(|c| image.plane(c).iter().any(|value| *value < 0.0))
}

/// What is known of the terminal.
struct Terminal {
    width: Option<u16>,
    is_one: bool,
    kind: String,
    deep: bool,
}

impl Terminal {
    fn here() -> Self {
        let variable = |name| std::env::var(name).unwrap_or_default();
        let out = console::Term::stdout();
        Self {
            width: out.size_checked().map(|(_, columns)| columns).filter(|columns| *columns > 1),
            is_one: out.is_term() && variable("NO_COLOR").is_empty(),
            kind: variable("TERM"),
            deep: ["truecolor", "24bit"].contains(&variable("COLORTERM").as_str()),
        }
    }
}

impl Colour {
    fn of(terminal: &Terminal) -> Self {
        match terminal {
            Terminal { is_one: true, deep: true, .. } => Self::True,
            Terminal { is_one: true, kind, .. } if kind.contains("256") => Self::Palette,
            _ => Self::None,
        }
    }
}

/// An image as small as it is shown, linear.
struct Small {
    extent: Extent,
    pixels: Vec<[f32; 3]>,
}

impl Small {
    /// Averages an image down to `across` columns, and rows of the same shape: two of them make a line. It is never made larger.
    fn of(extent: Extent, across: u32, value: impl Fn(usize, usize) -> f32) -> Self {
        let width = across.min(extent.width).max(1);
        let height = (u64::from(extent.height) * u64::from(width)).div_ceil(u64::from(extent.width.max(1))).max(1) as u32;
        let span = |k: u32, small: u32, large: u32| {
            let at = |k: u32| (u64::from(k) * u64::from(large) / u64::from(small)) as u32;
            at(k)..at(k + 1).max(at(k) + 1).min(large)
        };
        let pixel = |x: u32, y: u32| {
            let (mut sum, mut count) = ([0.0f32; 3], 0.0);
            for row in span(y, height, extent.height) {
                for column in span(x, width, extent.width) {
                    let k = row as usize * extent.width as usize + column as usize;
                    // One pixel that is not finite shall not hide its neighbours.
                    let own: [f32; 3] = std::array::from_fn(|c| value(k, c)).map(|value| if value.is_finite() { value } else { 0.0 });
                    sum = std::array::from_fn(|c| sum[c] + own[c]);
                    count += 1.0;
                }
            }
            sum.map(|sum| sum / f32::max(count, 1.0))
        };
        let pixels = (0..height).flat_map(|y| (0..width).map(move |x| (x, y))).map(|(x, y)| pixel(x, y)).collect();
        Self { extent: Extent { width, height }, pixels }
    }

    fn at(&self, x: u32, y: u32) -> Option<[u8; 3]> {
        let pixel = (y < self.extent.height).then(|| self.pixels[(y * self.extent.width + x) as usize])?;
        Some(pixel.map(|linear| (png::srgb(linear.clamp(0.0, 1.0)) * 255.0 + 0.5) as u8))
    }

    /// Lines of characters, without an end of line after the last.
    fn print(&self, colour: Colour) -> String {
        let mut text = String::new();
        for y in (0..self.extent.height).step_by(2) {
            if y > 0 {
                text.push('\n');
            }
            for x in 0..self.extent.width {
                let (upper, lower) = (self.at(x, y).unwrap_or_default(), self.at(x, y + 1));
                // Writing into a string does not fail.
                let _ = match (colour, lower) {
                    (Colour::True, Some(lower)) => write!(text, "\x1b[38;2;{};48;2;{}m▀", triple(upper), triple(lower)),
                    (Colour::True, None) => write!(text, "\x1b[38;2;{}m▀", triple(upper)),
                    (Colour::Palette, Some(lower)) => write!(text, "\x1b[38;5;{};48;5;{}m▀", palette(upper), palette(lower)),
                    (Colour::Palette, None) => write!(text, "\x1b[38;5;{}m▀", palette(upper)),
                    (Colour::None, lower) => write!(text, "{}", weight(upper, lower.unwrap_or(upper))),
                };
            }
            if colour != Colour::None {
                text.push_str("\x1b[0m");
            }
        }
        text
    }
}

fn triple([red, green, blue]: [u8; 3]) -> String {
    format!("{red};{green};{blue}")
}

/// The nearest colour of the 6 × 6 × 6 cube, or of the ramp of greys for what has no hue.
fn palette(colour: [u8; 3]) -> u8 {
    let [red, green, blue] = colour;
    if red.abs_diff(green).max(green.abs_diff(blue)).max(red.abs_diff(blue)) < 8 {
        return match red {
            0..=3 => 16,
            247.. => 231,
            _ => 232 + ((u16::from(red) - 3) * 23 / 243) as u8,
        };
    }
    // The cube's steps are 0, 95, 135, 175, 215, 255.
    let step = |value: u8| if value < 48 { 0 } else { ((u16::from(value).saturating_sub(35)) / 40).min(5) as u8 };
    16 + 36 * step(red) + 6 * step(green) + step(blue)
}

/// A character as bright as two pixels, where light is written on dark.
fn weight(upper: [u8; 3], lower: [u8; 3]) -> char {
    let sum: u32 = upper.iter().chain(&lower).map(|value| u32::from(*value)).sum();
    let last = RAMP.len() as u32 - 1;
    char::from(RAMP[((sum * last + 3 * 255) / (6 * 255)).min(last) as usize])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn images_are_averaged_and_keep_their_shape() {
        let extent = Extent { width: 200, height: 100 };
        let small = Small::of(extent, 50, |k, _| if k % 200 < 100 { 0.0 } else { 1.0 });
        assert_eq!((small.extent.width, small.extent.height), (50, 25));
        let text = small.print(Colour::None);
        assert_eq!(text.lines().count(), 13);
        assert!(text.lines().all(|line| line == format!("{}{}", " ".repeat(25), "@".repeat(25))), "{text}");
        let tiny = Small::of(Extent { width: 3, height: 2 }, 80, |_, c| [1.0, 0.0, f32::NAN][c]);
        assert_eq!(tiny.print(Colour::True), format!("{}\x1b[0m", "\x1b[38;2;255;0;0;48;2;255;0;0m▀".repeat(3)));
        let tall = Small::of(Extent { width: 1, height: 5000 }, 80, |_, _| 0.5);
        assert_eq!(tall.print(Colour::Palette).lines().count(), 2500);
    }

    #[test]
    fn palettes_have_what_is_near() {
        assert_eq!([palette([0, 0, 0]), palette([255, 255, 255]), palette([255, 0, 0])], [16, 231, 196]);
        assert_eq!(palette([128, 128, 128]), 243);
        let terminal = |is_one, kind: &str, deep| Terminal { width: None, is_one, kind: kind.into(), deep };
        assert_eq!(Colour::of(&terminal(true, "xterm-256color", true)), Colour::True);
        assert_eq!(Colour::of(&terminal(true, "xterm-256color", false)), Colour::Palette);
        assert_eq!(Colour::of(&terminal(false, "xterm-256color", true)), Colour::None);
    }
}
