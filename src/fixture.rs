//! Small torn problems for the tests of all rooms, on any number of ranks.

use std::ops::Deref;

use faer::Mat;

use crate::assembly::flow::Flow;
use crate::assembly::{Region, stiffness};
use crate::comm::{Comm, threads};
use crate::constraint::Row;
use crate::decomposition::Subdomain;
use crate::feti::Torn;
use crate::feti::coarse::{Coarse, Floating};
use crate::feti::dual::Interconnection;
use crate::feti::dual::hybrid::Hybrid;
use crate::feti::dual::operator::DualOperator;
use crate::feti::inverse::Inverse;
use crate::feti::inverse::factor::{Factors, analyse};
use crate::feti::inverse::tangents::Linearisation;
use crate::material::Material;
use crate::model;
use crate::model::discrete::Discrete;
use crate::monitor::events::Event;
use crate::monitor::timing::Timer;
use crate::random::Random;
use crate::restart::Standing;
use crate::scene::Scene;
use crate::sparse::cholesky::Precision;
use crate::sparse::pattern::Pattern;
use crate::study::Watcher;

/// Numbers of ranks to test on: one, even, odd, and more than [`two_bricks`] has subdomains.
pub const RANKS: [usize; 4] = [1, 2, 3, 5];

/// Two bricks of unequal stiffness, each held at its far end; the upper one is shifted by half a subdomain. Four
/// subdomains unless `sets` say otherwise.
pub fn two_bricks(sets: &[&str]) -> Scene {
    const TEXT: &str = r#"
        [material.hard]
        young = 210.0
        poisson = 0.29
        yield_stress = 0.45
        hardening = 10.0
        [material.soft]
        young = 30.0
        poisson = 0.4
        [body.lower]
        material = "hard"
        element = "tet4"
        brick = { origin = [0.0, 0.0, 0.0], size = [4.0, 2.2, 2.0], cells = [4, 2, 2] }
        [body.upper]
        material = "soft"
        element = "tet4"
        brick = { origin = [1.0, 0.0, 2.1], size = [4.0, 2.2, 1.8], cells = [4, 2, 2] }
        [support.left]
        surface = "lower.xmin"
        fix = ["x", "y", "z"]
        [support.right]
        surface = "upper.xmax"
        fix = ["x", "y", "z"]
        displacement = [0.0, 0.1, 0.0]
        [load.top]
        surface = "upper.zmax"
        traction = [0.1, 0.2, -0.3]
        [contact.joint]
        slave = "upper.zmin"
        master = "lower.zmax"
        [decomposition]
        method = "bricks"
        cells = [2, 2, 2]
    "#;
    Scene::from_text(TEXT, "two bricks", 1, &owned(sets)).expect("the scene is sound")
}

/// Two bricks cut into about so many compact parts.
pub fn two_bricks_by_metis(parts: usize) -> Scene {
    two_bricks(&[&format!("decomposition.subdomains={parts}")])
}

/// Two blocks of hexahedra and prisms from a mesh file, one over the other, cut into about so many compact parts.
pub fn two_meshes(parts: usize) -> Scene {
    const FILE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/meshes/hexes-and-prisms.msh");
    let text = format!(
        r#"
        material.steel = {{ young = 210.0, poisson = 0.3 }}
        [body.lower]
        material = "steel"
        element = "tet4"
        gmsh = {{ file = "{FILE}", volume = "block" }}
        [body.upper]
        material = "steel"
        element = "tet4"
        gmsh = {{ file = "{FILE}", translate = [0.0, 0.0, 1.25] }}
        [support]
        low = {{ surface = "lower.base", fix = ["x", "y", "z"] }}
        high = {{ surface = "upper.top", fix = ["x", "y", "z"], displacement = [0.0, 0.0, -0.3] }}
        [contact.joint]
        slave = "upper.base"
        master = "lower.top"
        [decomposition]
        subdomains = {parts}
        "#
    );
    Scene::from_text(&text, "two meshes", 1, &[]).expect("the scene is sound")
}

