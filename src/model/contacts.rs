//! The contacts of a scene: their conditions, and what is told of them.

use super::extent::{self, Extent, Site};
use crate::comm::Comm;
use crate::constraint::{Support, dirichlet};
use crate::contact::pairing::{self, Rule};
use crate::contact::surface::GatheredSurface;
use crate::contact::{Conditions, ContactError, ContactPair, MasterNode, corner, rigid, sagitta};
use crate::decomposition::Decomposition;
use crate::record::counts::ContactRow;
use crate::scene::{Contact, Scene, Sides, SurfaceName};

/// The contacts of a scene.
#[derive(Default)]
pub struct Contacts {
    /// Their names.
    pub names: Vec<String>,
    /// Indices of the surfaces in contact, contact by contact.
    pub surfaces: Vec<usize>,
    /// Pairs of all contacts.
    pub pairs: Vec<ContactPair>,
    /// Nodes of all master surfaces that have slaves opposite, by the indices of these pairs.
    pub masters: Vec<MasterNode>,
    /// Where each of the pairs is.
    pub sites: Vec<Site>,
    /// How each contact was paired.
    pub rows: Vec<ContactRow>,
}

/// Pairs all contacts; the texts are what the user should know. `index` numbers the surfaces of the decomposition, `extents`
/// are those of the bodies. Collective.
///
/// # Errors
/// If a contact has no pairs, or obstacles are too many for a node.
pub(super) fn pair(
    scene: &Scene,
    comm: &dyn Comm,
    decomposition: &Decomposition,
    supports: &[Support],
    extents: &[Extent],
    index: impl Fn(&SurfaceName) -> usize,
) -> Result<(Contacts, Vec<String>), ContactError> {
    let gather = |s: &SurfaceName| GatheredSurface::gather(comm, &decomposition.subdomains, index(s));
    let held = |nodes: &[u64]| dirichlet::fixed_at(comm, &decomposition.interface, supports, nodes);
    let mut all = Contacts {
        names: scene.contact.keys().cloned().collect(),
        surfaces: scene.contact.values().flat_map(Contact::surfaces).map(&index).collect(),
        ..Contacts::default()
    };
    let mut warnings = Vec::new();
    for (number, (name, contact)) in scene.contact.iter().enumerate() {
        let surfaces: Vec<(&SurfaceName, GatheredSurface)> = contact.surfaces().map(|s| (s, gather(s))).collect();
        let (slave, Conditions { mut pairs, mut masters, .. }, rule) = match (&contact.sides, &surfaces[..]) {
            (Sides::Rigid { obstacle, .. }, [(_, slave), ..]) => {
                let pairs = rigid::pair(number, name, slave, obstacle)?;
                (0, Conditions { pairs, ..Conditions::default() }, "rigid")
            }
            (Sides::Named { .. }, [(_, slave), (_, master)]) => {
                let (found, rule) = pairing::pair(number, name, slave, master, &held)?;
                (0, found, rule_name(rule))
            }
            (Sides::Either(_), [(_, one), (_, other)]) => {
                let (slave, found, rule) = pairing::choose(number, name, [one, other], &held)?;
                (slave, found, rule_name(rule))
            }
            _ => unreachable!("two sides have two surfaces"),
        };
        for pair in &mut pairs {
            pair.gap = contact.clearance.unwrap_or(pair.gap + contact.gap);
        }
        if let (Some(master), "mortar", None) = (surfaces.get(1 - slave), rule, contact.clearance) {
            let found = sagitta::unresolved(&surfaces[slave].1, &master.1, &pairs);
            warnings.extend(found.map(|found| extent::unresolved(name, &found, pairs.len())));
        }
        let sites = extent::sites(&surfaces[slave].1, &pairs);
        let extent = |body: &String| &extents[scene.body.keys().position(|known| known == body).expect("it exists")];
        let bodies: Vec<_> = surfaces.iter().map(|(surface, _)| (&surface.body, extent(&surface.body))).collect();
        warnings.extend(extent::overlap(name, &pairs, &sites, &bodies));
        all.rows.push(ContactRow {
            name: name.clone(),
            slave: surfaces[slave].0.to_string(),
            master: surfaces.get(1).map(|_| surfaces[1 - slave].0.to_string()),
            rule: rule.to_owned(),
            conditions: pairs.len() as u64,
        });
        let first = all.pairs.len();
        masters.iter_mut().flat_map(|node| &mut node.pairs).for_each(|(pair, _)| *pair += first);
        all.masters.extend(masters);
        all.pairs.extend(pairs);
        all.sites.extend(sites);
    }
    corner::check(&all.names, &all.pairs, held)?;
    Ok((all, warnings))
}

fn rule_name(rule: Rule) -> &'static str {
    match rule {
        Rule::NodeToNode => "node to node",
        Rule::Mortar => "mortar",
    }
}
