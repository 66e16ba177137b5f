//! `fetiplast verify`: the program against closed forms.

use std::path::PathBuf;

use clap::Args;

use super::{Failure, is_mute};
use crate::comm::Comm;
use crate::element::Kind;
use crate::results::replace::{self, Form};
use crate::results::write_json;
use crate::verify::{self, Measured, Report};

/// Arguments of `verify`.
#[derive(Debug, Args)]
pub struct Verify {
    /// Cases to run, all by default; an unknown name lists them.
    #[arg(value_name = "CASE")]
    cases: Vec<String>,
    /// Only this element: tet4, hex8 or tet10.
    #[arg(long, value_name = "NAME", value_parser = element)]
    element: Option<Kind>,
    /// Write errors, counts and times as JSON.
    #[arg(long, value_name = "FILE")]
    summary: Option<PathBuf>,
}

impl Verify {
    /// What to tell of a name that no case has.
    pub fn refusal(&self) -> Option<String> {
        verify::select(&self.cases).err()
    }
}

fn element(text: &str) -> Result<Kind, String> {
    let found = verify::ELEMENTS.into_iter().find(|element| element.name() == text);
    let [others @ .., last] = verify::ELEMENTS.map(Kind::name);
    found.ok_or_else(|| format!("it is {} or {last}", others.join(", ")))
}

/// Runs cases and says what became of them: exit code 0 if all demands are met. Collective.
///
/// # Errors
/// If the summary cannot be written, or a case is no sound scene.
pub fn verify(arguments: &Verify, comm: &dyn Comm) -> Result<i32, Failure> {
    if let Some(file) = &arguments.summary {
        replace::probe(comm, file, Form::Text).map_err(Failure::Place)?;
    }
    let mut report = Report { cases: Vec::new(), passed: true };
    for case in verify::select(&arguments.cases).unwrap_or_default() {
        let [name, about] = case.title();
        tracing::info!("{name}: {about}");
        let wanted =
            |element: &Kind| arguments.element.is_none_or(|only| only == *element) && !case.levels(*element).is_empty();
        if is_mute(comm) {
            return Err(Failure::Mute { path: None });
        }
        for (index, element) in verify::ELEMENTS.into_iter().filter(wanted).enumerate() {
            let mut tell = |measured: &Measured| {
                if index == 0 && measured.rows.len() == 1 {
                    tracing::info!("{}", measured.header());
                }
                tracing::info!("{}", measured.line());
            };
            let measured = verify::measure(case, element, comm, &mut tell)?;
            for verdict in measured.verdicts.iter().filter(|verdict| !verdict.met) {
                tracing::warn!("{name} {}: MISSED {}", element.name(), verdict.text);
            }
            report.passed &= measured.passed();
            report.cases.push(measured);
        }
    }
    if let Some(file) = &arguments.summary {
        write_json(comm, file, &report)?;
    }
    tracing::info!("{}", if report.passed { "All demands are met." } else { "Some demands are MISSED." });
    Ok(i32::from(!report.passed))
}