/// A bar from x = 0 to 3 of unit cross-section, cut at x = 1 and at z = 0.25 into four volumes, with these materials (a
/// name, or a table by volume), held against rigid motions without constraint of a uniaxial stress along x. `stiff` and
/// `soft` contract alike under one stress.
pub fn quarters(materials: &str, sets: &[&str]) -> Scene {
    const FILE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/meshes/quarters.msh");
    let text = format!(
        r#"
        material.stiff = {{ young = 200.0, poisson = 0.4 }}
        material.soft = {{ young = 50.0, poisson = 0.1 }}
        [body.bar]
        material = {materials}
        element = "tet4"
        gmsh = {{ file = "{FILE}", volume = ["left-low", "right-low", "left-high", "right-high"] }}
        [support]
        x = {{ surface = "bar.x0", fix = ["x"] }}
        y = {{ surface = "bar.y0", fix = ["y"] }}
        z = {{ surface = "bar.z0", fix = ["z"] }}
        [decomposition]
        method = "metis"
        subdomains = 5
        "#
    );
    Scene::from_text(&text, "quarters", 1, &owned(sets)).expect("the scene is sound")
}

/// Two bodies, each of four clusters of eight subdomains.
pub fn clustered() -> Scene {
    built_in("patch", &["decomposition.cells=[1, 1, 1]", "decomposition.cluster=8"])
}

/// Two long bricks whose meshes do not match: subdomains touch a part of the contact, and hold a little more.
pub fn long_contact() -> Scene {
    two_bricks(&[
        "body.lower.brick={origin=[0.0,0.0,0.0],size=[9.0,2.2,1.0],cells=[18,4,2]}",
        "body.upper.brick={origin=[1.0,0.0,1.1],size=[8.0,2.2,1.0],cells=[12,4,2]}",
        "decomposition.cells=[3, 4, 2]",
    ])
}

/// As [`two_bricks`], with meshes that do not match: all contact rows are in one block.
pub fn not_matching(sets: &[&str]) -> Scene {
    let cells =
        ["body.upper.brick.cells=[4, 4, 2]", "body.lower.brick.cells=[6, 4, 2]", "decomposition.cells=[2, 2, 1]"];
    two_bricks(&[&cells, sets].concat())
}

/// A built-in scene; `patch` has nodes with eight copies.
pub fn built_in(name: &str, sets: &[&str]) -> Scene {
    Scene::load(name, 1, &owned(sets)).expect("the scene is sound")
}

fn owned(sets: &[&str]) -> Vec<String> {
    sets.iter().map(|set| set.to_string()).collect()
}

/// One rank's part of a torn problem.
pub struct Setup<'a> {
    pub comm: &'a dyn Comm,
    pub discrete: Discrete,
    pub connection: Interconnection<'a>,
}

impl<'a> Deref for Setup<'a> {
    type Target = Interconnection<'a>;

    fn deref(&self) -> &Interconnection<'a> {
        &self.connection
    }
}

impl<'a> Setup<'a> {
    pub fn new(scene: &Scene, comm: &'a dyn Comm) -> Self {
        Self::of(model::discretise(scene, comm).expect("the scene has a discrete problem"), comm)
    }

    pub fn of(discrete: Discrete, comm: &'a dyn Comm) -> Self {
        let connection = Interconnection::new(comm, &discrete.decomposition, &discrete.constraints);
        Self { comm, discrete, connection }
    }

    pub fn subdomains(&self) -> &[Subdomain] {
        &self.discrete.decomposition.subdomains
    }

    pub fn rows(&self) -> &[Row] {
        &self.discrete.constraints.rows
    }

    pub fn material(&self, own: usize) -> &Material {
        &self.discrete.materials[self.subdomains()[own].material]
    }

