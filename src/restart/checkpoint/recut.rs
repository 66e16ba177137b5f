//! Arrays of a checkpoint on other subdomains of the same meshes.
//!
//! Displacements and fields go by node, histories and fields of cells by element, contact by slave node. Multipliers of
//! gluing and factors belong to the subdomains of the file. They are not read, but computed again. So are directions of plastic
//! flow, which begin as those of the stress.

use std::collections::HashMap;

use super::{Arrays, Recorded, contact};
use crate::assembly::flow::Flow;
use crate::comm::Comm;
use crate::comm::agree::agree;
use crate::feti::inverse::basis::Bases;
use crate::material::History;
use crate::model::discrete::Discrete;
use crate::restart::places::{Places, Wanted};
use crate::results::checkpoint::Checkpoint;

/// The arrays; multipliers but for those of the contacts in the last increment are zero. Collective.
///
/// # Errors
/// If they cannot be read; the same on every rank.
pub(super) fn read(
    comm: &dyn Comm,
    discrete: &Discrete,
    file: &Checkpoint,
    recorded: &[Recorded; 2],
) -> Result<Arrays, String> {
    let (subdomains, rows) = (&discrete.decomposition.subdomains[..], &discrete.constraints.rows[..]);
    let (places, arrays) = (Places::new(subdomains, |_| true), file.arrays());
    let points = Wanted::find(arrays, "points/node", |[node]| places.node(node))?;
    let cells = Wanted::find(arrays, "cells/nodes", |key| places.element(key))?;
    let whole = places.have_nodes(&points) && places.have_elements(&cells);
    agree(comm, "the arrays", if whole { Ok(()) } else { Err("nodes or elements are missing") })?;
    let torn = |name: &str| places.at_nodes(arrays, &points, (name, 3, 0));

    let of_contacts: HashMap<[i64; 4], usize> =
        (0..rows.len()).filter_map(|row| Some((contact(discrete, row)?, row))).collect();
    let contacts = Wanted::find(arrays, "contacts/condition", |key| of_contacts.get(&key).copied())?;
    let mut kept: Vec<bool> = rows.iter().map(|row| row.law().always_holds()).collect();
    let mut reached_lambda = vec![0.0; rows.len()];
    let states = contacts.read::<i64>(arrays, "contacts/kept", 0)?;
    let forces = contacts.read::<f64>(arrays, "contacts/last_force", 0)?;
    for (((_, row), state), force) in contacts.rows().zip(states).zip(forces) {
        (kept[row], reached_lambda[row]) = (state == 1, force / rows[row].scale);
    }

    let mut slips = Vec::new();
    if discrete.constraints.has_friction {
        slips.resize(rows.len(), 0.0);
        for ((_, row), slip) in contacts.rows().zip(contacts.read::<f64>(arrays, "contacts/slip", 0)?) {
            slips[row] = slip * rows[row].scale;
        }
    }
    let [of_points, of_cells] = recorded;
    Ok(Arrays {
        u: torn("points/displacement")?,
        reached_u: torn("points/last")?,
        lambda: vec![0.0; rows.len()],
        reached_lambda,
        kept,
        slips,
        flows: vec![Flow::default(); subdomains.len()],
        bases: vec![Bases::default(); subdomains.len()],
        histories: histories(discrete, file, &places, &cells)?,
        point_data: of_points.read(
            |at| Ok(places.at_nodes(arrays, &points, at)?.concat()),
            |at| Ok(places.at_nodes(arrays, &points, at)?.concat()),
        )?,
        cell_data: of_cells.read(
            |at| Ok(places.in_elements(arrays, &cells, at)?.concat()),
            |at| Ok(places.in_elements(arrays, &cells, at)?.concat()),
        )?,
    })
}

/// Histories of own elements, whose rows are known. There they go by subdomain, like cells, but for those where nothing ever
/// yielded.
fn histories(
    discrete: &Discrete,
    file: &Checkpoint,
    places: &Places,
    cells: &Wanted<(usize, usize)>,
) -> Result<Vec<Vec<History>>, String> {
    let of_cells = file.whole::<i64>("subdomains/cells")?;
    let of_histories = file.whole::<i64>("subdomains/histories")?;
    let begins = |counts: &[i64]| -> Vec<u64> {
        let begin = |sum: &mut u64, count: &i64| Some(std::mem::replace(sum, *sum + *count as u64));
        counts.iter().scan(0, begin).collect()
    };
    let (first_cells, first_histories) = (begins(&of_cells), begins(&of_histories));
    let points = cells.rows().flat_map(|(row, (k, element))| {
        let there = first_cells.partition_point(|first| *first <= row) - 1;
        let count = discrete.decomposition.subdomains[k].elements.kind().points();
        let first = first_histories[there] + (row - first_cells[there]) * count as u64;
        (0..if of_histories[there] == 0 { 0 } else { count })
            .map(move |point| (first + point as u64, (k, count * element + point)))
    });
    let total = of_histories.iter().sum::<i64>() as u64;
    places.histories(file.arrays(), &Wanted::new(total, points), "histories")
}
