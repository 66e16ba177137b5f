//! How large bodies are, where contact conditions stand, and what is wrong with a contact before anything is solved.
//!
//! Two sides may overlap at the start by a tenth of the extent that the thinner body has along the normal: closing the overlap
//! strains that body by so much, and the theory is of small strains.

use crate::comm::{Comm, all_gather_u64};
use crate::contact::sagitta::Unresolved;
use crate::contact::surface::GatheredSurface;
use crate::contact::{ContactPair, Site};
use crate::decomposition::Subdomain;
use crate::vector::{difference, length};

/// Least and largest coordinates of a body.
pub type Extent = [[f64; 3]; 2];

const OVERLAP: f64 = 0.1;

/// The sites of conditions on a surface.
pub fn sites(surface: &GatheredSurface, pairs: &[ContactPair]) -> Vec<Site> {
    let mut longest = vec![0.0_f64; surface.nodes.len()];
    for triangle in &surface.triangles {
        let side = |k: usize| difference(surface.points[triangle[k]], surface.points[triangle[(k + 1) % 3]]);
        let edge = (0..3).map(|k| length(side(k))).fold(0.0, f64::max);
        triangle.iter().for_each(|&node| longest[node] = longest[node].max(edge));
    }
    let site = |pair: &ContactPair| {
        let node = surface.index(pair.slave, pair.part).expect("slave nodes are on the surface");
        Site { place: surface.points[node], facet: longest[node] }
    };
    pairs.iter().map(site).collect()
}

/// Length of the diagonal of a bounding box.
pub fn diagonal([low, high]: &Extent) -> f64 {
    length(difference(*high, *low))
}

/// Extents of all bodies, from the subdomains of all ranks. Collective.
pub fn extents(comm: &dyn Comm, subdomains: &[Subdomain], bodies: usize) -> Vec<Extent> {
    const NONE: Extent = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
    let mut mine = vec![NONE; bodies];
    let add = |[low, high]: &mut Extent, [l, h]: [[f64; 3]; 2]| {
        (0..3).for_each(|a| (low[a], high[a]) = (low[a].min(l[a]), high[a].max(h[a])));
    };
    for subdomain in subdomains {
        subdomain.points.iter().for_each(|&x| add(&mut mine[subdomain.body], [x, x]));
    }
    let numbers: Vec<f64> = mine.as_flattened().as_flattened().to_vec();
    let all = comm.all_gather(&numbers, &vec![numbers.len(); comm.size()]);
    let mut extents = vec![NONE; bodies];
    for (k, &[a, b, c, d, e, f]) in all.as_chunks::<6>().0.iter().enumerate() {
        add(&mut extents[k % bodies], [[a, b, c], [d, e, f]]);
    }
    extents
}

/// What to tell of a contact whose sides overlap too deeply at the start, on any rank; `bodies` are those of its sides. Collective.
pub fn overlap(
    comm: &dyn Comm,
    name: &str,
    pairs: &[ContactPair],
    sites: &[Site],
    bodies: &[(&String, &Extent)],
) -> Option<String> {
    let relative = |(pair, site): (&ContactPair, &Site)| {
        let along = |[low, high]: &Extent| (0..3).map(|a| pair.normal[a].abs() * (high[a] - low[a])).sum::<f64>();
        let extents = bodies.iter().enumerate().map(|(body, (_, extent))| (along(extent), body));
        let (thin, body) = extents.min_by(|a, b| a.0.total_cmp(&b.0))?;
        let (depth, [x, y, z]) = (-pair.gap, site.place);
        let found = Overlap {
            numbers: [depth / thin, depth, thin, x, y, z],
            of: [pair.slave, u64::from(pair.part), body as u64],
        };
        (depth > OVERLAP * thin).then_some(found)
    };
    let mine = pairs.iter().zip(sites).filter_map(relative).reduce(Overlap::worse);
    let packed = mine.map(|Overlap { numbers, of }| [&numbers.map(f64::to_bits)[..], &of].concat()).unwrap_or_default();
    let all = all_gather_u64(comm, &packed);
    let unpacked = all.as_chunks::<9>().0.iter().map(|&[a, b, c, d, e, f, slave, part, body]| Overlap {
        numbers: [a, b, c, d, e, f].map(f64::from_bits),
        of: [slave, part, body],
    });
    let Overlap { numbers: [share, depth, extent, x, y, z], of: [.., body] } = unpacked.reduce(Overlap::worse)?;
    let (body, place) = (bodies[body as usize].0, [x, y, z]);
    Some(format!(
        "contact.{name}: its sides overlap by {} near {}, {} of the {} that body {body} extends there; small strains allow \
         {OVERLAP} of it: check the places of the bodies, gap and clearance",
        short(depth),
        shown(place),
        short(share),
        short(extent),
    ))
}

/// A condition whose sides overlap too deeply.
struct Overlap {
    /// The share of the thinner body's extent, the depth, that extent, the place.
    numbers: [f64; 6],
    /// Slave node, part, and which side is thinner.
    of: [u64; 3],
}

impl Overlap {
    /// The larger share; of equal ones that of the first condition.
    fn worse(self, other: Self) -> Self {
        let [one, next] = [&self, &other].map(|overlap| overlap.numbers[0]);
        if next > one || (next == one && other.of < self.of) { other } else { self }
    }
}

/// What to tell of a contact whose facets do not resolve its gaps.
pub fn unresolved(name: &str, found: &Unresolved, conditions: usize) -> String {
    format!(
        "contact.{name}: its surfaces are curved alike and their meshes do not match. Where it closes, pressures follow the \
         facets, which stand off the surfaces by up to {}: in {} of {conditions} conditions the distance is less than half a \
         facet's width. Say the distance that is meant, as in clearance = {}, the mean of the surfaces",
        short(found.sagitta),
        found.conditions,
        short(found.distance),
    )
}

/// A number with four digits.
pub fn short(x: f64) -> String {
    format!("{x:.3e}").parse::<f64>().map_or_else(|_| x.to_string(), |x| x.to_string())
}

/// A place with four digits a coordinate.
pub fn shown(place: [f64; 3]) -> String {
    format!("[{}]", place.map(short).join(", "))
}
