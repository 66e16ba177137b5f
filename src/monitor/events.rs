//! stub
#[derive(Clone,Debug)]
pub struct NewtonStep { pub step: usize, pub criterion: f64, pub residual: f64, pub damping: f64, pub energy: f64, pub plastic_elements: usize, pub active_contacts: usize, pub qp_outer: usize, pub qp_iterations: usize, pub hessian_multiplications: usize, pub factorisations: usize, pub seconds: f64 }
#[derive(Clone,Debug)]
pub enum Event { NewtonStep(NewtonStep) }
