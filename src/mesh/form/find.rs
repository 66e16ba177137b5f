//! Parts of a surface that are on a round form, or on a plane beside one.
//!
//! From a face one goes to those around it, where they meet smoothly; if the form through so much is exact, it goes on as far as faces
//! are on it, and is fitted to all. Nodes of a mesh are on its surface but for rounding: exact means [`EXACT`]. So few nodes tell a
//! form, but some parts are on one by chance:
//!
//! - any three lines along one direction are on a cylinder, and often four, as of a chamfer: there must be [`LINES`] of a cylinder or
//!   cone, and [`LINES`] circles of a torus as well;
//! - any two circles about one axis are on a sphere, and so are a tip and one circle: a sphere must have [`INNER`] nodes all
//!   around which it goes on.
//!
//! Two circles about one axis are a cylinder or a cone. A flat part with an inner node is no part of what is round. A plane beside a round
//! form counts where no other smooth face goes on from it: facets of free forms do not.

use std::collections::{HashMap, HashSet, VecDeque};
use std::f64::consts::TAU;

use super::{Form, about, fit};
use crate::mesh::surface::{SHARPEST, area_vector};
use crate::vector::{Point, difference, dot, length};

/// Nodes of a face are as near to its form, relative to its longest edge.
const EXACT: f64 = 1e-5;
/// A form has so many nodes at least.
const NODES: usize = 10;
/// Lines along the axis that a cone has at least, and circles that a torus has.
const LINES: usize = 5;
/// They are apart by more, in radians.
const APART: f64 = 1e-3;
/// Inner nodes that a sphere has at least.
const INNER: usize = 3;
/// Faces that a form is first fitted to: fewer where so many are not on one.
const PATCHES: [usize; 4] = [150, 48, 24, 12];
/// Faces around one that no form was found from are not tried.
const TRIED: usize = 12;
/// Fits to all faces of a form, or to those that have so many of its nodes.
const FITS: usize = 2;
const SAMPLE: usize = 500;

/// The faces of a surface.
struct Surface {
    /// Their nodes, by place.
    faces: Vec<Vec<usize>>,
    places: Vec<Point>,
    /// Area vectors of the corners.
    normals: Vec<Point>,
    /// Longest edges.
    longest: Vec<f64>,
    /// Faces that meet it smoothly at an edge.
    smooth: Vec<Vec<usize>>,
    /// Faces that meet it at an edge of the surface.
    sharp: Vec<Vec<usize>>,
    /// Faces around each node.
    around: Vec<Vec<usize>>,
}

/// Forms with the faces on them; faces list three corners, counter-clockwise from outside, then the middles of their edges if they
/// have any. The result depends on the order of the faces alone.
pub fn find(faces: &[Vec<u32>], place: impl Fn(u32) -> Point) -> Vec<(Form, Vec<usize>)> {
    let surface = Surface::new(faces, place);
    let flat = surface.flat();
    // What no round form may have: faces of planes, then also those of other forms.
    let mut taken = vec![false; faces.len()];
    for part in flat.iter().filter(|part| surface.inner(part) > 0) {
        part.iter().for_each(|&face| taken[face] = true);
    }
    let mut found: Vec<(Form, Vec<usize>)> = Vec::new();
    let mut tried = taken.clone();
    for seed in 0..faces.len() {
        if taken[seed] || tried[seed] {
            continue;
        }
        if let Some((form, part)) = surface.grow(seed, &taken, &mut tried) {
            part.iter().for_each(|&face| taken[face] = true);
            found.push((form, part));
        }
    }
    let mut is_round = vec![false; faces.len()];
    found.iter().flat_map(|(_, part)| part).for_each(|&face| is_round[face] = true);
    for part in flat {
        let of_part: HashSet<usize> = part.iter().copied().collect();
        let ends = |face: &usize| surface.smooth[*face].iter().all(|other| of_part.contains(other) || is_round[*other]);
        let meets = |face: &usize| surface.sharp[*face].iter().chain(&surface.smooth[*face]).any(|&f| is_round[f]);
        if part.iter().all(|face| !is_round[*face] && ends(face)) && part.iter().any(meets) {
            let plane = fit::plane(&surface.places_of(&part)).filter(|plane| surface.are_on(&part, plane));
            found.extend(plane.map(|form| (form, part)));
        }
    }
    found
}

