//! What CONTRIBUTING.md says of extensions: which rooms may name an element or a law.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use crate::element::Kind;
use crate::material::{History, Variables};

/// All source files but those of tests.
fn sources(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("the source is there") {
        let path = entry.expect("a folder can be read").path();
        let is_test =
            ["tests", "tests.rs", "orders.rs", "fixture.rs", "extension.rs"].iter().any(|name| path.ends_with(name));
        if path.is_dir() && !is_test {
            sources(&path, found);
        } else if path.extension().is_some_and(|end| end == "rs") && !is_test {
            found.push(path);
        }
    }
}

/// Words of a file, without comments and tests.
fn words(path: &Path) -> BTreeSet<String> {
    let text = fs::read_to_string(path).expect("the source is text");
    let code = text.split("#[cfg(test)]\nmod tests {").next().unwrap_or_default();
    let lines = code.lines().filter(|line| !line.trim_start().starts_with("//"));
    let words = lines.flat_map(|line| line.split(|c: char| !c.is_alphanumeric() && c != '_'));
    words.map(str::to_owned).collect()
}

/// Fails if a file outside of these rooms has one of the words.
fn assert_only_in(rooms: &[&str], names: &[String]) {
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut files = Vec::new();
    sources(&source, &mut files);
    assert!(files.len() > 100, "{} files", files.len());
    let mut seen = BTreeSet::new();
    for file in files {
        let place = file.strip_prefix(&source).expect("it is in the source");
        let known: Vec<&String> = names.iter().filter(|name| words(&file).contains(*name)).collect();
        let may = rooms.iter().any(|room| place.starts_with(room));
        assert!(may || known.is_empty(), "{} names {known:?}, which only {rooms:?} may", place.display());
        seen.extend(known.into_iter().cloned());
    }
    assert_eq!(seen.len(), names.len(), "{seen:?}");
}

/// Everything else asks `Kind`. Verification demands other things of other elements.
#[test]
fn elements_are_named_in_their_own_room_and_in_verification_only() {
    let names: Vec<String> = Kind::ALL.iter().flat_map(|kind| [format!("{kind:?}"), kind.name().to_owned()]).collect();
    assert_only_in(&["element", "verify"], &names);
}

/// Everything else asks `Law`. Closed forms are those of a law, and verification compares with them.
#[test]
fn laws_and_their_variables_are_named_in_their_own_room_and_where_closed_forms_are_only() {
    let mut virgin = History::VIRGIN;
    let mut names: Vec<String> = virgin.variables().map(|(name, _)| name.to_owned()).collect();
    names.extend(["VonMises", "PlasticState", "yield_stress", "kinematic_hardening"].map(str::to_owned));
    assert_only_in(&["material", "analytic", "verify"], &names);
}
