//! What has changed from one scene to another, key by key.

use toml::{Table, Value};

/// The keys in which two scenes differ (as [`super::Scene::to_toml`] writes them), with both values.
pub fn changes(before: &str, now: &str) -> Vec<String> {
    let read = |text: &str| Value::Table(text.parse::<Table>().unwrap_or_default());
    let mut found = Vec::new();
    compare("", Some(&read(before)), Some(&read(now)), &mut found);
    found
}

fn compare(key: &str, before: Option<&Value>, now: Option<&Value>, found: &mut Vec<String>) {
    let below = |name: &str| if key.is_empty() { name.to_owned() } else { format!("{key}.{name}") };
    match (before, now) {
        (Some(Value::Table(before)), Some(Value::Table(now))) => {
            let added = now.keys().filter(|name| !before.contains_key(*name));
            for name in before.keys().chain(added) {
                compare(&below(name), before.get(name), now.get(name), found);
            }
        }
        (Some(Value::Array(before)), Some(Value::Array(now))) => {
            for k in 0..before.len().max(now.len()) {
                compare(&below(&k.to_string()), before.get(k), now.get(k), found);
            }
        }
        (Some(before), Some(now)) if before != now => found.push(format!("{key} was {before}, is {now}")),
        (Some(_), None) => found.push(format!("{key} is gone")),
        (None, Some(_)) => found.push(format!("{key} is new")),
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn changed_new_and_lost_keys_are_named() {
        let before = "title = \"a\"\n[load.top]\ntraction = [0.0, 0.0, -1.5]\n[material.steel]\nyoung = 1.0";
        let now = "title = \"a\"\n[load.top]\ntraction = [0.0, 0.0, -2.5]\n[material.copper]\nyoung = 1.0";
        assert_eq!(changes(before, before), Vec::<String>::new());
        let expected = ["load.top.traction.2 was -1.5, is -2.5", "material.steel is gone", "material.copper is new"];
        assert_eq!(changes(before, now), expected);
    }
}
