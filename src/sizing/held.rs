//! What a rank holds, item by item: its share of the scene, and what every rank holds beside it.
//!
//! Of `N` ranks each holds `owned / N + everywhere + N a_rank` bytes of an item. `owned` grows with the scene and is shared.
//! `everywhere` is on every rank: where it grows with the scene, a machine of any size ends. It does for three items: contact
//! rows that are coupled, up to a bound for each contact ([`kind`]), the factors of the coarse problem, and the lists of clusters.

use super::memory::megabytes;
use crate::constraint::links::FEW;
use crate::record::forecast::HeldRow;
use crate::scene::{Contact, Scene};

/// An item; all in bytes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Item {
    /// Its name in tables.
    pub name: &'static str,
    /// Of all ranks together, each its share.
    pub owned: f64,
    /// On every rank.
    pub everywhere: f64,
    /// On every rank, for each rank of the run.
    pub a_rank: f64,
}

/// Which of [`super::memory::Held::conditions`] the conditions of a contact are among. Rows are coupled, as conditions share nodes, where meshes
/// do not match, and on quadratic faces. If they are few, every rank at the contact holds all of them.
pub fn kind(scene: &Scene, contact: &Contact, meshes_match: bool, conditions: f64) -> usize {
    let is_quadratic = contact.surfaces().any(|surface| scene.body[&surface.body].element.degree() > 1);
    match is_quadratic || !meshes_match {
        false => 0,
        true if conditions <= FEW as f64 => 1,
        true => 2,
    }
}

impl Item {
    /// Each rank has its share of these bytes.
    pub fn owned(name: &'static str, bytes: f64) -> Self {
        Self { name, owned: bytes, everywhere: 0.0, a_rank: 0.0 }
    }

    /// Every rank has these bytes.
    pub fn everywhere(name: &'static str, bytes: f64) -> Self {
        Self { name, owned: 0.0, everywhere: bytes, a_rank: 0.0 }
    }

    /// Every rank has these bytes for each rank.
    pub fn a_rank(name: &'static str, bytes: f64) -> Self {
        Self { name, owned: 0.0, everywhere: 0.0, a_rank: bytes }
    }

    /// Of one of so many ranks.
    pub fn of_rank(&self, ranks: usize) -> f64 {
        self.owned / ranks as f64 + self.replicated(ranks)
    }

    /// What each of so many ranks holds whatever its share.
    pub fn replicated(&self, ranks: usize) -> f64 {
        self.everywhere + self.a_rank * ranks as f64
    }

