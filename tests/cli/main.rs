//! Command line: runs, refusals, outputs.
mod bad_input;
mod cache;
mod limits;
mod outputs;
mod refine;
mod run;
mod tools;
mod mesh_mistakes;
mod scenes;
