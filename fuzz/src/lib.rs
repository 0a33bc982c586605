//! What the fuzz targets share: reading bytes as a scene, a mesh or an image, with a few small files beside them.

use gradfarm_core::scene::read::{Format, read};
use gradfarm_core::scene::{Assets, Error, ErrorKind, Scene, SceneDescription};

/// The fuzzed bytes under the name `x`, and the files that the seeds refer to.
struct Files<'a>(&'a [u8]);

impl Assets for Files<'_> {
    fn open(&self, name: &str) -> Result<Vec<u8>, Error> {
        match name {
            "x" => Ok(self.0.to_vec()),
            "square.ply" => Ok(include_bytes!("../../tests/scenes/seeds/square.ply").to_vec()),
            "picture.png" => Ok(include_bytes!("../../tests/scenes/seeds/picture.png").to_vec()),
            "more.pbrt" => Ok(include_bytes!("../../tests/scenes/seeds/more.pbrt").to_vec()),
            _ => Err(Error::new(ErrorKind::Unreadable, name, "", "no such file", "one of the seeds")),
        }
    }
}

/// Reads a scene. One that is read must pass its own check and come back from its JSON as it was.
pub fn scene(format: Format, bytes: &[u8]) {
    if let Ok(imported) = read(format, bytes.to_vec(), "fuzzed", &Files(b"")) {
        imported.description.validate("fuzzed").expect("what an importer makes is valid");
        let again = SceneDescription::from_json(&imported.description.to_json(), "fuzzed");
        assert_eq!(again.expect("what is written can be read"), imported.description);
    }
}

/// Reads a mesh; `kind` is `obj` or `ply`.
pub fn mesh(kind: &str, bytes: &[u8]) {
    compile("", &format!(r#"{{"{kind}": {{"file": "x"}}}}"#), "0.5", bytes);
}

/// Reads an image as a texture.
pub fn image(bytes: &[u8]) {
    compile(r#""t": {"bitmap": {"file": "x"}}"#, r#""cube""#, r#"{"texture": "t"}"#, bytes);
}

fn compile(textures: &str, geometry: &str, reflectance: &str, bytes: &[u8]) {
    let text = format!(
        r#"{{"version": 1, "camera": {{"perspective": {{"fov": 40}}}}, "textures": {{{textures}}},
            "materials": {{"m": {{"diffuse": {{"reflectance": {reflectance}}}}}}}, "shapes": [{{"geometry": {geometry}, "material": "m"}}]}}"#
    );
    let description = SceneDescription::from_json(&text, "around.json").expect("the scene around the bytes is sound");
    let _ = Scene::compile(&description, &Files(bytes));
}
