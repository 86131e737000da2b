//! Reliability of readers and writers: mutated inputs, truncated and changed files, failing disks, and too little
//! memory.
//!
//! The same random sequence mutates valid inputs in every run, so that failures are reproducible.
//! `ORTHOWEAR_FUZZ_SECONDS` sets the time for each reader instead of a fixed number of inputs. `ORTHOWEAR_FUZZ_SEED`
//! selects another sequence. Failing inputs are written to `target/tmp`. After the fault is fixed, the failing input is
//! added to `corpus/READER/`.
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
