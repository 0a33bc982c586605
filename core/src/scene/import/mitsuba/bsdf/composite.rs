//! Mitsuba's surfaces that are made of others.

use super::super::super::xml::Element;
use super::super::context::Context;
use super::super::values::Meaning;
use super::opaque::{black, on_both_sides, passes};
use crate::scene::description::{Blend, BumpMap, Input, Mask, Material, NormalMap, TwoSided};
use crate::scene::error::{Error, ErrorKind};

impl<'a> Context<'a> {
    pub(super) fn mask(&mut self, element: &'a Element) -> Result<Material, Error> {
        let opacity = self.scalar(element, "opacity")?.unwrap_or(0.5.into());
        let inner = self.inner(element)?;
        let material = self.material(inner)?;
        Ok(Material::Mask(Mask { material, opacity }))
    }

    pub(super) fn blend(&mut self, element: &'a Element) -> Result<Material, Error> {
        let weight = self.scalar(element, "weight")?.unwrap_or(0.5.into());
        let [first, second] = self.nested(element, "bsdf")?[..] else {
            return Err(element.fault(ErrorKind::Malformed, "not two surfaces", "two bsdfs"));
        };
        Ok(Material::Blend(Blend { first: self.material(first)?, second: self.material(second)?, weight }))
    }

    /// `mixturebsdf` of Mitsuba 0.x: any number of surfaces with weights, here a chain of blends. What is missing to 1 is black.
    pub(super) fn mixture(&mut self, element: &'a Element) -> Result<Material, Error> {
        let text = self.word(element, "weights")?.unwrap_or_default();
        let mut weights = self.numbers(element, text)?;
        let inner = self.nested(element, "bsdf")?;
        if inner.is_empty() || inner.len() > 16 || weights.len() != inner.len() || weights.iter().any(|weight| *weight < 0.0) {
            let found = format!("{} surfaces and {} weights", inner.len(), weights.len());
            return Err(element.fault(ErrorKind::Malformed, found, "1 to 16 surfaces, and a weight ≥ 0 for each"));
        }
        let mut names = inner.into_iter().map(|inner| self.material(inner)).collect::<Result<Vec<_>, _>>()?;
        let name = self.name(element)?;
        let sum: f64 = weights.iter().sum();
        if sum < 1.0 - 1e-6 {
            let dark = format!("{name}: what is missing to 1");
            self.materials.insert(dark.clone(), black());
            names.push(dark);
            weights.push(1.0 - sum);
        } else if sum > 1.0 + 1e-6 {
            self.note(element, format!("weights that add up to {sum}: they are scaled to 1"));
        }
        // From the last to the first: each blend takes its share of what is left.
        let (mut rest, mut left) = (names.len() - 1, weights[names.len() - 1]);
        let mut tail = names[rest].clone();
        while rest > 0 {
            rest -= 1;
            left += weights[rest];
            let share = if left > 0.0 { weights[rest] / left } else { 0.0 };
            let blend = Material::Blend(Blend { first: tail, second: names[rest].clone(), weight: share.clamp(0.0, 1.0).into() });
            if rest == 0 {
                return Ok(blend);
            }
            tail = format!("{name}: from surface {}", rest + 1);
            self.materials.insert(tail.clone(), blend);
        }
        Ok(Material::Blend(Blend { first: tail.clone(), second: tail, weight: 0.0.into() }))
    }

    pub(super) fn two_sided(&mut self, element: &'a Element) -> Result<Material, Error> {
        let inner = self.nested(element, "bsdf")?;
        let (front, back) = match inner[..] {
            [one] => (one, one),
            [front, back] => (front, back),
            _ => return Err(element.fault(ErrorKind::Malformed, format!("{} surfaces", inner.len()), "one or two bsdfs")),
        };
        let (front_name, back_name) = (self.material(front)?, self.material(back)?);
        for (side, name) in [(front, &front_name), (back, &back_name)] {
            if self.materials.get(name).is_some_and(passes) {
                return Err(side.fault(ErrorKind::Invalid, "a surface that light passes", "one that only reflects"));
            }
        }
        if front_name == back_name
            && let Some(both) = self.materials.get(&front_name).and_then(on_both_sides)
        {
            // Nobody else may know it: then it need not stay beside its own two-sided self.
            if front.attribute("id").is_none() {
                self.materials.remove(&front_name);
                self.origins.remove(&format!("materials.{front_name}"));
            }
            return Ok(both);
        }
        Ok(Material::TwoSided(TwoSided { front: front_name, back: back_name }))
    }

    pub(super) fn bump_map(&mut self, element: &'a Element) -> Result<Material, Error> {
        let inner = self.inner(element)?;
        let texture = self.nested_one(element, "texture")?;
        let texture = texture.ok_or_else(|| element.fault(ErrorKind::Malformed, "no texture inside", "one"))?;
        let mut scale = self.number(element, "scale")?.unwrap_or(1.0);
        // In Mitsuba 0.x the factor stands in a `scale` texture around the image, which would hide the image from its derivatives.
        let texture = match texture.attribute("type") {
            Some("scale") => {
                scale *= self.number(texture, "scale")?.or(self.number(texture, "value")?).unwrap_or(1.0);
                let image = self.nested_one(texture, "texture")?;
                image.ok_or_else(|| texture.fault(ErrorKind::Malformed, "no texture inside", "one"))?
            }
            _ => texture,
        };
        let height = self.scalar_of(texture)?;
        let material = self.material(inner)?;
        if height.texture().is_none() {
            self.note(element, "bumps of one height: there are none");
            return self.same(&material, element);
        }
        Ok(Material::BumpMap(BumpMap { material, height, scale }))
    }

    pub(super) fn normal_map(&mut self, element: &'a Element) -> Result<Material, Error> {
        let inner = self.inner(element)?;
        let normals = match self.input(element, "normalmap", Meaning::Number)? {
            Some(normals) => normals,
            None => {
                let texture = self.nested_one(element, "texture")?;
                self.input_of(texture.ok_or_else(|| element.fault(ErrorKind::Malformed, "no texture inside", "one"))?, Meaning::Number)?
            }
        };
        let material = self.material(inner)?;
        if let Input::Constant(_) = normals {
            self.note(element, "a normal map of one colour: left aside");
            return self.same(&material, element);
        }
        Ok(Material::NormalMap(NormalMap { material, normals, scale: 1.0 }))
    }

    /// A copy of a material that was read.
    fn same(&self, name: &str, element: &Element) -> Result<Material, Error> {
        self.materials.get(name).cloned().ok_or_else(|| self.unsupported(element, "a surface"))
    }
}
