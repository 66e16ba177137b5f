//! The contacts of a scene: their conditions, and what is told of them.

use std::collections::BTreeMap;

use super::extent::{self, Extent};
use crate::comm::{Comm, all_gather_u64};
use crate::constraint::{Support, dirichlet};
use crate::contact::known::{Found, Pairs, spread};
use crate::contact::pairing::{Pairing, Rule};
use crate::contact::patch::Patch;
use crate::contact::{ContactError, ContactPair, MasterNode, corner, quadratic, rigid, sagitta};
use crate::decomposition::Decomposition;
use crate::material::Law;
use crate::record::counts::ContactRow;
use crate::scene::{Contact, Scene, Sides, SurfaceName};

/// The contacts of a scene.
#[derive(Default)]
pub struct Contacts {
    /// Their names.
    pub names: Vec<String>,
    /// What touches in each of them.
    pub surfaces: Vec<Surfaces>,
    /// Pairs of all contacts: those of the rows that this rank holds.
    pub pairs: Pairs,
    /// Own nodes of master surfaces that have slaves opposite, by the numbers of these pairs.
    pub masters: Vec<MasterNode>,
    /// Contacts that have a node in common with another one.
    pub sharing: Vec<usize>,
    /// How each contact was paired.
    pub rows: Vec<ContactRow>,
    /// Whether any has friction, in any step.
    pub has_friction: bool,
}

/// The surfaces of a contact, by their indices.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surfaces {
    /// That of the conditions.
    pub slave: usize,
    /// The other one; none at a rigid obstacle.
    pub master: Option<usize>,
    /// Whether conditions are means over faces of the master.
    pub is_mortar: bool,
    /// What corners of quadratic faces get of the functions of middles, where nodes have conditions.
    pub share: f64,
}

impl Contacts {
    /// How many surfaces are in contact, once for each contact.
    pub fn surfaces(&self) -> usize {
        self.surfaces.iter().map(|of| 1 + usize::from(of.master.is_some())).sum()
    }

    /// Whether a surface is in contact with anything.
    pub fn touch(&self, surface: usize) -> bool {
        self.surfaces.iter().any(|of| of.slave == surface || of.master == Some(surface))
    }
}

/// What contacts are made of.
pub(super) struct Given<'a> {
    pub scene: &'a Scene,
    pub decomposition: &'a Decomposition,
    pub supports: &'a [Support],
    /// Of the bodies.
    pub extents: &'a [Extent],
    /// Nodes of all bodies.
    pub nodes: u64,
}

/// Pairs all contacts; the texts are what the user should know. `index` numbers the surfaces of the decomposition. Collective.
///
/// # Errors
/// If a contact has no pairs, or obstacles are too many for a node.
pub(super) fn pair(
    comm: &dyn Comm,
    given: &Given,
    index: impl Fn(&SurfaceName) -> usize,
) -> Result<(Contacts, Vec<String>), ContactError> {
    let &Given { scene, decomposition, supports, nodes, .. } = given;
    let mut all = Contacts {
        names: scene.contact.keys().cloned().collect(),
        has_friction: scene.contact.iter().any(|(name, contact)| contact.rubs(name, scene.steps())),
        ..Contacts::default()
    };
    let (mut found, mut warnings) = (Vec::new(), Vec::new());
    for (number, (name, contact)) in scene.contact.iter().enumerate() {
        let (of_contact, touching, row, told) = one(comm, given, (number, name, contact), &index)?;
        found.push(of_contact);
        all.surfaces.push(touching);
        all.rows.push(row);
        warnings.extend(told);
    }
    (all.pairs, all.masters) = spread(comm, decomposition, nodes, found);
    all.sharing = sharing(comm, &all);
    // The rank of the lowest copy of a slave node has all its conditions.
    let interface = &decomposition.interface;
    let own = all.pairs.iter().map(|(_, pair)| pair).filter(|pair| decomposition.tells(pair.slave));
    corner::check(comm, &all.names, own, |nodes| dirichlet::fixed_here(interface, supports, nodes))?;
    Ok((all, warnings))
}

