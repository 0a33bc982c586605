//! The options that `render`, `submit` and `plan` share: what to ask of the renderer.

use clap::builder::{PossibleValuesParser, TypedValueParser};
use gradfarm_core::lattice::Extent;
use gradfarm_core::plan::{ReconstructionKind, Request, ShiftKind, Stop, Technique};
use gradfarm_core::scene::SceneDescription;
use gradfarm_core::scene::limits::{LINKS, PATH_EDGES, REUSE_EDGE, ROUNDS};
use gradfarm_proto::limits;

use super::time::TimeOptions;
use crate::request;
use crate::service::Frames;

/// What to ask of the renderer. Everything left out is chosen from the scene.
#[derive(Clone, Debug, clap::Args)]
#[command(next_help_heading = "Rendering")]
pub(super) struct RenderOptions {
    /// How light is followed: pt is path tracing, gpt the same with gradients, reuse shares paths in groups of pixels, graph measures differences to
    /// similar pixels nearby
    #[arg(long, default_value = request::AUTO, value_name = "NAME", value_parser = technique())]
    technique: Choice<Technique>,
    /// How the image is made: none takes the primal as it is, l2 and l1 solve a screened Poisson problem (l2 is unbiased, l1 robust), graph
    /// does for technique graph what l2 does for gpt
    #[arg(long, default_value = request::AUTO, value_name = "NAME", value_parser = reconstruction())]
    reconstruction: Choice<ReconstructionKind>,
    /// Samples per pixel; the most of them with --error or --seconds [default: 64, with those 65536]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=i64::from(limits::SAMPLES)))]
    samples: Option<u32>,
    /// Size of the image in pixels, such as 640x480 [default: the scene's]
    #[arg(long, value_name = "WxH", value_parser = request::size)]
    size: Option<Extent>,
    /// Seed of all randomness: the same seed gives the same bits
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,
    /// Weight of the primal against the gradients in the reconstruction, above 0 [default: what the measured noise calls for]
    #[arg(long, value_name = "A", value_parser = alpha)]
    alpha: Option<f32>,
    /// Set negative values of the finished image to zero; this biases it
    #[arg(long)]
    clamp: bool,
    /// Longest path in edges: 1 shows emitters only, 2 adds one bounce [default: the scene's]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=i64::from(PATH_EDGES)))]
    max_depth: Option<u32>,
    /// How paths are shifted to neighbouring pixels
    #[arg(long, default_value = request::AUTO, value_name = "NAME", value_parser = shift())]
    shift: Choice<ShiftKind>,
    /// Least probability with which Russian roulette lets a shift happen, above 0; 1 shifts always [default: 1]
    #[arg(long, value_name = "Q", value_parser = survival)]
    shift_survival: Option<f32>,
    /// Edge of the groups of pixels that reuse one another's paths, for technique reuse [default: 6]
    #[arg(long, value_name = "PIXELS", value_parser = clap::value_parser!(u32).range(1..=i64::from(REUSE_EDGE)))]
    reuse_edge: Option<u32>,
    /// Most links of a pixel to similar ones, for technique graph [default: 4]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=i64::from(LINKS)))]
    links: Option<u32>,
    /// Rounds in which samples are placed where the noise is; 1 places them evenly [default: 1]. With --error, --seconds or --curve rounds
    /// double, from 64 samples on, and this is the most of them
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=i64::from(ROUNDS)))]
    rounds: Option<u32>,
    /// Stop each frame when its estimated relMSE is this or less, and the estimate is trusted
    #[arg(long, value_name = "RELMSE", value_parser = error)]
    error: Option<f64>,
    /// Stop each frame so that its image is there after this many seconds, with reconstruction; files come on top
    #[arg(long, value_name = "S", value_parser = seconds)]
    seconds: Option<f64>,
    /// Measure the error on the way even if nothing depends on it
    #[arg(long)]
    curve: bool,
    #[command(flatten)]
    time: TimeOptions,
}

impl RenderOptions {
    /// The request that these options make.
    pub(super) fn request(&self) -> Request {
        let request = Request {
            technique: self.technique.0,
            reconstruction: self.reconstruction.0,
            samples: self.samples,
            extent: self.size,
            seed: self.seed,
            alpha: self.alpha,
            clamp: self.clamp,
            max_depth: self.max_depth,
            shift: self.shift.0,
            shift_survival: self.shift_survival,
            reuse_edge: self.reuse_edge,
            links: self.links,
            rounds: self.rounds,
            stop: Stop { error: self.error, seconds: self.seconds, curve: self.curve },
            ..Request::default()
        };
        self.time.ask(request)
    }

