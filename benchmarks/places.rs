//! Paths of the program and of the files of this repository.

use std::error::Error;
use std::path::{Path, PathBuf};

/// Path of the program orthowear: $ORTHOWEAR_PROGRAM, or `orthowear` in the parent of the folder of this benchmark
/// program.
///
/// # Errors
/// If the program has not been built.
pub fn program() -> Result<PathBuf, Box<dyn Error>> {
    if let Some(given) = std::env::var_os("ORTHOWEAR_PROGRAM") {
        return Ok(given.into());
    }
    let here = std::env::current_exe()?;
    let folder = here.parent().and_then(Path::parent).ok_or("no folder of the program")?;
    let program = folder.join("orthowear");
    match program.exists() {
        true => Ok(program),
        false => Err(format!("run `cargo build --release` in {} first", root().display()).into()),
    }
}

/// Root folder of this repository.
pub fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}
