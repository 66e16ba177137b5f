//! The contacts of a scene: their conditions, and what is told of them.

use crate::comm::Comm;
use crate::constraint::{Support, dirichlet};
use crate::contact::pairing::{self, Rule};
use crate::contact::surface::{GatheredSurface, dot};
use crate::contact::{Conditions, ContactError, ContactPair, MasterNode, corner, quadratic, rigid};
use crate::decomposition::Decomposition;
use crate::results::summary::ContactRow;
use crate::scene::{Contact, Scene, Sides, SurfaceName};

/// The contacts of a scene.
pub(super) struct Contacts {
    /// Pairs of all contacts.
    pub pairs: Vec<ContactPair>,
    /// Nodes of all master surfaces, by the indices of these pairs.
    pub masters: Vec<MasterNode>,
    /// A row for each contact.
    pub rows: Vec<ContactRow>,
}

/// Pairs all contacts. `index` numbers the surfaces of the decomposition. Collective.
///
/// # Errors
/// If a contact has no pairs, or obstacles are too many for a node.
pub(super) fn pair(
    scene: &Scene,
    comm: &dyn Comm,
    decomposition: &Decomposition,
    supports: &[Support],
    index: impl Fn(&SurfaceName) -> usize,
) -> Result<Contacts, ContactError> {
    let gather = |s: &SurfaceName| GatheredSurface::gather(comm, &decomposition.subdomains, index(s));
    let held = |nodes: &[u64]| dirichlet::held(comm, &decomposition.interface, supports, nodes);
    let mut contacts = Contacts { pairs: Vec::new(), masters: Vec::new(), rows: Vec::new() };
    for (number, (name, Contact { sides, gap, clearance })) in scene.contact.iter().enumerate() {
        let (slave, master, mut found, rule) = match sides {
            Sides::Named { slave, master } => {
                let (found, rule) = pairing::pair(number, name, &gather(slave), &gather(master), &held)?;
                (slave, Some(master), found, rule_name(rule))
            }
            Sides::Either([one, other]) => {
                let (slave, found, rule) = pairing::choose(number, name, [&gather(one), &gather(other)], &held)?;
                let (slave, master) = if slave == 0 { (one, other) } else { (other, one) };
                (slave, Some(master), found, rule_name(rule))
            }
            Sides::Rigid { slave, obstacle, .. } => {
                let surface = gather(slave);
                let pairs = rigid::pair(number, name, &surface, obstacle)?;
                let along = |pair: &ContactPair, direction| pair.gap * dot(pair.normal, direction);
                let pairs = quadratic::conditions(&surface, pairs, along);
                (slave, None, Conditions { pairs, ..Conditions::default() }, "rigid")
            }
        };
        found.pairs.iter_mut().for_each(|pair| match clearance {
            Some(clearance) => pair.set_distance(*clearance),
            None => pair.widen(*gap),
        });
        contacts.rows.push(ContactRow {
            name: name.clone(),
            slave: slave.to_string(),
            master: master.map(SurfaceName::to_string),
            rule: rule.to_owned(),
            conditions: found.pairs.len() as u64,
        });
        let first = contacts.pairs.len();
        found.masters.iter_mut().flat_map(|node| &mut node.pairs).for_each(|(pair, _)| *pair += first);
        contacts.masters.extend(found.masters);
        contacts.pairs.extend(found.pairs);
    }
    let names: Vec<String> = scene.contact.keys().cloned().collect();
    corner::check(&names, &contacts.pairs, held)?;
    Ok(contacts)
}

fn rule_name(rule: Rule) -> &'static str {
    match rule {
        Rule::NodeToNode => "node to node",
        Rule::Mortar => "mortar",
    }
}
