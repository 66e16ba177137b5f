//! From text to a typed scene, keeping the place of whatever is wrong.

use std::ops::Range;

use toml::Table;
use toml::de::{DeArray, DeTable};

use super::error::{Place, SceneError, in_user_words};
use super::{Scene, overrides};

/// Reads the text and applies the overrides; nothing is checked but form and types.
pub(super) fn scene(text: &str, origin: &str, sets: &[String]) -> Result<Scene, SceneError> {
    let syntax = |error: toml::de::Error| SceneError::Syntax {
        place: Place::Text { origin: origin.to_owned(), position: error.span().map(|span| line_column(text, span)) },
        message: in_user_words(error.message()),
    };
    // A value tree knows no places, so the text is also read directly: its own errors are reported with theirs. But only the
    // tree's reader minds lists that are too long.
    let unchanged = toml::from_str::<Scene>(text);
    let tree: Table = toml::from_str(text).map_err(syntax)?;
    let changed = overrides::apply(tree.clone(), sets)?;
    changed.try_into().map_err(|error| match unchanged {
        Err(own) => syntax(own),
        Ok(_) if sets.is_empty() => too_long(text, origin, &error),
        Ok(_) => overrides::blame(&tree, sets, &error),
    })
}

/// The error for a tree whose text was fine; it ends with the key.
fn too_long(text: &str, origin: &str, error: &toml::de::Error) -> SceneError {
    let message = in_user_words(&error.to_string());
    let key = message.rsplit('`').nth(1).unwrap_or_default();
    SceneError::Syntax { place: place(text, origin, &[], key), message }
}

/// The text of a file.
pub(super) fn text(bytes: Vec<u8>, origin: &str) -> Result<String, SceneError> {
    let no_text = |before: &[u8]| {
        let before = String::from_utf8_lossy(before);
        let position = Some(line_column(&before, before.len()..before.len()));
        let message = "this is no text in UTF-8, as scenes are".to_owned();
        SceneError::Syntax { place: Place::Text { origin: origin.to_owned(), position }, message }
    };
    // Where texts go from rank to rank they end at a NUL, which TOML has not either.
    match (bytes.iter().position(|byte| *byte == 0), String::from_utf8(bytes)) {
        (None, Ok(text)) => Ok(text),
        (_, Err(error)) => Err(no_text(&error.as_bytes()[..error.utf8_error().valid_up_to()])),
        (Some(at), Ok(text)) => Err(no_text(&text.as_bytes()[..at])),
    }
}

/// Where a dotted key got its value: an override, or the nearest line of the text.
pub(super) fn place(text: &str, origin: &str, sets: &[String], key: &str) -> Place {
    match sets.iter().rev().find(|set| overrides::concerns(set, key)) {
        Some(set) => Place::Override(set.clone()),
        None => Place::Text { origin: origin.to_owned(), position: position(text, key) },
    }
}

fn position(text: &str, key: &str) -> Option<(usize, usize)> {
    let root = DeTable::parse(text).ok()?;
    let (mut table, mut rows) = (Some(root.get_ref()), None::<&DeArray>);
    let mut found = None;
    for part in key.split('.') {
        let (span, value) = match (table, rows) {
            (Some(table), _) => {
                let Some((name, value)) = table.iter().find(|(name, _)| name.get_ref() == part) else { break };
                (name.span(), value)
            }
            (_, Some(rows)) => {
                let row = part.parse::<usize>().ok().and_then(|index| rows.get(index));
                let Some(row) = row else { break };
                (row.span(), row)
            }
            _ => break,
        };
        found = Some(line_column(text, span));
        (table, rows) = (value.get_ref().as_table(), value.get_ref().as_array());
    }
    found
}

/// Line and column of the beginning of a span of bytes, from 1; columns count characters.
fn line_column(text: &str, span: Range<usize>) -> (usize, usize) {
    let before = text.get(..span.start).unwrap_or(text);
    let line_start = before.rfind('\n').map_or(0, |end| end + 1);
    (before.matches('\n').count() + 1, before[line_start..].chars().count() + 1)
}