    /// As a row of the table for so many ranks.
    pub fn row(&self, ranks: usize) -> HeldRow {
        HeldRow {
            item: self.name.to_owned(),
            owned_mb: megabytes(self.owned / ranks as f64),
            everywhere_mb: megabytes(self.replicated(ranks)),
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::comm::solo::Solo;
    use crate::comm::threads;
    use crate::comm::watched::Watched;
    use crate::decomposition::sums::NodeSums;
    use crate::decomposition::twins::twins;
    use crate::fixture::{Setup, not_matching, two_bricks};
    use crate::model::discretise;
    use crate::scene::Scene;
    use crate::sizing;
    use crate::sizing::counts::Counted;

    const RANKS: std::ops::RangeInclusive<usize> = 1..=8;

    /// Items that every rank holds and that grow with the scene.
    const GROWING: [&str; 3] = ["coupled contact", "coarse problem", "lists of clusters"];

    /// A scene of boxes of one cell, and one with twice as many cells along each edge; contact where nodes meet, short edges.
    fn small_and_large(more: &[&str]) -> [Scene; 2] {
        [["[4, 2, 2]"; 2], ["[8, 4, 4]"; 2]].map(|[lower, upper]| {
            let cells = [format!("body.lower.brick.cells={lower}"), format!("body.upper.brick.cells={upper}")];
            two_bricks(&[&[&cells[0][..], &cells[1][..], "decomposition.cells=[1, 1, 1]"], more].concat())
        })
    }

    #[test]
    fn what_every_rank_holds_stays_the_same_but_for_what_is_named() {
        let [small, large] = small_and_large(&["decomposition.cluster=1"]);
        let built = |scene: &Scene| {
            let discrete = discretise(scene, &Solo).expect("the scene has a discrete problem");
            sizing::memory(scene, &discrete, &Solo)
        };
        let counted = |scene: &Scene| Counted::new(scene).expect("bodies are bricks").memory();
        for [small, large] in [[built(&small), built(&large)], [counted(&small), counted(&large)]] {
            for ranks in RANKS {
                for (a, b) in small.items.iter().zip(&large.items) {
                    assert_eq!(a.name, b.name);
                    let (before, after) = (a.replicated(ranks), b.replicated(ranks));
                    assert_eq!(before == after, !GROWING[1..].contains(&a.name), "{}: {before} {after}", a.name);
                    assert!(a.owned == 0.0 || b.owned > 2.0 * a.owned, "{}: {} {}", a.name, a.owned, b.owned);
                }
                let total = |memory: &sizing::memory::Memory| {
                    memory.held(ranks).iter().map(|row| row.owned_mb + row.everywhere_mb).sum::<f64>()
                };
                assert!((total(&large) * ranks as f64 / large.total_mb(ranks) - 1.0).abs() < 1e-12);
                assert!(total(&large) > total(&small));
            }
        }
        for ranks in RANKS {
            let memory = |comm: &dyn crate::comm::Comm| {
                let discrete = discretise(&small, comm).expect("the scene has a discrete problem");
                sizing::memory(&small, &discrete, comm)
            };
            assert!(threads::run(ranks, memory).iter().all(|found| *found == built(&small)), "whoever asks");
        }
        let mortar = built(&not_matching(&[]));
        assert!(mortar.items.iter().any(|item| item.name == GROWING[0] && item.everywhere > 0.0));
    }

    /// Grouped again and again, a scene of any size has a coarse problem of few blocks.
    #[test]
    fn the_coarse_problem_that_every_rank_holds_has_a_bound() {
        let of = |edge: usize| {
            let cells =
                ["lower", "upper"].map(|body| format!("body.{body}.brick.cells=[{0}, {edge}, {edge}]", 2 * edge));
            let scene = two_bricks(&[&cells[0][..], &cells[1][..], "decomposition.cells=[1, 1, 1]"]);
            let counted = Counted::new(&scene).expect("bodies are bricks");
            let items = counted.memory().items;
            let coarse = items.iter().find(|item| item.name == "coarse problem").expect("there is one");
            (counted.sizes().coarse_blocks, coarse.everywhere)
        };
        let largest = [16, 40, 64, 100, 160, 256, 400].map(of);
        assert!(largest.iter().all(|(blocks, bytes)| *blocks < 1700 && *bytes < 1e8), "{largest:?}");
    }

    /// Of an application of the dual operator with its projection, the longest message that is for all: with as many blocks in the
    /// coarse problem it does not depend on how many subdomains are below them.
    #[test]
    fn what_all_ranks_are_told_in_an_application_does_not_grow_with_the_scene() {
        let longest = [("[8, 4, 4]", "8"), ("[16, 8, 8]", "[8, 8]")].map(|(cells, cluster)| {
            let sets = ["lower", "upper"].map(|body| format!("body.{body}.brick.cells={cells}"));
            let cluster = format!("decomposition.cluster={cluster}");
            let scene = two_bricks(&[&sets[0][..], &sets[1], "decomposition.cells=[1, 1, 1]", &cluster]);
            let of_ranks = threads::run(6, |comm| {
                let discrete = discretise(&scene, comm).expect("the scene has a discrete problem");
                let watched = Watched::new(comm);
                let setup = Setup::of(discrete, &watched);
                let coarse = setup.coarse().expect("supports hold both bodies");
                let x = setup.multipliers(1);
                let (mut operator, mut y) = (setup.operator(), x.clone());
                operator.apply(&x, &mut y);
                setup.space.dots(&[(&x, &y), (&x, &x)]);
                let mut a = coarse.apply(&y);
                coarse.solve(&mut a);
                watched.longest()
            });
            of_ranks.into_iter().max()
        });
        assert_eq!(longest[0], longest[1]);
        assert!(longest[0] > Some(0));
    }

    /// Of setting up a problem, the longest message that is for all.
    #[test]
    fn what_all_ranks_are_told_does_not_grow_with_the_scene() {
        // Of fewer ranks all may be around each node of a flat body, and hear the same of it.
        for ranks in RANKS.skip(5) {
            // Boxes, and flat ones with short edges.
            for more in [&[][..], &["body.upper.brick.size.2=0.2"]] {
                let [small, large] = small_and_large(more).map(|scene| {
                    let longest = threads::run(ranks, |comm| {
                        let watched = Watched::new(comm);
                        let discrete = discretise(&scene, &watched).expect("the scene has a discrete problem");
                        sizing::sizes(&discrete, &watched);
                        sizing::memory(&scene, &discrete, &watched);
                        NodeSums::new(&watched, &discrete.decomposition);
                        twins(&watched, &discrete.decomposition.subdomains);
                        watched.longest()
                    });
                    longest.into_iter().max()
                });
                assert_eq!(small, large, "{ranks} ranks, {more:?}");
                assert!(small > Some(0));
            }
        }
    }
}
