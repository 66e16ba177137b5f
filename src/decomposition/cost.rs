//! How many subdomains to cut into when nobody says.

/// Elements of a subdomain.
pub const ELEMENTS: u64 = 6000;

/// Subdomains for bodies of so many elements: at least one each.
pub fn subdomains(elements: &[u64]) -> usize {
    elements.iter().map(|&n| n.div_ceil(ELEMENTS).max(1) as usize).sum()
}
