//! The directives of a pbrt file.

use glam::{DMat4, DVec3};

use super::Importer;
use super::parameters::Parameters;
use super::spectrum::Space;
use super::state;
use super::token::{Kind, Spot, Token, Tokens};
use crate::scene::description::{Geometry, Instance, Integrator, Operation, Shape, Transform};
use crate::scene::error::{Error, ErrorKind};
use crate::scene::limits;

impl Importer<'_> {
    /// Reads one directive, whose first word was taken.
    pub(super) fn directive(&mut self, tokens: &mut Tokens<'_>, token: &Token<'_>, depth: usize) -> Result<(), Error> {
        let Kind::Word(word) = token.kind else {
            return Err(tokens.fault(token.spot, token.kind.shown(), "a directive"));
        };
        let spot = token.spot;
        match word {
            "Identity" => self.state.set(DMat4::IDENTITY),
            "Translate" => {
                let by = numbers::<3>(tokens, spot, word)?;
                self.concat(Some(DMat4::from_translation(by.into())), tokens, spot, word)?;
            }
            "Scale" => {
                let by = numbers::<3>(tokens, spot, word)?;
                self.concat(Some(DMat4::from_scale(DVec3::from(by))), tokens, spot, word)?;
            }
            "Rotate" => {
                let turn = numbers::<4>(tokens, spot, word)?;
                self.concat(state::rotation(turn), tokens, spot, word)?;
            }
            "LookAt" => {
                let look = numbers::<9>(tokens, spot, word)?;
                self.concat(state::look_at(look), tokens, spot, word)?;
            }
            "Transform" | "ConcatTransform" => {
                let matrix = matrix(tokens, spot, word)?;
                if word == "Transform" {
                    self.state.set(DMat4::IDENTITY);
                }
                self.concat(Some(matrix), tokens, spot, word)?;
            }
            "CoordinateSystem" => {
                let name = text(tokens, spot, word)?;
                self.state.keep_system(&name, self.state.ctm);
            }
            "CoordSysTransform" => {
                let name = text(tokens, spot, word)?;
                match self.state.system(&name) {
                    Some(matrix) => self.state.set(matrix),
                    None => self.say(tokens, spot, word, &format!("{name:?}, which no CoordinateSystem names, changes nothing")),
                }
            }
            "ActiveTransform" => self.active_transform(tokens, spot)?,
            "TransformTimes" => {
                numbers::<2>(tokens, spot, word)?;
                self.say(tokens, spot, word, "left out, the scene stands as at its start");
            }
            "ReverseOrientation" => self.state.reverse = !self.state.reverse,
            "AttributeBegin" | "TransformBegin" => {
                if !self.state.begin() {
                    let expected = format!("at most {} blocks in each other", state::BLOCKS);
                    return Err(
                        Error::new(ErrorKind::TooLarge, tokens.file, word, "blocks nested deeper", expected).at(spot.line, spot.column)
                    );
                }
            }
            "AttributeEnd" => self.end(tokens, spot, word)?,
            "TransformEnd" => {
                let now = self.state.clone_attributes();
                self.end(tokens, spot, word)?;
                self.state.keep_but_transform(now);
            }
            "WorldBegin" => {
                self.state.begin_world();
            }
            "WorldEnd" => {}
            "ColorSpace" => {
                let name = text(tokens, spot, word)?;
                match Space::of(&name) {
                    Some(space) => self.state.space = space,
                    None => return Err(tokens.fault(spot, format!("the colour space {name:?}"), "srgb, rec2020, dci-p3 or aces2065-1")),
                }
            }
            "MediumInterface" => {
                let inside = text(tokens, spot, word)?;
                let outside = match tokens.peek()?.map(|token| &token.kind) {
                    Some(Kind::Text(_)) => text(tokens, spot, word)?,
                    _ => inside.clone(),
                };
                let at = Parameters { title: word.to_string(), spot, file: tokens.file.to_string(), ..Parameters::default() };
                self.state.inside = self.medium_named(&inside, &at)?;
                self.state.outside = self.medium_named(&outside, &at)?;
            }
            "Include" | "Import" => {
                let name = text(tokens, spot, word)?;
                let at = Parameters { title: format!("{word} {name:?}"), spot, file: tokens.file.to_string(), ..Parameters::default() };
                self.include(&name, &at, depth)?;
            }
            "Option" => {
                let parameters = Parameters::read(tokens, word.to_string(), spot)?;
                self.note(&parameters, "left aside: it says how pbrt works");
            }
            "ObjectBegin" => {
                let name = text(tokens, spot, word)?;
                self.object_begin(name, tokens, spot)?;
            }
            "ObjectEnd" => self.object_end(tokens, spot)?,
            "ObjectInstance" => {
                let name = text(tokens, spot, word)?;
                self.object_instance(&name, tokens, spot)?;
            }
            "NamedMaterial" => {
                let name = text(tokens, spot, word)?;
                let material = self.named_materials.get(&name).cloned();
                let known: Vec<&str> = self.named_materials.keys().map(String::as_str).take(12).collect();
                let unknown = || {
                    let expected = format!("a material named above: {}", known.join(", "));
                    Error::new(ErrorKind::UnknownName, tokens.file, word, format!("{name:?}"), expected).at(spot.line, spot.column)
                };
                self.state.material = Some(material.ok_or_else(unknown)?);
            }
            "NamedMedium" => {
                let name = text(tokens, spot, word)?;
                return Err(tokens.fault(spot, format!("NamedMedium {name:?}"), "MediumInterface"));
            }
            "Texture" => self.texture_directive(tokens, spot)?,
            "Sampler" | "Accelerator" | "Integrator" | "PixelFilter" | "Film" | "Camera" | "Material" | "MakeNamedMaterial"
            | "MakeNamedMedium" | "LightSource" | "AreaLightSource" | "Shape" | "Attribute" => {
                let kind = text(tokens, spot, word)?;
                let parameters = Parameters::read(tokens, format!("{word} {kind:?}"), spot)?;
                self.described_directive(word, kind, parameters)?;
            }
            _ => return Err(tokens.fault(spot, token.kind.shown(), "a directive of pbrt-v4")),
        }
        Ok(())
    }

    /// A directive of the form `Word "kind" parameters`.
    fn described_directive(&mut self, word: &str, kind: String, parameters: Parameters) -> Result<(), Error> {
        match word {
            "Sampler" => self.note(&parameters, "left aside: samples are chosen for each job"),
            "Accelerator" => self.note(&parameters, "left aside: there is one for all scenes"),
            "Integrator" => self.integrator(&kind, &parameters)?,
            "PixelFilter" => self.filter(&kind, &parameters)?,
            "Film" => self.film(&kind, &parameters)?,
            "Camera" => {
                let world_to_camera = self.state.ctm;
                self.state.keep_system("camera", world_to_camera.inverse());
                self.camera_medium = self.state.outside.clone();
                self.pending_camera = Some((parameters, kind, world_to_camera));
                // Its notes may wait, but light is scaled by its exposure as it is read.
                self.expose()?;
            }
            "Material" => {
                let name = self.material(&kind, &parameters, &kind)?;
                self.state.material = Some(name);
            }
            "MakeNamedMaterial" => {
                let of = parameters.text("type")?.map(str::to_string);
                let of = of.ok_or_else(|| parameters.fault_here(ErrorKind::Malformed, "no type", "\"string type\""))?;
                let name = self.material(&of, &parameters, &kind)?;
                self.named_materials.insert(kind, name);
            }
            "MakeNamedMedium" => self.make_medium(&kind, &parameters)?,
            "LightSource" => self.light_source(&kind, &parameters)?,
            "AreaLightSource" => self.area_light(&kind, &parameters)?,
            "Shape" => self.shape(&kind, &parameters)?,
            _ => self.note(&parameters, "left out: defaults for parameters that follow"),
        }
        Ok(())
    }

    fn integrator(&mut self, kind: &str, parameters: &Parameters) -> Result<(), Error> {
        if !["path", "volpath"].contains(&kind) {
            self.note(parameters, "not here: path tracing measures the same picture");
        }
        if let Some(depth) = parameters.index("maxdepth")? {
            let edges = depth.saturating_add(1);
            if edges > limits::PATH_EDGES {
                self.note(parameters, format!("paths are cut at {} edges", limits::PATH_EDGES));
            }
            self.integrator = Integrator { max_depth: edges.min(limits::PATH_EDGES), ..Integrator::default() };
        }
        if parameters.flag("regularize")? == Some(true) {
            self.note(parameters, "regularize is left out: nothing is blurred");
        }
        parameters.pass_over(&["radius", "photonsperiteration", "lightsampler", "mutationsperpixel", "chains", "bootstrapsamples", "seed"]);
        parameters.pass_over(&["largestepprobability", "sigma", "usemis", "samplelights", "samplebsdf", "visualizestrategies"]);
        self.note_unread(parameters);
        Ok(())
    }

    fn concat(&mut self, matrix: Option<DMat4>, tokens: &Tokens<'_>, spot: Spot, word: &str) -> Result<(), Error> {
        let fault =
            || Error::new(ErrorKind::Invalid, tokens.file, word, "a transform that is none", "finite numbers, an axis, a line of sight");
        let matrix = matrix.ok_or_else(|| fault().at(spot.line, spot.column))?;
        self.state.concat(matrix);
        if !self.state.ctm.is_finite() {
            return Err(fault().at(spot.line, spot.column));
        }
        Ok(())
    }

    fn active_transform(&mut self, tokens: &mut Tokens<'_>, spot: Spot) -> Result<(), Error> {
        let Some(token) = tokens.next()? else { return Err(tokens.fault(spot, "the end", "All, StartTime or EndTime")) };
        match token.kind {
            Kind::Word("All" | "StartTime") => self.state.active = true,
            Kind::Word("EndTime") => {
                self.say(tokens, spot, "ActiveTransform", "motion is left out, the scene stands as at its start");
                self.state.active = false;
            }
            kind => return Err(tokens.fault(token.spot, kind.shown(), "All, StartTime or EndTime")),
        }
        Ok(())
    }

    fn end(&mut self, tokens: &Tokens<'_>, spot: Spot, word: &str) -> Result<(), Error> {
        if self.state.end() { Ok(()) } else { Err(tokens.fault(spot, format!("{word} without a beginning"), "AttributeBegin before it")) }
    }

    fn object_begin(&mut self, name: String, tokens: &Tokens<'_>, spot: Spot) -> Result<(), Error> {
        if self.object.is_some() {
            return Err(tokens.fault(spot, "an object inside another", "ObjectEnd before it"));
        }
        self.state.begin();
        self.object = Some((name, Vec::new()));
        Ok(())
    }

    fn object_end(&mut self, tokens: &Tokens<'_>, spot: Spot) -> Result<(), Error> {
        let Some((name, shapes)) = self.object.take() else {
            return Err(tokens.fault(spot, "ObjectEnd without a beginning", "ObjectBegin before it"));
        };
        self.end(tokens, spot, "ObjectEnd")?;
        let group = self.names.groups.fresh(&name, "object");
        self.described.groups.insert(group.clone(), shapes);
        if self.objects.insert(name.clone(), group).is_some() {
            return Err(tokens.fault(spot, format!("the object {name:?} twice"), "each name once"));
        }
        Ok(())
    }

    fn object_instance(&mut self, name: &str, tokens: &Tokens<'_>, spot: Spot) -> Result<(), Error> {
        let at = Parameters { title: format!("ObjectInstance {name:?}"), spot, file: tokens.file.to_string(), ..Parameters::default() };
        let group = self.objects.get(name).cloned();
        let group = group.ok_or_else(|| at.fault_here(ErrorKind::UnknownName, "that name", "an object defined above"))?;
        let geometry = Geometry::Instance(Instance { of: group });
        let to_world = self.placed(&at)?;
        let Some(to_world) = to_world else { return Ok(()) };
        let shape = Shape { to_world, material: None, ..super::shape::bare(geometry) };
        self.put(shape, &at)
    }

    /// The present transform in the description's words; `None`, with a note, where it flattens space.
    pub(super) fn placed(&mut self, at: &Parameters) -> Result<Option<Transform>, Error> {
        let ctm = self.state.ctm;
        if ctm == DMat4::IDENTITY {
            return Ok(Some(Transform::default()));
        }
        if !ctm.row(3).abs_diff_eq(glam::DVec4::W, 1e-9) {
            return Err(at.fault_here(ErrorKind::Unsupported, "a transform that is not affine", "a last row of 0 0 0 1"));
        }
        if ctm.determinant() == 0.0 || !ctm.inverse().is_finite() {
            self.note(at, "left out, its transform makes it flat");
            return Ok(None);
        }
        Ok(Some(Transform(vec![rows(ctm)])))
    }

    fn say(&mut self, tokens: &Tokens<'_>, spot: Spot, word: &str, sentence: &str) {
        let at = Parameters { title: word.to_string(), spot, file: tokens.file.to_string(), ..Parameters::default() };
        self.note(&at, sentence);
    }
}

