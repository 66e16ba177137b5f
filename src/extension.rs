//! What CONTRIBUTING.md says of extensions: which rooms may name an element or a law.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use crate::element::Kind;
use crate::material::{History, Variables};

/// The source without comments and tests beside it: path of each file from the project's folder, and code.
pub fn sources() -> Vec<(String, String)> {
    let mut found = Vec::new();
    walk(&Path::new(env!("CARGO_MANIFEST_DIR")).join("src"), &mut found);
    assert!(found.len() > 100, "{} files", found.len());
    found
}

fn walk(folder: &Path, found: &mut Vec<(String, String)>) {
    for entry in fs::read_dir(folder).expect("the source is there") {
        let path = entry.expect("a folder can be read").path();
        if path.is_dir() {
            walk(&path, found);
        } else if path.extension().is_some_and(|end| end == "rs") && !path.ends_with("tests.rs") {
            let text = fs::read_to_string(&path).expect("the source is text");
            let code = text.split("#[cfg(test)]\nmod tests {").next().unwrap_or_default();
            let lines = code.lines().filter(|line| !line.trim_start().starts_with("//"));
            let name = path.strip_prefix(env!("CARGO_MANIFEST_DIR")).expect("it is in the project").display();
            found.push((name.to_string(), lines.collect::<Vec<_>>().join("\n")));
        }
    }
}

/// Fails if a file outside of these rooms, and of tests, has one of the words.
fn assert_only_in(rooms: &[&str], names: &[String]) {
    let mut seen = BTreeSet::new();
    let is_test = |file: &str| {
        file.contains("/tests/") || ["/orders.rs", "/fixture.rs", "/extension.rs"].iter().any(|end| file.ends_with(end))
    };
    for (file, code) in sources().into_iter().filter(|(file, _)| !is_test(file)) {
        let words: BTreeSet<&str> = code.split(|c: char| !c.is_alphanumeric() && c != '_').collect();
        let known: Vec<&String> = names.iter().filter(|name| words.contains(&name[..])).collect();
        let may = rooms.iter().any(|room| file.starts_with(&format!("src/{room}/")));
        assert!(may || known.is_empty(), "{file} names {known:?}, which only {rooms:?} may");
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
