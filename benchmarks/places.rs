//! Where benchmarks find the program and the files of this repository.

use std::error::Error;
use std::path::{Path, PathBuf};

/// The program beside this one: target/release/orthowear.
///
/// # Errors
/// If it has not been built.
pub fn program() -> Result<PathBuf, Box<dyn Error>> {
    let here = std::env::current_exe()?;
    let folder = here.parent().and_then(Path::parent).ok_or("no folder of the program")?;
    let program = folder.join("orthowear");
    if program.exists() { Ok(program) } else { Err("run `cargo build --release` first".into()) }
}

/// The folder of this repository.
pub fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}
