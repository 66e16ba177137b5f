//! What is told of a solution: rows of the log, contact states, the summary.

use std::collections::{BTreeMap, HashMap};

use super::contact::ContactState;
use super::limits;
use crate::comm::Comm;
use crate::constraint::Kind;
use crate::constraint::law::Status;
use crate::model::contacts::Contacts;
use crate::model::discrete::Discrete;
use crate::model::held::load_step;
use crate::newton::balance::BodyBalance;
use crate::newton::friction::Rubbing;
use crate::newton::path::At;
use crate::newton::{self, Iterate, Newton, StepRecord, TornProblem};
use crate::record::counts::{ContactRow, Counters};
use crate::record::rows::{LimitLoad, NewtonRow, StepRow};
use crate::record::state::{Acting, Errors, Measures, Residuals, Rubbed, State};
use crate::record::summary::Summary;
use crate::scene::{self, Friction, Scene};
use crate::sizing::sizes::sizes;

/// Where in the history an attempt leads, in words; nothing where all acts at once.
pub(super) fn place(scene: &Scene, at: At) -> Option<String> {
    let Some(mut text) = load_step(scene, at.stage) else {
        return (at.fraction < 1.0).then(|| format!("up to {:.4} of the load", at.fraction));
    };
    let step = &scene.steps()[at.stage];
    if step.increments > 1 {
        text += &format!(", increment {} of {}", at.increment, step.increments);
    }
    if at.fraction != at.increment as f64 / step.increments as f64 {
        text += &format!(", up to {:.4} of the step", at.fraction);
    }
    Some(text)
}

/// An increment in numbers; `von_mises` is the largest stress on this rank.
pub(super) fn step_row(
    comm: &dyn Comm,
    scene: &Scene,
    discrete: &Discrete,
    newton: &Newton,
    contact: &[ContactState],
    von_mises: f64,
) -> StepRow {
    let (at, converged) = (newton.at(), newton.outcome() == Some(&newton::Outcome::Converged));
    let bounds = if converged { newton.bounds() } else { None };
    let measures = limits::measure(comm, scene, discrete, newton, contact);
    StepRow {
        step: at.stage as u64 + 1,
        name: scene.steps()[at.stage].name.clone(),
        increment: at.increment as u64,
        time: at.time(),
        halvings: at.halvings as u64,
        converged,
        limit_load: bounds.map(|newton::Bounds { lower, upper, work, rest }| LimitLoad {
            lower,
            upper,
            factor: lower,
            work,
            rest,
        }),
        goal: None,
        consistency: None,
        state: State { measures, ..state(scene, discrete, newton, contact, von_mises) },
    }
}

pub(super) fn newton_row(increment: usize, record: &StepRecord) -> NewtonRow {
    NewtonRow {
        increment: increment as u64,
        step: record.number as u64,
        criterion: record.criterion,
        residual: record.residual,
        damping: record.damping,
        plastic_elements: record.plastic_elements as u64,
        active_contacts: record.active_contacts as u64,
        energy: record.energy,
        local_residual: record.local_residual,
        qp_iterations: (record.statistics.outer + record.statistics.sets) as u64,
        hessian_multiplications: record.applications as u64,
        factorisations: record.factorisations as u64,
        seconds: record.seconds,
    }
}

/// What to tell where rounding spoils a step more than the loosest quadratic program would.
pub(super) fn loss_of_accuracy(record: &StepRecord) -> String {
    let StepRecord { number, local_residual, .. } = record;
    format!(
        "Newton step {number} lost accuracy: stiffness matrices are so near to singular that rounding leaves {local_residual:.1e} \
         of the forces on subdomains out of balance; factors are in double precision from here on"
    )
}

