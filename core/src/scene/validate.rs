//! Everything about a description that its types do not already say: domains, names, limits, circles between groups.

use glam::{DMat3, DVec3};

use super::animate::{Pose, check_deformation};
use super::assets::check_name;
use super::description::{
    Animation, Camera, Colour, Cylinder, Filter, Geometry, Material, MeshInline, Operation, SceneDescription, Shape, Transform, VERSION,
};
use super::error::{Error, ErrorKind};
use super::limits;

mod animation;
mod groups;
mod light;
mod surface;

/// Checks a whole description; `file` is the name that errors carry.
pub(super) fn description(scene: &SceneDescription, file: &str) -> Result<(), Error> {
    let check = Check { file, animation: scene.animation.as_ref(), meshes: true };
    match &scene.animation {
        Some(animation) => check.animated(scene, animation),
        None => still(&check, scene),
    }
}

/// Checks what an instant is made from: keys, nodes, forms and joints. What they make is for [`instant`] to check.
pub(super) fn sources(scene: &SceneDescription, file: &str) -> Result<(), Error> {
    let check = Check { file, animation: scene.animation.as_ref(), meshes: true };
    if let Some(animation) = &scene.animation {
        check.moves(scene, animation)?;
    }
    let groups =
        scene.groups.iter().flat_map(|(name, shapes)| shapes.iter().enumerate().map(move |(k, s)| (format!("groups.{name}[{k}]"), s)));
    let shapes = scene.shapes.iter().enumerate().map(|(k, shape)| (format!("shapes[{k}]"), shape));
    for (path, shape) in groups.chain(shapes) {
        if let Geometry::Mesh(mesh) = &shape.geometry
            && (mesh.morph.is_some() || mesh.skin.is_some())
        {
            check.mesh(&format!("{path}.geometry.mesh"), mesh)?;
        }
    }
    Ok(())
}

/// Checks what moves in a description that is sound at its keys, as it is at one instant.
pub(super) fn instant(pose: &Pose<'_>, still: &SceneDescription, file: &str, seconds: f64) -> Result<(), Error> {
    Check { file, animation: None, meshes: false }.parts(pose, still, seconds)
}

/// Checks a whole description in which nothing moves, or one instant of one.
fn still(check: &Check<'_>, scene: &SceneDescription) -> Result<(), Error> {
    if scene.version != VERSION {
        return check.invalid("version", scene.version, format!("{VERSION}, the version that this program reads"));
    }
    check.film(scene)?;
    check.camera(&scene.camera)?;
    check.surfaces(scene)?;
    let written = scene.groups.values().map(Vec::len).sum::<usize>() + scene.shapes.len();
    if written > limits::SHAPES {
        return Err(check.fault(ErrorKind::TooLarge, "shapes", format!("{written} shapes"), format!("at most {}", limits::SHAPES)));
    }
    for (name, shapes) in &scene.groups {
        for (index, shape) in shapes.iter().enumerate() {
            check.shape(&format!("groups.{name}[{index}]"), shape, scene, true)?;
        }
    }
    for (index, shape) in scene.shapes.iter().enumerate() {
        check.shape(&format!("shapes[{index}]"), shape, scene, false)?;
    }
    groups::check(scene, check.file)?;
    for (index, light) in scene.lights.iter().enumerate() {
        check.light(&format!("lights[{index}]"), light)?;
    }
    if let Some(environment) = &scene.environment {
        check.environment(environment)?;
    }
    if let Some(medium) = &scene.medium {
        check.named("medium", medium, "medium", &scene.media)?;
    }
    Ok(())
}

struct Check<'a> {
    file: &'a str,
    /// What moves in the scene of which this is an instant.
    animation: Option<&'a Animation>,
    /// Whether to look into meshes: their vertices are the same at all times.
    meshes: bool,
}

