//! Events as log lines: a block of sizes, one aligned line a Newton step, tables at the end.
//!
//! Lines go out through `tracing` at level INFO, warnings at WARN. What the QP solver does inside a step is left to
//! [`super::progress`].

use super::events::{Event, Sink};
use super::table::{Phase, PhaseTable, Spread};
use crate::record::counts::{ContactRow, Counted, Sizes, Work};
use crate::record::forecast::{Forecast, HeldRow};
use crate::record::rows::{LimitLoad, NewtonRow, RefinementRow};
use crate::record::state::{Errors, Residuals};

/// Writes log lines.
#[derive(Default)]
pub struct Plain {
    newton_header_written: bool,
}

impl Sink for Plain {
    fn event(&mut self, event: &Event) {
        if let Event::Warning(text) = event {
            tracing::warn!("{text}");
        }
        for line in self.lines(event) {
            tracing::info!("{line}");
        }
    }
}

impl Plain {
    fn lines(&mut self, event: &Event) -> Vec<String> {
        match event {
            Event::Sizes { scene, level, ranks, sizes } => {
                self.newton_header_written = false;
                size_lines(scene, *level, *ranks, sizes)
            }
            Event::Contact(row) => vec![contact_line(row)],
            Event::Reading { megabytes } => {
                vec![format!("  {:<16}{megabytes:>12.0}  MiB, largest rank", "reading meshes")]
            }
            Event::Memory { megabytes, available_mb } => {
                let left = available_mb.map(|left| format!("; {left:.0} are available"));
                let left = left.unwrap_or_default();
                vec![format!("  {:<16}{megabytes:>12.0}  MiB, all ranks together{left}", "memory estimate")]
            }
            Event::Held { ranks, rows } => held_lines(*ranks, rows),
            Event::Forecast(forecast) => vec![forecast_line(forecast)],
            Event::NewtonStep(row) => {
                let header = (!std::mem::replace(&mut self.newton_header_written, true)).then(newton_header);
                header.into_iter().chain([newton_line(row)]).collect()
            }
            Event::Increment(text) | Event::Note(text) => vec![text.clone()],
            Event::Refinement { row, goal } => vec![refinement_line(row, *goal)],
            Event::Limit(bounds) => vec![limit_line(*bounds)],
            Event::Phases(table) => phase_lines(table),
            Event::Residuals(residuals) => residual_lines(residuals),
            Event::Errors(errors) => error_line(errors).into_iter().collect(),
            Event::Outcome { converged, newton_iterations, seconds, note } => {
                let verdict = if *converged { "Converged" } else { "NOT converged" };
                vec![format!("{verdict} in {newton_iterations} Newton steps, {seconds:.2} s. {note}").trim_end().into()]
            }
            Event::Inner { .. } | Event::Warning(_) => Vec::new(),
        }
    }
}

fn size_lines(scene: &str, level: usize, ranks: usize, sizes: &Sizes) -> Vec<String> {
    let about = |key: &str, count: u64| {
        let sign = if sizes.estimated.iter().any(|estimated| estimated == key) { "~" } else { "" };
        format!("{sign}{count}")
    };
    let line = |what: &str, count: String, detail: String| format!("  {what:<16}{count:>12}{detail}");
    let contact = sizes.contact_rows;
    let rows = format!(
        "  {} gluing + {} support + {} contact",
        about("gluing_rows", sizes.gluing_rows),
        about("dirichlet_rows", sizes.dirichlet_rows),
        about("contact_rows", contact)
    );
    let mut share = match ranks {
        1 => "on 1 rank".to_owned(),
        _ => format!("on {ranks} ranks"),
    };
    if sizes.clusters < sizes.subdomains {
        share = format!("in {} clusters {share}", about("clusters", sizes.clusters));
    }
    if contact > 0 {
        share += &format!(", {} at contact surfaces", about("contact_subdomains", sizes.contact_subdomains));
    }
    vec![
        format!("{scene}, level {level}"),
        line("nodes", sizes.nodes.to_string(), String::new()),
        line("elements", sizes.elements.to_string(), format!("  in {} cells", sizes.cells)),
        line("subdomains", about("subdomains", sizes.subdomains), format!("  {share}")),
        line("primal unknowns", about("primal_dofs", sizes.primal_dofs), String::new()),
        line("dual unknowns", about("dual_dofs", sizes.dual_dofs), rows),
    ]
}

/// What one of so many ranks holds, and all of it.
fn held_lines(ranks: usize, rows: &[HeldRow]) -> Vec<String> {
    let line = |item: &str, owned: f64, everywhere: f64| format!("  {item:<24}{owned:>14.3}{everywhere:>14.3}");
    let sum = |of: fn(&HeldRow) -> f64| rows.iter().map(of).sum::<f64>();
    let header = format!("  {:<24}{:>14}{:>14}", format!("MiB on each of {ranks}"), "its share", "on every rank");
    let rows_of = rows.iter().map(|row| line(&row.item, row.owned_mb, row.everywhere_mb));
    let all = line("all", sum(|row| row.owned_mb), sum(|row| row.everywhere_mb));
    std::iter::once(header).chain(rows_of).chain([all]).collect()
}

