//! A scene like another with larger cells, for what is a matter of shapes and places.
//!
//! Whether contact surfaces face each other, and whether supports, contacts and loads hold all bodies, hardly depends on the
//! mesh. So where a scene is too large to be built these are looked at on larger cells; where they are refused, once more on
//! cells half as large, whose word counts. How many conditions there are on curved surfaces and on meshes that do not match is
//! estimated by their share of the slave's nodes there.

use super::counts::{Counted, contacts};
use crate::comm::Comm;
use crate::model::ModelError;
use crate::model::discrete::{Discrete, discretise};
use crate::model::held::held;
use crate::record::counts::{ContactRow, Sizes};
use crate::scene::{Scene, SurfaceName};

/// Tetrahedra that are built for a look.
const LOOK: u64 = 40_000;

/// What a look at larger cells tells.
pub struct Look {
    /// The contacts, with the conditions that the scene itself has, or about as many.
    pub contacts: Vec<ContactRow>,
    /// What the user should know of the bodies.
    pub warnings: Vec<String>,
    /// The look's cells are so many times as large.
    pub larger: usize,
}

/// Why a scene is refused after a look at larger cells.
pub struct Refused {
    /// The reason there.
    pub error: ModelError,
    /// The look's cells are so many times as large.
    pub larger: usize,
}

/// Looks at larger cells in place of a scene; adds the rows of contact to its sizes. Collective.
///
/// # Errors
/// What solving would refuse.
pub fn look(scene: &Scene, counted: &Counted, sizes: &mut Sizes, comm: &dyn Comm) -> Result<Look, Refused> {
    let at = |most: u64| {
        let larger = larger(scene, most);
        let coarse = scene.coarser(larger);
        let looked = discretise(&coarse, comm).and_then(|discrete| {
            held(&coarse, &discrete, comm)?;
            Ok(discrete)
        });
        looked.map(|discrete| (coarse, discrete, larger)).map_err(|error| Refused { error, larger })
    };
    counted.can_be_cut().map_err(|error| Refused { error: error.into(), larger: 1 })?;
    let (coarse, discrete, larger) = at(LOOK).or_else(|_| at(8 * LOOK))?;
    let rows = conditions(scene, counted, (&coarse, &discrete), sizes, comm);
    let seen =
        |text: String| if larger == 1 { text } else { format!("{text} (seen with cells {larger} times as large)") };
    Ok(Look { contacts: rows, warnings: discrete.warnings.into_iter().map(seen).collect(), larger })
}

/// How many times as large cells are of which no more than so many tetrahedra fill the bodies: a divisor of all numbers of
/// cells if there is one near, so that nodes that meet still do.
fn larger(scene: &Scene, most: u64) -> usize {
    let fits = |factor: usize| Counted::new(&scene.coarser(factor)).is_none_or(|c| c.tetrahedra() <= most);
    let (mut low, mut high) = (0, 1);
    while !fits(high) && high < usize::MAX / 2 {
        (low, high) = (high, 2 * high);
    }
    while high - low > 1 {
        let middle = low + (high - low) / 2;
        if fits(middle) { high = middle } else { low = middle }
    }
    let common = scene.common_divisor();
    (high..=high.saturating_mul(2)).take(1 << 16).find(|factor| common.is_multiple_of(*factor)).unwrap_or(high)
}

/// The contacts' rows: counted, or by their share on larger cells.
fn conditions(
    scene: &Scene,
    counted: &Counted,
    (coarse, discrete): (&Scene, &Discrete),
    sizes: &mut Sizes,
    comm: &dyn Comm,
) -> Vec<ContactRow> {
    let of_coarse = Counted::new(coarse).expect("the scene's bodies are counted");
    let all: u64 = discrete.contacts.rows.iter().map(|row| row.conditions).sum();
    let with_row = super::sizes(discrete, comm).contact_rows as f64 / all.max(1) as f64;
    let is_brick = |surface: &SurfaceName| scene.body[&surface.body].brick().is_some();
    let (mut rows, mut is_exact) = (Vec::new(), true);
    for (contact, row) in scene.contact.values().zip(&discrete.contacts.rows) {
        let mut row = row.clone();
        let mut surfaces = contact.surfaces();
        if let Some(known) = contacts::count(scene, contact) {
            row.slave = surfaces.next().expect("a contact has a slave").to_string();
            row.master = surfaces.next().map(SurfaceName::to_string);
            (row.rule, row.conditions) = (known.rule.to_owned(), known.all);
            sizes.contact_rows += known.rows;
            is_exact &= contacts::is_alone(scene, contact);
        } else {
            if row.master.is_some() && contact.surfaces().all(is_brick) {
                row.rule = "mortar".to_owned();
            }
            let slave = surfaces.find(|surface| surface.to_string() == row.slave).expect("it is one of the two");
            let share = row.conditions as f64 / of_coarse.nodes_on(slave) as f64;
            row.conditions = (share * counted.nodes_on(slave) as f64).round() as u64;
            sizes.contact_rows += (with_row * row.conditions as f64).round() as u64;
            is_exact = false;
        }
        rows.push(row);
    }
    sizes.dual_dofs += sizes.contact_rows;
    if !is_exact {
        sizes.estimated.push("contact_rows".to_owned());
        if !sizes.estimated.iter().any(|key| key == "dual_dofs") {
            sizes.estimated.push("dual_dofs".to_owned());
        }
    }
    rows
}
