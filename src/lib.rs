//! fetiplast: contact of elasto-plastic bodies in 3D by Total-FETI domain decomposition on MPI.
//!
//! Data flows one way: [`scene`] -> [`mesh`] -> [`decomposition`] -> [`constraint`] -> [`assembly`] ->
//! [`feti`] + [`qp`] -> [`newton`] -> [`results`]; [`study`] is the only file that sees every stage.
//! The method is the one of Cermak and Sysala, "Total-FETI method for solving contact elasto-plastic problems".

pub mod comm;
pub mod monitor;
pub mod qp;
pub mod results;