/// A matrix as an operation of the description.
pub(super) fn rows(matrix: DMat4) -> Operation {
    // Inverting leaves its rounding in the last row, which is 0 0 0 1 of every affine transform.
    let [x, y, z] = [0, 1, 2].map(|row| matrix.row(row).to_array());
    Operation::Matrix([x, y, z, [0.0, 0.0, 0.0, 1.0]])
}

/// The string that follows a directive.
pub(super) fn text(tokens: &mut Tokens<'_>, spot: Spot, word: &str) -> Result<String, Error> {
    match tokens.next()? {
        Some(Token { kind: Kind::Text(text), .. }) => Ok(text.into_owned()),
        Some(token) => Err(tokens.fault(token.spot, token.kind.shown(), format!("a string after {word}"))),
        None => Err(tokens.fault(spot, format!("the end after {word}"), "a string")),
    }
}

/// The `N` numbers that follow a directive.
fn numbers<const N: usize>(tokens: &mut Tokens<'_>, spot: Spot, word: &str) -> Result<[f64; N], Error> {
    let mut numbers = [0.0; N];
    for number in &mut numbers {
        let Some(token) = tokens.next()? else { return Err(tokens.fault(spot, format!("the end after {word}"), format!("{N} numbers"))) };
        let parsed = match token.kind {
            Kind::Word(word) => word.parse::<f64>().ok().filter(|number| number.is_finite()),
            _ => None,
        };
        *number = parsed.ok_or_else(|| tokens.fault(token.spot, token.kind.shown(), format!("{N} finite numbers after {word}")))?;
    }
    Ok(numbers)
}

/// The sixteen numbers of a matrix, by columns, with or without brackets.
fn matrix(tokens: &mut Tokens<'_>, spot: Spot, word: &str) -> Result<DMat4, Error> {
    let bracketed = tokens.peek()?.is_some_and(|token| token.kind == Kind::Open);
    if bracketed {
        tokens.next()?;
    }
    let matrix = DMat4::from_cols_array(&numbers::<16>(tokens, spot, word)?);
    if bracketed {
        match tokens.next()? {
            Some(Token { kind: Kind::Close, .. }) => {}
            Some(token) => return Err(tokens.fault(token.spot, token.kind.shown(), "] after sixteen numbers")),
            None => return Err(tokens.fault(spot, format!("the end after {word}"), "] after sixteen numbers")),
        }
    }
    Ok(matrix)
}
