//! fetiplast: contact of elasto-plastic bodies in 3D by Total-FETI domain decomposition on MPI.
//!
//! Data flows one way: [`scene`] -> [`mesh`] -> [`decomposition`] -> [`contact`] -> [`constraint`] -> [`assembly`] ->
//! [`feti`] + [`qp`] -> [`newton`] (with [`estimate`]) -> [`results`]; [`study`] is the only file that sees every stage.
//! The method is the one of Cermak and Sysala, "Total-FETI method for solving contact elasto-plastic problems".

pub mod analytic;
pub mod assembly;
pub mod cascade;
pub mod cli;
pub mod comm;
pub mod constraint;
pub mod contact;
pub mod decomposition;
pub mod element;
pub mod estimate;
pub mod feti;
pub mod heap;
pub mod material;
pub mod mesh;
pub mod model;
pub mod monitor;
pub mod newton;
pub mod qp;
pub mod record;
pub mod restart;
pub mod results;
pub mod scene;
pub mod sizing;
pub mod span;
pub mod sparse;
pub mod study;
pub mod tensor;
pub mod vector;
pub mod verify;

#[cfg(test)]
mod fixture;
#[cfg(test)]
mod random;
