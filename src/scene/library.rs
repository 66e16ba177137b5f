//! Scenes that come with the program; `fetiplast show NAME` prints one to start from.

const SCENES: [(&str, &str); 6] = [
    ("bar", include_str!("library/bar.toml")),
    ("patch", include_str!("library/patch.toml")),
    ("shear", include_str!("library/shear.toml")),
    ("step-42", include_str!("library/step-42.toml")),
    ("two-blocks", include_str!("library/two-blocks.toml")),
    ("two-blocks-elastic", include_str!("library/two-blocks-elastic.toml")),
];

/// Names of the built-in scenes, sorted.
pub fn names() -> impl Iterator<Item = &'static str> {
    SCENES.iter().map(|(name, _)| *name)
}

/// The TOML of a built-in scene, comments included.
pub fn text(name: &str) -> Option<&'static str> {
    SCENES.iter().find(|(known, _)| *known == name).map(|(_, text)| *text)
}
