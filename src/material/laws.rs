//! The list of laws: [`Material`] is one of them, [`History`] has the state of each.

use super::{BadParameter, Hooke, Law, Response, Variables, VonMises};
use crate::tensor::{Tangent, Voigt};

/// `Material` and `History`, and the law that a material is. The law is looked up where a point is asked, at the price of a
/// comparison, and its methods are inlined.
macro_rules! laws {
    ($($(#[$about:meta])* $law:ident = $name:ident,)+) => {
        /// A material: a law with its parameters.
        #[derive(Clone, Copy, Debug, PartialEq)]
        pub enum Material {
            $($(#[$about])* $law($law),)+
        }

        $(impl From<$law> for Material {
            fn from(law: $law) -> Self {
                Self::$law(law)
            }
        })+

        impl Law for Material {
            type State = History;

            fn check(&self) -> Result<(), BadParameter> {
                match self { $(Self::$law(law) => law.check(),)+ }
            }

            #[inline]
            fn hooke(&self) -> Hooke {
                match self { $(Self::$law(law) => law.hooke(),)+ }
            }

            fn yields(&self) -> bool {
                match self { $(Self::$law(law) => law.yields(),)+ }
            }

            fn has_limit(&self) -> bool {
                match self { $(Self::$law(law) => law.has_limit(),)+ }
            }

            #[inline]
            fn respond(&self, strain: &Voigt, committed: &History) -> Response {
                match self { $(Self::$law(law) => law.respond(strain, &committed.$name),)+ }
            }

            #[inline]
            fn stiffness(&self, strain: &Voigt, committed: &History, flow: Option<&Voigt>) -> Tangent {
                match self { $(Self::$law(law) => law.stiffness(strain, &committed.$name, flow),)+ }
            }

            #[inline]
            fn flow(&self, strain: &Voigt, committed: &History, flow: Option<&Voigt>, step: (&Voigt, f64)) -> Voigt {
                match self { $(Self::$law(law) => law.flow(strain, &committed.$name, flow, step),)+ }
            }

            #[inline]
            fn divergence(&self, strain: &Voigt, change: &Voigt, committed: &History) -> f64 {
                match self { $(Self::$law(law) => law.divergence(strain, change, &committed.$name),)+ }
            }

            fn strain(&self, stress: &Voigt, committed: &History) -> Voigt {
                match self { $(Self::$law(law) => law.strain(stress, &committed.$name),)+ }
            }

            fn least_tangent(&self) -> f64 {
                match self { $(Self::$law(law) => law.least_tangent(),)+ }
            }

            fn firmer(&self, least_tangent: f64) -> Self {
                match self { $(Self::$law(law) => Self::$law(law.firmer(least_tangent)),)+ }
            }

            #[inline]
            fn dissipation(&self, rate: &Voigt) -> Option<f64> {
                match self { $(Self::$law(law) => law.dissipation(rate),)+ }
            }

            #[inline]
            fn commit(&self, strain: &Voigt, committed: &History) -> History {
                let mut history = *committed;
                match self { $(Self::$law(law) => history.$name = law.commit(strain, &committed.$name),)+ }
                history
            }
        }

        /// What a material point remembers between load steps: the states of all laws, of which it uses that of its own.
        #[derive(Clone, Copy, Debug, PartialEq)]
        pub struct History {
            $($(#[$about])* pub $name: <$law as Law>::State,)+
        }

        impl Variables for History {
            const VIRGIN: Self = Self { $($name: <$law as Law>::State::VIRGIN,)+ };

            fn variables(&mut self) -> impl Iterator<Item = (&'static str, &mut [f64])> {
                std::iter::empty()$(.chain(self.$name.variables()))+
            }
        }
    };
}

// The one list of laws.
laws! {
    /// Elasticity, and plasticity of von Mises with linear hardening.
    VonMises = von_mises,
}
