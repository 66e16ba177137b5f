//! The contacts of a scene: their pairs, and what is told of them.

use crate::comm::Comm;
use crate::constraint::{Support, dirichlet};
use crate::contact::pairing::{self, Rule};
use crate::contact::surface::{GatheredSurface, dot};
use crate::contact::{ContactError, ContactPair, corner, quadratic, rigid};
use crate::decomposition::Decomposition;
use crate::results::summary::ContactRow;
use crate::scene::{Contact, Scene, Sides, SurfaceName};

/// Pairs of all contacts, and a row for each contact. `index` numbers the surfaces of the decomposition. Collective.
///
/// # Errors
/// If a contact has no pairs, or obstacles are too many for a node.
pub(super) fn pair(
    scene: &Scene,
    comm: &dyn Comm,
    decomposition: &Decomposition,
    supports: &[Support],
    index: impl Fn(&SurfaceName) -> usize,
) -> Result<(Vec<ContactPair>, Vec<ContactRow>), ContactError> {
    let gather = |s: &SurfaceName| GatheredSurface::gather(comm, &decomposition.subdomains, index(s));
    let held = |nodes: &[u64]| dirichlet::held(comm, &decomposition.interface, supports, nodes);
    let (mut pairs, mut rows) = (Vec::new(), Vec::new());
    for (number, (name, Contact { sides, gap, clearance })) in scene.contact.iter().enumerate() {
        let (slave, master, mut found, rule) = match sides {
            Sides::Named { slave, master } => {
                let (pairs, rule) = pairing::pair(number, name, &gather(slave), &gather(master), &held)?;
                (slave, Some(master), pairs, rule_name(rule))
            }
            Sides::Either([one, other]) => {
                let (slave, pairs, rule) = pairing::choose(number, name, [&gather(one), &gather(other)], &held)?;
                let (slave, master) = if slave == 0 { (one, other) } else { (other, one) };
                (slave, Some(master), pairs, rule_name(rule))
            }
            Sides::Rigid { slave, obstacle, .. } => {
                let surface = gather(slave);
                let pairs = rigid::pair(number, name, &surface, obstacle)?;
                let along = |pair: &ContactPair, direction| pair.gap * dot(pair.normal, direction);
                (slave, None, quadratic::conditions(&surface, pairs, along), "rigid")
            }
        };
        found.iter_mut().for_each(|pair| match clearance {
            Some(clearance) => pair.set_distance(*clearance),
            None => pair.widen(*gap),
        });
        rows.push(ContactRow {
            name: name.clone(),
            slave: slave.to_string(),
            master: master.map(SurfaceName::to_string),
            rule: rule.to_owned(),
            conditions: found.len() as u64,
        });
        pairs.extend(found);
    }
    let names: Vec<String> = scene.contact.keys().cloned().collect();
    corner::check(&names, &pairs, held)?;
    Ok((pairs, rows))
}

fn rule_name(rule: Rule) -> &'static str {
    match rule {
        Rule::NodeToNode => "node to node",
        Rule::Mortar => "mortar",
    }
}
