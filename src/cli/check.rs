//! `fetiplast check`: what a scene would cost, before it is solved.

use clap::Args;

use super::{Failure, Source, describe_run, find, warnings};
use crate::comm::Comm;
use crate::monitor::Monitor;
use crate::monitor::events::{Event, Sink};
use crate::monitor::progress::Mode;
use crate::results::replace::{self, Form};
use crate::results::summary::Summary;
use crate::study::{self, StudyError};

/// Arguments of `check`.
#[derive(Debug, Args)]
pub struct Check {
    #[command(flatten)]
    source: Source,
}

/// Reports sizes and warnings of a scene. Collective.
///
/// # Errors
/// If the scene is bad or files cannot be read or written.
pub fn check(arguments: &Check, comm: &dyn Comm) -> Result<i32, Failure> {
    let source = &arguments.source;
    let mut monitor = Monitor::of_rank(comm.rank(), Mode::Off);
    let scene = find(source, comm)?.at_level(source.level, &source.sets)?;
    if let Some(file) = &source.summary {
        replace::probe(comm, file, Form::Text).map_err(Failure::Place)?;
    }
    let discrete = study::discretise(&scene, comm)?;
    study::held(&scene, &discrete, comm)?;
    if let Some(initial) = &scene.initial {
        study::earlier(comm, &scene, &discrete, initial).map_err(StudyError::from)?;
    }
    let sizes = study::sizes(&discrete, comm);
    let memory = study::memory_estimate_mb(&scene, &discrete, comm);
    let warnings = warnings(&scene, &discrete, comm);
    monitor.event(&Event::Sizes {
        scene: source.scene.clone(),
        level: source.level,
        ranks: comm.size(),
        sizes: sizes.clone(),
    });
    discrete.contact_rows.iter().for_each(|row| monitor.event(&Event::Contact(row.clone())));
    discrete.reading_mb.into_iter().for_each(|megabytes| monitor.event(&Event::Reading { megabytes }));
    monitor.event(&Event::Memory { megabytes: memory });
    warnings.iter().for_each(|text| monitor.event(&Event::Warning(text.clone())));
    if let Some(file) = &source.summary {
        let mut summary = Summary { sizes, warnings, title: scene.title.clone(), ..Summary::default() };
        summary.contacts = discrete.contact_rows.clone();
        summary.memory_estimate_mb = Some(memory);
        summary.mesh_reading_mb = discrete.reading_mb;
        describe_run(&mut summary, source, comm);
        summary.write(comm, file)?;
    }
    Ok(0)
}
