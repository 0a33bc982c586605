//! The names of Mitsuba 0.x in the words of Mitsuba 3: `toWorld` is `to_world`, `intIOR` is `int_ior`.

/// Names that the rule of [`modern`] does not reach, with what they are called since.
const RENAMED: [(&str, &str); 5] = [("lookAt", "lookat"), ("intIOR", "int_ior"), ("extIOR", "ext_ior"), ("B", "B"), ("C", "C")];

/// The name since Mitsuba 2: an underscore before every capital, which becomes small; names of today stay as they are.
pub(super) fn modern(name: &str) -> String {
    if let Some((_, renamed)) = RENAMED.iter().find(|(old, _)| *old == name) {
        return (*renamed).to_string();
    }
    let mut modern = String::with_capacity(name.len() + 4);
    for (index, c) in name.chars().enumerate() {
        if c.is_ascii_uppercase() && index > 0 {
            modern.push('_');
        }
        modern.push(c.to_ascii_lowercase());
    }
    modern
}

#[cfg(test)]
mod tests {
    use super::modern;

    #[test]
    fn old_names_become_new_ones_and_new_ones_stay() {
        for (old, new) in [
            ("toWorld", "to_world"),
            ("maxDepth", "max_depth"),
            ("intIOR", "int_ior"),
            ("specularReflectance", "specular_reflectance"),
            ("lookAt", "lookat"),
            ("alphaU", "alpha_u"),
            ("fovAxis", "fov_axis"),
            ("cropOffsetX", "crop_offset_x"),
            ("maxSmoothAngle", "max_smooth_angle"),
            ("sigmaT", "sigma_t"),
        ] {
            assert_eq!(modern(old), new);
            assert_eq!(modern(new), new);
        }
    }
}
