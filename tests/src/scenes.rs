//! Scenes whose radiance is known in closed form, written in the native format.

use gradfarm_core::lattice::Extent;
use gradfarm_core::math::Ray;
use gradfarm_core::plan::{Plan, Request, resolve};
use gradfarm_core::scene::{Error, NoAssets, Scene, SceneDescription};

/// Radiance along a ray over paths of at most so many edges.
type Radiance = dyn Fn(&Ray, u32) -> [f64; 3] + Sync;

/// A scene and what the camera must see in it.
pub struct ClosedForm {
    /// Its name, for messages.
    pub name: &'static str,
    /// As written.
    pub description: SceneDescription,
    /// Compiled.
    pub scene: Scene,
    /// Longest paths [edges] at which the closed form is worth testing.
    pub depths: &'static [u32],
    /// Radiance that arrives along a camera ray over paths of at most so many edges, per channel.
    radiance: Box<Radiance>,
}

/// Sub-pixel positions a side over which closed forms are averaged.
const GRID: u32 = 24;

impl ClosedForm {
    /// The value of a pixel: the mean over its area, by the midpoint rule.
    pub fn pixel(&self, extent: Extent, max_depth: u32, x: u32, y: u32) -> [f64; 3] {
        let view = self.scene.sensor.view(extent);
        let mut sum = [0.0; 3];
        for cell in 0..GRID * GRID {
            let within = |k: u32| (k as f32 + 0.5) / GRID as f32;
            let film = [x as f32 + within(cell % GRID), y as f32 + within(cell / GRID)];
            let radiance = (self.radiance)(&view.ray(film, [0.5; 2]), max_depth);
            sum.iter_mut().zip(radiance).for_each(|(s, r)| *s += r);
        }
        sum.map(|s| s / f64::from(GRID * GRID))
    }
}

/// Reads and compiles a scene without files.
///
/// # Errors
/// If the text is no scene.
pub fn compile(text: &str, name: &str) -> Result<(SceneDescription, Scene), Error> {
    let description = SceneDescription::from_json(text, name)?;
    let scene = Scene::compile(&description, &NoAssets)?;
    Ok((description, scene))
}

/// The plan of a request, for scenes of the suite, which have one.
///
/// # Panics
/// If the request is at fault.
#[expect(clippy::panic, reason = "a fault of the test itself")]
pub fn plan(description: &SceneDescription, request: &Request) -> Plan {
    resolve(description, request).unwrap_or_else(|fault| panic!("{fault}"))
}

fn closed_form(
    name: &'static str,
    depths: &'static [u32],
    text: &str,
    radiance: impl Fn(&Ray, u32) -> [f64; 3] + Sync + 'static,
) -> Result<ClosedForm, Error> {
    let (description, scene) = compile(text, name)?;
    Ok(ClosedForm { name, description, scene, depths, radiance: Box::new(radiance) })
}

/// Every closed form.
///
/// # Errors
/// If the format of descriptions changed and a scene here did not.
pub fn closed_forms() -> Result<Vec<ClosedForm>, Error> {
    Ok(vec![sky_over_ball()?, sky_in_mirror()?, sky_through_glass()?, glowing_room()?, lamp_over_plane()?, panel_over_plane()?])
}

/// Radiance of the sky in the first three scenes.
const SKY: [f64; 3] = [0.5, 1.0, 2.0];

/// A ball of this material fills the view; around it nothing but sky.
fn under_the_sky(material: &str) -> String {
    format!(
        r#"{{
        "version": 1,
        "camera": {{ "perspective": {{ "to_world": [{{ "look_at": {{ "origin": [0, 0, -5], "target": [0, 0, 0] }} }}], "fov": 14 }} }},
        "materials": {{ "ball": {material} }},
        "shapes": [{{ "geometry": {{ "sphere": {{ "radius": 1 }} }}, "material": "ball" }}],
        "environment": {{ "radiance": [{}, {}, {}] }}
        }}"#,
        SKY[0], SKY[1], SKY[2]
    )
}

