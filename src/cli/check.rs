//! `fetiplast check`: what a scene would cost, before it is solved.

use clap::Args;

use super::room::Room;
use super::solve::Cascade;
use super::{Failure, Source, describe_run, find, values};
use crate::comm::Comm;
use crate::model;
use crate::monitor::Monitor;
use crate::monitor::events::{Event, Sink};
use crate::monitor::progress::Mode;
use crate::record::counts::{ContactRow, Sizes};
use crate::record::summary::Summary;
use crate::restart;
use crate::results;
use crate::results::replace::{self, Form};
use crate::scene::Scene;
use crate::sizing;
use crate::sizing::counts::Counted;
use crate::sizing::forecast::forecast;
use crate::sizing::likeness::{Look, Refused};
use crate::sizing::memory::Memory;
use crate::study::adaptive::start::{Start, start};

/// Arguments of `check`.
#[derive(Debug, Args)]
pub struct Check {
    #[command(flatten)]
    source: Source,
    /// Tell what each of so many ranks would hold, item by item, and how long the run would take.
    #[arg(long, value_name = "N", value_parser = values::ranks, allow_negative_numbers = true)]
    ranks: Option<usize>,
}

/// What is told where meshes will be refined.
const FIRST: &str = "all that follows is of the first meshes; what solver.error takes is not known before";

/// Scenes of more tetrahedra are not built.
const BUILT: u64 = 150_000;

/// Reports sizes and warnings of a scene. Collective.
///
/// # Errors
/// If the scene is bad or files cannot be read or written.
pub fn check(arguments: &Check, comm: &dyn Comm) -> Result<i32, Failure> {
    let source = &arguments.source;
    let mut monitor = Monitor::of_rank(comm.rank(), Mode::Off);
    let mut scene = find(source, comm)?.at_level(source.level, &source.sets)?;
    if scene.solver.error.is_some() {
        let is_chosen = |name: &str| super::is_chosen(source, name);
        let Start { read: [first, _], notes, .. } = start(&scene, is_chosen).map_err(Failure::Scene)?;
        notes.into_iter().chain([FIRST.to_owned()]).for_each(|note| monitor.event(&Event::Note(note)));
        scene = first;
    }
    if let Some(file) = &source.summary {
        replace::probe(comm, file, Form::Text).map_err(Failure::Place)?;
    }
    let found = match Counted::new(&scene).filter(|counted| counted.tetrahedra() > BUILT) {
        Some(counted) => Found::from_counts(&scene, &counted, comm)?,
        None => Found::from_built(&scene, comm)?,
    };
    let Found { sizes, memory, contacts, mut warnings, reading_mb } = found;
    let room = Room::find(comm, &memory);
    warnings = super::warnings(&scene, &warnings, sizes.subdomains, comm);
    warnings.extend(room.as_ref().and_then(Room::warning));
    let (megabytes, available_mb) = (memory.total_mb(comm.size()), room.map(|room| room.everywhere_mb));
    monitor.event(&Event::Sizes {
        scene: source.scene.clone(),
        level: source.level,
        ranks: comm.size(),
        sizes: sizes.clone(),
    });
    contacts.iter().for_each(|row| monitor.event(&Event::Contact(row.clone())));
    reading_mb.into_iter().for_each(|megabytes| monitor.event(&Event::Reading { megabytes }));
    monitor.event(&Event::Memory { megabytes, available_mb });
    let held = arguments.ranks.map(|ranks| (ranks, memory.held(ranks)));
    held.iter().for_each(|(ranks, rows)| monitor.event(&Event::Held { ranks: *ranks, rows: rows.clone() }));
    // A level has as many cells along an edge.
    let levels = Cascade::Auto.before(source.level, &scene).into_iter().chain([source.level]);
    let parts: Vec<f64> = levels.map(|level| (level as f64 / source.level as f64).powi(3)).collect();
    let forecast = arguments.ranks.map(|ranks| forecast((&sizes, scene.body.len()), &memory, ranks, &parts));
    forecast.iter().for_each(|forecast| monitor.event(&Event::Forecast(forecast.clone())));
    warnings.iter().for_each(|text| monitor.event(&Event::Warning(text.clone())));
    if let Some(file) = &source.summary {
        let mut summary = Summary { sizes, warnings, contacts, title: scene.title.clone(), ..Summary::default() };
        summary.memory_estimate_mb = Some(megabytes);
        summary.memory_available_mb = available_mb;
        summary.mesh_reading_mb = reading_mb;
        if let Some((ranks, rows)) = held {
            (summary.memory_ranks, summary.memory_of_rank, summary.forecast) = (Some(ranks), rows, forecast);
        }
        describe_run(&mut summary, source, comm);
        results::write_json(comm, file, &summary)?;
    }
    Ok(0)
}

/// What a check finds.
struct Found {
    sizes: Sizes,
    memory: Memory,
    contacts: Vec<ContactRow>,
    warnings: Vec<String>,
    reading_mb: Option<f64>,
}

impl Found {
    /// By building the problem as solving does.
    fn from_built(scene: &Scene, comm: &dyn Comm) -> Result<Self, Failure> {
        let discrete = model::discretise(scene, comm)?;
        model::held::held(scene, &discrete, comm)?;
        if let Some(initial) = &scene.initial {
            restart::state::earlier(comm, scene, &discrete, initial)?;
        }
        Ok(Self {
            sizes: sizing::sizes(&discrete, comm),
            memory: sizing::memory(scene, &discrete, comm),
            contacts: discrete.contacts.rows,
            warnings: discrete.warnings,
            reading_mb: discrete.reading_mb,
        })
    }

    /// Without building anything as large as the scene.
    fn from_counts(scene: &Scene, counted: &Counted, comm: &dyn Comm) -> Result<Self, Failure> {
        let mut sizes = counted.sizes();
        let refused = |Refused { error, larger }| match larger {
            1 => Failure::Model(error),
            _ => Failure::Scene(format!("{error} (seen with cells {larger} times as large)")),
        };
        let Look { contacts, mut warnings, larger } =
            sizing::look(scene, counted, &mut sizes, comm).map_err(refused)?;
        if let Some(initial) = &scene.initial {
            warnings.push(format!("initial.result = {:?} is not looked at: the scene is too large", initial.result));
        }
        let note = format!(
            "counted, not built: what supports and contacts hold was looked at with cells {larger} times as large"
        );
        warnings.push(note);
        Ok(Self { sizes, memory: counted.memory(), contacts, warnings, reading_mb: None })
    }
}
