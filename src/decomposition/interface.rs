//! Which subdomains share a node, and which named surfaces it lies on.
//!
//! Found by rendezvous: every rank reports its boundary nodes to the rank that the node's number points to, which
//! merges the reports and answers. No rank ever holds the whole interface.

use super::Subdomain;
use crate::comm::Comm;

/// A node with more than one copy, or on a named surface.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct InterfaceNode {
    /// Global number.
    pub node: u64,
    /// Subdomains that hold a copy, ascending.
    pub copies: Vec<u32>,
    /// Named surfaces that the node lies on, ascending.
    pub surfaces: Vec<u32>,
}

impl InterfaceNode {
    /// As numbers, for sending.
    pub fn pack(&self, message: &mut Vec<u64>) {
        message.extend([self.node, self.copies.len() as u64, self.surfaces.len() as u64]);
        message.extend(self.copies.iter().chain(&self.surfaces).map(|&n| u64::from(n)));
    }

    /// Nodes packed one behind the other.
    pub fn unpack(message: &[u64]) -> Vec<Self> {
        let mut numbers = message.iter().copied();
        let mut nodes = Vec::new();
        while let (Some(node), Some(copies), Some(surfaces)) = (numbers.next(), numbers.next(), numbers.next()) {
            let mut take = |count: u64| numbers.by_ref().take(count as usize).map(|n| n as u32).collect();
            nodes.push(Self { node, copies: take(copies), surfaces: take(surfaces) });
        }
        nodes
    }

    /// Merges reports of the same node.
    fn merge(mut reports: Vec<Self>) -> Vec<Self> {
        reports.sort_by_key(|report| report.node);
        let mut merged: Vec<Self> = Vec::new();
        for report in reports {
            match merged.last_mut().filter(|last| last.node == report.node) {
                Some(last) => {
                    last.copies.extend(report.copies);
                    last.surfaces.extend(report.surfaces);
                }
                None => merged.push(report),
            }
        }
        for node in &mut merged {
            node.copies.sort_unstable();
            node.surfaces.sort_unstable();
            node.surfaces.dedup();
        }
        merged
    }
}

/// The interface nodes of this rank's subdomains, ascending. Collective.
pub(crate) fn share(comm: &dyn Comm, subdomains: &[Subdomain]) -> Vec<InterfaceNode> {
    let reports = InterfaceNode::merge(subdomains.iter().flat_map(boundary_reports).collect());
    let mut outgoing = vec![Vec::new(); comm.size()];
    for report in &reports {
        report.pack(&mut outgoing[(report.node % comm.size() as u64) as usize]);
    }
    let incoming: Vec<Vec<InterfaceNode>> =
        comm.all_to_all(outgoing).iter().map(|message| InterfaceNode::unpack(message)).collect();
    let merged = InterfaceNode::merge(incoming.iter().flatten().cloned().collect());
    let answers = incoming
        .iter()
        .map(|asked| {
            let mut message = Vec::new();
            for report in asked {
                let at = merged.binary_search_by_key(&report.node, |n| n.node).expect("merged from these reports");
                if merged[at].copies.len() > 1 || !merged[at].surfaces.is_empty() {
                    merged[at].pack(&mut message);
                }
            }
            message
        })
        .collect();
    let mut nodes: Vec<_> = comm.all_to_all(answers).iter().flat_map(|m| InterfaceNode::unpack(m)).collect();
    nodes.sort_by_key(|n| n.node);
    nodes
}

/// What one subdomain knows of its own boundary nodes.
fn boundary_reports(subdomain: &Subdomain) -> Vec<InterfaceNode> {
    let mut surfaces = vec![Vec::new(); subdomain.nodes.len()];
    for facet in &subdomain.facets {
        for &node in &facet.nodes {
            surfaces[node as usize].push(facet.surface as u32);
        }
    }
    subdomain
        .boundary
        .iter()
        .map(|&node| InterfaceNode {
            node: subdomain.nodes[node as usize],
            copies: vec![subdomain.id as u32],
            surfaces: std::mem::take(&mut surfaces[node as usize]),
        })
        .collect()
}
