//! The description as a whole: it reads back what it writes, keeps to its schema, and names the place of every fault.

use super::description::{Colour, Conductor, Geometry, Material, json_schema};
use super::{ErrorKind, SceneDescription};

const SMALL: &str = r#"{
  "version": 1,
  "camera": { "perspective": { "to_world": [{ "look_at": { "origin": [0, 1, 5], "target": [0, 1, 0] } }], "fov": 40 } },
  "film": { "width": 64, "height": 48 },
  "materials": {
    "white": { "diffuse": { "reflectance": 0.8 } },
    "gold": { "conductor": { "metal": "Au", "roughness": 0.2 } },
    "glass": { "dielectric": { "interior_ior": 1.5 } }
  },
  "groups": {
    "ball": [{ "geometry": { "sphere": { "radius": 0.5 } }, "material": "glass" }],
    "balls": [{ "geometry": { "instance": { "of": "ball" } }, "to_world": [{ "translate": [1, 0, 0] }] }]
  },
  "shapes": [
    { "geometry": "rectangle", "material": "white", "emission": { "radiance": [17, 12, 4] } },
    { "geometry": { "instance": { "of": "balls" } } },
    { "geometry": { "mesh": { "positions": [[0, 0, 0], [1, 0, 0], [0, 1, 0]], "indices": [[0, 1, 2]] } }, "material": "gold" },
    { "geometry": { "obj": { "file": "models/b.obj" } }, "material": "gold" },
    { "geometry": { "ply": { "file": "a.ply" } }, "material": "gold" },
    { "geometry": { "ply": { "file": "a.ply" } }, "material": "white" }
  ],
  "environment": { "radiance": [0.1, 0.2, 0.3] }
}"#;

fn read(text: &str) -> Result<SceneDescription, super::Error> {
    SceneDescription::from_json(text, "test.json")
}

#[test]
fn it_reads_back_what_it_writes() {
    let scene = read(SMALL).unwrap();
    assert_eq!(read(&scene.to_json()).unwrap(), scene);
    assert_eq!(scene.assets(), ["a.ply", "models/b.obj"]);
    assert_eq!(scene.integrator.max_depth, 16);
    assert_eq!(scene.integrator.roulette_depth, 5);
    assert_eq!(
        scene.materials["white"],
        Material::Diffuse(super::description::Diffuse { reflectance: Colour::grey(0.8).into(), two_sided: true })
    );
    let Material::Conductor(Conductor { reflectance, roughness, .. }) = &scene.materials["gold"] else { panic!("no conductor") };
    assert_eq!((reflectance, roughness), (&Colour::WHITE.into(), &0.2.into()));
    assert_eq!(scene.shapes[0].geometry, Geometry::Rectangle);
}

