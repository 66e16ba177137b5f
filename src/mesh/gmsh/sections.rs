//! What both versions have in common: the format, names of physical groups, and which entities are in which group.

use std::collections::HashMap;
use std::io::BufRead;

use super::GroupName;
use super::error::Problem;
use super::source::Source;

/// Physical groups of each surface and volume, by dimension and tag.
pub(super) type Entities = HashMap<(i32, i32), Vec<i32>>;

/// A section that is read in one of several ways.
pub(super) enum Section<'a> {
    Nodes,
    /// After the nodes.
    Elements(&'a Entities),
}

/// Reads a file behind its header, with what reads nodes and elements to their ends. Names of physical groups.
pub(super) fn sections<R: BufRead>(
    source: &mut Source<R>,
    version: u8,
    mut read: impl FnMut(&mut Source<R>, Section) -> Result<(), Problem>,
) -> Result<Vec<GroupName>, Problem> {
    let (mut names, mut entities) = (Vec::new(), Entities::new());
    let (mut has_nodes, mut has_elements) = (false, false);
    while let Some((place, line)) = source.filled_line()? {
        match &line[..] {
            b"$PhysicalNames" => names = physical_names(source)?,
            b"$Entities" if version == 4 => entities = self::entities(source)?,
            b"$PartitionedEntities" => return Err(Problem::Partitioned),
            b"$Nodes" => {
                read(source, Section::Nodes)?;
                has_nodes = true;
            }
            b"$Elements" if !has_nodes => {
                return Err(Problem::NoSection("Nodes", "it must come before $Elements"));
            }
            b"$Elements" => {
                read(source, Section::Elements(&entities))?;
                has_elements = true;
            }
            [b'$', name @ ..] if !name.starts_with(b"End") => {
                let name = String::from_utf8_lossy(name).into_owned();
                if !source.skip_to(&format!("$End{name}"))? {
                    return Err(Problem::NoEnd { place, name });
                }
            }
            other => return Err(Problem::expected(place, "the beginning of a section, as $Nodes", other)),
        }
    }
    match (has_nodes, has_elements) {
        (false, _) => Err(Problem::NoSection("Nodes", "save the mesh again")),
        (_, false) => Err(Problem::NoSection("Elements", "save the mesh again")),
        _ => Ok(names),
    }
}

/// `$MeshFormat`, to its end. The version of the rest of the file: 4 for 4.1, 2 for 2.2.
pub(super) fn header(source: &mut Source<impl BufRead>) -> Result<u8, Problem> {
    let first = source.filled_line()?;
    if first.is_none_or(|(_, line)| line != b"$MeshFormat") {
        return Err(Problem::NoMesh);
    }
    let version: f64 = source.text("the version of the format, as 4.1")?;
    let is = |known: f64| (version - known).abs() < 1e-9;
    let number = if is(4.1) { 4 } else { 2 };
    if !is(4.1) && !is(2.2) && !is(2.1) && !is(2.0) {
        return Err(Problem::Version(version.to_string()));
    }
    let binary: i32 = source.text("0 for text or 1 for binary")?;
    let bytes: i32 = source.text("the bytes of a number, as 8")?;
    source.finish_line()?;
    if bytes != 8 {
        return Err(Problem::Foreign("numbers of other than 8 bytes"));
    }
    source.binary = binary == 1;
    if source.binary && source.int("the number 1")? != 1 {
        return Err(Problem::Foreign("another byte order"));
    }
    source.end("$EndMeshFormat")?;
    Ok(number)
}

/// `$PhysicalNames`, which is text in binary files too.
pub(super) fn physical_names(source: &mut Source<impl BufRead>) -> Result<Vec<GroupName>, Problem> {
    source.announce("PhysicalNames", "names", 0, 1)?;
    let count: u64 = source.text("the number of names")?;
    source.announce("PhysicalNames", "names", count, 7)?;
    let mut names = Vec::new();
    for _ in 0..count {
        let dimension = source.text("the dimension of a group")?;
        let tag = source.text("the number of a group")?;
        let (place, line) = source.line()?.ok_or_else(|| source.cut_short())?;
        let name = line.strip_prefix(b"\"").and_then(|rest| rest.strip_suffix(b"\""));
        let name = name.ok_or_else(|| Problem::expected(place, "a name in quotation marks", &line))?;
        let name = String::from_utf8_lossy(name).into_owned();
        if dimension >= 2 {
            names.push(GroupName { dimension, tag, name });
        }
        source.done();
    }
    source.end("$EndPhysicalNames")?;
    Ok(names)
}

/// `$Entities` of version 4.1.
pub(super) fn entities(source: &mut Source<impl BufRead>) -> Result<Entities, Problem> {
    source.announce("Entities", "entities", 0, 1)?;
    let mut counts = [0; 4];
    for count in &mut counts {
        *count = source.size("a number of entities")?;
    }
    let all = counts.iter().fold(0_u64, |sum, &n| sum.saturating_add(n));
    source.announce("Entities", "entities", all, 8)?;
    let mut entities = Entities::new();
    for (dimension, count) in (0..).zip(counts) {
        for _ in 0..count {
            let tag = source.int("the tag of an entity")?;
            // A point has its place, everything else its bounding box.
            for _ in 0..if dimension == 0 { 3 } else { 6 } {
                source.real("a coordinate")?;
            }
            let mut groups = Vec::new();
            for _ in 0..source.size("a number of physical groups")? {
                // The sign tells a sense of orientation.
                groups.push(source.int("the number of a physical group")?.saturating_abs());
            }
            if dimension > 0 {
                for _ in 0..source.size("a number of bounding entities")? {
                    source.int("the tag of a bounding entity")?;
                }
            }
            if dimension >= 2 {
                groups.sort_unstable();
                groups.dedup();
                entities.insert((dimension, tag), groups);
            }
            source.done();
        }
    }
    source.end("$EndEntities")?;
    Ok(entities)
}
