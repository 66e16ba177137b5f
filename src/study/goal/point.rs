//! Where a point of a body is: the element that has it, and its place there.
//!
//! Elements whose box is near the point are asked for its barycentric coordinates, by Newton's method where they are curved. The
//! element that it is least outside of has it, of equal ones the first of the first subdomain, on whatever rank. A point may be
//! beside a body by a share of its size, as meshes cut corners of curved bodies: what is there belongs to the nearest place of the
//! element. Tetrahedra only: those are what meshes are refined of.

use super::GoalError;
use crate::comm::{Comm, all_gather_u64};
use crate::decomposition::Subdomain;
use crate::element::{Cell, Kind};
use crate::model::Discrete;
use crate::model::extent::diagonal;
use crate::scene::Scene;
use crate::vector::{difference, length};

/// Share of a body's diagonal that a point may be outside.
const BESIDE: f64 = 0.01;
/// Of an element's longest edge: less is rounding.
const ROUNDING: f64 = 1e-9;
/// Steps of Newton's method at most; it converges quadratically.
const STEPS: usize = 20;

/// A place in an own element, or in that of another rank.
pub(super) struct Place {
    /// The subdomain's number.
    pub subdomain: usize,
    /// The element's number in it.
    pub element: usize,
    /// Barycentric coordinates; those of another rank's are not known.
    pub at: [f64; 4],
}

/// The place of a point, in a body or in the only one that has it. Collective.
///
/// # Errors
/// If no body has it, or several have.
pub(super) fn find(
    comm: &dyn Comm,
    scene: &Scene,
    discrete: &Discrete,
    (point, body): ([f64; 3], Option<&str>),
) -> Result<Place, GoalError> {
    let names: Vec<&String> = scene.body.keys().collect();
    let mut best: Option<(usize, [u64; 3])> = None;
    for (index, name) in names.iter().enumerate().filter(|(_, name)| body.is_none_or(|body| **name == body)) {
        let Some(found) = in_body(comm, discrete, point, index) else { continue };
        match best {
            Some((other, before)) if before[0] == found[0] => {
                let (one, other) = (names[other].clone(), (*name).clone());
                return Err(GoalError::Shared { point, one, other });
            }
            Some((_, before)) if before[0] < found[0] => {}
            _ => best = Some((index, found)),
        }
    }
    let Some((_, [_, subdomain, element])) = best else {
        return Err(GoalError::Outside { point, body: body.map(str::to_owned) });
    };
    let (subdomain, element) = (subdomain as usize, element as usize);
    let own = discrete.decomposition.own_index(subdomain as u32);
    let at = own.and_then(|own| {
        let subdomain = &discrete.decomposition.subdomains[own];
        subdomain.elements.iter().nth(element).and_then(|nodes| inside(subdomain, nodes, point))
    });
    Ok(Place { subdomain, element, at: at.map_or([0.0; 4], |(_, at)| at) })
}

/// How far outside, as bits, the subdomain and the element, of the best element of all ranks. Collective.
fn in_body(comm: &dyn Comm, discrete: &Discrete, point: [f64; 3], body: usize) -> Option<[u64; 3]> {
    let beside = BESIDE * diagonal(&discrete.extents[body]);
    let of_body = discrete.decomposition.subdomains.iter().filter(|subdomain| subdomain.body == body);
    let candidates = of_body.flat_map(|subdomain| {
        let near = move |(index, nodes): (usize, &[u32])| {
            let outside = is_near(subdomain, nodes, point, beside).then(|| inside(subdomain, nodes, point))??.0;
            (outside <= beside).then(|| [outside.to_bits(), subdomain.id as u64, index as u64])
        };
        subdomain.elements.iter().enumerate().filter_map(near)
    });
    // Bits of numbers that are not negative ascend as these do.
    let mine = candidates.min();
    let all = all_gather_u64(comm, mine.as_slice().as_flattened());
    all.as_chunks().0.iter().min().copied()
}

