//! Light from infinitely far away, from an equirectangular image.

use super::LightPoint;
use crate::math::{Frame, PI, Vec3, sin_cos};
use crate::sampling::Discrete;
use crate::spectrum::Spectrum;
use crate::texture::TexturePoint;

/// An environment image: in its own frame +Y is up and at the top row, −Z in the middle, +X a quarter to the right of it.
#[derive(Clone, Debug)]
pub struct ImageEnvironment {
    width: usize,
    height: usize,
    /// Radiance at texel centres, row by row from the top [W·m⁻²·sr⁻¹].
    texels: Vec<Spectrum>,
    /// World directions of its own axes.
    axes: Frame,
    /// Choice of the row, then of the column in it.
    rows: Discrete,
    columns: Vec<Discrete>,
    /// Mean radiance over the sphere.
    mean: f32,
}

impl ImageEnvironment {
    /// From texels, `width · height` of them; `axes` are the world directions of the image's x (tangent), y (bitangent) and z (normal).
    /// `None` if the image is black, or a texel is negative or not finite.
    pub fn new(width: u32, height: u32, texels: Vec<Spectrum>, axes: Frame) -> Option<Self> {
        let (width, height) = (width as usize, height as usize);
        if texels.iter().any(|texel| !texel.is_finite() || texel.to_rgb().iter().any(|v| *v < 0.0)) || texels.len() != width * height {
            return None;
        }
        // A cell's light is blended from its own texel and its neighbours': each of them must give it some weight.
        let light = |x: usize, y: usize| texels[y * width + x].mean();
        let blend = |x: usize, y: usize| {
            let xs = [(x + width - 1) % width, x, (x + 1) % width];
            let ys = [y.saturating_sub(1), y, (y + 1).min(height - 1)];
            let row = |y: usize| light(xs[0], y) + 2.0 * light(xs[1], y) + light(xs[2], y);
            (row(ys[0]) + 2.0 * row(ys[1]) + row(ys[2])) / 16.0
        };
        let sine = |y: usize| libm::sinf(PI * (y as f32 + 0.5) / height as f32);
        let mut sums = Vec::with_capacity(height);
        let mut columns = Vec::with_capacity(height);
        let mut total = 0.0f64;
        for y in 0..height {
            let weights: Vec<f32> = (0..width).map(|x| blend(x, y)).collect();
            let sum: f64 = weights.iter().map(|w| f64::from(*w)).sum();
            total += sum * f64::from(sine(y));
            sums.push((sum as f32) * sine(y));
            // A black row is never chosen; its table only fills the place.
            columns.push(Discrete::new(&weights).or_else(|| Discrete::new(&vec![1.0; width]))?);
        }
        let mean = (total * f64::from(PI) / (2.0 * (width * height) as f64)) as f32;
        Some(Self { width, height, texels, axes, rows: Discrete::new(&sums)?, columns, mean })
    }

    /// Radiance from a unit direction.
    #[inline]
    pub(super) fn radiance(&self, direction: Vec3) -> Spectrum {
        let (u, v) = self.place(direction);
        let (x, y) = (u * self.width as f32 - 0.5, v * self.height as f32 - 0.5);
        let (x0, y0) = (x.floor(), y.floor());
        let (s, t) = (x - x0, y - y0);
        let column = |x: f32| (x as i64).rem_euclid(self.width as i64) as usize;
        let row = |y: f32| (y as i64).clamp(0, self.height as i64 - 1) as usize;
        let [left, right] = [column(x0), column(x0 + 1.0)];
        let line = |y: usize| self.texels[y * self.width + left] * (1.0 - s) + self.texels[y * self.width + right] * s;
        line(row(y0)) * (1.0 - t) + line(row(y0 + 1.0)) * t
    }

    /// Where the image shows a direction, both in [0, 1].
    #[inline]
    fn place(&self, direction: Vec3) -> (f32, f32) {
        let d = self.axes.to_local(direction);
        (0.5 + libm::atan2f(d.x, -d.z) / (2.0 * PI), libm::acosf(d.y.clamp(-1.0, 1.0)) / PI)
    }

