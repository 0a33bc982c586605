//! Mitsuba's films and reconstruction filters.

use super::super::xml::Element;
use super::context::Context;
use crate::scene::description::film::{Gaussian, Mitchell, Tent};
use crate::scene::description::{Crop, Film, Filter};
use crate::scene::error::{Error, ErrorKind};

impl<'a> Context<'a> {
    pub(super) fn film(&mut self, element: &'a Element) -> Result<Film, Error> {
        match self.kind(element)? {
            "hdrfilm" => {}
            "ldrfilm" | "mfilm" | "tiledhdrfilm" if self.old => {
                self.note(element, "files are OpenEXR, RGB, float32 here, and tone mapping is a step of its own");
            }
            _ => return Err(self.unsupported(element, "hdrfilm, or ldrfilm, mfilm and tiledhdrfilm of Mitsuba 0.x")),
        }
        // Mitsuba's own defaults; sizes out of range are found when the description is checked.
        let size =
            |context: &Self, name: &str| Ok::<_, Error>(context.integer(element, name)?.map(|side| u32::try_from(side).unwrap_or(0)));
        let width = size(self, "width")?.unwrap_or(768);
        let height = size(self, "height")?.unwrap_or(576);
        let crop = [size(self, "crop_offset_x")?, size(self, "crop_offset_y")?, size(self, "crop_width")?, size(self, "crop_height")?];
        let crop = crop.iter().any(Option::is_some).then(|| {
            let [x, y] = [crop[0].unwrap_or(0), crop[1].unwrap_or(0)];
            let (rest_x, rest_y) = (width.saturating_sub(x), height.saturating_sub(y));
            Crop { x, y, width: crop[2].unwrap_or(rest_x), height: crop[3].unwrap_or(rest_y) }
        });
        let own = ["openexr", "rgb", "float32", "float16", "auto"];
        for format in ["file_format", "pixel_format", "component_format"] {
            let word = self.word(element, format)?;
            if let Some(word) = word.filter(|word| !own.contains(&word.to_ascii_lowercase().as_str())) {
                self.note(element, format!("{format} {word}: files are OpenEXR, RGB, float32 here"));
            }
        }
        let tone =
            ["gamma", "exposure", "key", "burn", "banner", "tonemap_method", "attach_log", "filename", "digits", "variable", "compress"];
        self.leave(element, &tone, "files and tone mapping are a step of their own")?;
        if self.boolean(element, "sample_border")?.unwrap_or(false) {
            self.note(element, "sample_border: of no use where each sample belongs to one pixel");
        }
        if self.boolean(element, "high_quality_edges")?.unwrap_or(false) {
            self.note(element, "high_quality_edges: of no use where each sample belongs to one pixel");
        }
        let filter = match self.nested_one(element, "rfilter")? {
            Some(filter) => self.filter(filter)?,
            None => Filter::Gaussian(Gaussian { deviation: 0.5, radius: 2.0 }),
        };
        self.finish(element, "width, height, crop_*, file_format, pixel_format, component_format, sample_border and rfilter")?;
        Ok(Film { width, height, crop, filter })
    }

    fn filter(&mut self, element: &'a Element) -> Result<Filter, Error> {
        let filter = match self.kind(element)? {
            "box" => match self.number(element, "radius")? {
                Some(radius) if radius != 0.5 => {
                    self.note(element, format!("a box of radius {radius}: one of the pixel's own width is used"));
                    Filter::Box
                }
                _ => Filter::Box,
            },
            "tent" => Filter::Tent(Tent { radius: self.number(element, "radius")?.unwrap_or(1.0) }),
            "gaussian" => {
                let deviation = self.number(element, "stddev")?.unwrap_or(0.5);
                Filter::Gaussian(Gaussian { deviation, radius: 4.0 * deviation })
            }
            "mitchell" => {
                let third = 1.0 / 3.0;
                let small = (self.number(element, "b")?, self.number(element, "c")?);
                let (b, c) = (self.number(element, "B")?.or(small.0), self.number(element, "C")?.or(small.1));
                Filter::Mitchell(Mitchell { b: b.unwrap_or(third), c: c.unwrap_or(third) })
            }
            // Catmull and Rom's spline is the member of Mitchell's family with these parameters.
            "catmullrom" => Filter::Mitchell(Mitchell { b: 0.0, c: 0.5 }),
            "lanczos" => {
                self.leave(element, &["lobes"], "approximated together with its filter")?;
                self.note(element, "the filter lanczos: Mitchell's with B = 0 and C = 0.5 is used, which rings less");
                Filter::Mitchell(Mitchell { b: 0.0, c: 0.5 })
            }
            other => {
                let expected = "box, tent, gaussian, mitchell, catmullrom or lanczos";
                return Err(element.fault(ErrorKind::Unsupported, format!("the filter {other}"), expected));
            }
        };
        self.finish(element, "what the kind of filter needs")?;
        Ok(filter)
    }
}