/// A convex diffuse body under a constant sky: albedo times sky, whatever the depth.
fn sky_over_ball() -> Result<ClosedForm, Error> {
    let text = under_the_sky(r#"{ "diffuse": { "reflectance": [0.2, 0.5, 0.9] } }"#);
    closed_form("sky over a diffuse ball", &[2, 5], &text, |_, _| [0.2 * SKY[0], 0.5 * SKY[1], 0.9 * SKY[2]])
}

/// A perfect mirror shows the sky as it is.
fn sky_in_mirror() -> Result<ClosedForm, Error> {
    let text = under_the_sky(r#"{ "conductor": { "eta": 0, "k": 1 } }"#);
    closed_form("sky in a mirror ball", &[2, 5], &text, |_, _| SKY)
}

/// Clear glass absorbs nothing: all orders of reflection together show the sky as it is.
///
/// Inside a ball every bounce meets the surface at the same angle, so with reflectance R paths of at most d edges carry
/// R + (1−R)² (1 + R + … + R^(d−3)) = 1 − (1−R) R^(d−2).
fn sky_through_glass() -> Result<ClosedForm, Error> {
    let text = under_the_sky(r#"{ "dielectric": { "interior_ior": 1.5 } }"#);
    closed_form("sky through a glass ball", &[2, 3, 12], &text, |ray, max_depth| {
        let (origin, direction) = (ray.origin.as_dvec3(), ray.direction.as_dvec3().normalize());
        // The ball is the unit ball: the distance of the ray from its centre is the sine of the angle of incidence.
        let sin2 = origin.length_squared() - origin.dot(direction).powi(2);
        let (cos, cos_t) = ((1.0 - sin2).sqrt(), (1.0 - sin2 / 2.25).sqrt());
        let parallel = (1.5 * cos - cos_t) / (1.5 * cos + cos_t);
        let perpendicular = (cos - 1.5 * cos_t) / (cos + 1.5 * cos_t);
        let reflectance = 0.5 * (parallel * parallel + perpendicular * perpendicular);
        SKY.map(|sky| sky * (1.0 - (1.0 - reflectance) * reflectance.powi(max_depth as i32 - 2)))
    })
}

/// A closed room in which every surface glows and reflects alike, the ball that stands in it too: after d edges each ray
/// carries E (1 + ρ + … + ρ^(d−1)).
fn glowing_room() -> Result<ClosedForm, Error> {
    const GLOW: [f64; 3] = [1.0, 0.5, 0.25];
    const ALBEDO: [f64; 3] = [0.5, 0.7, 0.9];
    let text = format!(
        r#"{{
        "version": 1,
        "camera": {{ "perspective": {{ "to_world": [{{ "look_at": {{ "origin": [0.5, 0.2, -0.9], "target": [0, -0.3, 0.3] }} }}], "fov": 60 }} }},
        "materials": {{ "wall": {{ "diffuse": {{ "reflectance": {ALBEDO:?} }} }} }},
        "shapes": [
            {{ "geometry": "cube", "flip_normals": true, "material": "wall", "emission": {{ "radiance": {GLOW:?} }} }},
            {{ "geometry": {{ "sphere": {{ "center": [-0.2, -0.5, 0.3], "radius": 0.4 }} }}, "material": "wall", "emission": {{ "radiance": {GLOW:?} }} }}
        ]
        }}"#
    );
    closed_form("glowing room", &[1, 2, 3, 6], &text, |_, max_depth| {
        [0, 1, 2].map(|c| GLOW[c] * (1.0 - ALBEDO[c].powi(max_depth as i32)) / (1.0 - ALBEDO[c]))
    })
}

/// Albedo of the plane under lamps.
const PLANE: [f64; 3] = [0.8, 0.5, 0.3];

/// A plane at y = 0, seen from beside the lamp, which lies out of view and reflects nothing.
fn plane_under(lamp: &str) -> String {
    format!(
        r#"{{
        "version": 1,
        "camera": {{ "perspective": {{ "to_world": [{{ "look_at": {{ "origin": [0, 1, -4], "target": [0, 0, -1] }} }}], "fov": 28 }} }},
        "materials": {{ "plane": {{ "diffuse": {{ "reflectance": {PLANE:?} }} }}, "lamp": {{ "diffuse": {{ "reflectance": 0 }} }} }},
        "shapes": [
            {{ "geometry": "rectangle", "to_world": [{{ "rotate": {{ "axis": [1, 0, 0], "degrees": -90 }} }}, {{ "scale": [60, 1, 60] }}], "material": "plane" }},
            {lamp}
        ]
        }}"#
    )
}

/// Where a camera ray meets the plane y = 0.
fn on_plane(ray: &Ray) -> glam::DVec3 {
    let (origin, direction) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
    origin - direction * (origin.y / direction.y)
}

