//! `--set dotted.path=value`: changes to the value tree between reading and typing.
//!
//! Paths are TOML keys; a number steps into an array (`load.top.traction.2=-75`). Values are TOML; what is not TOML but
//! begins with a letter is a string, so that shells need no quotes (`solver.qp=active-set`). A path may name a key that
//! is absent; whether such a key exists at all is decided when the tree is typed.

use toml::{Table, Value};

use super::error::in_user_words;
use super::{Scene, SceneError};

/// Sections whose entries have names of the user's choice.
const NAMED: [&str; 5] = ["material", "body", "support", "load", "contact"];

struct Override {
    path: Vec<String>,
    value: Value,
}

/// The tree with all overrides applied in order.
pub(super) fn apply(mut tree: Table, sets: &[String]) -> Result<Table, SceneError> {
    let changes = sets.iter().map(|set| parse(set)).collect::<Result<Vec<_>, _>>()?;
    give_way(&mut tree, &changes);
    for (change, set) in changes.into_iter().zip(sets) {
        insert(&mut tree, change).map_err(|problem| refused(set, problem))?;
    }
    Ok(tree)
}

/// The error for a tree that was fine before the overrides: names the override that breaks it alone, or else all.
pub(super) fn blame(tree: &Table, sets: &[String], error: &toml::de::Error) -> SceneError {
    let culprit = sets.iter().find(|set| {
        let changed = apply(tree.clone(), std::slice::from_ref(set)).ok().map(Table::try_into::<Scene>);
        matches!(changed, Some(Err(alone)) if alone.message() == error.message())
    });
    // Without a text, toml's own message ends in a line "in `section`", which is wanted here.
    let problem = in_user_words(&error.to_string());
    match culprit {
        Some(set) => refused(set, new_entry(tree, set, &problem).unwrap_or(problem)),
        None => refused(&sets.join(" --set "), problem),
    }
}

/// Whether this override gives the key its value, as a whole or in part.
pub fn concerns(set: &str, key: &str) -> bool {
    parse(set).is_ok_and(|Override { mut path, .. }| {
        path.pop_if(|last| last.parse::<usize>().is_ok());
        let path = path.join(".");
        key.strip_prefix(&path).is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
    })
}

/// Adds overrides that cut bodies otherwise to those of a run that goes on; earlier ones that they make meaningless are dropped.
///
/// # Errors
/// If one is malformed, or of another section.
pub fn recut(sets: &mut Vec<String>, more: Vec<String>) -> Result<(), SceneError> {
    let keys = |set: &str| parse(set).map(|Override { path, .. }| path);
    for set in &more {
        let path = keys(set)?;
        if path[0] != "decomposition" {
            let problem =
                "a run that goes on solves the problem that it began with: only keys of decomposition can be set";
            return Err(refused(set, problem.into()));
        }
        let stale = match path.get(1).map(String::as_str) {
            Some("subdomains") => "method",
            Some("method" | "cells") => "subdomains",
            _ => continue,
        };
        sets.retain(|before| keys(before).is_ok_and(|path| path != ["decomposition", stale]));
    }
    sets.extend(more);
    Ok(())
}

fn refused(set: &str, problem: String) -> SceneError {
    SceneError::Override { set: set.to_owned(), problem }
}

/// Whether this is an override at all, whatever the scene.
///
/// # Errors
/// What is wrong with it.
pub fn well_formed(set: &str) -> Result<(), String> {
    split(set).map(drop)
}

fn parse(set: &str) -> Result<Override, SceneError> {
    split(set).map_err(|problem| refused(set, problem))
}

fn split(set: &str) -> Result<Override, String> {
    let (path, value) = set.split_once('=').ok_or("write dotted.path=value, as in solver.qp=active-set")?;
    let path = parse_path(path).ok_or_else(|| format!("`{path}` is not a dotted path"))?;
    Ok(Override { path, value: parse_value(value.trim())? })
}

fn parse_path(path: &str) -> Option<Vec<String>> {
    let mut table: Table = toml::from_str(&format!("{path} = 0")).ok()?;
    let mut parts = Vec::new();
    loop {
        let mut entries = std::mem::take(&mut table).into_iter();
        let (part, inner) = entries.next().filter(|_| entries.next().is_none())?;
        parts.push(part);
        match inner {
            Value::Table(inner) => table = inner,
            _ => return Some(parts),
        }
    }
}