    pub fn coarse(&self) -> Result<Coarse<'_>, Floating> {
        let mut coarse = self.bare_coarse();
        coarse.factorise().map(|()| coarse)
    }

    /// Without a factor.
    pub fn bare_coarse(&self) -> Coarse<'_> {
        let Discrete { decomposition, constraints, .. } = &self.discrete;
        Coarse::new(self.comm, decomposition, constraints, &self.connection)
    }

    /// Factors of the elastic stiffness matrices, and these.
    pub fn factors(&self) -> (Factors, Vec<Vec<f64>>) {
        let mut factors = Factors::new(analyse(self.subdomains()), Precision::Double, None);
        let mut stiffnesses = Vec::new();
        for (own, subdomain) in self.subdomains().iter().enumerate() {
            let values = elastic(subdomain, self.material(own), &factors.symbolic(own).pattern);
            factors.factorise(own, subdomain, &values, false).expect("elastic bodies are stiff");
            stiffnesses.push(values);
        }
        (factors, stiffnesses)
    }

    /// `F` of the elastic bodies.
    pub fn operator(&self) -> DualOperator<'_> {
        let Discrete { decomposition, constraints, .. } = &self.discrete;
        let hybrid = Hybrid::of_clusters(&self.connection, decomposition, constraints).expect("clusters are firm");
        let (count, timer) = (self.subdomains().len(), Timer::start());
        let symbolic = analyse(self.subdomains());
        let inverse = Inverse::new(symbolic, Precision::Double, vec![None; count], None);
        let mut operator = DualOperator::new(inverse, hybrid, &self.gather);
        let region =
            |subdomain| Region { subdomain, material: &self.discrete.materials[subdomain.material], history: &[] };
        let regions: Vec<Region> = self.subdomains().iter().map(region).collect();
        let (u, yielding, flows) = (&self.gather.zeros(), &vec![0; count][..], &vec![Flow::default(); count][..]);
        let at = Linearisation { regions: &regions, u, yielding, flows };
        operator.update(&at, 0.0, None, &self.space, &timer).expect("elastic bodies are stiff");
        operator
    }

    /// Random multipliers that depend on their rows alone: the same on any number of ranks.
    pub fn multipliers(&self, seed: u64) -> Vec<f64> {
        let mix = |key: u64, part: u64| (key ^ part).wrapping_mul(0x9e37_79b9_7f4a_7c15).rotate_left(29);
        let number = |row: &Row| {
            let parts = row.terms.iter().flat_map(|t| [t.subdomain.into(), t.node, t.axis as u64, t.value.to_bits()]);
            Random::new(parts.fold(seed, mix)).number()
        };
        self.rows().iter().map(number).collect()
    }

    /// Random displacements, the same on any number of ranks.
    pub fn displacements(&self, seed: u64) -> Torn {
        let random = |s: &Subdomain| {
            let mut random = Random::new(seed + 1000 * s.id as u64);
            (0..s.dofs()).map(|_| random.number()).collect()
        };
        self.subdomains().iter().map(random).collect()
    }

    /// The values of the rows that count for own subdomains: in rank order, all rows once and in one order.
    pub fn owned(&self, rows: &[f64]) -> Vec<f64> {
        self.space.owned().iter().flat_map(|owned| &rows[owned.clone()]).copied().collect()
    }

    /// `B`, on a single rank.
    pub fn dense_rows(&self) -> Mat<f64> {
        let mut begins = vec![0];
        self.subdomains().iter().for_each(|s| begins.push(begins[s.id] + s.dofs()));
        let mut b = Mat::zeros(self.rows().len(), begins[self.subdomains().len()]);
        for (at, row) in self.rows().iter().enumerate() {
            for term in &row.terms {
                let subdomain = term.subdomain as usize;
                let node = self.subdomains()[subdomain].local_node(term.node).expect("a copy is in its subdomain");
                b[(at, begins[subdomain] + 3 * node + term.axis)] += term.value;
            }
        }
        b
    }

    /// `R`, on a single rank.
    pub fn dense_modes(&self) -> Mat<f64> {
        let total: usize = self.subdomains().iter().map(Subdomain::dofs).sum();
        let clusters = &self.discrete.decomposition.clusters;
        let mut r = Mat::zeros(total, 6 * clusters.total());
        let mut row = 0;
        for (subdomain, modes) in self.subdomains().iter().zip(self.modes()) {
            for components in subdomain.points.iter().flat_map(|&point| modes.at(point)) {
                (0..6).for_each(|k| r[(row, 6 * clusters.of(subdomain.id) + k)] = components[k]);
                row += 1;
            }
        }
        r
    }
}