/// A spherical lamp wholly above the horizon: irradiance π L (R/d)² cosθ.
fn lamp_over_plane() -> Result<ClosedForm, Error> {
    let lamp = r#"{ "geometry": { "sphere": { "center": [0.4, 2, 0], "radius": 0.5 } }, "material": "lamp", "emission": { "radiance": [10, 20, 40] } }"#;
    closed_form("spherical lamp over a plane", &[2, 4], &plane_under(lamp), |ray, _| {
        let to = glam::DVec3::new(0.4, 2.0, 0.0) - on_plane(ray);
        let factor = 0.25 / to.length_squared() * (to.y / to.length());
        [PLANE[0] * 10.0 * factor, PLANE[1] * 20.0 * factor, PLANE[2] * 40.0 * factor]
    })
}

/// A square lamp that faces the plane: irradiance by Lambert's formula, L/2 Σ γᵢ cosδᵢ over the edges as seen from the point.
fn panel_over_plane() -> Result<ClosedForm, Error> {
    let lamp = r#"{ "geometry": "rectangle", "to_world": [{ "rotate": { "axis": [1, 0, 0], "degrees": 90 } }, { "translate": [0.4, 1.6, 0] }],
        "material": "lamp", "emission": { "radiance": [1, 2, 4] } }"#;
    closed_form("square lamp over a plane", &[2, 4], &plane_under(lamp), |ray, _| {
        let from = on_plane(ray);
        let corners =
            [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]].map(|[x, z]| (glam::DVec3::new(0.4 + x, 1.6, z) - from).normalize());
        let mut sum = 0.0;
        for k in 0..4 {
            let (a, b) = (corners[k], corners[(k + 1) % 4]);
            sum += libm::acos(a.dot(b)) * a.cross(b).normalize().y;
        }
        let factor = sum.abs() / (2.0 * std::f64::consts::PI);
        [PLANE[0] * factor, PLANE[1] * 2.0 * factor, PLANE[2] * 4.0 * factor]
    })
}

/// A small room with something in it, lit so broadly that no path is rare: its noise is tame enough for tests of means.
pub struct StillLife {
    /// What is in it.
    pub name: &'static str,
    /// As written.
    pub description: SceneDescription,
    /// Compiled.
    pub scene: Scene,
}

