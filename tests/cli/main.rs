//! Command line: runs, refusals, outputs.
mod bad_input;
mod cache;
mod compare;
mod doubts;
mod interrupt;
mod iterative;
mod limits;
mod loads;
mod materials;
mod outputs;
mod refine;
mod repeated;
mod run;
mod tools;
mod mesh_mistakes;
mod scenes;
mod units;