/// (what stands in `SMALL`, what to put there, sort, parts of the message)
const FAULTS: &[(&str, &str, ErrorKind, &[&str])] = &[
    (r#""version": 1,"#, r#""version": 2,"#, ErrorKind::Invalid, &["version", "found 2", "expected 1"]),
    (r#""version": 1,"#, r#""version": 1,,"#, ErrorKind::Malformed, &["test.json:2:"]),
    (r#""version": 1,"#, "", ErrorKind::Malformed, &["missing field `version`"]),
    (r#""version": 1,"#, r#""version": 1, "verison": 1,"#, ErrorKind::Malformed, &["verison", "expected one of `version`", "test.json:2:"]),
    (r#""fov": 40"#, r#""fov": "wide""#, ErrorKind::Malformed, &["camera.perspective.fov", "\"wide\"", "expected f64", "test.json:3:"]),
    (r#""fov": 40"#, r#""fov": 180"#, ErrorKind::Invalid, &["camera.perspective.fov", "found 180", "(0, 180)"]),
    (r#""fov": 40"#, r#""fov": 40, "lens_radius": -1"#, ErrorKind::Invalid, &["lens_radius", "found -1", "≥ 0"]),
    (r#""fov": 40"#, r#""fov": 40, "focus_distance": 0"#, ErrorKind::Invalid, &["focus_distance", "found 0"]),
    (r#""target": [0, 1, 0]"#, r#""target": [0, 1, 5]"#, ErrorKind::Invalid, &["camera.perspective.to_world[0]", "line of sight"]),
    (r#""target": [0, 1, 0]"#, r#""target": [0, 1]"#, ErrorKind::Malformed, &["to_world[0].look_at.target", "array of length 3"]),
    (r#"[{ "look_at""#, r#"[{ "scale": [2, 2, 2] }, { "look_at""#, ErrorKind::Invalid, &["camera.perspective.to_world", "turns and moves"]),
    (r#""width": 64"#, r#""width": 0"#, ErrorKind::Invalid, &["film.width", "found 0", "1 to 65536"]),
    (r#""width": 64"#, r#""width": 65537"#, ErrorKind::Invalid, &["film.width", "found 65537"]),
    (r#""width": 64, "height": 48"#, r#""width": 65536, "height": 65536"#, ErrorKind::TooLarge, &["film", "65536 × 65536"]),
    (r#""width": 64"#, r#""width": -3"#, ErrorKind::Malformed, &["film.width", "-3", "u32"]),
    (r#""reflectance": 0.8"#, r#""reflectance": 1.8"#, ErrorKind::Invalid, &["materials.white.diffuse.reflectance", "1.8", "0 to 1"]),
    (r#""reflectance": 0.8"#, r#""reflectance": [1, 1]"#, ErrorKind::Malformed, &["materials.white.diffuse.reflectance", "[r, g, b]"]),
    (r#""reflectance": 0.8"#, r#""reflectance": "red""#, ErrorKind::Malformed, &["reflectance", "\"red\"", "a number or [r, g, b]"]),
    (r#""metal": "Au""#, r#""metal": "Xx""#, ErrorKind::Malformed, &["materials.gold.conductor.metal", "Xx", "`Au`"]),
    (
        r#""metal": "Au""#,
        r#""metal": "Au", "eta": 1"#,
        ErrorKind::Invalid,
        &["materials.gold.conductor", "metal and eta", "either `metal`"],
    ),
    (r#""metal": "Au", "#, "", ErrorKind::Invalid, &["materials.gold.conductor", "neither", "`eta` and `k`"]),
    (r#""metal": "Au""#, r#""eta": 0.2"#, ErrorKind::Invalid, &["materials.gold.conductor", "only eta"]),
    (r#""roughness": 0.2"#, r#""roughness": 1.5"#, ErrorKind::Invalid, &["materials.gold.conductor.roughness", "1.5"]),
    (r#""interior_ior": 1.5"#, r#""interior_ior": 0"#, ErrorKind::Invalid, &["materials.glass.dielectric.interior_ior", "found 0", "> 0"]),
    (r#""gold": {"#, r#""white": {"#, ErrorKind::Malformed, &["`white` twice"]),
    (r#""radius": 0.5"#, r#""radius": 0"#, ErrorKind::Invalid, &["groups.ball[0].geometry.sphere.radius", "found 0", "> 0"]),
    (r#""radius": 0.5"#, r#""radius": 0.5, "center": [1e39, 0, 0]"#, ErrorKind::Invalid, &["sphere.center", "finite"]),
    (
        r#""radius": 0.5 } }, "material": "glass""#,
        r#""radius": 0.5 } }"#,
        ErrorKind::Invalid,
        &["groups.ball[0]", "no `material`", "`gold`"],
    ),
    (
        r#""material": "white", "emission""#,
        r#""material": "grey", "emission""#,
        ErrorKind::UnknownName,
        &["shapes[0].material", "\"grey\"", "`glass`, `gold`, `white`"],
    ),
    (r#""of": "balls""#, r#""of": "bell""#, ErrorKind::UnknownName, &["shapes[1].geometry.instance.of", "\"bell\"", "`ball`, `balls`"]),
    (
        r#""radius": 0.5 } }"#,
        r#""radius": 0.5 } }, "to_world": [{ "scale": [1, 2, 1] }]"#,
        ErrorKind::Invalid,
        &["groups.ball[0].to_world", "evenly"],
    ),
    (r#""of": "ball" }"#, r#""of": "balls" }"#, ErrorKind::Invalid, &["groups.balls", "balls → balls"]),
    (
        r#""material": "glass" }]"#,
        r#""material": "glass", "emission": { "radiance": 1 } }]"#,
        ErrorKind::Unsupported,
        &["groups.ball[0].emission", "outside groups"],
    ),
    (r#""radiance": [17, 12, 4]"#, r#""radiance": [17, -12, 4]"#, ErrorKind::Invalid, &["shapes[0].emission.radiance", "-12", "≥ 0"]),
    (r#"[[0, 1, 2]]"#, r#"[[0, 1, 2], [0, 3, 1]]"#, ErrorKind::Invalid, &["geometry.mesh.indices[1][1]", "found 3", "0 to 2"]),
    (r#"[[0, 1, 2]]"#, r#"[]"#, ErrorKind::Invalid, &["shapes[2].geometry.mesh.indices", "0 entries"]),
    (r#"[[0, 1, 2]]"#, r#"[[0, 1, 2]], "normals": [[0, 0, 1]]"#, ErrorKind::Invalid, &["mesh.normals", "1 entries", "3, one for each"]),
    (r#"[1, 0, 0], [0, 1, 0]]"#, r#"[1, 0, 1e39], [0, 1, 0]]"#, ErrorKind::Malformed, &["mesh.positions[1][2]", "finite"]),
    ("models/b.obj", "../b.obj", ErrorKind::OutsideFolder, &["shapes[3].geometry.obj.file", "../b.obj", "inside the scene's folder"]),
    ("models/b.obj", "/b.obj", ErrorKind::OutsideFolder, &["shapes[3].geometry.obj.file"]),
    ("models/b.obj", "C:/b.obj", ErrorKind::OutsideFolder, &["shapes[3].geometry.obj.file"]),
    (r#""translate": [1, 0, 0]"#, r#""scale": [1, 0, 0]"#, ErrorKind::Invalid, &["groups.balls[0].to_world", "undone"]),
    (r#""translate": [1, 0, 0]"#, r#""translate": [1e999, 0, 0]"#, ErrorKind::Malformed, &["number out of range"]),
    (r#""translate": [1, 0, 0]"#, r#""rotate": { "axis": [0, 0, 0], "degrees": 1 }"#, ErrorKind::Invalid, &["to_world[0]", "an axis"]),
    (
        r#""translate": [1, 0, 0]"#,
        r#""matrix": [[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,1,1]]"#,
        ErrorKind::Invalid,
        &["to_world[0]", "[0, 0, 0, 1]"],
    ),
    (r#""radiance": [0.1, 0.2, 0.3]"#, r#""radiance": -1"#, ErrorKind::Invalid, &["environment.radiance"]),
    (r#""environment""#, r#""integrator": { "max_depth": 0 }, "environment""#, ErrorKind::Invalid, &["integrator.max_depth", "found 0"]),
];

#[test]
fn every_fault_names_its_place_what_was_found_and_what_was_expected() {
    for (good, bad, kind, parts) in FAULTS {
        assert_eq!(SMALL.matches(good).count().min(1), 1, "{good} does not stand in the scene");
        let error = read(&SMALL.replacen(good, bad, 1)).expect_err(bad);
        let message = error.to_string();
        assert_eq!(error.kind, *kind, "{message}");
        for part in parts.iter().chain(&["test.json", "found "]) {
            assert!(message.contains(part), "{bad}\n  gave: {message}\n  without: {part}");
        }
    }
}

#[test]
fn circles_and_towers_of_groups_are_refused() {
    let mut groups = String::new();
    for level in 0..40 {
        groups += &format!(r#""g{level:02}": [{{ "geometry": {{ "instance": {{ "of": "g{:02}" }} }} }}], "#, level + 1);
    }
    let tower = SMALL.replacen(r#""ball": ["#, &format!(r#"{groups} "g40": [], "ball": ["#), 1);
    assert_eq!(read(&tower).unwrap_err().kind, ErrorKind::TooLarge);
    // Ten groups of ten instances each would be ten thousand million spheres.
    let mut groups = String::new();
    for level in 0..10 {
        let of = if level == 0 { "ball".to_string() } else { format!("g{}", level - 1) };
        let instance = format!(r#"{{ "geometry": {{ "instance": {{ "of": "{of}" }} }} }}"#);
        groups += &format!(r#""g{level}": [{}], "#, [instance.as_str(); 10].join(", "));
    }
    let bomb = SMALL.replacen(r#""ball": ["#, &format!(r#"{groups} "ball": ["#), 1).replacen(r#""of": "balls""#, r#""of": "g9""#, 1);
    let error = read(&bomb).unwrap_err();
    assert_eq!((error.kind, error.found.as_str()), (ErrorKind::TooLarge, "10000000005 shapes"));
}

/// Every byte of a good scene, changed: whatever still reads, compiles or is refused, but nothing panics.
#[test]
fn no_damage_makes_it_panic() {
    let mut read_again = 0;
    for (index, replacement) in (0..SMALL.len()).flat_map(|index| [b'9', b'-', b'e', b']'].map(|byte| (index, byte))) {
        let mut bytes = SMALL.as_bytes().to_vec();
        bytes[index] = replacement;
        if let Ok(scene) = read(std::str::from_utf8(&bytes).unwrap()) {
            read_again += 1;
            let _ = super::Scene::compile(&scene, &super::NoAssets);
        }
    }
    assert!(read_again > 100, "only {read_again} of the damaged scenes could still be read: the test tests little");
}

/// Whether every key of `value` is known to `schema`: enough to notice a field that one of the two has and the other has not.
fn keys_are_known(value: &serde_json::Value, schema: &serde_json::Value, root: &serde_json::Value, path: &str) -> Result<(), String> {
    if let Some(name) = schema["$ref"].as_str() {
        let definition = &root["$defs"][name.trim_start_matches("#/$defs/")];
        return keys_are_known(value, definition, root, path);
    }
    for choice in ["oneOf", "anyOf"] {
        if let Some(options) = schema[choice].as_array() {
            let errors: Vec<String> = options.iter().filter_map(|option| keys_are_known(value, option, root, path).err()).collect();
            return if errors.len() < options.len() { Ok(()) } else { Err(errors.join("; ")) };
        }
    }
    let types = match &schema["type"] {
        serde_json::Value::Array(types) => types.iter().filter_map(|one| one.as_str()).collect(),
        one => one.as_str().into_iter().collect::<Vec<_>>(),
    };
    let found = match value {
        serde_json::Value::Object(_) => "object",
        serde_json::Value::Array(_) => "array",
        serde_json::Value::String(_) => "string",
        serde_json::Value::Bool(_) => "boolean",
        serde_json::Value::Number(number) if number.is_f64() => "number",
        serde_json::Value::Number(_) => "integer",
        serde_json::Value::Null => "null",
    };
    if !(types.is_empty() || types.contains(&found) || found == "integer" && types.contains(&"number")) {
        return Err(format!("{path}: {found} is none of {types:?}"));
    }
    if let Some(constant) = schema.get("const").filter(|constant| *constant != value) {
        return Err(format!("{path}: not {constant}"));
    }
    if let Some(words) = schema["enum"].as_array().filter(|words| !words.contains(value)) {
        return Err(format!("{path}: none of {words:?}"));
    }
    for name in schema["required"].as_array().into_iter().flatten().filter_map(|name| name.as_str()) {
        value.get(name).ok_or_else(|| format!("{path}: no {name}"))?;
    }
    for (key, inner) in value.as_object().into_iter().flatten() {
        let known = schema["properties"].get(key).unwrap_or(&schema["additionalProperties"]);
        if known.is_null() || *known == serde_json::Value::Bool(false) {
            return Err(format!("{path}: unknown {key}"));
        }
        keys_are_known(inner, known, root, &format!("{path}.{key}"))?;
    }
    for (index, inner) in value.as_array().into_iter().flatten().enumerate() {
        keys_are_known(inner, &schema["items"], root, &format!("{path}[{index}]"))?;
    }
    Ok(())
}

#[test]
fn the_schema_knows_what_the_reader_knows() {
    let schema = json_schema();
    let small: serde_json::Value = serde_json::from_str(SMALL).unwrap();
    keys_are_known(&small, &schema, &schema, "").unwrap();
    let written: serde_json::Value = serde_json::from_str(&read(SMALL).unwrap().to_json()).unwrap();
    keys_are_known(&written, &schema, &schema, "").unwrap();
    let wrong: serde_json::Value = serde_json::from_str(&SMALL.replace("radius", "radios")).unwrap();
    assert!(keys_are_known(&wrong, &schema, &schema, "").is_err());
}

#[test]
fn our_own_scenes_are_sound() {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/scenes");
    let schema = json_schema();
    let scenes: [(&str, &[&str]); 6] = [
        ("cornell-box", &[]),
        ("colonnade", &[]),
        ("turning-box", &[]),
        ("door-ajar", &[]),
        ("glossy-counter", &[]),
        ("hall", &["column.obj", "urn.ply"]),
    ];
    for (name, assets) in scenes {
        let path = folder.join(name).with_extension("json");
        let loaded = super::load(&path).unwrap();
        assert_eq!(loaded.description.assets(), assets);
        let written: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(&path).unwrap()).unwrap();
        keys_are_known(&written, &schema, &schema, name).unwrap();
        let scene = super::Scene::compile(&loaded.description, &loaded.assets).unwrap();
        assert!(!scene.lights.is_empty(), "{name} is dark");
        assert!(scene.world.bounds().radius() < 100.0, "{name} is larger than a building");
    }
}
