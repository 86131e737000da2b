//! The compiled part of the Python package `orthowear`: scenes, runs and operators of the library as Python objects.
//!
//! No algorithm is in here. Whatever computes does so in a thread of its own without the interpreter's lock, while the calling thread
//! waits and hears signals (`engine`).

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