fn forecast_line(Forecast { ranks, levels, seconds, messages }: &Forecast) -> String {
    let applications: f64 = levels.last().map_or(0.0, |level| level.applications);
    let share = 100.0 * messages / seconds;
    format!(
        "  about {seconds:.3} s on {ranks} of the cores it was measured on, {share:.0} % of it messages, with {applications:.0} \
         multiplications by F on the finest mesh"
    )
}

fn contact_line(ContactRow { name, slave, master, rule, conditions }: &ContactRow) -> String {
    let sides = master.as_ref().map_or(slave.clone(), |master| format!("{slave} against {master}"));
    format!("  {:<16}{conditions:>12}  {sides}, {rule}", format!("contact {name}"))
}

fn refinement_line(row: &RefinementRow, goal: f64) -> String {
    let RefinementRow { elements, unknowns, error, energy, seconds, goal: number, .. } = row;
    let number = number.map(|number| format!("Q = {:.6e}, ", number.value)).unwrap_or_default();
    let error = if *error < f64::MAX { format!("about {:.2} %", 100.0 * error) } else { "not known".to_owned() };
    format!(
        "mesh of {elements} elements, {unknowns} unknowns: J = {energy:.6e}, {number}error {error} ({:.2} % wanted), {seconds:.2} s",
        100.0 * goal
    )
}

fn limit_line(bounds: LimitLoad) -> String {
    format!("limit load factor between {bounds}, {:.2} % apart", 100.0 * bounds.width())
}

fn newton_header() -> String {
    format!(
        "{:>4} {:>10} {:>10} {:>8} {:>9} {:>8} {:>6} {:>8} {:>9}",
        "step", "criterion", "residual", "damping", "plastic", "contact", "QP", "F", "seconds"
    )
}

fn newton_line(row: &NewtonRow) -> String {
    format!(
        "{:>4} {:>10.3e} {:>10.3e} {:>8.4} {:>9} {:>8} {:>6} {:>8} {:>9.2}",
        row.step,
        row.criterion,
        row.residual,
        row.damping,
        row.plastic_elements,
        row.active_contacts,
        row.qp_iterations,
        row.hessian_multiplications,
        row.seconds
    )
}

fn phase_lines(table: &PhaseTable) -> Vec<String> {
    let line = |name: &str, calls: String, spread: Spread, rates: [String; 3]| {
        let ratio = spread.ratio().map_or("-".into(), |ratio| format!("{ratio:.2}"));
        let percent = 100.0 * spread.max / table.total_seconds;
        let rates: String = rates.iter().map(|rate| format!(" {rate:>8}")).collect();
        let line = format!("{name:<29} {calls:>7} {:>9.3} {ratio:>7} {percent:>5.1}{rates}", spread.max);
        line.trim_end().to_owned()
    };
    let phase = |phase: &Phase| {
        let Work { flops, bytes } = phase.work;
        let seconds = phase.seconds.max * 1e9;
        let rates = [(flops, seconds), (bytes, seconds), (bytes, phase.calls as f64 * 1e6)];
        let rates =
            rates.map(|(work, per)| if work > 0.0 && per > 0.0 { format!("{:.2}", work / per) } else { String::new() });
        line(&phase.name, phase.calls.to_string(), phase.seconds, rates)
    };
    let messages = |kind: &Phase| {
        let volume = format!("{:.2} MiB", kind.work.bytes / f64::from(1 << 20));
        line(&kind.name, kind.calls.to_string(), kind.seconds, [String::new(), volume, String::new()])
    };
    let (total, memory) = (table.total_seconds, table.memory_mb);
    let header = |name: &str| format!("{name:<29} {:>7} {:>9} {:>7} {:>5}", "calls", "max s", "max/min", "%");
    let mut lines = vec![format!("{} {:>8} {:>8} {:>8}", header("phase"), "GF/s", "GB/s", "MB/call")];
    lines.extend(table.phases.iter().map(phase));
    if !table.communication.is_empty() {
        lines.push(header("messages, with waiting"));
        lines.extend(table.communication.iter().map(messages));
    }
    lines.push(line("all but messages", String::new(), table.busy, Default::default()));
    lines.push(line("total", String::new(), Spread { max: total, min: total }, Default::default()));
    lines.extend(
        memory.ratio().map(|ratio| format!("{:<29} {:>7} {:>9.0} {ratio:>7.2}", "memory of a rank", "MiB", memory.max)),
    );
    lines.extend(counted_line(&table.counted));
    lines
}

/// `busiest rank over the mean      flops 1.04, bytes read 1.03, messages 1.50, bytes sent 1.40`; none where no rank has neighbours.
fn counted_line(Counted { counts_total, partners, .. }: &Counted) -> Option<String> {
    let of = counts_total.filter(|_| partners.is_some_and(|partners| partners.busiest > 0.0))?;
    let kinds =
        [("flops", of.flops), ("bytes read", of.bytes), ("messages", of.messages), ("bytes sent", of.bytes_sent)];
    let ratios = kinds.map(|(name, load)| format!("{name} {:.2}", load.busiest / load.mean));
    Some(format!("{:<29} {}", "busiest rank over the mean", ratios.join(", ")))
}