fn parse_value(value: &str) -> Result<Value, String> {
    match toml::from_str::<Table>(&format!("value = {value}")) {
        Ok(mut table) if table.len() == 1 => Ok(table.remove("value").expect("the key just written")),
        _ if value.starts_with(char::is_alphabetic) => Ok(Value::String(value.to_owned())),
        Ok(_) => Err("give one value".to_owned()),
        Err(error) => Err(format!("`{value}` is not a TOML value: {}", in_user_words(error.message()))),
    }
}

/// Keys of the file that an override makes meaningless: `subdomains` alone selects metis whatever method and cells the file
/// has, a method alone drops the keys of others.
fn give_way(tree: &mut Table, changes: &[Override]) {
    let given = |key: &str| changes.iter().find(|change| change.path == ["decomposition", key]);
    let stale: &[&str] = match (given("method").map(|method| method.value.as_str()), given("subdomains")) {
        (None, Some(_)) => &["method", "cells"],
        (Some(Some("bricks")), None) => &["subdomains"],
        (Some(Some("auto")), None) => &["subdomains", "cells"],
        (Some(Some("metis")), _) => &["cells"],
        _ => return,
    };
    if let Some(Value::Table(section)) = tree.get_mut("decomposition") {
        stale.iter().for_each(|key| drop(section.remove(*key)));
    }
}

fn insert(tree: &mut Table, change: Override) -> Result<(), String> {
    let (first, rest) = change.path.split_first().expect("a path has a part");
    let mut here = tree.entry(first).or_insert_with(|| Value::Table(Table::new()));
    let mut above = first.clone();
    for part in rest {
        here = match here {
            Value::Table(table) => table.entry(part).or_insert_with(|| Value::Table(Table::new())),
            Value::Array(values) => {
                let length = values.len();
                let index = part.parse::<usize>().ok().filter(|index| *index < length);
                let index = index.ok_or_else(|| {
                    format!("`{above}` is an array of {length}, and `{part}` is no index into it (they start at 0)")
                })?;
                &mut values[index]
            }
            other => return Err(format!("`{above}` is a single {}, it has no `{part}`", other.type_str())),
        };
        above = format!("{above}.{part}");
    }
    *here = change.value;
    Ok(())
}

/// The likely case of a misspelt name, which would otherwise be told as a key missing from a new entry.
fn new_entry(tree: &Table, set: &str, problem: &str) -> Option<String> {
    let path = parse(set).ok()?.path;
    let [section, name, _, ..] = path.as_slice() else { return None };
    let known = tree.get(section).and_then(Value::as_table);
    let incomplete = NAMED.contains(&section.as_str()) && problem.starts_with("missing key");
    if !incomplete || known.is_some_and(|known| known.contains_key(name)) {
        return None;
    }
    let known = match known.filter(|known| !known.is_empty()) {
        Some(known) => format!("has {}", known.keys().map(String::as_str).collect::<Vec<_>>().join(", ")),
        None => "is empty".to_owned(),
    };
    Some(format!("unknown key `{section}.{name}`: [{section}] {known}; a new entry needs all its keys ({problem})"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cut(before: &[&str], more: &[&str]) -> Result<Vec<String>, String> {
        let own = |sets: &[&str]| sets.iter().map(|set| set.to_string()).collect::<Vec<_>>();
        let mut sets = own(before);
        recut(&mut sets, own(more)).map(|()| sets).map_err(|error| error.to_string())
    }

    #[test]
    fn a_later_cut_takes_the_place_of_the_one_before() {
        let kept = ["load.top.traction.2=-75", "decomposition.cluster=2"];
        for (before, more) in [
            ("decomposition.subdomains=4", "decomposition.cells=[5, 5, 5]"),
            ("decomposition.subdomains=4", "decomposition.method=auto"),
            ("decomposition.method=bricks", "decomposition.subdomains=4"),
        ] {
            let found = cut(&[kept[0], before, kept[1]], &[more]).unwrap();
            assert_eq!(found, [kept[0], kept[1], more]);
        }
        let before = ["decomposition.method=bricks", "decomposition.cells=[5, 5, 5]"];
        assert_eq!(cut(&before, &["decomposition.cells.0=3"]).unwrap().len(), 3);
        assert_eq!(cut(&before, &[]).unwrap(), before);
    }

    #[test]
    fn nothing_but_the_cut_may_change() {
        let told = cut(&[], &["decomposition.subdomains=4", "material.steel.young=1"]).unwrap_err();
        assert!(
            told.starts_with("--set material.steel.young=1: ") && told.contains("only keys of decomposition"),
            "{told}"
        );
        assert!(cut(&[], &["decomposition.subdomains"]).is_err());
    }
}
