//! Materials, textures and media: domains, names, circles.

use std::collections::BTreeMap;

use super::super::description::{ColourInput, Conductor, Input, Material, Medium, SceneDescription, Texture};
use super::super::error::{Error, ErrorKind};
use super::super::limits;
use super::{Check, one_of};
use crate::scene::description::Colour;

impl Check<'_> {
    /// All textures, media and materials of a scene.
    pub(super) fn surfaces(&self, scene: &SceneDescription) -> Result<(), Error> {
        for (name, texture) in &scene.textures {
            self.texture(&format!("textures.{name}"), texture, scene)?;
        }
        let parts: BTreeMap<&str, Vec<&str>> = scene.textures.iter().map(|(name, texture)| (name.as_str(), texture.parts())).collect();
        self.circles("textures", &parts)?;
        for (name, medium) in &scene.media {
            self.medium(&format!("media.{name}"), medium)?;
        }
        for (name, material) in &scene.materials {
            self.material(&format!("materials.{name}"), material, scene)?;
        }
        let parts: BTreeMap<&str, Vec<&str>> = scene.materials.iter().map(|(name, material)| (name.as_str(), material.parts())).collect();
        self.circles("materials", &parts)
    }

    fn texture(&self, path: &str, texture: &Texture, scene: &SceneDescription) -> Result<(), Error> {
        let finite = |path: &str, uv: &crate::scene::description::UvTransform| {
            let numbers = [uv.scale[0], uv.scale[1], uv.rotate, uv.offset[0], uv.offset[1]];
            if numbers.iter().all(|x| (*x as f32).is_finite()) { Ok(()) } else { self.invalid(path, format!("{uv:?}"), "finite numbers") }
        };
        match texture {
            Texture::Bitmap(bitmap) => {
                self.file_name(&format!("{path}.bitmap.file"), &bitmap.file)?;
                finite(&format!("{path}.bitmap.uv"), &bitmap.uv)?;
                self.colour(&format!("{path}.bitmap.scale"), bitmap.scale, f64::INFINITY)
            }
            Texture::Checkerboard(board) => {
                finite(&format!("{path}.checkerboard.uv"), &board.uv)?;
                self.input(&format!("{path}.checkerboard.color0"), &board.color0, f64::INFINITY, scene)?;
                self.input(&format!("{path}.checkerboard.color1"), &board.color1, f64::INFINITY, scene)
            }
            Texture::VertexColour(colours) => self.colour(&format!("{path}.vertex_colour.scale"), colours.scale, f64::INFINITY),
            Texture::Product(product) => {
                self.input(&format!("{path}.product.first"), &product.first, f64::INFINITY, scene)?;
                self.input(&format!("{path}.product.second"), &product.second, f64::INFINITY, scene)
            }
            Texture::Mix(mix) => {
                self.input(&format!("{path}.mix.first"), &mix.first, f64::INFINITY, scene)?;
                self.input(&format!("{path}.mix.second"), &mix.second, f64::INFINITY, scene)?;
                self.scalar(&format!("{path}.mix.amount"), &mix.amount, [0.0, 1.0], scene)
            }
        }
    }

    /// A coloured input: a constant with channels from 0 to `greatest`, or the name of a texture.
    pub(super) fn input(&self, path: &str, input: &ColourInput, greatest: f64, scene: &SceneDescription) -> Result<(), Error> {
        match input {
            Input::Constant(colour) => self.colour(path, *colour, greatest),
            Input::Texture(name) => self.named(path, name, "texture", &scene.textures),
        }
    }

    fn scalar(&self, path: &str, input: &Input<f64>, [least, greatest]: [f64; 2], scene: &SceneDescription) -> Result<(), Error> {
        match input {
            Input::Constant(number) if (least..=greatest).contains(number) && (*number as f32).is_finite() => Ok(()),
            Input::Constant(number) => self.invalid(path, number, format!("{least} to {greatest}")),
            Input::Texture(name) => self.named(path, name, "texture", &scene.textures),
        }
    }

    /// A name that must be in a map.
    pub(super) fn named<T>(&self, path: &str, name: &str, what: &str, map: &BTreeMap<String, T>) -> Result<(), Error> {
        if map.contains_key(name) {
            return Ok(());
        }
        Err(self.fault(ErrorKind::UnknownName, path, format!("{name:?}"), one_of(what, map.keys())))
    }

    fn material(&self, path: &str, material: &Material, scene: &SceneDescription) -> Result<(), Error> {
        let path = format!("{path}.{}", material.kind());
        for (field, input, greatest) in material.colours() {
            self.input(&format!("{path}.{field}"), input, greatest, scene)?;
        }
        for (field, input, range) in material.scalars() {
            self.scalar(&format!("{path}.{field}"), input, range, scene)?;
        }
        for part in material.parts() {
            self.named(&path, part, "material", &scene.materials)?;
        }
        let index = |field: &str, ior: f64| {
            let fits = ior > 0.0 && (ior as f32).is_finite() && (ior as f32) > 0.0;
            if fits { Ok(()) } else { self.invalid(&format!("{path}.{field}"), ior, "a finite index of refraction > 0") }
        };
        match material {
            Material::Conductor(conductor) => self.conductor(&path, conductor),
            Material::Dielectric(m) => {
                index("interior_ior", m.interior_ior)?;
                index("exterior_ior", m.exterior_ior)?;
                if m.thin && !(m.roughness.is_zero() && m.roughness_v.is_none()) {
                    return self.invalid(&format!("{path}.roughness"), "a rough thin sheet", "0: thin sheets are smooth");
                }
                Ok(())
            }
            Material::Plastic(m) => {
                index("interior_ior", m.interior_ior)?;
                index("exterior_ior", m.exterior_ior)
            }
            Material::Principled(m) if !(m.ior >= 1.0 && (m.ior as f32).is_finite()) => {
                self.invalid(&format!("{path}.ior"), m.ior, "a finite index of refraction ≥ 1")
            }
            Material::BumpMap(m) if m.height.texture().is_none() => self.invalid(&format!("{path}.height"), "a constant", "a texture"),
            Material::NormalMap(m) if m.normals.texture().is_none() => self.invalid(&format!("{path}.normals"), "a constant", "a texture"),
            Material::BumpMap(m) => self.finite(&format!("{path}.scale"), m.scale),
            Material::NormalMap(m) => self.finite(&format!("{path}.scale"), m.scale),
            _ => Ok(()),
        }
    }

    fn finite(&self, path: &str, number: f64) -> Result<(), Error> {
        if (number as f32).is_finite() { Ok(()) } else { self.invalid(path, number, "a finite number") }
    }

    fn conductor(&self, path: &str, conductor: &Conductor) -> Result<(), Error> {
        if conductor.index_of_refraction().is_none() {
            let given = [("metal", conductor.metal.is_some()), ("eta", conductor.eta.is_some()), ("k", conductor.k.is_some())];
            let given: Vec<&str> = given.into_iter().filter_map(|(name, is_given)| is_given.then_some(name)).collect();
            let found = if given.is_empty() { "neither".to_string() } else { format!("only {}", given.join(" and ")) };
            let found = if given.len() > 1 { given.join(" and ") } else { found };
            return self.invalid(path, found, "either `metal`, or `eta` and `k`");
        }
        for (field, colour) in [("eta", conductor.eta), ("k", conductor.k)] {
            self.colour(&format!("{path}.{field}"), colour.unwrap_or(Colour::WHITE), f64::INFINITY)?;
        }
        Ok(())
    }

    fn medium(&self, path: &str, medium: &Medium) -> Result<(), Error> {
        let Medium::Homogeneous(medium) = medium;
        self.colour(&format!("{path}.homogeneous.extinction"), medium.extinction, f64::INFINITY)?;
        self.colour(&format!("{path}.homogeneous.albedo"), medium.albedo, 1.0)?;
        let g = medium.phase.mean_cosine();
        if g > -1.0 && g < 1.0 {
            return Ok(());
        }
        self.invalid(&format!("{path}.homogeneous.phase.henyey_greenstein.g"), g, "a mean cosine in (-1, 1)")
    }

    /// Refuses things that are made of themselves, and towers of things made of things. Every name is known to exist.
    fn circles(&self, what: &str, parts: &BTreeMap<&str, Vec<&str>>) -> Result<(), Error> {
        // Heights settle from the bottom up; what has none after as many rounds as a tower may be high stands in a circle or too high.
        let mut heights: BTreeMap<&str, u32> = BTreeMap::new();
        for _ in 0..=limits::GROUP_DEPTH {
            for (name, inner) in parts {
                let height = inner.iter().try_fold(0, |most, part| heights.get(part).map(|height| most.max(height + 1)));
                if let Some(height) = height {
                    heights.insert(name, height);
                }
            }
        }
        match parts.keys().find(|name| heights.get(*name).is_none_or(|height| *height > limits::GROUP_DEPTH)) {
            None => Ok(()),
            Some(name) => {
                let expected = format!("{what} that are not made of themselves, nested at most {} deep", limits::GROUP_DEPTH);
                self.invalid(&format!("{what}.{name}"), "a circle, or too high a tower", expected)
            }
        }
    }
}