/// The Newton steps as columns of a table; with more than one increment the first says which.
pub(super) fn convergence(rows: &[NewtonRow]) -> Vec<(String, Vec<f64>)> {
    let column = |name: &str, value: fn(&NewtonRow) -> f64| (name.to_owned(), rows.iter().map(value).collect());
    let several = rows.iter().any(|row| row.increment > 1);
    let increment = several.then(|| column("increment", |r| r.increment as f64));
    let columns = [
        column("criterion", |r| r.criterion),
        column("residual", |r| r.residual),
        column("damping", |r| r.damping),
        column("energy", |r| r.energy),
        column("local_residual", |r| r.local_residual),
        column("plastic_elements", |r| r.plastic_elements as f64),
        column("active_contacts", |r| r.active_contacts as f64),
        column("hessian_multiplications", |r| r.hessian_multiplications as f64),
        column("factorisations", |r| r.factorisations as f64),
    ];
    increment.into_iter().chain(columns).collect()
}

/// Contact of every pair whose row is on this rank.
pub(super) fn contact_states(problem: &TornProblem, Iterate { u, lambda, .. }: &Iterate) -> Vec<ContactState> {
    let slack = problem.slack(u);
    let size = problem.space.maximum(newton::residuals::largest_displacement(u));
    let rubbing = problem.rubbing(&slack, lambda).into_iter();
    let rubbing: HashMap<usize, Rubbing> = rubbing.map(|rubbing| (rubbing.pair, rubbing)).collect();
    let rows = problem.constraints.rows.iter().zip(&slack).zip(lambda);
    rows.filter_map(|((row, slack), lambda)| {
        let Kind::Contact { pair } = row.kind else { return None };
        let (force, friction) = (row.scale * lambda, rubbing.get(&pair).copied());
        let status = match (row.law().status(force), friction) {
            (Status::Closed, Some(rubbing)) if rubbing.limit > 0.0 => rubbing.status(size),
            (status, _) => status,
        };
        Some(ContactState { pair, force, gap: slack / row.scale, status, friction })
    })
    .collect()
}

/// Friction at each contact that has any. Collective.
fn friction(
    scene: &Scene,
    problem: &TornProblem,
    discrete: &Discrete,
    (contact, size): (&[ContactState], f64),
) -> BTreeMap<String, Rubbed> {
    if !problem.constraints.has_friction {
        return BTreeMap::new();
    }
    let pairs = &discrete.contacts.pairs;
    let signs = signs(scene, discrete);
    let of_state = |state: &ContactState| {
        let rubbing = state.friction?;
        let acts = rubbing.limit > 0.0 && (rubbing.is_given || state.status.is_closed());
        let slips = acts && rubbing.status(size) == Status::Slip;
        let [x, y, z] = rubbing.force.map(|f| signs[pairs[state.pair].contact] * f);
        Some([x, y, z, rubbing.dissipation(), f64::from(acts && !slips), f64::from(slips)])
    };
    let sums = by_contact(problem, discrete, contact, of_state);
    let of_contact = |&[x, y, z, dissipation, sticking, slipping]: &[f64; 6]| Rubbed {
        force: [x, y, z],
        dissipation,
        sticking: sticking as u64,
        slipping: slipping as u64,
    };
    let rubbed = sums.iter().map(of_contact);
    let all = scene.contact.iter().zip(rubbed);
    all.filter(|((_, contact), _)| contact.friction.is_some())
        .map(|((name, _), rubbed)| (name.clone(), rubbed))
        .collect()
}

