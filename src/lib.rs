//! fetiplast: contact of elasto-plastic bodies in 3D by Total-FETI domain decomposition on MPI.
//!
//! Data flows one way: [`scene`] -> [`mesh`] -> [`decomposition`] -> [`constraint`] -> [`assembly`] ->
//! [`feti`] + [`qp`] -> [`newton`] -> [`results`]; [`study`] is the only file that sees every stage.
//! The method is the one of Cermak and Sysala, "Total-FETI method for solving contact elasto-plastic problems".

pub mod analytic;
pub mod comm;
pub mod element;
pub mod material;
pub mod mesh;
pub mod qp;
pub mod tensor;

#[cfg(test)]
mod random;