/// The lower values of a subdomain's elastic stiffness.
pub fn elastic(subdomain: &Subdomain, material: &Material, pattern: &Pattern) -> Vec<f64> {
    let mut values = vec![0.0; pattern.rows.len()];
    let rest = vec![0.0; subdomain.dofs()];
    stiffness::assemble(&Region::virgin(subdomain, material), (&rest, &[]), pattern, &mut values);
    values
}

/// What `body` returns on each rank.
pub fn on_ranks<T: Send>(scene: &Scene, ranks: usize, body: impl Fn(&Setup) -> T + Sync) -> Vec<T> {
    threads::run(ranks, |comm| body(&Setup::new(scene, comm)))
}

/// The numbers that `body` returns on all ranks, one rank behind the other. Asserts that they are the same bits for
/// every number of ranks.
pub fn same_on_any_ranks(scene: &Scene, body: impl Fn(&Setup) -> Vec<f64> + Sync) -> Vec<f64> {
    let [alone, others @ ..] = RANKS.map(|ranks| on_ranks(scene, ranks, &body).concat());
    for (numbers, ranks) in others.iter().zip(&RANKS[1..]) {
        assert!(numbers.iter().map(|x| x.to_bits()).eq(alone.iter().map(|x| x.to_bits())), "{ranks} ranks differ");
    }
    alone
}

/// The symmetric matrix with these lower values.
pub fn dense(pattern: &Pattern, values: &[f64]) -> Mat<f64> {
    let n = pattern.dofs();
    let mut matrix = Mat::zeros(n, n);
    for column in 0..n {
        let range = pattern.column_begin[column] as usize..pattern.column_begin[column + 1] as usize;
        for (&row, &value) in pattern.rows[range.clone()].iter().zip(&values[range]) {
            matrix[(row as usize, column)] = value;
            matrix[(column, row as usize)] = value;
        }
    }
    matrix
}

/// The block diagonal matrix of these blocks.
pub fn block_diagonal(blocks: &[Mat<f64>]) -> Mat<f64> {
    let total = blocks.iter().map(Mat::nrows).sum();
    let mut matrix = Mat::zeros(total, total);
    let mut begin = 0;
    for block in blocks {
        let n = block.nrows();
        matrix.submatrix_mut(begin, begin, n, n).copy_from(block);
        begin += n;
    }
    matrix
}

/// A matrix of one column.
pub fn column(values: &[f64]) -> Mat<f64> {
    Mat::from_fn(values.len(), 1, |i, _| values[i])
}

/// Asserts that two matrices agree to `tolerance`, relative to the largest entry of the second.
#[track_caller]
pub fn assert_close(found: &Mat<f64>, expected: &Mat<f64>, tolerance: f64) {
    assert_eq!((found.nrows(), found.ncols()), (expected.nrows(), expected.ncols()));
    let error = (found - expected).norm_max() / expected.norm_max();
    assert!(error <= tolerance, "relative error {error:e}");
}

/// Stops a solution before so many of its Newton steps, and keeps where it stands.
pub struct Stopper {
    /// The step to stop before, from 1.
    pub before: usize,
    /// Where it stands then.
    pub stood: Option<Standing>,
    asked: usize,
}

impl Stopper {
    /// Stops before this step.
    pub fn new(before: usize) -> Self {
        Self { before, stood: None, asked: 0 }
    }
}

impl Watcher for Stopper {
    fn tell(&mut self, _event: Event) {}

    fn stops(&mut self, standing: &dyn Fn() -> Standing) -> bool {
        self.asked += 1;
        if self.asked == self.before {
            self.stood = Some(standing());
        }
        self.stood.is_some()
    }
}