    /// The frames to render of a scene.
    pub(super) fn frames(&self, scene: &SceneDescription) -> Frames {
        self.time.frames(scene, &self.request())
    }

    /// The request with the number of frames that a scene is rendered in.
    pub(super) fn request_for(&self, scene: &SceneDescription) -> Request {
        Request { frames: self.frames(scene).count, ..self.request() }
    }
}

/// A name, or `None` for `auto`. (clap gives a plain `Option` another meaning.)
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Choice<T>(Option<T>);

fn technique() -> impl TypedValueParser<Value = Choice<Technique>> {
    PossibleValuesParser::new(request::technique_names()).try_map(|name| request::technique(&name).map(Choice))
}

fn reconstruction() -> impl TypedValueParser<Value = Choice<ReconstructionKind>> {
    PossibleValuesParser::new(request::reconstruction_names()).try_map(|name| request::reconstruction(&name).map(Choice))
}

fn shift() -> impl TypedValueParser<Value = Choice<ShiftKind>> {
    PossibleValuesParser::new(request::shift_names()).try_map(|name| request::shift(&name).map(Choice))
}

fn survival(text: &str) -> Result<f32, String> {
    request::check_survival(text.parse().unwrap_or(f32::NAN))
}

fn error(text: &str) -> Result<f64, String> {
    request::check_error(text.parse().unwrap_or(f64::NAN))
}

fn seconds(text: &str) -> Result<f64, String> {
    request::check_seconds(text.parse().unwrap_or(f64::NAN))
}

fn alpha(text: &str) -> Result<f32, String> {
    request::check_alpha(text.parse().unwrap_or(f32::NAN))
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;

    #[derive(Parser)]
    struct Line {
        #[command(flatten)]
        options: RenderOptions,
    }

    fn parse(words: &[&str]) -> Result<Request, String> {
        let words = std::iter::once("gradfarm").chain(words.iter().copied());
        Line::try_parse_from(words).map(|line| line.options.request()).map_err(|fault| fault.to_string())
    }

    #[test]
    fn nothing_asked_is_nothing_decided() {
        assert_eq!(parse(&[]).unwrap(), Request::default());
        assert_eq!(parse(&["--technique", "auto", "--reconstruction", "auto"]).unwrap(), Request::default());
    }

    #[test]
    fn what_is_asked_arrives() {
        let words = ["--technique=gpt", "--reconstruction=l1", "--samples=7", "--size=3x4", "--seed=9", "--alpha=0.5", "--max-depth=2"];
        let more = [
            "--shift=hybrid",
            "--shift-survival=0.1",
            "--reuse-edge=5",
            "--links=4",
            "--rounds=3",
            "--error=1e-3",
            "--seconds=2.5",
            "--curve",
            "--clamp",
        ];
        let expected = Request {
            technique: Some(Technique::Gpt),
            reconstruction: Some(ReconstructionKind::L1),
            samples: Some(7),
            extent: Some(Extent { width: 3, height: 4 }),
            seed: 9,
            alpha: Some(0.5),
            clamp: true,
            max_depth: Some(2),
            shift: Some(ShiftKind::Hybrid),
            shift_survival: Some(0.1),
            reuse_edge: Some(5),
            links: Some(4),
            rounds: Some(3),
            stop: Stop { error: Some(1e-3), seconds: Some(2.5), curve: true },
            ..Request::default()
        };
        assert_eq!(parse(&[&words[..], &more].concat()).unwrap(), expected);
    }

    #[test]
    fn nonsense_is_refused_with_what_was_expected() {
        for (word, expected) in [
            ("--technique=magic", "auto, pt, gpt"),
            ("--reconstruction=l3", "auto, none, l2, weighted-l2, l1"),
            ("--size=640", "such as 640x480"),
            ("--alpha=much", "above 0"),
            ("--shift=magic", "auto, hybrid"),
            ("--shift-survival=1.5", "at most 1"),
            ("--links=0", "1.."),
            ("--error=0", "above 0"),
            ("--seconds=soon", "above 0"),
            ("--samples=0", "1.."),
            ("--max-depth=0", "1.."),
        ] {
            let fault = parse(&[word]).unwrap_err();
            assert!(fault.contains(expected), "{word}: {fault}");
        }
    }
}
