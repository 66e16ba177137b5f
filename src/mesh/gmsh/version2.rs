//! `$Nodes` and `$Elements` of MSH 2: one list each; a cell in several physical groups is there several times.

use std::io::BufRead;

use super::Block;
use super::error::Problem;
use super::kind::Kind;
use super::nodes::NodeTags;
use super::source::Source;

/// Reads `$Nodes` to its end.
pub(super) fn nodes(source: &mut Source<impl BufRead>) -> Result<(Vec<[f64; 3]>, NodeTags), Problem> {
    let announced = count(source, "Nodes", "nodes")?;
    let (mut points, mut tags) = (Vec::new(), Vec::new());
    for _ in 0..announced {
        let tag = source.short_size("the number of a node")?;
        let point = [source.real("x")?, source.real("y")?, source.real("z")?];
        if !point.iter().all(|x| x.is_finite()) {
            return Err(Problem::NotFinite(tag));
        }
        tags.push(tag);
        points.push(point);
        source.done();
    }
    source.end("$EndNodes")?;
    Ok((points, NodeTags::new(&tags)?))
}

/// The number on the first line, which is text in binary files too.
fn count(source: &mut Source<impl BufRead>, section: &'static str, items: &'static str) -> Result<u64, Problem> {
    source.announce(section, "counts", 1, 1)?;
    let count = source.text("a count")?;
    source.finish_line()?;
    source.announce(section, items, count, 8)?;
    Ok(count)
}

/// Reads `$Elements` to its end.
pub(super) fn elements(source: &mut Source<impl BufRead>, tags: &NodeTags) -> Result<Vec<Block>, Problem> {
    let announced = count(source, "Elements", "elements")?;
    let mut blocks: Vec<Block> = Vec::new();
    let mut found = 0;
    while found < announced {
        // Text has a header for each cell, binary files one for several cells.
        if !source.binary {
            source.short_size("the number of a cell")?;
        }
        let place = source.place();
        let kind = source.int("the type of a cell")?;
        let kind = Kind::of(kind).ok_or(Problem::UnknownKind(place, kind))?;
        let cells = if source.binary { source.short_size("a number of cells")? } else { 1 };
        if cells == 0 || cells > announced - found {
            return Err(Problem::Count { section: "Elements", items: "elements", announced, found: found + cells });
        }
        let tag_count = source.int("a number of tags")?;
        for _ in 0..cells {
            if source.binary {
                source.short_size("the number of a cell")?;
            }
            let mut first_tags = [0; 2];
            for k in 0..tag_count {
                let tag = source.int("a tag")?;
                if let Some(first) = first_tags.get_mut(k as usize) {
                    *first = tag;
                }
            }
            let [group, entity] = first_tags;
            let groups: &[i32] = if group == 0 { &[] } else { &[group] };
            let fits = |b: &&mut Block| b.kind == kind && b.entity == entity && b.groups == groups;
            if blocks.last_mut().as_ref().filter(|b| fits(b)).is_none() {
                blocks.push(Block { kind, entity, groups: groups.to_vec(), cells: 0, first: 0, nodes: Vec::new() });
            }
            let block = blocks.last_mut().expect("one was pushed");
            block.cells += 1;
            for _ in 0..kind.nodes {
                block.add_node(source.place(), source.short_size("the number of a node")?, tags)?;
            }
            source.done();
        }
        found += cells;
    }
    source.end("$EndElements")?;
    blocks.retain(|block| block.kind.dimension >= 2);
    Ok(blocks)
}
