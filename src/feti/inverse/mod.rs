//! The generalised inverse `K^+` of the torn stiffness, its kernel `R`, and which factors are made when.
//!
//! [`kernel`] has the rigid modes, [`factor`] the factors of whole subdomains, [`schur`] those of their interiors with the Schur
//! complement, [`stock`] the scratch that their solves share. [`tangents`] decides which of them are kept, shared or made
//! again, from what they are made of ([`basis`]); [`refine`] makes up for the digits that they lack. [`hybrid`] joins subdomains
//! to clusters.

pub mod basis;
pub mod factor;
pub mod hybrid;
pub mod kernel;
pub mod refine;
pub mod schur;
pub mod stock;
pub mod tangents;
