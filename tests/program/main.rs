//! Tests of the whole program as users run it, alone and under `mpirun`. One binary, so that linking is paid once and
//! short runs fill the gaps between long ones.

mod again;
mod bad_input;
mod bad_mesh;
mod benchmark;
mod cascade;
mod checkpoint;
mod common;
mod edges;
mod elements;
mod faults;
mod files;
mod friction;
mod fuzz;
mod gmsh;
mod hard;
mod held;
mod history;
mod initial;
mod library;
mod limit;
mod limits;
mod loads;
mod many;
mod memory;
mod mortar;
mod numbers;
mod patch;
mod ranks;
mod refined;
mod results;
mod rigid;
mod ring;
mod rubbing;
mod twins;
mod verify;
