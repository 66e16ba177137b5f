//! Which volumes of a mesh file make a body, and what each of them is made of.

use std::collections::{BTreeMap, BTreeSet};

use serde::{Deserialize, Serialize};

use super::require::{Checked, known, require};
use crate::material::Material;

/// Physical volumes that make a body, by name, or by number where they have none.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged, expecting = "expected the name of a volume, or a list of names")]
pub enum Volumes {
    /// A single one.
    One(String),
    /// Several, glued where they share faces.
    Several(Vec<String>),
}

/// What a body is made of.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged, expecting = "expected the name of a material, or a table with one for each volume")]
pub enum Materials {
    /// One material throughout, by its name.
    Whole(String),
    /// Names of materials by volume.
    Each(BTreeMap<String, String>),
}

impl Volumes {
    /// Their names.
    pub fn names(&self) -> &[String] {
        match self {
            Self::One(name) => std::slice::from_ref(name),
            Self::Several(names) => names,
        }
    }
}

impl Materials {
    /// Names of the materials, each once, in their order.
    pub fn names(&self) -> BTreeSet<&str> {
        match self {
            Self::Whole(name) => BTreeSet::from([&name[..]]),
            Self::Each(names) => names.values().map(|name| &name[..]).collect(),
        }
    }

    /// Name of the material of a volume, if it has one.
    pub fn of(&self, volume: &str) -> Option<&str> {
        match self {
            Self::Whole(name) => Some(name),
            Self::Each(names) => names.get(volume).map(|name| &name[..]),
        }
    }
}

/// Whether a body's volumes are named once and all have a material.
pub(super) fn check(
    known_materials: &BTreeMap<String, Material>,
    key: &str,
    volumes: Option<&Volumes>,
    materials: &Materials,
) -> Checked {
    let exists = |key: &str, name: &String| {
        require(known_materials.contains_key(name), key, name, known("material", known_materials.keys()))
    };
    if let Some(Volumes::Several(names)) = volumes {
        let key = format!("{key}.gmsh.volume");
        require(!names.is_empty(), &key, names, "name at least one volume")?;
        let once = names.iter().collect::<BTreeSet<_>>().len() == names.len();
        require(once, &key, names, "name each volume once")?;
    }
    let volumes = volumes.map_or(&[][..], Volumes::names);
    let key = format!("{key}.material");
    let of_volumes = match materials {
        Materials::Whole(name) => return exists(&key, name),
        Materials::Each(of_volumes) => of_volumes,
    };
    let rule = "materials go by the volumes of a mesh file: give one name, or name the volumes, as in gmsh.volume = [\"core\", \
                \"shell\"]";
    require(!volumes.is_empty(), &key, of_volumes, rule)?;
    for (volume, name) in of_volumes {
        let key = format!("{key}.{volume}");
        require(volumes.contains(volume), &key, name, known("volume in this body's gmsh.volume", volumes.iter()))?;
        exists(&key, name)?;
    }
    let without = volumes.iter().find(|volume| !of_volumes.contains_key(*volume));
    without.map_or(Ok(()), |volume| {
        require(false, &key, of_volumes, format!("no material for volume `{volume}`: add one"))
    })
}
