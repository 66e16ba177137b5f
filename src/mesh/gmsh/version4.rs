//! `$Nodes` and `$Elements` of MSH 4.1: blocks by entity.

use std::io::BufRead;

use super::Block;
use super::error::Problem;
use super::kind::Kind;
use super::nodes::NodeTags;
use super::sections::Entities;
use super::source::Source;

/// Number of blocks and of items in all of them; the least and greatest number follow and are not needed.
pub(super) fn counts(source: &mut Source<impl BufRead>, section: &'static str) -> Result<(u64, u64), Problem> {
    source.announce(section, "counts", 4, 1)?;
    let counts = (source.size("a number of blocks")?, source.size("a number of items")?);
    source.size("the least number")?;
    source.size("the greatest number")?;
    Ok(counts)
}

/// Reads `$Nodes` to its end.
pub(super) fn nodes(source: &mut Source<impl BufRead>) -> Result<(Vec<[f64; 3]>, NodeTags), Problem> {
    let (blocks, announced) = counts(source, "Nodes")?;
    source.announce("Nodes", "nodes", announced, 8)?;
    let (mut points, mut tags) = (Vec::new(), Vec::new());
    for _ in 0..blocks {
        let dimension = source.int("the dimension of an entity")?;
        source.int("the tag of an entity")?;
        let parametric = source.int("0 or 1")? != 0;
        let count = source.size("a number of nodes")?;
        if (tags.len() as u64).checked_add(count).is_none_or(|sum| sum > announced) {
            let found = (tags.len() as u64).saturating_add(count);
            return Err(Problem::Count { section: "Nodes", items: "nodes", announced, found });
        }
        let first = tags.len();
        for _ in 0..count {
            tags.push(source.size("the number of a node")?);
        }
        for k in 0..count as usize {
            let point = [source.real("x")?, source.real("y")?, source.real("z")?];
            if !point.iter().all(|x| x.is_finite()) {
                return Err(Problem::NotFinite(tags[first + k]));
            }
            for _ in 0..if parametric { dimension } else { 0 } {
                source.real("a parameter")?;
            }
            points.push(point);
            source.done();
        }
    }
    if points.len() as u64 != announced {
        return Err(Problem::Count { section: "Nodes", items: "nodes", announced, found: points.len() as u64 });
    }
    source.end("$EndNodes")?;
    Ok((points, NodeTags::new(&tags)?))
}

/// Reads `$Elements` to its end.
pub(super) fn elements(
    source: &mut Source<impl BufRead>,
    tags: &NodeTags,
    entities: &Entities,
) -> Result<Vec<Block>, Problem> {
    let (blocks, announced) = counts(source, "Elements")?;
    source.announce("Elements", "elements", announced, 4)?;
    let mut result = Vec::new();
    let mut found = 0;
    for _ in 0..blocks {
        let mut block = block(source, entities, (&mut found, announced))?;
        for _ in 0..block.cells {
            source.size("the number of a cell")?;
            for _ in 0..block.kind.nodes {
                block.add_node(source.place(), source.size("the number of a node")?, tags)?;
            }
            source.done();
        }
        if block.kind.dimension >= 2 {
            result.push(block);
        }
    }
    all_found(source, found, announced)?;
    Ok(result)
}

/// The header of a block of cells; counts these.
pub(super) fn block(
    source: &mut Source<impl BufRead>,
    entities: &Entities,
    (found, announced): (&mut u64, u64),
) -> Result<Block, Problem> {
    let dimension = source.int("the dimension of an entity")?;
    let entity = source.int("the tag of an entity")?;
    let place = source.place();
    let number = source.int("the type of cells")?;
    let kind = Kind::of(number).ok_or(Problem::UnknownKind(place, number))?;
    let cells = source.size("a number of cells")?;
    *found = found.saturating_add(cells);
    if *found > announced {
        return Err(Problem::Count { section: "Elements", items: "elements", announced, found: *found });
    }
    let groups = entities.get(&(dimension, entity)).cloned().unwrap_or_default();
    Ok(Block { kind, entity, groups, cells, first: 0, nodes: Vec::new() })
}

/// The end of `$Elements`, if as many cells were found as announced.
pub(super) fn all_found(source: &mut Source<impl BufRead>, found: u64, announced: u64) -> Result<(), Problem> {
    if found != announced {
        return Err(Problem::Count { section: "Elements", items: "elements", announced, found });
    }
    source.end("$EndElements")
}
