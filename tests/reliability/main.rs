//! Readers and writers under damage: inputs taken apart at random, files cut and flipped, disks and memory that fail.
//!
//! The inputs are made from valid ones by the same sequence of random numbers in every run, so that what fails fails again.
//! `ORTHOWEAR_FUZZ_SECONDS` gives each reader so many seconds instead of a fixed number of inputs, and `ORTHOWEAR_FUZZ_SEED`
//! another sequence; what fails is written to `target/tmp` and belongs into `corpus/READER/` once it is mended.
mod caches;
mod checkpoints;
mod faults;
mod harness;
mod memory;
mod meshes;
mod meter;
mod mutate;
mod scenes;
#[path = "../fixtures/structured.rs"]
mod structured;
mod studies;
mod tables;

#[global_allocator]
static COUNTED: meter::Counted = meter::Counted;