impl Check<'_> {
    fn fault(&self, kind: ErrorKind, path: &str, found: impl Into<String>, expected: impl Into<String>) -> Error {
        Error::new(kind, self.file, path, found, expected)
    }

    fn invalid(&self, path: &str, found: impl ToString, expected: impl Into<String>) -> Result<(), Error> {
        Err(self.fault(ErrorKind::Invalid, path, found.to_string(), expected))
    }

    fn film(&self, scene: &SceneDescription) -> Result<(), Error> {
        let film = scene.film;
        for (path, side) in [("film.width", film.width), ("film.height", film.height)] {
            if side == 0 || side > limits::FILM_SIDE {
                return self.invalid(path, side, format!("1 to {} pixels", limits::FILM_SIDE));
            }
        }
        if u64::from(film.width) * u64::from(film.height) > limits::FILM_PIXELS {
            let found = format!("{} × {} pixels", film.width, film.height);
            return Err(self.fault(ErrorKind::TooLarge, "film", found, format!("at most {} pixels in all", limits::FILM_PIXELS)));
        }
        if let Some(crop) = film.crop {
            let fits = |start: u32, side: u32, whole: u32| side > 0 && start.checked_add(side).is_some_and(|end| end <= whole);
            if !(fits(crop.x, crop.width, film.width) && fits(crop.y, crop.height, film.height)) {
                let found = format!("{} × {} pixels from ({}, {})", crop.width, crop.height, crop.x, crop.y);
                return self.invalid("film.crop", found, format!("a part of the film of {} × {} pixels", film.width, film.height));
            }
        }
        self.filter(film.filter)?;
        let depths = [("integrator.max_depth", scene.integrator.max_depth), ("integrator.roulette_depth", scene.integrator.roulette_depth)];
        for (path, depth) in depths {
            if depth == 0 || (path == "integrator.max_depth" && depth > limits::PATH_EDGES) {
                return self.invalid(path, depth, format!("1 to {} edges", limits::PATH_EDGES));
            }
        }
        Ok(())
    }

    fn filter(&self, filter: Filter) -> Result<(), Error> {
        let numbers: &[(&str, f64, [f64; 2])] = match filter {
            Filter::Box => &[],
            Filter::Tent(tent) => &[("tent.radius", tent.radius, [1e-3, 8.0])],
            Filter::Gaussian(gaussian) => {
                &[("gaussian.deviation", gaussian.deviation, [1e-3, 8.0]), ("gaussian.radius", gaussian.radius, [1e-3, 8.0])]
            }
            Filter::Mitchell(mitchell) => &[("mitchell.b", mitchell.b, [0.0, 1.0]), ("mitchell.c", mitchell.c, [0.0, 1.0])],
        };
        for (field, number, [least, greatest]) in numbers {
            if !(*least..=*greatest).contains(number) {
                return self.invalid(&format!("film.filter.{field}"), number, format!("{least} to {greatest}"));
            }
        }
        Ok(())
    }

    fn camera(&self, camera: &Camera) -> Result<(), Error> {
        let kind = match camera {
            Camera::Perspective(_) => "perspective",
            Camera::Orthographic(_) => "orthographic",
        };
        let path = |field: &str| format!("camera.{kind}.{field}");
        let to_world = camera.to_world();
        self.transform(&path("to_world"), to_world)?;
        if !even_scale(to_world).is_some_and(|scale| (scale - 1.0).abs() < 1e-3) {
            let frame = DMat3::from_mat4(to_world.matrix());
            let scales = [frame.x_axis, frame.y_axis, frame.z_axis].map(|axis| axis.length());
            return self.invalid(
                &path("to_world"),
                format!("axes of lengths {scales:?}, or not square to each other"),
                "turns and moves only",
            );
        }
        match camera {
            Camera::Orthographic(camera) => {
                if !(camera.scale > 0.0 && camera.scale.is_finite()) {
                    return self.invalid(&path("scale"), camera.scale, "a finite width > 0");
                }
            }
            Camera::Perspective(camera) => {
                if !(camera.fov > 0.0 && camera.fov < 180.0) {
                    return self.invalid(&path("fov"), camera.fov, "an angle in (0, 180) degrees");
                }
                if !(camera.lens_radius >= 0.0 && camera.lens_radius.is_finite()) {
                    return self.invalid(&path("lens_radius"), camera.lens_radius, "a finite radius ≥ 0");
                }
                if !(camera.focus_distance > 0.0 && camera.focus_distance.is_finite()) {
                    return self.invalid(&path("focus_distance"), camera.focus_distance, "a finite distance > 0");
                }
                if !camera.principal_point.iter().all(|x| x.abs() <= 1e3) {
                    return self.invalid(&path("principal_point"), format!("{:?}", camera.principal_point), "numbers up to 1000");
                }
            }
        }
        Ok(())
    }

    fn colour(&self, path: &str, colour: Colour, greatest: f64) -> Result<(), Error> {
        // Held in single precision from here on, so it must be finite there too.
        if colour.0.iter().all(|channel| (0.0..=greatest).contains(channel) && (*channel as f32).is_finite()) {
            return Ok(());
        }
        let expected = if greatest.is_finite() { format!("channels from 0 to {greatest}") } else { "finite channels ≥ 0".to_string() };
        self.invalid(path, format!("{:?}", colour.0), expected)
    }

    fn transform(&self, path: &str, transform: &Transform) -> Result<(), Error> {
        for (index, operation) in transform.0.iter().enumerate() {
            let matrix = operation.matrix();
            let path = format!("{path}[{index}]");
            if let Operation::Node(name) = operation {
                let expected = "the name of a node in `animation.nodes`";
                return Err(self.fault(ErrorKind::UnknownName, &path, format!("the node {name:?}"), expected));
            }
            if !matrix.is_finite() {
                return self.invalid(&path, format!("{operation:?}"), "finite numbers, an axis, and a line of sight not along `up`");
            }
            if matrix.row(3).to_array() != [0.0, 0.0, 0.0, 1.0] {
                return self.invalid(&path, format!("the last row {:?}", matrix.row(3).to_array()), "[0, 0, 0, 1]");
            }
        }
        let matrix = transform.matrix().as_mat4();
        let inverse = transform.matrix().inverse().as_mat4();
        if matrix.is_finite() && inverse.is_finite() && transform.matrix().determinant() != 0.0 {
            return Ok(());
        }
        self.invalid(path, "a transform that flattens space or overflows", "one that can be undone")
    }

    fn shape(&self, path: &str, shape: &Shape, scene: &SceneDescription, in_group: bool) -> Result<(), Error> {
        self.transform(&format!("{path}.to_world"), &shape.to_world)?;
        self.geometry(path, shape, scene)?;
        let is_instance = matches!(shape.geometry, Geometry::Instance(_));
        match &shape.material {
            Some(_) if is_instance => {
                return self.invalid(&format!("{path}.material"), "a material", "none: the group's shapes carry their own");
            }
            Some(name) if !scene.materials.contains_key(name) => {
                let expected = one_of("material", scene.materials.keys());
                return Err(self.fault(ErrorKind::UnknownName, &format!("{path}.material"), format!("{name:?}"), expected));
            }
            None if !is_instance => return self.invalid(path, "no `material`", one_of("material", scene.materials.keys())),
            _ => {}
        }
        if let Some(emission) = &shape.emission {
            if is_instance || in_group {
                let expected = "emission on shapes outside groups only";
                return Err(self.fault(ErrorKind::Unsupported, &format!("{path}.emission"), "emission", expected));
            }
            let material = shape.material.as_ref().and_then(|name| scene.materials.get(name));
            if let Some(material @ (Material::Mask(_) | Material::Null)) = material {
                let found = format!("emission from a surface with holes (material {})", material.kind());
                return Err(self.fault(ErrorKind::Unsupported, &format!("{path}.emission"), found, "a material without holes"));
            }
            self.input(&format!("{path}.emission.radiance"), &emission.radiance, f64::INFINITY, scene)?;
        }
        for (field, medium) in [("interior", &shape.interior), ("exterior", &shape.exterior)] {
            if let Some(medium) = medium {
                self.named(&format!("{path}.{field}"), medium, "medium", &scene.media)?;
            }
        }
        let unturnable = match &shape.geometry {
            Geometry::Instance(_) => Some("false: the group's shapes say it themselves"),
            _ => None,
        };
        if let Some(expected) = unturnable.filter(|_| shape.flip_normals) {
            return Err(self.fault(ErrorKind::Unsupported, &format!("{path}.flip_normals"), "true", expected));
        }
        Ok(())
    }

    fn geometry(&self, path: &str, shape: &Shape, scene: &SceneDescription) -> Result<(), Error> {
        match &shape.geometry {
            Geometry::Rectangle | Geometry::Cube | Geometry::Disk => Ok(()),
            Geometry::Cylinder(cylinder) => self.cylinder(path, shape, cylinder),
            Geometry::Sphere(sphere) => {
                let to_world = format!("{path}.to_world");
                let path = |field: &str| format!("{path}.geometry.sphere.{field}");
                if !(sphere.radius > 0.0 && (sphere.radius as f32).is_finite()) {
                    return self.invalid(&path("radius"), sphere.radius, "a finite radius > 0");
                }
                if even_scale(&shape.to_world).is_none() {
                    let expected = "turns, moves and even scales: a sphere stays a sphere; scale it evenly or use a mesh";
                    return self.invalid(&to_world, "a scale that is not the same in every direction", expected);
                }
                if !DVec3::from(sphere.center).as_vec3().is_finite() {
                    return self.invalid(&path("center"), format!("{:?}", sphere.center), "finite numbers");
                }
                Ok(())
            }
            Geometry::Mesh(mesh) => self.mesh(&format!("{path}.geometry.mesh"), mesh),
            Geometry::Obj(mesh) => self.file_name(&format!("{path}.geometry.obj.file"), &mesh.file),
            Geometry::Ply(mesh) => self.file_name(&format!("{path}.geometry.ply.file"), &mesh.file),
            Geometry::Instance(instance) if scene.groups.contains_key(&instance.of) => Ok(()),
            Geometry::Instance(instance) => {
                let expected = one_of("group", scene.groups.keys());
                let path = format!("{path}.geometry.instance.of");
                Err(self.fault(ErrorKind::UnknownName, &path, format!("{:?}", instance.of), expected))
            }
        }
    }

    fn cylinder(&self, path: &str, shape: &Shape, cylinder: &Cylinder) -> Result<(), Error> {
        if even_scale(&shape.to_world).is_none() {
            let expected = "turns, moves and even scales: a cylinder stays round; scale it evenly or use a mesh";
            return self.invalid(&format!("{path}.to_world"), "a scale that is not the same in every direction", expected);
        }
        let path = |field: &str| format!("{path}.geometry.cylinder.{field}");
        if !(cylinder.radius > 0.0 && (cylinder.radius as f32).is_finite()) {
            return self.invalid(&path("radius"), cylinder.radius, "a finite radius > 0");
        }
        let (p0, p1) = (DVec3::from(cylinder.p0).as_vec3(), DVec3::from(cylinder.p1).as_vec3());
        if !(p0.is_finite() && p1.is_finite() && p0 != p1) {
            return self.invalid(&path("p1"), format!("an axis from {p0} to {p1}"), "two different points of finite numbers");
        }
        Ok(())
    }

    fn file_name(&self, path: &str, name: &str) -> Result<(), Error> {
        check_name(name).map_err(|expected| self.fault(ErrorKind::OutsideFolder, path, format!("{name:?}"), expected))
    }

    fn mesh(&self, path: &str, mesh: &MeshInline) -> Result<(), Error> {
        if !self.meshes {
            return Ok(());
        }
        let vertices = mesh.positions.len();
        for (field, count) in [("positions", vertices), ("indices", mesh.indices.len())] {
            if count == 0 || count > limits::MESH_ELEMENTS {
                return self.invalid(&format!("{path}.{field}"), format!("{count} entries"), format!("1 to {}", limits::MESH_ELEMENTS));
            }
        }
        let lengths = [
            ("normals", mesh.normals.as_ref().map(Vec::len)),
            ("uvs", mesh.uvs.as_ref().map(Vec::len)),
            ("colours", mesh.colours.as_ref().map(Vec::len)),
        ];
        for (field, count) in lengths {
            if let Some(count) = count.filter(|count| *count != vertices) {
                return self.invalid(&format!("{path}.{field}"), format!("{count} entries"), format!("{vertices}, one for each vertex"));
            }
        }
        let vectors = [("positions", Some(&mesh.positions)), ("normals", mesh.normals.as_ref()), ("colours", mesh.colours.as_ref())];
        for (field, list) in vectors {
            let bad = list.and_then(|list| list.iter().position(|vector| !vector.iter().all(|x| x.is_finite())));
            if let Some(index) = bad {
                return self.invalid(&format!("{path}.{field}[{index}]"), "a number that overflows", "finite numbers");
            }
        }
        if let Some(index) = mesh.uvs.as_ref().and_then(|uvs| uvs.iter().position(|uv| !uv.iter().all(|x| x.is_finite()))) {
            return self.invalid(&format!("{path}.uvs[{index}]"), "a number that overflows", "finite numbers");
        }
        for (triangle, corners) in mesh.indices.iter().enumerate() {
            if let Some((corner, index)) = corners.iter().enumerate().find(|(_, index)| **index as usize >= vertices) {
                return self.invalid(&format!("{path}.indices[{triangle}][{corner}]"), index, format!("0 to {}", vertices - 1));
            }
        }
        let known = |name: &str| self.animation.is_some_and(|animation| animation.nodes.contains_key(name));
        check_deformation(mesh, known)
            .map_err(|(field, found, expected)| self.fault(ErrorKind::Invalid, &format!("{path}.{field}"), found, expected))
    }
}

/// "one of the materials `a`, `b`": the known names, cut short past a dozen.
fn one_of<'a>(what: &str, names: impl ExactSizeIterator<Item = &'a String>) -> String {
    let count = names.len();
    if count == 0 {
        return format!("the name of a {what}; the scene has none");
    }
    let shown: Vec<String> = names.take(12).map(|name| format!("`{name}`")).collect();
    let more = if count > shown.len() { format!(" and {} more", count - shown.len()) } else { String::new() };
    format!("one of the {what}s {}{more}", shown.join(", "))
}

/// The scale of a transform that turns, moves, mirrors and scales evenly; `None` for any other.
fn even_scale(transform: &Transform) -> Option<f64> {
    let frame = DMat3::from_mat4(transform.matrix());
    let gram = frame.transpose() * frame;
    let square = (gram.x_axis.x + gram.y_axis.y + gram.z_axis.z) / 3.0;
    (gram * square.recip()).abs_diff_eq(DMat3::IDENTITY, 1e-3).then_some(square.sqrt())
}
