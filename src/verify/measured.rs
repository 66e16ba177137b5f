//! Errors on a sequence of meshes, what must hold of them, and what does.

use serde::{Serialize, Serializer};

use crate::element::Kind;

/// What must hold of an error.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Demand {
    /// At most this large, on every mesh.
    Below(f64),
    /// At most this large on the finest mesh.
    Finest(f64),
    /// It falls with this power of the mesh width, from the last mesh but one.
    Order(f64),
    /// At least this large on the finest mesh: what the element is known to miss.
    Missed(f64),
    /// It is no error, but a ratio between these, on every mesh.
    Between(f64, f64),
    /// Nothing; it is shown.
    Shown,
}

/// An error of a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Error {
    /// What is wrong by so much.
    pub name: &'static str,
    /// Relative to the size of what is compared; negative where less was found. Or a ratio.
    pub value: f64,
    /// What must hold.
    pub demand: Demand,
}

impl Error {
    /// An error of which something must hold.
    pub fn new(name: &'static str, value: f64, demand: Demand) -> Self {
        Self { name, value, demand }
    }
}

/// Orders may be this much below the demand: they come up to it from below as meshes get finer.
const ORDER_TOLERANCE: f64 = 0.2;

/// A case on one mesh.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    pub level: usize,
    pub nodes: u64,
    pub elements: u64,
    pub subdomains: u64,
    pub newton_iterations: u64,
    pub hessian_multiplications: u64,
    /// Displacements of the torn problem.
    pub primal_dofs: u64,
    /// What the dual operator and the preconditioner read of factors, all ranks together (1e9 bytes).
    pub gigabytes: f64,
    /// Wall time, discretisation included.
    pub seconds: f64,
    /// Whether the run ended as it must.
    pub ended_well: bool,
    /// Why it did not converge.
    pub message: Option<String>,
    /// Names and values.
    #[serde(serialize_with = "by_name")]
    pub errors: Vec<Error>,
}

fn by_name<S: Serializer>(errors: &[Error], serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_map(errors.iter().map(|error| (error.name, error.value)))
}

/// A case with one element, on meshes coarse to fine.
#[derive(Clone, Debug, Serialize)]
pub struct Measured {
    pub case: &'static str,
    /// What the case is.
    pub about: &'static str,
    pub element: Kind,
    pub rows: Vec<Row>,
    /// What became of each demand, and of the runs themselves, when all are done.
    pub verdicts: Vec<Verdict>,
}

/// What became of a demand.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Verdict {
    pub met: bool,
    /// In words, with numbers.
    pub text: String,
}

impl Measured {
    /// Observed order of an error between a row and the one before.
    pub fn order(&self, row: usize, error: usize) -> Option<f64> {
        let before = self.rows.get(row.checked_sub(1)?)?;
        let (coarse, fine) = (before.errors.get(error)?.value, self.rows[row].errors[error].value);
        let refined = self.rows[row].level as f64 / before.level as f64;
        Some((coarse / fine).abs().ln() / refined.ln())
    }

    /// Judges what was measured.
    pub(super) fn judge(&self) -> Vec<Verdict> {
        let Some(finest) = self.rows.last() else { return Vec::new() };
        let ends = self.rows.iter().filter(|row| !row.ended_well).map(|row| {
            let message = row.message.as_deref().unwrap_or("it converged beyond what can be carried");
            Verdict { met: false, text: format!("level {}: {message}", row.level) }
        });
        let demands = (0..finest.errors.len()).filter_map(|index| self.verdict(index));
        ends.chain(demands).collect()
    }

    fn verdict(&self, index: usize) -> Option<Verdict> {
        let last = self.rows.len() - 1;
        let Error { name, value, demand } = self.rows[last].errors[index];
        let worst = self.rows.iter().map(|row| row.errors[index].value.abs()).fold(0.0, f64::max);
        let (met, text) = match demand {
            Demand::Shown => return None,
            Demand::Below(bound) => (worst <= bound, format!("{worst:.1e} on the worst mesh, at most {bound:.1e}")),
            Demand::Finest(bound) => (value.abs() <= bound, format!("{:.2e}, at most {bound:.1e}", value.abs())),
            Demand::Missed(bound) => (value.abs() >= bound, format!("{:.2e}, at least {bound:.1e}", value.abs())),
            Demand::Between(low, high) => {
                let values = || self.rows.iter().map(|row| row.errors[index].value);
                let (least, most) = (values().fold(value, f64::min), values().fold(value, f64::max));
                // Not a number is not between.
                let met = values().all(|value| (low..=high).contains(&value));
                (met, format!("{least:.2} to {most:.2}, between {low} and {high}"))
            }
            Demand::Order(wanted) => match self.order(last, index) {
                Some(order) => (order >= wanted - ORDER_TOLERANCE, format!("order {order:.2}, wanted {wanted}")),
                None => (false, "an order needs two meshes".to_owned()),
            },
        };
        Some(Verdict { met, text: format!("{name}: {text}") })
    }

