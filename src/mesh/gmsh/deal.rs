//! From what rank 0 knows of a mesh file to every rank's share in it.

use std::fs::File;
use std::path::Path;

use super::error::Problem;
use super::kind::Kind;
use super::ranges::{Outline, Stretch};
use super::{Block, GroupName, Msh};
use crate::comm::agree::root_texts;
use crate::comm::words::{pack_pairs, share, share_of, unpack_pairs};
use crate::comm::{Comm, from_root};

/// What rank 0 finds in a file.
pub(super) enum Look {
    /// All of it.
    Whole(Msh),
    /// Where its parts are.
    Ranges(Outline),
}

/// What rank 0 has, or everybody its problem. Collective.
pub(super) fn told<T>(comm: &dyn Comm, outcome: Result<T, Problem>) -> Result<T, Problem> {
    let texts = match &outcome {
        Ok(_) => root_texts(comm, ["", ""]),
        Err(problem) => {
            root_texts(comm, [if problem.is_unreadable() { "unreadable" } else { "bad" }, &problem.to_string()])
        }
    };
    match &texts[0][..] {
        "" => outcome,
        word => Err(Problem::Told { text: texts[1].clone(), is_unreadable: word == "unreadable" }),
    }
}

/// Gives every rank its share. Collective.
pub(super) fn deal(comm: &dyn Comm, path: &Path, look: Look) -> Result<Msh, Problem> {
    let (mut msh, stretches, places, is_whole) = match look {
        Look::Whole(msh) => (msh, Vec::new(), Vec::new(), true),
        Look::Ranges(Outline { msh, stretches, places }) => (msh, stretches, places, false),
    };
    let names: Vec<String> =
        msh.names.iter().map(|name| format!("{} {} {}", name.dimension, name.tag, name.name)).collect();
    let names = root_texts(comm, names.iter().map(|name| &name[..]));
    let mut words = from_root(comm, pack(&msh, &stretches, &places, is_whole)).into_iter();
    let (outline, is_whole) = unpack(&mut || words.next().expect("an outline is whole"), &names);
    if !is_whole {
        let file = File::open(path);
        return outline.read(comm, file);
    }
    if comm.size() == 1 {
        return Ok(msh);
    }
    let outgoing = if comm.rank() == 0 { hand_out(&msh, comm) } else { vec![Vec::new(); comm.size()] };
    msh = outline.msh;
    let received = comm.all_to_all(outgoing).swap_remove(0);
    let mut words = received.into_iter();
    let mut next = || words.next().expect("a share is whole");
    let points = share(msh.nodes, comm);
    msh.points = points.map(|_| [(); 3].map(|()| f64::from_bits(next()))).collect();
    let parts = msh.parts(&share(msh.cells(), comm));
    for (block, part) in msh.blocks.iter_mut().zip(parts) {
        block.first = part.start;
        block.nodes = unpack_pairs((part.end - part.start) as usize * block.kind.nodes, &mut next);
    }
    Ok(msh)
}

/// The shares of all ranks in a file that rank 0 has read.
fn hand_out(msh: &Msh, comm: &dyn Comm) -> Vec<Vec<u64>> {
    let of_rank = |rank: usize| {
        let [points, cells] = [msh.nodes, msh.cells()].map(|items| share_of(rank, items, comm));
        let points = &msh.points[points.start as usize..points.end as usize];
        let mut message: Vec<u64> = points.as_flattened().iter().map(|x| x.to_bits()).collect();
        for (block, part) in msh.blocks.iter().zip(msh.parts(&cells)) {
            let nodes = part.start as usize * block.kind.nodes..part.end as usize * block.kind.nodes;
            pack_pairs(&block.nodes[nodes], &mut message);
        }
        message
    };
    (0..comm.size()).map(of_rank).collect()
}

/// All but names, nodes and cells.
fn pack(msh: &Msh, stretches: &[Stretch], places: &[u64], is_whole: bool) -> Vec<u64> {
    let mut words = vec![is_whole.into(), msh.nodes, msh.blocks.len() as u64];
    for block in &msh.blocks {
        words.extend([block.kind.number as u64, block.entity as u64, block.cells, block.groups.len() as u64]);
        words.extend(block.groups.iter().map(|&group| group as u64));
    }
    words.push(places.len() as u64);
    words.extend(places);
    words.push(stretches.len() as u64);
    words.extend(stretches.iter().flat_map(|stretch| [stretch.at, stretch.count, stretch.parameters]));
    words
}

fn unpack(next: &mut impl FnMut() -> u64, names: &[String]) -> (Outline, bool) {
    let name = |text: &String| {
        let mut words = text.splitn(3, ' ');
        let mut number = || words.next().and_then(|word| word.parse().ok()).expect("a name begins with two numbers");
        let (dimension, tag) = (number(), number());
        GroupName { dimension, tag, name: words.next().unwrap_or_default().to_owned() }
    };
    let is_whole = next() == 1;
    let mut msh = Msh { nodes: next(), names: names.iter().map(name).collect(), ..Msh::default() };
    for _ in 0..next() {
        let kind = Kind::of(next() as i32).expect("rank 0 knows the kind");
        let (entity, cells) = (next() as i32, next());
        let groups = (0..next()).map(|_| next() as i32).collect();
        msh.blocks.push(Block { kind, entity, groups, cells, first: 0, nodes: Vec::new() });
    }
    let places = (0..next()).map(|_| next()).collect();
    let stretches = (0..next()).map(|_| Stretch { at: next(), count: next(), parameters: next() }).collect();
    (Outline { msh, stretches, places }, is_whole)
}