/// Rooms with something of every material, with instances, with fog, and lit by what has no surface; and a place under the sky.
///
/// # Errors
/// If the format of descriptions changed and a scene here did not.
pub fn still_lifes() -> Result<Vec<StillLife>, Error> {
    let ball = |x: f64, z: f64, material: &str| {
        format!(r#"{{ "geometry": {{ "sphere": {{ "center": [{x}, -0.55, {z}], "radius": 0.45 }} }}, "material": "{material}" }}"#)
    };
    let matte = [ball(-0.5, 0.3, "red"), ball(0.5, 0.0, "white")].join(", ");
    let polished = [ball(-0.5, 0.3, "mirror"), ball(0.5, 0.0, "glass")].join(", ");
    let brushed = [ball(-0.5, 0.3, "gold"), ball(0.5, 0.0, "frosted")].join(", ");
    let cloud =
        r#"{ "geometry": { "sphere": { "center": [-0.5, -0.55, 0.3], "radius": 0.45 } }, "material": "clear", "interior": "milk" }"#;
    let clouded = [cloud, &ball(0.5, 0.0, "frosted")].join(", ");
    let group = r#"{ "geometry": { "instance": { "of": "steps" } }, "to_world": [{ "rotate": { "axis": [0, 1, 0], "degrees": 25 } }] }"#;
    Ok(vec![
        room("matte balls", &matte)?,
        room("mirror and glass", &polished)?,
        room("gold and frosted glass", &brushed)?,
        room("instanced steps", group)?,
        room_with("matte ball in fog", &ball(-0.4, 0.2, "red"), r#""medium": "fog""#)?,
        room_with("cloud and frosted glass", &clouded, r#""lights": []"#)?,
        room_with("points and spots", &[ball(-0.5, 0.3, "gold"), ball(0.5, 0.1, "white")].join(", "), WITHOUT_SURFACE)?,
        under_open_sky(&[ball(-0.5, 0.3, "mirror"), ball(0.5, 0.0, "gold")].join(", "))?,
    ])
}

/// Lights that only next-event estimation finds.
const WITHOUT_SURFACE: &str = r#""lights": [
    { "point": { "position": [-0.3, 0.1, -0.3], "intensity": [0.3, 0.4, 0.6] } },
    { "spot": { "position": [0.4, 0.6, -0.2], "direction": [-0.2, -1, 0.3], "intensity": [1.2, 1, 0.7], "inner_angle": 20, "outer_angle": 40 } }
]"#;

/// Of what the rooms are made.
const MATTER: &str = r#"
    "materials": {
        "white": { "diffuse": { "reflectance": [0.7, 0.7, 0.6] } },
        "red": { "diffuse": { "reflectance": [0.7, 0.2, 0.1] } },
        "black": { "diffuse": { "reflectance": 0 } },
        "mirror": { "conductor": { "metal": "Al" } },
        "glass": { "dielectric": { "interior_ior": 1.5 } },
        "gold": { "conductor": { "metal": "Au", "roughness": 0.15 } },
        "frosted": { "dielectric": { "interior_ior": 1.4, "roughness": 0.25 } },
        "clear": { "mask": { "opacity": 0, "material": "black" } }
    },
    "media": {
        "fog": { "homogeneous": { "extinction": [0.2, 0.4, 0.6], "albedo": 0.9, "phase": { "henyey_greenstein": { "g": 0.3 } } } },
        "milk": { "homogeneous": { "extinction": [3, 2, 1], "albedo": 0.8 } }
    }"#;

/// A room, its ceiling a lamp but for a frame, with these shapes inside.
fn room(name: &'static str, text: &str) -> Result<StillLife, Error> {
    room_with(name, text, r#""lights": []"#)
}

/// The same with one more entry of the description.
fn room_with(name: &'static str, shapes: &str, more: &str) -> Result<StillLife, Error> {
    let text = format!(
        r#"{{
        "version": 1,
        "camera": {{ "perspective": {{ "to_world": [{{ "look_at": {{ "origin": [0, -0.2, -0.95], "target": [0, -0.35, 0] }} }}], "fov": 75 }} }},
        {MATTER},
        "groups": {{ "steps": [
            {{ "geometry": "cube", "to_world": [{{ "scale": [0.5, 0.2, 0.25] }}, {{ "translate": [0, -0.8, 0.2] }}], "material": "red" }},
            {{ "geometry": "cube", "to_world": [{{ "scale": [0.5, 0.2, 0.25] }}, {{ "translate": [0, -0.4, 0.6] }}], "material": "gold" }}
        ] }},
        "shapes": [
            {{ "geometry": "cube", "flip_normals": true, "material": "white" }},
            {{ "geometry": "rectangle", "to_world": [{{ "rotate": {{ "axis": [1, 0, 0], "degrees": 90 }} }}, {{ "scale": [0.8, 1, 0.8] }}, {{ "translate": [0, 0.98, 0] }}],
               "material": "black", "emission": {{ "radiance": [2, 1.8, 1.5] }} }},
            {shapes}
        ],
        {more}
        }}"#
    );
    let (description, scene) = compile(&text, name)?;
    Ok(StillLife { name, description, scene })
}

/// These shapes on a floor under an even sky and a sun, seen through a lens.
fn under_open_sky(shapes: &str) -> Result<StillLife, Error> {
    let text = format!(
        r#"{{
        "version": 1,
        "camera": {{ "perspective": {{ "to_world": [{{ "look_at": {{ "origin": [0, 0, -1.6], "target": [0, -0.6, 0] }} }}],
                    "fov": 60, "lens_radius": 0.03, "focus_distance": 1.8 }} }},
        {MATTER},
        "shapes": [
            {{ "geometry": "rectangle", "to_world": [{{ "rotate": {{ "axis": [1, 0, 0], "degrees": -90 }} }}, {{ "scale": [4, 1, 4] }}, {{ "translate": [0, -1, 0] }}],
               "material": "white" }},
            {shapes}
        ],
        "lights": [{{ "directional": {{ "direction": [-0.4, -0.8, 0.4], "irradiance": [2, 1.8, 1.5] }} }}],
        "environment": {{ "radiance": [0.5, 0.7, 1] }}
        }}"#
    );
    let (description, scene) = compile(&text, "mirror and gold under the sky")?;
    Ok(StillLife { name: "mirror and gold under the sky", description, scene })
}