    /// Whether all demands are met.
    pub fn passed(&self) -> bool {
        self.verdicts.iter().all(|verdict| verdict.met)
    }

    /// Names of the errors, over the rows.
    pub fn header(&self) -> String {
        let names: String = self.rows[0].errors.iter().map(|error| format!("{:>24}", error.name)).collect();
        format!("{:<20}{:>6}{:>6}{:>9}{:>8}{:>8}{names}", self.case, "", "level", "nodes", "F", "s")
    }

    /// The last row: errors, and their orders in brackets.
    pub fn line(&self) -> String {
        let last = self.rows.len() - 1;
        let Row { level, nodes, hessian_multiplications: products, seconds, errors, .. } = &self.rows[last];
        let error = |(index, error): (usize, &Error)| {
            if let Demand::Between(..) = error.demand {
                return format!("{:>24}", format!("{:.2}", error.value));
            }
            let order = self.order(last, index).filter(|_| error.value.abs() > ROUNDING);
            let order = order.map_or(String::new(), |order| format!(" ({order:.2})"));
            format!("{:>24}", format!("{:.2e}{order:>8}", error.value))
        };
        let errors: String = errors.iter().enumerate().map(error).collect();
        let element = self.element.name();
        format!("{:<20}{element:>6}{level:>6}{nodes:>9}{products:>8}{seconds:>8.2}{errors}", "")
    }
}

/// Smaller errors are round-off and have no order.
const ROUNDING: f64 = 1e-8;

#[cfg(test)]
mod tests {
    use super::*;

    fn measured(values: &[f64], demand: Demand) -> Measured {
        let row = |(k, &value): (usize, &f64)| Row {
            level: 2 << k,
            nodes: 0,
            elements: 0,
            subdomains: 0,
            newton_iterations: 0,
            hessian_multiplications: 0,
            primal_dofs: 0,
            gigabytes: 0.0,
            seconds: 0.0,
            ended_well: true,
            message: None,
            errors: vec![Error::new("something", value, demand)],
        };
        let rows = values.iter().enumerate().map(row).collect();
        let case = Measured { case: "case", about: "", element: Kind::Hex8, rows, verdicts: Vec::new() };
        Measured { verdicts: case.judge(), ..case }
    }

    #[test]
    fn demands_are_met_or_missed() {
        for (values, demand, met) in [
            (&[0.4, 0.2, 0.1][..], Demand::Order(1.0), true),
            (&[0.4, 0.1, 0.05], Demand::Order(2.0), false),
            (&[0.4, -0.1], Demand::Order(2.0), true),
            (&[0.4], Demand::Order(1.0), false),
            (&[0.4, f64::NAN], Demand::Order(1.0), false),
            (&[1e-3, -1e-9], Demand::Below(1e-8), false),
            (&[1e-3, -1e-9], Demand::Finest(1e-8), true),
            (&[f64::NAN], Demand::Finest(1.0), false),
            (&[1e-3, 0.5], Demand::Missed(0.2), true),
            (&[0.5, 0.1], Demand::Missed(0.2), false),
            (&[0.5, 2.0], Demand::Between(0.5, 2.0), true),
            (&[2.1, 1.0], Demand::Between(0.5, 2.0), false),
            (&[1.0, 0.4], Demand::Between(0.5, 2.0), false),
            (&[f64::NAN, 1.0], Demand::Between(0.5, 2.0), false),
            (&[f64::NAN], Demand::Shown, true),
        ] {
            let measured = measured(values, demand);
            assert_eq!(measured.passed(), met, "{values:?} {demand:?}: {:?}", measured.verdicts);
        }
    }

    #[test]
    fn a_run_that_did_not_end_as_it_must_fails_the_case() {
        let mut case = measured(&[0.4, 0.2], Demand::Shown);
        assert!(case.passed());
        case.rows[0].ended_well = false;
        case.rows[0].message = Some("no luck".into());
        assert_eq!(case.judge(), [Verdict { met: false, text: "level 2: no luck".into() }]);
    }
}
