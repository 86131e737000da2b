//! Compiled part of the Python package `orthowear`: scenes, runs and operators of the library as Python objects.
//!
//! This crate contains no algorithms. Each computation runs in a separate thread without the interpreter's lock. The
//! calling thread waits and checks for signals (`engine`).
#![warn(clippy::too_many_lines)]

mod convert;
mod engine;
mod errors;
mod fields;
mod flexibility;
mod run;
mod scene;
mod steps;
mod study;

use pyo3::prelude::*;

#[pymodule]
fn _orthowear(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add_class::<scene::Scene>()?;
    module.add_class::<steps::Steps>()?;
    module.add_class::<study::Study>()?;
    module.add_class::<flexibility::Flexibility>()?;
    Ok(())
}
