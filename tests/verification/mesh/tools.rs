//! Runs the programs that tests compare with: gmsh, and Python with meshio. If a program is absent, the test reports this and
//! passes. With ORTHOWEAR_REQUIRE_TOOLS=1 the test fails.

use std::path::{Path, PathBuf};
use std::process::Command;

pub fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

fn absent(what: &str) {
    let required = std::env::var("ORTHOWEAR_REQUIRE_TOOLS").is_ok_and(|value| value == "1");
    assert!(!required, "{what} is not installed, but ORTHOWEAR_REQUIRE_TOOLS=1 requires it");
    eprintln!("SKIPPED: {what} is not installed");
}

pub fn run(command: &mut Command) {
    let output = command.output().expect("the program starts");
    let text = [output.stdout, output.stderr].concat();
    assert!(output.status.success(), "{command:?} failed:\n{}", String::from_utf8_lossy(&text));
}

/// Runs gmsh in `directory`. Returns `false` if gmsh is absent.
pub fn gmsh(arguments: &[&str], directory: &Path) -> bool {
    if Command::new("gmsh").arg("--version").output().is_err() {
        absent("gmsh");
        return false;
    }
    run(Command::new("gmsh").args(["-nt", "1", "-v", "1"]).args(arguments).current_dir(directory));
    true
}

/// Runs Python with meshio in `directory`: $ORTHOWEAR_PYTHON or the project's .venv. Returns `false` if Python or meshio is
/// absent.
pub fn python(arguments: &[&str], directory: &Path) -> bool {
    let program =
        std::env::var_os("ORTHOWEAR_PYTHON").map_or_else(|| root().join(".venv/bin/python"), PathBuf::from);
    let works = Command::new(&program).args(["-c", "import meshio, numpy"]).output();
    if !works.is_ok_and(|output| output.status.success()) {
        absent("Python with meshio (scripts/setup makes .venv)");
        return false;
    }
    run(Command::new(&program).args(arguments).current_dir(directory));
    true
}
