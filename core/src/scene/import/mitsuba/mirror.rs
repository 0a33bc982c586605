//! Variants of materials and textures for shapes whose texture coordinates Mitsuba does not turn round.
//!
//! Textures are written for shapes of OBJ files. A shape of another kind gets copies of all that it is made of, with v′ = 1 − v before
//! everything else. What has no texture is left as it is.

use std::collections::BTreeSet;

use super::context::Context;
use super::transform::Uv;
use crate::scene::description::{ColourInput, Input, Material, ScalarInput, Shape, Texture, UvTransform};

impl Context<'_> {
    /// The name of a material's variant, or of the material itself where no texture is in it.
    pub(super) fn mirrored_material(&mut self, name: &str) -> String {
        let turned = format!("{name} (v turned round)");
        if self.materials.contains_key(&turned) {
            return turned;
        }
        let Some(mut material) = self.materials.get(name).cloned() else { return name.to_string() };
        let mut changed = false;
        for part in parts(&mut material) {
            let variant = self.mirrored_material(part);
            changed |= variant != *part;
            *part = variant;
        }
        for texture in textures(&mut material) {
            let variant = self.mirrored_texture(texture);
            changed |= variant != *texture;
            *texture = variant;
        }
        if !changed {
            return name.to_string();
        }
        if let Some(origin) = self.origins.get(&format!("materials.{name}")).copied() {
            self.origins.insert(format!("materials.{turned}"), origin);
        }
        self.materials.insert(turned.clone(), material);
        turned
    }

    /// An input that may be a texture, as a shape that is not turned round sees it.
    pub(super) fn mirrored_input(&mut self, input: ColourInput) -> ColourInput {
        match input {
            Input::Texture(name) => Input::Texture(self.mirrored_texture(&name)),
            Input::Constant(colour) => Input::Constant(colour),
        }
    }

    fn mirrored_texture(&mut self, name: &str) -> String {
        let turned = format!("{name} (v turned round)");
        if self.textures.contains_key(&turned) {
            return turned;
        }
        let Some(mut texture) = self.textures.get(name).cloned() else { return name.to_string() };
        let changed = match &mut texture {
            Texture::Bitmap(bitmap) => turn(&mut bitmap.uv),
            Texture::Checkerboard(board) => {
                let inner = [&mut board.color0, &mut board.color1].map(|input| self.turn_input(input));
                turn(&mut board.uv) || inner.contains(&true)
            }
            Texture::VertexColour(_) => false,
            Texture::Product(product) => [&mut product.first, &mut product.second].map(|input| self.turn_input(input)).contains(&true),
            Texture::Mix(mix) => [&mut mix.first, &mut mix.second].map(|input| self.turn_input(input)).contains(&true),
        };
        if !changed {
            return name.to_string();
        }
        if let Some(origin) = self.origins.get(&format!("textures.{name}")).copied() {
            self.origins.insert(format!("textures.{turned}"), origin);
        }
        self.textures.insert(turned.clone(), texture);
        turned
    }

    /// Drops the materials and textures that no shape is made of: those that only their variants replaced, and parts that were merged.
    pub(super) fn prune(&mut self, shapes: &[Shape]) {
        let mut materials = BTreeSet::new();
        let mut textures = BTreeSet::new();
        let mut open: Vec<String> = Vec::new();
        let mut painted: Vec<String> = Vec::new();
        for shape in self.groups.values().flatten().chain(shapes) {
            open.extend(shape.material.clone());
            painted.extend(shape.emission.iter().filter_map(|emission| emission.radiance.texture()).map(str::to_string));
        }
        while let Some(name) = open.pop() {
            if let Some(material) = self.materials.get(&name).filter(|_| materials.insert(name.clone())) {
                open.extend(material.parts().into_iter().map(str::to_string));
                painted.extend(material.textures().into_iter().map(str::to_string));
            }
        }
        while let Some(name) = painted.pop() {
            if let Some(texture) = self.textures.get(&name).filter(|_| textures.insert(name.clone())) {
                painted.extend(texture.parts().into_iter().map(str::to_string));
            }
        }
        self.materials.retain(|name, _| materials.contains(name));
        self.textures.retain(|name, _| textures.contains(name));
    }

    fn turn_input(&mut self, input: &mut ColourInput) -> bool {
        let Input::Texture(name) = input else { return false };
        let variant = self.mirrored_texture(name);
        let changed = variant != *name;
        *name = variant;
        changed
    }
}

/// Turns v round before a map; no map that the description can write shears by this.
fn turn(uv: &mut UvTransform) -> bool {
    if let Some(turned) = Uv::UPSIDE_DOWN.then(&Uv::of(uv)).described() {
        *uv = turned;
    }
    true
}

/// The names of what a material is made of.
fn parts(material: &mut Material) -> Vec<&mut String> {
    match material {
        Material::Mask(mask) => vec![&mut mask.material],
        Material::Blend(blend) => vec![&mut blend.first, &mut blend.second],
        Material::TwoSided(sides) => vec![&mut sides.front, &mut sides.back],
        Material::BumpMap(map) => vec![&mut map.material],
        Material::NormalMap(map) => vec![&mut map.material],
        _ => Vec::new(),
    }
}

/// The names of the textures that a material uses itself.
fn textures(material: &mut Material) -> Vec<&mut String> {
    let (colours, scalars): (Vec<&mut ColourInput>, Vec<&mut ScalarInput>) = match material {
        Material::Diffuse(m) => (vec![&mut m.reflectance], Vec::new()),
        Material::RoughDiffuse(m) => (vec![&mut m.reflectance], vec![&mut m.roughness]),
        Material::Conductor(m) => (vec![&mut m.reflectance], [&mut m.roughness].into_iter().chain(&mut m.roughness_v).collect()),
        Material::Dielectric(m) => {
            (vec![&mut m.reflectance, &mut m.transmittance], [&mut m.roughness].into_iter().chain(&mut m.roughness_v).collect())
        }
        Material::Plastic(m) => (vec![&mut m.diffuse, &mut m.specular], vec![&mut m.roughness]),
        Material::Principled(m) => (
            vec![&mut m.base_color, &mut m.specular_color, &mut m.sheen_color],
            vec![
                &mut m.metallic,
                &mut m.roughness,
                &mut m.anisotropy,
                &mut m.specular,
                &mut m.clearcoat,
                &mut m.clearcoat_roughness,
                &mut m.sheen_roughness,
                &mut m.transmission,
            ],
        ),
        Material::Phong(m) => (vec![&mut m.diffuse, &mut m.specular], vec![&mut m.exponent]),
        Material::Ward(m) => (vec![&mut m.diffuse, &mut m.specular], [&mut m.roughness].into_iter().chain(&mut m.roughness_v).collect()),
        Material::Mask(m) => (Vec::new(), vec![&mut m.opacity]),
        Material::Blend(m) => (Vec::new(), vec![&mut m.weight]),
        Material::BumpMap(m) => (Vec::new(), vec![&mut m.height]),
        Material::NormalMap(m) => (vec![&mut m.normals], Vec::new()),
        Material::TwoSided(_) | Material::Null => (Vec::new(), Vec::new()),
    };
    colours.into_iter().filter_map(named).chain(scalars.into_iter().filter_map(named)).collect()
}

fn named<T>(input: &mut Input<T>) -> Option<&mut String> {
    match input {
        Input::Texture(name) => Some(name),
        Input::Constant(_) => None,
    }
}