/// The numbers of a run; what belongs to the whole run (times, scene name, ranks) is filled in by the caller.
pub(super) fn summarise(
    scene: &Scene,
    discrete: &Discrete,
    steps: &[(usize, StepRecord)],
    failure: &Option<(At, newton::Outcome)>,
    rows: Vec<StepRow>,
    comm: &dyn Comm,
) -> Summary {
    let sizes = sizes(discrete, comm);
    let last = rows.last().map(|row| row.state.clone()).unwrap_or_default();
    let state = State { plastic_elements: rows.iter().filter_map(|row| row.state.plastic_elements).max(), ..last };
    let total = |count: fn(&StepRecord) -> usize| Some(steps.iter().map(|(_, s)| count(s)).sum::<usize>() as u64);
    let message = |(at, outcome): &(At, newton::Outcome)| {
        let mut message = outcome.message()?;
        if scene.limit.is_some() {
            let found = rows.iter().rev().find_map(|row| row.limit_load);
            let found = found.map(|bounds| format!("; the last bounds are {bounds}"));
            return Some(message + &found.unwrap_or_default());
        }
        if scene.has_limit_load() && !scene.load.is_empty() {
            message = collapse(scene, &rows, *at, &message);
        }
        let place = place(scene, *at).filter(|_| !scene.step.is_empty());
        Some(place.map_or(message.clone(), |place| format!("{place}: {message}")))
    };
    Summary {
        title: scene.title.clone(),
        contacts: discrete.contacts.rows.clone(),
        converged: Some(failure.is_none()),
        plastic_fraction: state.plastic_elements.map(|plastic| plastic as f64 / sizes.elements as f64),
        newton_iterations: Some(steps.len() as u64),
        qp: qp_name(scene, discrete.constraints.has_inequalities).to_owned(),
        counters: Counters {
            smalse_iterations: total(|s| s.statistics.outer),
            active_set_iterations: total(|s| s.statistics.sets),
            dual_iterations: total(|s| s.statistics.cg + s.statistics.expansions + s.statistics.proportionings),
            hessian_multiplications: total(|s| s.applications),
            preconditioner_applications: total(|s| s.statistics.preconditioner),
            factorisations: total(|s| s.factorisations),
        },
        error: failure.as_ref().and_then(message),
        newton: steps.iter().map(|(increment, record)| newton_row(*increment, record)).collect(),
        warnings: limits::warnings(scene, &rows),
        steps: rows,
        state,
        sizes,
        ..Summary::default()
    }
}

/// What a solution is like. Collective.
fn state(scene: &Scene, discrete: &Discrete, newton: &Newton, contact: &[ContactState], von_mises: f64) -> State {
    let (problem, Iterate { u, lambda, state, residuals, errors, energies, ended_by_accuracy }) =
        (newton.problem(), newton.iterate());
    let reactions = problem.reactions(state, lambda, discrete.supports.len());
    let (balance, residual_balance) = problem.balance(state, lambda, discrete.bodies.len());
    let contact_forces = contact_forces(scene, problem, discrete, contact);
    let names = discrete.supports.iter().map(|s| s.name.clone());
    let maximum = |x: f64| problem.space.maximum(x);
    let largest = maximum(newton::residuals::largest_displacement(u));
    let friction = friction(scene, problem, discrete, (contact, largest));
    let given = scene.contact.iter().filter(|(_, contact)| matches!(contact.friction, Some(Friction::Tresca(_))));
    let given = given.filter_map(|(name, _)| friction.get(name)).map(|rubbed| rubbed.dissipation).sum::<f64>();
    State {
        plastic_elements: Some(state.plastic as u64),
        active_contacts: Some(problem.active_contacts(lambda) as u64),
        contact_force: Some(std::array::from_fn(|axis| {
            contact_forces.iter().fold(0.0, |sum, force| sum + force[axis])
        })),
        contact_forces: discrete.contacts.names.iter().cloned().zip(contact_forces).collect(),
        friction,
        reactions: names.zip(reactions).collect(),
        external_work: Some(state.external_work),
        internal_energy: Some(state.internal_energy),
        energy: Some(if given == 0.0 { state.energy } else { state.energy + given }),
        energies: energies.as_ref().map(|energies| energies.parts),
        max_displacement: Some(largest),
        max_von_mises: Some(maximum(von_mises)),
        residuals: Residuals {
            equilibrium: Some(residuals.equilibrium),
            gluing: Some(residuals.gluing),
            gap: Some(residuals.gap),
            complementarity: Some(residuals.complementarity),
            friction: Some(residuals.friction),
            balance: Some(residual_balance),
            energies: energies.as_ref().map(newton::Energies::imbalance),
        },
        balance: scene.body.keys().cloned().zip(balance.iter().map(acting)).collect(),
        errors: Errors {
            duality_gap: errors.as_ref().map(|errors| errors.gap),
            algebraic: errors.as_ref().map(|errors| errors.algebraic),
            algebraic_is_bound: errors.as_ref().map(|errors| errors.is_bound),
            discretisation: errors.as_ref().map(|errors| errors.discretisation),
            ended_by_accuracy: Some(*ended_by_accuracy),
        },
        measures: Measures::default(),
    }
}

