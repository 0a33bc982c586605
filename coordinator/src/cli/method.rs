//! What `study` compares: a technique with its reconstruction and options, written as one word.

use std::fmt;
use std::str::FromStr;

use gradfarm_core::plan::{ReconstructionKind, Request, Technique};

use crate::request;

/// A way to make an image, such as `gpt+l2` or `gpt+l1:shift=replay:rounds=4`.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Method {
    /// As it was written.
    text: String,
    /// What it asks for; samples, size and seed are the study's.
    asked: Request,
}

impl Method {
    /// Path tracing as it is: what every other method is compared with.
    pub(super) fn path_tracing() -> Self {
        let asked = Request { technique: Some(Technique::Pt), reconstruction: Some(ReconstructionKind::None), ..Request::default() };
        Self { text: Technique::Pt.name().to_owned(), asked }
    }

    /// A technique with its reconstruction, and nothing else.
    pub(super) fn pair(technique: Technique, kind: ReconstructionKind) -> Self {
        let asked = Request { technique: Some(technique), reconstruction: Some(kind), ..Request::default() };
        Self { text: format!("{}+{}", technique.name(), kind.name()), asked }
    }

    /// The request, with the study's own part filled in.
    pub(super) fn request(&self, study: Request) -> Request {
        Request { samples: study.samples, extent: study.extent, seed: study.seed, ..self.asked.clone() }
    }
}

impl fmt::Display for Method {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

impl FromStr for Method {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let mut parts = text.split(':');
        let name = parts.next().unwrap_or_default();
        let (technique, reconstruction) = name.split_once('+').unwrap_or((name, request::AUTO));
        let mut asked = Request {
            technique: Some(request::technique(technique)?.ok_or("a method names its technique, such as gpt+l2")?),
            reconstruction: request::reconstruction(reconstruction)?,
            ..Request::default()
        };
        for part in parts {
            let (key, value) = part.split_once('=').ok_or_else(|| format!("`{part}` should be KEY=VALUE, such as rounds=4"))?;
            let number = |expected: &str| format!("{key} is `{value}`, expected {expected}");
            let count = || value.parse::<u32>().map_err(|_| number("a whole number"));
            let real = || value.parse::<f32>().map_err(|_| number("a number"));
            match key {
                "shift" => asked.shift = request::shift(value)?,
                "survival" => asked.shift_survival = Some(request::check_survival(real()?)?),
                "clamp" => asked.clamp = value.parse().map_err(|_| number("true or false"))?,
                "alpha" => asked.alpha = Some(request::check_alpha(real()?)?),
                "reuse-edge" => asked.reuse_edge = Some(count()?),
                "links" => asked.links = Some(count()?),
                "rounds" => asked.rounds = Some(count()?),
                "max-depth" => asked.max_depth = Some(count()?),
                _ => return Err(format!("`{key}` is none of shift, survival, alpha, clamp, reuse-edge, links, rounds, max-depth")),
            }
        }
        Ok(Self { text: text.to_owned(), asked })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gradfarm_core::plan::ShiftKind;

    #[test]
    fn methods_are_one_word_each() {
        let method: Method = "gpt+l1:shift=hybrid:rounds=4:alpha=0.3".parse().unwrap();
        let asked = method.request(Request { samples: Some(9), seed: 3, ..Request::default() });
        assert_eq!((asked.technique, asked.reconstruction), (Some(Technique::Gpt), Some(ReconstructionKind::L1)));
        assert_eq!((asked.shift, asked.rounds, asked.alpha), (Some(ShiftKind::Hybrid), Some(4), Some(0.3)));
        assert_eq!((asked.samples, asked.seed), (Some(9), 3));
        assert_eq!(method.to_string(), "gpt+l1:shift=hybrid:rounds=4:alpha=0.3");
        assert_eq!("pt".parse::<Method>().unwrap().request(Request::default()).reconstruction, None);
    }

    #[test]
    fn nonsense_is_told() {
        for (text, told) in [
            ("magic", "expected auto or one of pt"),
            ("auto", "names its technique"),
            ("gpt+l9", "expected auto or one of none"),
            ("gpt:rounds", "KEY=VALUE"),
            ("gpt:rounds=x", "a whole number"),
            ("gpt:colour=1", "none of shift"),
            ("gpt:alpha=0", "above 0"),
        ] {
            let fault = text.parse::<Method>().unwrap_err();
            assert!(fault.contains(told), "{text}: {fault}");
        }
    }
}