/// One contact: its conditions, what touches, how they were found, and what to tell of it. Collective.
fn one(
    comm: &dyn Comm,
    &Given { scene, decomposition, supports, extents, .. }: &Given,
    (number, name, contact): (usize, &String, &Contact),
    index: impl Fn(&SurfaceName) -> usize,
) -> Result<(Found, Surfaces, ContactRow, Vec<String>), ContactError> {
    let held = |nodes: &[u64]| dirichlet::fixed_at(comm, &decomposition.interface, supports, nodes);
    let pairing = Pairing { comm, contact: number, name, held: &held };
    let patch = |s| (s, Patch::new(comm, decomposition, index(s)));
    let surfaces: Vec<(&SurfaceName, Patch)> = contact.surfaces().map(patch).collect();
    let (slave, mut conditions, rule) = match (&contact.sides, &surfaces[..]) {
        (Sides::Rigid { obstacle, .. }, [(_, slave), ..]) => {
            (0, rigid::pair(comm, number, name, &slave.surface, obstacle)?, "rigid")
        }
        (Sides::Named { .. }, [(_, slave), (_, master)]) => {
            let (found, rule) = pairing.pair(slave, master)?;
            (0, found, rule_name(rule))
        }
        (Sides::Either(_), [(_, one), (_, other)]) => {
            let harder = harder(scene, &surfaces).map(|(harder, _)| harder);
            let (slave, found, rule) = pairing.choose([one, other], harder)?;
            (slave, found, rule_name(rule))
        }
        _ => unreachable!("two sides have two surfaces"),
    };
    conditions.prescribe(contact.clearance, contact.gap);
    let (mut warnings, pairs, patch) = (Vec::new(), &conditions.pairs, &surfaces[slave].1);
    if let (Sides::Named { .. }, "mortar") = (&contact.sides, rule) {
        warnings.extend(hard_slave(scene, (name, contact), &surfaces));
    }
    if let (Some(master), "mortar", None) = (surfaces.get(1 - slave), rule, contact.clearance) {
        let found = sagitta::unresolved(comm, patch, &master.1, pairs);
        warnings.extend(found.map(|found| extent::unresolved(name, &found, conditions.count)));
    }
    let sites = extent::sites(&patch.surface, pairs);
    let extent = |body: &String| &extents[scene.body.keys().position(|known| known == body).expect("it exists")];
    let bodies: Vec<_> = surfaces.iter().map(|(surface, _)| (&surface.body, extent(&surface.body))).collect();
    warnings.extend(extent::overlap(comm, name, pairs, &sites, &bodies));
    let touching = Surfaces {
        slave: index(surfaces[slave].0),
        master: surfaces.get(1 - slave).map(|(surface, _)| index(surface)),
        is_mortar: rule == rule_name(Rule::Mortar),
        share: match &contact.sides {
            Sides::Rigid { obstacle, .. } => rigid::share(obstacle),
            _ => quadratic::SHARE,
        },
    };
    let row = ContactRow {
        name: name.clone(),
        slave: surfaces[slave].0.to_string(),
        master: surfaces.get(1).map(|_| surfaces[1 - slave].0.to_string()),
        rule: rule.to_owned(),
        conditions: conditions.count as u64,
    };
    let tells =
        |pair: &ContactPair| patch.surface.index(pair.slave, pair.part).is_some_and(|index| patch.surface.tells(index));
    let told = pairs.iter().map(tells).collect();
    Ok((Found { conditions, sites, told }, touching, row, warnings))
}

/// Ratio of Young's moduli from which a body is much harder than another one.
const HARDER: f64 = 16.0;

/// Which of two surfaces is that of a much harder body, and how many times as stiff as the other one it is at least.
fn harder(scene: &Scene, surfaces: &[(&SurfaceName, Patch)]) -> Option<(usize, f64)> {
    let young = |(surface, _): &(&SurfaceName, Patch)| {
        let names = scene.body[&surface.body].material.names().into_iter();
        let all = names.map(|name| scene.material[name].hooke().young);
        all.fold([f64::INFINITY, 0.0], |[least, most], young| [f64::min(least, young), f64::max(most, young)])
    };
    let [one, other] = surfaces else { return None };
    let ([low, high], [least, most]) = (young(one), young(other));
    [low / most, least / high].into_iter().enumerate().find(|(_, times)| *times >= HARDER)
}

/// What to tell of a slave, the first surface, that is much harder and finer than its master, and is rubbed.
fn hard_slave(scene: &Scene, (name, contact): (&str, &Contact), surfaces: &[(&SurfaceName, Patch)]) -> Option<String> {
    let [(slave, one), (master, other)] = surfaces else { return None };
    let (0, times) = harder(scene, surfaces)? else { return None };
    let is_told = contact.rubs(name, scene.steps()) && one.surface.spacing() < other.surface.spacing();
    is_told.then(|| {
        format!(
            "contact.{name}: its slave {slave} has the finer mesh and is {} times as stiff as {master}. With friction that takes many \
             iterations, which may not end: exchange slave and master, or leave it to the program (surfaces)",
            extent::short(times),
        )
    })
}

fn rule_name(rule: Rule) -> &'static str {
    match rule {
        Rule::NodeToNode => "node to node",
        Rule::Mortar => "mortar",
    }
}

/// Contacts that have a node in common with another one, on any rank. Collective.
fn sharing(comm: &dyn Comm, Contacts { names, pairs, masters, .. }: &Contacts) -> Vec<usize> {
    let slaves = pairs.iter().filter(|(_, pair)| pair.covered).map(|(_, pair)| (pair.slave, pair.contact));
    let masters = masters.iter().map(|master| (master.node, master.contact));
    let mut of_node: BTreeMap<u64, Vec<usize>> = BTreeMap::new();
    slaves.chain(masters).for_each(|(node, contact)| of_node.entry(node).or_default().push(contact));
    let mut shares = vec![0_u64; names.len()];
    for contacts in of_node.values().filter(|contacts| contacts.iter().any(|contact| *contact != contacts[0])) {
        contacts.iter().for_each(|contact| shares[*contact] = 1);
    }
    let all = all_gather_u64(comm, &shares);
    (0..names.len())
        .filter(|contact| all.iter().skip(*contact).step_by(names.len()).any(|shares| *shares == 1))
        .collect()
}