impl Surface {
    fn new(faces: &[Vec<u32>], place: impl Fn(u32) -> Point) -> Self {
        let mut nodes: Vec<u32> = faces.iter().flatten().copied().collect();
        nodes.sort_unstable();
        nodes.dedup();
        let local = |node: &u32| nodes.binary_search(node).expect("every node is listed");
        let faces: Vec<Vec<usize>> = faces.iter().map(|face| face.iter().map(local).collect()).collect();
        let places: Vec<Point> = nodes.iter().map(|&node| place(node)).collect();
        let corners = |face: &Vec<usize>| [face[0], face[1], face[2]].map(|node| places[node]);
        let normals: Vec<Point> = faces.iter().map(|face| area_vector(&corners(face))).collect();
        let edge = |[a, b, c]: [Point; 3]| [(a, b), (b, c), (c, a)].map(|(x, y)| length(difference(x, y)));
        let longest = faces.iter().map(|face| edge(corners(face)).into_iter().fold(0.0, f64::max)).collect();
        let (mut at_edge, mut around) = (HashMap::<[usize; 2], Vec<usize>>::new(), vec![Vec::new(); places.len()]);
        let edges = |face: &[usize]| [0, 1, 2].map(|k| [face[k], face[(k + 1) % 3]]);
        let key = |[a, b]: [usize; 2]| [a.min(b), a.max(b)];
        for (number, face) in faces.iter().enumerate() {
            edges(face).into_iter().for_each(|ends| at_edge.entry(key(ends)).or_default().push(number));
            face.iter().for_each(|&node| around[node].push(number));
        }
        let cosine = SHARPEST.to_radians().cos();
        let is_smooth = |f: usize, g: usize| {
            dot(normals[f], normals[g]) >= cosine * length(normals[f]) * length(normals[g]) && length(normals[f]) > 0.0
        };
        let (mut smooth, mut sharp) = (vec![Vec::new(); faces.len()], vec![Vec::new(); faces.len()]);
        for (number, face) in faces.iter().enumerate() {
            for ends in edges(face) {
                let there = &at_edge[&key(ends)];
                for &other in there.iter().filter(|&&other| other != number) {
                    let is_one = there.len() == 2 && is_smooth(number, other);
                    if is_one { smooth[number].push(other) } else { sharp[number].push(other) }
                }
            }
        }
        Self { faces, places, normals, longest, smooth, sharp, around }
    }

    /// A face and those around it, in the order in which they are reached, but at most so many, of those that are wanted.
    fn near(&self, seed: usize, most: usize, is_wanted: impl Fn(usize) -> bool) -> Vec<usize> {
        let (mut reached, mut next) = (vec![seed], VecDeque::from([seed]));
        let mut seen = HashSet::from([seed]);
        while let Some(face) = next.pop_front() {
            for &other in &self.smooth[face] {
                if reached.len() < most && is_wanted(other) && seen.insert(other) {
                    reached.push(other);
                    next.push_back(other);
                }
            }
        }
        reached
    }

    /// All faces, in parts that are in one plane each.
    fn flat(&self) -> Vec<Vec<usize>> {
        let (mut parts, mut done) = (Vec::new(), vec![false; self.faces.len()]);
        for seed in 0..self.faces.len() {
            if done[seed] {
                continue;
            }
            let size = length(self.normals[seed]);
            let normal = self.normals[seed].map(|x| x / size);
            let plane = Form::Plane { point: self.places[self.faces[seed][0]], normal };
            let part = self.near(seed, usize::MAX, |face| !done[face] && self.is_on(face, &plane));
            part.iter().for_each(|&face| done[face] = true);
            parts.push(part);
        }
        parts
    }

    /// The round form that a face is on with others that are not taken; if there is none, those that one was sought of are tried.
    fn grow(&self, seed: usize, taken: &[bool], tried: &mut [bool]) -> Option<(Form, Vec<usize>)> {
        let near = self.near(seed, PATCHES[0], |face| !taken[face]);
        let mut sought = near[..near.len().min(TRIED)].to_vec();
        let mut sizes = PATCHES.map(|most| near.len().min(most)).to_vec();
        sizes.dedup();
        for size in sizes {
            let patch = &near[..size];
            let grown = |form: &Form| self.near(seed, usize::MAX, |face| !taken[face] && self.is_on(face, form));
            for fitted in [Self::cones, Self::spheres, Self::tori] {
                let through = |part: &[usize]| fitted(self, part).into_iter().find(|form| self.are_on(part, form));
                let mut part = patch.to_vec();
                let mut form = through(&part);
                for _ in 0..FITS {
                    part = form.map_or(part, |form| grown(&form));
                    form = form.and_then(|_| through(&part));
                }
                match form {
                    Some(form) if self.is_evident(&form, &part) => return Some((form, part)),
                    _ if part.len() > patch.len() => sought.extend(part),
                    _ => (),
                }
            }
        }
        sought.into_iter().for_each(|face| tried[face] = true);
        None
    }

