//! Command line: runs, refusals, outputs.
mod bad_input;
mod limits;
mod outputs;
mod run;
mod tools;
mod mesh_mistakes;
mod scenes;