fn residual_lines(residuals: &Residuals) -> Vec<String> {
    let rows = [
        ("equilibrium", residuals.equilibrium),
        ("gluing", residuals.gluing),
        ("gap", residuals.gap),
        ("complementarity", residuals.complementarity),
        ("friction", residuals.friction.filter(|friction| *friction != 0.0)),
        ("balance", residuals.balance),
        ("energies", residuals.energies),
    ];
    let known = rows.into_iter().filter_map(|(name, value)| value.map(|v| format!("  {name:<16}{v:>12.3e}")));
    ["relative residuals".to_owned()].into_iter().chain(known).collect()
}

/// `error estimate  algebraic <= 1.2e-6, discretisation 4.1e-2 (stress, relative energy norm)`.
fn error_line(errors: &Errors) -> Option<String> {
    let (algebraic, discretisation) = (errors.algebraic?, errors.discretisation?);
    let sign = if errors.algebraic_is_bound == Some(true) { "<=" } else { "about" };
    let reason = if errors.ended_by_accuracy == Some(true) { ": enough for solver.accuracy" } else { "" };
    Some(format!(
        "error estimate  algebraic {sign} {algebraic:.1e}, discretisation {discretisation:.1e} (stress, relative energy \
         norm){reason}"
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::counts::{Counts, Load};

    #[test]
    fn newton_lines_stand_under_one_header() {
        let mut plain = Plain::default();
        let row = NewtonRow {
            increment: 1,
            step: 3,
            criterion: 0.0123456,
            residual: 4.5e-7,
            damping: 1.0,
            plastic_elements: 6813,
            active_contacts: 70,
            energy: -1.0,
            local_residual: 1e-7,
            factorisations: 4,
            qp_iterations: 25,
            hessian_multiplications: 325,
            seconds: 1.234,
        };
        let first = plain.lines(&Event::NewtonStep(row.clone()));
        assert_eq!(
            first,
            [
                "step  criterion   residual  damping   plastic  contact     QP        F   seconds",
                "   3   1.235e-2   4.500e-7   1.0000      6813       70     25      325      1.23",
            ]
        );
        assert_eq!(plain.lines(&Event::NewtonStep(row)), first[1..]);
    }

    #[test]
    fn a_contact_says_which_surface_is_the_slave() {
        let row = ContactRow {
            name: "joint".into(),
            slave: "upper.zmin".into(),
            master: Some("lower.zmax".into()),
            rule: "mortar".into(),
            conditions: 275,
        };
        let line = |row: ContactRow| Plain::default().lines(&Event::Contact(row)).concat();
        assert_eq!(line(row.clone()), "  contact joint            275  upper.zmin against lower.zmax, mortar");
        let floor = ContactRow { master: None, rule: "rigid".into(), ..row };
        assert_eq!(line(floor), "  contact joint            275  upper.zmin, rigid");
    }

    #[test]
    fn the_busiest_rank_is_compared_with_the_mean_where_ranks_have_neighbours() {
        let load = |busiest| Load { busiest, mean: 2.0 };
        let of = Counts {
            flops: load(3.0),
            messages: load(2.0),
            bytes: load(2.5),
            bytes_sent: load(5.0),
            ..Counts::default()
        };
        let counted =
            |partners| Counted { counts_total: Some(of), partners: Some(load(partners)), ..Counted::default() };
        assert_eq!(
            counted_line(&counted(2.0)).unwrap(),
            "busiest rank over the mean    flops 1.50, bytes read 1.25, messages 1.00, bytes sent 2.50"
        );
        assert_eq!(counted_line(&counted(0.0)), None);
        assert_eq!(counted_line(&Counted::default()), None);
    }

    #[test]
    fn absent_residuals_have_no_line() {
        let residuals = Residuals { equilibrium: Some(2e-9), ..Residuals::default() };
        let lines = Plain::default().lines(&Event::Residuals(residuals));
        assert_eq!(lines, ["relative residuals", "  equilibrium         2.000e-9"]);
    }
    #[test]
    fn the_error_line_tells_bounds_from_estimates_and_what_ended_the_run() {
        let line = |errors: Errors| Plain::default().lines(&Event::Errors(errors)).concat();
        let errors = Errors {
            algebraic: Some(1.23e-6),
            algebraic_is_bound: Some(true),
            discretisation: Some(0.0412),
            ended_by_accuracy: Some(false),
            ..Errors::default()
        };
        let bound = "error estimate  algebraic <= 1.2e-6, discretisation 4.1e-2 (stress, relative energy norm)";
        assert_eq!(line(errors), bound);
        let ended = Errors { ended_by_accuracy: Some(true), ..errors };
        assert_eq!(line(ended), format!("{bound}: enough for solver.accuracy"));
        let perfect = Errors { algebraic_is_bound: Some(false), ..errors };
        assert!(line(perfect).contains("algebraic about 1.2e-6"));
        assert_eq!(line(Errors::default()), "");
    }
}