    #[inline]
    pub(super) fn sample(&self, light: u32, u: [f32; 2]) -> Option<(LightPoint, f32)> {
        let (y, _, t) = self.rows.sample(u[1]);
        let (x, _, s) = self.columns[y].sample(u[0]);
        let (sin_phi, cos_phi) = sin_cos(2.0 * PI * ((x as f32 + s) / self.width as f32 - 0.5));
        let (sin_theta, cos_theta) = sin_cos(PI * (y as f32 + t) / self.height as f32);
        let position = self.axes.to_world(Vec3::new(sin_theta * sin_phi, cos_theta, -sin_theta * cos_phi)).normalize();
        let point =
            LightPoint { light, position, error: 0.0, normal: Vec3::ZERO, at: TexturePoint::default(), infinite: true, delta: false };
        // By the direction itself, so that asking again gives the same.
        let density = self.density(position);
        (density > 0.0).then_some((point, density))
    }

    /// Density of a unit direction [sr⁻¹].
    #[inline]
    pub(super) fn density(&self, direction: Vec3) -> f32 {
        let (u, v) = self.place(direction);
        let x = ((u * self.width as f32) as usize).min(self.width - 1);
        let y = ((v * self.height as f32) as usize).min(self.height - 1);
        let cell = self.rows.probability(y) * self.columns[y].probability(x);
        let sine = libm::sinf(PI * v).max(1e-6);
        cell * (self.width * self.height) as f32 / (2.0 * PI * PI * sine)
    }

    pub(super) fn power(&self, radius: f32) -> f32 {
        self.mean * 4.0 * PI * radius * radius
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::warp::uniform_sphere;

    fn sun() -> ImageEnvironment {
        let (width, height) = (16, 8);
        let mut texels = vec![Spectrum::grey(0.1); width * height];
        texels[2 * width + 11] = Spectrum::rgb(300.0, 200.0, 100.0);
        texels[7 * width] = Spectrum::BLACK;
        ImageEnvironment::new(width as u32, height as u32, texels, Frame::from_normal(Vec3::new(0.3, 0.2, 0.9).normalize())).unwrap()
    }

    fn grid(n: usize) -> impl Iterator<Item = [f32; 2]> {
        (0..n * n).map(move |k| [((k % n) as f32 + 0.5) / n as f32, ((k / n) as f32 + 0.5) / n as f32])
    }

    #[test]
    fn densities_integrate_to_one_and_samples_have_them() {
        let environment = sun();
        let n = 600;
        let sum: f64 = grid(n).map(|u| f64::from(environment.density(uniform_sphere(u)))).sum();
        assert!((sum / (n * n) as f64 * 4.0 * std::f64::consts::PI - 1.0).abs() < 0.01);
        // ∫ L dω by importance sampling is that by uniform sampling.
        let by_light: f64 = grid(200)
            .filter_map(|u| environment.sample(0, u))
            .map(|(point, density)| f64::from(environment.radiance(point.position).mean()) / f64::from(density))
            .sum::<f64>()
            / 40_000.0;
        let by_area: f64 = grid(n).map(|u| f64::from(environment.radiance(uniform_sphere(u)).mean())).sum::<f64>() / (n * n) as f64;
        assert!((by_light / (by_area * 4.0 * std::f64::consts::PI) - 1.0).abs() < 0.01, "{by_light}, {by_area}");
        assert!((f64::from(environment.mean) / by_area - 1.0).abs() < 0.1);
    }

    #[test]
    fn wherever_there_is_light_there_is_density() {
        let environment = sun();
        for u in grid(200) {
            let direction = uniform_sphere(u);
            assert!(environment.radiance(direction).is_black() || environment.density(direction) > 0.0);
        }
    }

    #[test]
    fn up_is_at_the_top_and_minus_z_in_the_middle() {
        let texels = (0..8).map(|k| Spectrum::grey(k as f32)).collect();
        let axes = Frame { tangent: Vec3::X, bitangent: Vec3::Y, normal: Vec3::Z };
        let environment = ImageEnvironment::new(4, 2, texels, axes).unwrap();
        for (direction, u, v) in [(-Vec3::Z, 0.5, 0.5), (Vec3::X, 0.75, 0.5), (-Vec3::X, 0.25, 0.5)] {
            let (x, y) = environment.place(direction);
            assert!((x - u).abs() < 1e-6 && (y - v).abs() < 1e-6, "{direction} at {x}, {y}");
        }
        assert_eq!(environment.place(Vec3::Y).1, 0.0);
        assert!((environment.place(-Vec3::Y).1 - 1.0).abs() < 1e-6);
    }
}