/// What acts on a body.
fn acting(body: &BodyBalance) -> Acting {
    let &BodyBalance { loads, supports, contacts, .. } = body;
    Acting { loads, supports, contacts, unbalanced: body.unbalanced() }
}

/// What to tell where a body without hardening does not bear its load.
fn collapse(scene: &Scene, rows: &[StepRow], at: At, reason: &str) -> String {
    let (begin, unit) = if scene.step.is_empty() { ("", " of the load") } else { ("time ", "") };
    let failed = at.time();
    let Some(reached) = rows.iter().filter(|row| row.converged).map(|row| row.time).next_back() else {
        return format!(
            "no equilibrium was found, not even at {begin}{failed:.4}{unit}: that is probably more than the limit load of bodies \
             without hardening, or what supports and overlaps prescribe beside it is too much ({reason})"
        );
    };
    format!(
        "no equilibrium was found above {begin}{reached:.4}{unit}, and none at {failed:.4}: the limit load of bodies without \
         hardening is probably between them; the last results are those at {reached:.4}"
    )
}

/// The solver of the quadratic programs, by its name in scene files.
fn qp_name(scene: &Scene, has_inequalities: bool) -> &'static str {
    match scene.solver.qp {
        _ if !has_inequalities => "pcpg",
        scene::Qp::SmalseM => "smalse-m",
        scene::Qp::ActiveSet => "active-set",
    }
}

/// Of each contact, 1 if the surface that the scene names first is the slave, else -1.
pub(super) fn signs(scene: &Scene, discrete: &Discrete) -> Vec<f64> {
    let is_slave = |(contact, row): (&scene::Contact, &ContactRow)| {
        contact.surfaces().next().is_some_and(|first| first.to_string() == row.slave)
    };
    scene.contact.values().zip(&discrete.contacts.rows).map(|of| if is_slave(of) { 1.0 } else { -1.0 }).collect()
}

/// Force of each contact on the surface that the scene names first.
fn contact_forces(
    scene: &Scene,
    problem: &TornProblem,
    discrete: &Discrete,
    contact: &[ContactState],
) -> Vec<[f64; 3]> {
    let (pairs, signs) = (&discrete.contacts.pairs, signs(scene, discrete));
    by_contact(problem, discrete, contact, |state| {
        let mut force = pairs[state.pair].force(state.force);
        if let Some(rubbing) = &state.friction {
            force.iter_mut().zip(rubbing.force).for_each(|(sum, f)| *sum += f);
        }
        Some(force.map(|f| signs[pairs[state.pair].contact] * f))
    })
}

/// Sums of some numbers of each pair, by contact. Collective.
fn by_contact<const N: usize>(
    problem: &TornProblem,
    discrete: &Discrete,
    contact: &[ContactState],
    of: impl Fn(&ContactState) -> Option<[f64; N]>,
) -> Vec<[f64; N]> {
    let Contacts { names, pairs, .. } = &discrete.contacts;
    let of_pair: HashMap<usize, [f64; N]> = contact.iter().filter_map(|state| Some((state.pair, of(state)?))).collect();
    let mut partial = Vec::new();
    for rows in problem.space.owned() {
        let mut sums = vec![[0.0; N]; names.len()];
        for row in rows.clone() {
            if let Kind::Contact { pair } = problem.constraints.rows[row].kind
                && let Some(numbers) = of_pair.get(&pair)
            {
                sums[pairs[pair].contact].iter_mut().zip(numbers).for_each(|(sum, x)| *sum += x);
            }
        }
        partial.extend_from_slice(sums.as_flattened());
    }
    problem.space.sum(&partial, N * names.len()).as_chunks::<N>().0.to_vec()
}