/// Whether the point is in the box of an element, or less than a distance beside it.
fn is_near(subdomain: &Subdomain, nodes: &[u32], point: [f64; 3], beside: f64) -> bool {
    (0..3).all(|i| {
        let along = nodes.iter().map(|&n| subdomain.points[n as usize][i]);
        let (low, high) = along.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)));
        // Curved edges reach beyond their nodes.
        let more = beside + 0.25 * (high - low);
        point[i] >= low - more && point[i] <= high + more
    })
}

/// How far a point is outside of an element (length, more or less), and the place in it that is nearest.
fn inside(subdomain: &Subdomain, nodes: &[u32], point: [f64; 3]) -> Option<(f64, [f64; 4])> {
    let kind = subdomain.elements.kind();
    let places: Vec<[f64; 3]> = nodes.iter().map(|&n| subdomain.points[n as usize]).collect();
    let at = coordinates(kind, &places, point)?;
    let edge = (0..4).flat_map(|a| (0..a).map(move |b| (a, b)));
    let edge = edge.map(|(a, b)| length(difference(places[a], places[b]))).fold(0.0, f64::max);
    let least = at.into_iter().fold(0.0, f64::min);
    let kept = at.map(|a| a.max(0.0));
    let sum: f64 = kept.iter().sum();
    Some((if -least < ROUNDING { 0.0 } else { -least * edge }, kept.map(|a| a / sum)))
}

/// Barycentric coordinates of a point; none where the map has no inverse.
fn coordinates(kind: Kind, places: &[[f64; 3]], point: [f64; 3]) -> Option<[f64; 4]> {
    if kind.cell() != Cell::Tetrahedron {
        return None;
    }
    let size = length(difference(places[1], places[0]));
    let mut at = [0.25; 4];
    for _ in 0..STEPS {
        let sample = kind.sample(places, &at, 1.0);
        let way = difference(point, sample.value(places));
        let mut change = [0.0; 4];
        for (a, change) in change.iter_mut().enumerate() {
            // A coordinate is one at its corner and half at the middles beside it.
            let ends = kind.middles().iter().zip(&sample.gradients[4..]);
            let beside = ends.filter(|((i, j), _)| *i == a || *j == a);
            let slope = |i: usize| sample.gradients[a][i] + 0.5 * beside.clone().map(|(_, g)| g[i]).sum::<f64>();
            *change = (0..3).map(|i| slope(i) * way[i]).sum();
        }
        at.iter_mut().zip(change).for_each(|(at, change)| *at += change);
        if !at.iter().all(|a| a.abs() < 10.0) {
            return None;
        }
        if length(way) <= 1e-3 * ROUNDING * size {
            return Some(at);
        }
    }
    // Far outside of a curved element there may be no such place.
    (length(difference(point, kind.sample(places, &at, 1.0).value(places))) <= ROUNDING * size).then_some(at)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::element::cell::EDGES;
    use crate::random::Random;

    /// Points that the shape functions of a curved element make, found again.
    #[test]
    fn places_in_curved_elements_are_found_again() {
        let corners = [[0.1, 0.0, 0.2], [2.0, 0.3, 0.0], [0.4, 1.5, 0.1], [0.2, 0.5, 1.0]];
        let mut random = Random::new(3);
        let mut places = corners.to_vec();
        for (a, b) in EDGES {
            let bent: [f64; 3] = random.vector(0.05);
            places.push(std::array::from_fn(|i| 0.5 * (corners[a][i] + corners[b][i]) + bent[i]));
        }
        for (kind, nodes) in [(Kind::Tet4, &places[..4]), (Kind::Tet10, &places[..])] {
            for _ in 0..50 {
                let raw: [f64; 3] = random.vector(1.0);
                let raw = [raw[0].abs(), raw[1].abs(), raw[2].abs(), 0.3];
                let at = raw.map(|a| a / raw.iter().sum::<f64>());
                let point = kind.sample(nodes, &at, 1.0).value(nodes);
                let found = coordinates(kind, nodes, point).unwrap();
                assert!(found.iter().zip(at).all(|(f, a)| (f - a).abs() < 1e-12), "{kind:?}: {found:?} {at:?}");
            }
        }
        assert!(coordinates(Kind::Hex8, &places[..8], [0.0; 3]).is_none());
    }
}
