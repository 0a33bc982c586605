//! Materials onto those of the description.

use super::Importer;
use super::parameters::Parameters;
use super::texture::held;
use crate::scene::description::{Bitmap, Channels, Encoding, TextureFilter, UvTransform, Wrap};
use crate::scene::description::{
    Blend, BumpMap, Colour, ColourInput, Conductor, Dielectric, Diffuse, Distribution, Input, Mask, Material, Metal, NormalMap, Plastic,
    Principled, ScalarInput, Texture,
};
use crate::scene::error::{Error, ErrorKind};

/// Roughness α below which pbrt takes a surface for smooth.
const SMOOTH: f64 = 1e-3;

impl Importer<'_> {
    /// A material of pbrt's type `kind`. Returns its name in the description.
    pub(super) fn material(&mut self, kind: &str, parameters: &Parameters, name: &str) -> Result<String, Error> {
        let material = match kind {
            "" | "interface" | "none" => Material::Null,
            "diffuse" => Material::Diffuse(self.diffuse(parameters)?),
            "coateddiffuse" => self.coated_diffuse(parameters)?,
            "conductor" => self.conductor(parameters, "")?,
            "coatedconductor" => self.coated_conductor(parameters)?,
            "dielectric" | "thindielectric" => self.dielectric(parameters, kind == "thindielectric")?,
            "diffusetransmission" => self.diffuse_transmission(parameters)?,
            "mix" => self.mix(parameters)?,
            "subsurface" => {
                self.note(parameters, "light does not travel below its surface here: a coated diffuse surface stands for it");
                parameters.pass_over(&["mfp", "name", "sigma_a", "sigma_s", "scale"]);
                self.coated_diffuse(parameters)?
            }
            _ => {
                self.note(parameters, format!("a material of type {kind:?} is not here: a diffuse one stands for it"));
                Material::Diffuse(self.diffuse(parameters)?)
            }
        };
        let relief = self.scalar_input(parameters, "displacement")?;
        let normals = parameters.text("normalmap")?.map(str::to_string);
        self.note_unread(parameters);
        let mut name = self.add(name, material);
        if let Some(height @ Input::Texture(_)) = relief {
            name = self.add(&format!("{name} with bumps"), Material::BumpMap(BumpMap { material: name.clone(), height, scale: 1.0 }));
        }
        if let Some(file) = normals {
            let bitmap = Bitmap {
                file,
                encoding: Encoding::Linear,
                channels: Channels::Rgb,
                filter: TextureFilter::Bilinear,
                wrap: Wrap::Repeat,
                uv: UvTransform::default(),
                scale: Colour::WHITE,
            };
            let texture = self.names.textures.fresh(&format!("{name} normals"), "normals");
            self.described.textures.insert(texture.clone(), Texture::Bitmap(bitmap));
            let map = NormalMap { material: name.clone(), normals: Input::Texture(texture), scale: 1.0 };
            name = self.add(&format!("{name} with normals"), Material::NormalMap(map));
        }
        Ok(name)
    }

    /// Puts a material into the description. Returns its name.
    fn add(&mut self, name: &str, material: Material) -> String {
        let name = self.names.materials.fresh(name, "material");
        self.described.materials.insert(name.clone(), material);
        name
    }

    /// A material with holes, for a shape whose `alpha` is not 1 everywhere.
    pub(super) fn masked(&mut self, material: String, opacity: ScalarInput) -> String {
        let mask = Material::Mask(Mask { material: material.clone(), opacity: held(opacity) });
        if let Some((name, _)) = self.described.materials.iter().find(|(_, known)| **known == mask) {
            return name.clone();
        }
        self.add(&format!("{material} with holes"), mask)
    }

    /// The name of the material of shapes before any directive sets one.
    pub(super) fn default_material(&mut self) -> String {
        let plain = Material::Diffuse(Diffuse { reflectance: ColourInput::grey(0.5), two_sided: true });
        let name = self.add("default", plain);
        self.state.material = Some(name.clone());
        name
    }

    fn diffuse(&mut self, parameters: &Parameters) -> Result<Diffuse, Error> {
        let reflectance = self.colour_input(parameters, "reflectance")?.unwrap_or(ColourInput::grey(0.5));
        Ok(Diffuse { reflectance, two_sided: true })
    }

    fn coated_diffuse(&mut self, parameters: &Parameters) -> Result<Material, Error> {
        let diffuse = self.diffuse(parameters)?.reflectance;
        let (roughness, roughness_v) = self.roughness(parameters, "")?;
        if roughness_v.is_some() {
            self.note(parameters, "its coat is as rough along v as along u");
        }
        self.note(parameters, "a plastic stands for its layers: its coat has no thickness and takes nothing from the light");
        parameters.pass_over(&["thickness", "maxdepth", "nsamples", "g", "albedo"]);
        Ok(Material::Plastic(Plastic {
            diffuse,
            specular: ColourInput::white(),
            interior_ior: self.index(parameters, "eta", 1.5)?,
            exterior_ior: 1.0,
            nonlinear: true,
            roughness,
            distribution: Distribution::Ggx,
            two_sided: true,
        }))
    }

    /// A metal; the parameters of one below a coat start with `prefix`.
    fn conductor(&mut self, parameters: &Parameters, prefix: &str) -> Result<Material, Error> {
        let (roughness, roughness_v) = self.roughness(parameters, prefix)?;
        let (eta, k) = (format!("{prefix}eta"), format!("{prefix}k"));
        let copper = Metal::Cu.index_of_refraction();
        let (eta, k) = match self.colour_input(parameters, "reflectance")? {
            Some(Input::Constant(reflectance)) => (Colour::WHITE, Colour(reflectance.0.map(absorbing))),
            Some(reflectance @ Input::Texture(_)) => {
                self.note(parameters, "its textured reflectance is that of normal incidence, by Schlick's approximation");
                let perceptual = |alpha: ScalarInput| alpha.constant().map_or(0.5, |alpha| alpha.sqrt());
                return Ok(Material::Principled(Principled {
                    base_color: reflectance,
                    metallic: ScalarInput::one(),
                    roughness: Input::Constant(perceptual(roughness)),
                    ..Principled::default()
                }));
            }
            None => (self.index_of_metal(parameters, &eta)?.unwrap_or(copper.0), self.index_of_metal(parameters, &k)?.unwrap_or(copper.1)),
        };
        Ok(Material::Conductor(Conductor {
            metal: None,
            eta: Some(eta),
            k: Some(k),
            roughness,
            roughness_v,
            distribution: Distribution::Ggx,
            energy_conserving: false,
            reflectance: ColourInput::white(),
            two_sided: true,
        }))
    }

    fn coated_conductor(&mut self, parameters: &Parameters) -> Result<Material, Error> {
        self.note(parameters, "a principled metal under a clear coat of index 1.5 stands for its layers");
        let (coat, _) = self.roughness(parameters, "interface.")?;
        let (metal, base_color) = match self.conductor(parameters, "conductor.")? {
            Material::Conductor(metal) => {
                let (eta, k) = metal.index_of_refraction().unwrap_or(Metal::Cu.index_of_refraction());
                let normal = [0, 1, 2].map(|c| {
                    let (below, above, k) = (eta.0[c] - 1.0, eta.0[c] + 1.0, k.0[c]);
                    (below * below + k * k) / (above * above + k * k)
                });
                (metal.roughness, ColourInput::Constant(Colour(normal)))
            }
            Material::Principled(metal) => (metal.roughness, metal.base_color),
            other => return Ok(other),
        };
        parameters.pass_over(&["interface.eta", "thickness", "maxdepth", "nsamples", "g", "albedo"]);
        let perceptual = |alpha: &ScalarInput| Input::Constant(alpha.constant().map_or(0.5, |alpha| alpha.sqrt()));
        Ok(Material::Principled(Principled {
            base_color,
            metallic: ScalarInput::one(),
            roughness: perceptual(&metal),
            clearcoat: ScalarInput::one(),
            clearcoat_roughness: perceptual(&coat),
            ..Principled::default()
        }))
    }

    fn dielectric(&mut self, parameters: &Parameters, thin: bool) -> Result<Material, Error> {
        let (roughness, roughness_v) = if thin { (ScalarInput::zero(), None) } else { self.roughness(parameters, "")? };
        Ok(Material::Dielectric(Dielectric {
            interior_ior: self.index(parameters, "eta", 1.5)?,
            exterior_ior: 1.0,
            thin,
            roughness,
            roughness_v,
            distribution: Distribution::Ggx,
            energy_conserving: false,
            reflectance: ColourInput::white(),
            transmittance: ColourInput::white(),
        }))
    }

    fn diffuse_transmission(&mut self, parameters: &Parameters) -> Result<Material, Error> {
        self.note(parameters, "a rough thin wall stands for it, with the mean of its colours' shares");
        let mean = |input: &ColourInput| input.constant().map_or(0.25, |colour| colour.0.iter().sum::<f64>() / 3.0);
        let scale = parameters.number_or("scale", 1.0)?;
        let reflected = self.colour_input(parameters, "reflectance")?.unwrap_or(ColourInput::grey(0.25));
        let passed = self.colour_input(parameters, "transmittance")?.unwrap_or(ColourInput::grey(0.25));
        let whole = mean(&reflected) + mean(&passed);
        let base_color = match &reflected {
            Input::Constant(reflected) => {
                let passed = passed.constant().copied().unwrap_or(Colour::grey(0.25));
                Input::Constant(Colour([0, 1, 2].map(|k| ((reflected.0[k] + passed.0[k]) * scale).clamp(0.0, 1.0))))
            }
            texture => texture.clone(),
        };
        Ok(Material::Principled(Principled {
            base_color,
            roughness: ScalarInput::one(),
            specular: ScalarInput::zero(),
            transmission: Input::Constant(if whole > 0.0 { (mean(&passed) / whole).clamp(0.0, 1.0) } else { 0.0 }),
            ..Principled::default()
        }))
    }

    fn mix(&mut self, parameters: &Parameters) -> Result<Material, Error> {
        let names = parameters.texts("materials")?.map(<[String]>::to_vec).unwrap_or_default();
        let [first, second] = &names[..] else {
            return Err(parameters.fault_here(
                ErrorKind::Malformed,
                format!("{} materials", names.len()),
                "\"string materials\" of two names",
            ));
        };
        let known = |name: &String| {
            let found = self.named_materials.get(name).cloned();
            found.ok_or_else(|| parameters.fault_here(ErrorKind::UnknownName, format!("the material {name:?}"), "a material named above"))
        };
        let (first, second) = (known(first)?, known(second)?);
        let weight = held(self.scalar_input(parameters, "amount")?.unwrap_or(Input::Constant(0.5)));
        // Holes are no part of other materials here: what passes straight on is a mask around the rest.
        let is_null = |name: &String| self.described.materials.get(name) == Some(&Material::Null);
        match (is_null(&first), is_null(&second), &weight) {
            (true, false, _) => Ok(Material::Mask(Mask { material: second, opacity: weight })),
            (false, true, Input::Constant(weight)) => Ok(Material::Mask(Mask { material: first, opacity: Input::Constant(1.0 - weight) })),
            _ => Ok(Material::Blend(Blend { first, second, weight })),
        }
    }

    /// α along u, and along v where it is another one.
    fn roughness(&mut self, parameters: &Parameters, prefix: &str) -> Result<(ScalarInput, Option<ScalarInput>), Error> {
        let remap = parameters.flag("remaproughness")?.unwrap_or(true);
        let both = self.scalar_input(parameters, &format!("{prefix}roughness"))?;
        let u = self.scalar_input(parameters, &format!("{prefix}uroughness"))?.or(both.clone()).unwrap_or(ScalarInput::zero());
        let v = self.scalar_input(parameters, &format!("{prefix}vroughness"))?.or(both).unwrap_or(ScalarInput::zero());
        let (u, v) = (self.alpha(parameters, u, remap), self.alpha(parameters, v, remap));
        let smooth = |input: &ScalarInput| input.constant().is_some_and(|alpha| *alpha < SMOOTH);
        if smooth(&u) && smooth(&v) {
            return Ok((ScalarInput::zero(), None));
        }
        let other = (u != v).then_some(v);
        Ok((u, other))
    }

    /// α of what the file calls roughness: its square root, unless the file gives α itself.
    fn alpha(&mut self, parameters: &Parameters, roughness: ScalarInput, remap: bool) -> ScalarInput {
        match roughness {
            Input::Constant(roughness) => {
                let roughness = roughness.clamp(0.0, 1.0);
                Input::Constant(if remap { roughness.sqrt() } else { roughness })
            }
            texture => {
                if remap {
                    self.note(parameters, "its textured roughness counts as alpha, without the square root");
                }
                texture
            }
        }
    }
}

/// k of a metal of η = 1 that reflects this much at normal incidence.
fn absorbing(reflectance: f64) -> f64 {
    let reflectance = reflectance.clamp(0.0, 0.9999);
    2.0 * reflectance.sqrt() / (1.0 - reflectance).sqrt()
}