    fn are_on(&self, part: &[usize], form: &Form) -> bool {
        part.iter().all(|&face| self.is_on(face, form))
    }

    fn cones(&self, part: &[usize]) -> Vec<Form> {
        let part = sample(part);
        let normals: Vec<Point> = part.iter().map(|&face| self.normals[face]).collect();
        fit::cones(&self.places_of(&part), &normals)
    }

    fn spheres(&self, part: &[usize]) -> Vec<Form> {
        fit::sphere(&self.places_of(&sample(part))).into_iter().collect()
    }

    fn tori(&self, part: &[usize]) -> Vec<Form> {
        let part = sample(part);
        let faces: Vec<[Point; 2]> = part.iter().map(|&face| [self.centre(face), self.normals[face]]).collect();
        fit::torus(&self.places_of(&part), &faces).into_iter().collect()
    }

    fn centre(&self, face: usize) -> Point {
        let corners = [0, 1, 2].map(|k| self.places[self.faces[face][k]]);
        std::array::from_fn(|a| (corners[0][a] + corners[1][a] + corners[2][a]) / 3.0)
    }

    /// Whether all nodes of a face are on a form, and the face along it.
    fn is_on(&self, face: usize, form: &Form) -> bool {
        let cosine = (0.5 * SHARPEST).to_radians().cos() * length(self.normals[face]);
        self.faces[face].iter().all(|&node| {
            let (distance, normal) = form.distance(self.places[node]);
            distance.abs() <= EXACT * self.longest[face] && dot(normal, self.normals[face]).abs() >= cosine
        })
    }

    /// Whether faces are on a form not by chance.
    fn is_evident(&self, form: &Form, part: &[usize]) -> bool {
        let places = self.places_of(part);
        let lines = |angle: &dyn Fn(Point) -> f64| {
            let mut angles: Vec<f64> = places.iter().map(|&x| angle(x)).collect();
            angles.sort_by(f64::total_cmp);
            let mut first = vec![angles[0]];
            angles.iter().for_each(|&angle| {
                if angle > first[first.len() - 1] + APART {
                    first.push(angle)
                }
            });
            let is_once_round = angles[angles.len() - 1] > angles[0] + TAU - APART;
            first.len() - usize::from(is_once_round)
        };
        let around = |point: Point, axis: Point| {
            let [one, other] = fit::across(axis);
            lines(&|x| dot(other, difference(x, point)).atan2(dot(one, difference(x, point))))
        };
        let is_form = match *form {
            Form::Plane { .. } => true,
            Form::Sphere { .. } => self.inner(part) >= INNER,
            Form::Cone { point, axis, .. } => around(point, axis) >= LINES,
            Form::Torus { centre, axis, radii } => {
                let of_circle = |x: Point| {
                    let (along, from_axis, _) = about(x, centre, axis);
                    along.atan2(from_axis - radii[0])
                };
                around(centre, axis) >= LINES && lines(&of_circle) >= LINES
            }
        };
        is_form && places.len() >= NODES
    }

    /// How many corners have all faces around them in a part.
    fn inner(&self, part: &[usize]) -> usize {
        let mut beside: HashMap<usize, Vec<usize>> = HashMap::new();
        for face in part {
            let corners = &self.faces[*face][..3];
            corners.iter().for_each(|&node| beside.entry(node).or_default().extend(corners));
        }
        let is_inner = |(node, mut beside): (usize, Vec<usize>)| {
            let faces = beside.len() / 3;
            beside.sort_unstable();
            beside.dedup();
            // Each face has one more edge at it than the last, and the last one meets the first.
            self.around[node].len() == faces && beside.len() == faces + 1
        };
        beside.into_iter().map(is_inner).filter(|is_inner| *is_inner).count()
    }

    /// Places of all nodes of a part, once each.
    fn places_of(&self, part: &[usize]) -> Vec<Point> {
        let mut nodes: Vec<usize> = part.iter().flat_map(|&face| self.faces[face].iter().copied()).collect();
        nodes.sort_unstable();
        nodes.dedup();
        nodes.into_iter().map(|node| self.places[node]).collect()
    }
}

/// Some faces out of many.
fn sample(part: &[usize]) -> Vec<usize> {
    part.iter().step_by(part.len().div_ceil(SAMPLE)).copied().collect()
}
