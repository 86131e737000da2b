//! Programs that tests start: orthowear itself, gmsh, a browser, and Python with meshio and VTK ($ORTHOWEAR_PYTHON or the
//! project's .venv). If a program is missing, the test reports this and passes. With ORTHOWEAR_REQUIRE_TOOLS=1 the test fails
//! instead.

use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;

/// Returns `finest` in thorough tests (`scripts/test --thorough`), `usual` otherwise.
pub fn usual_or_finest<T>(usual: T, finest: T) -> T {
    if std::env::var_os("ORTHOWEAR_THOROUGH").is_some() { finest } else { usual }
}

/// Command for the program without a cache, because tests must not depend on the user's cache.
pub fn orthowear() -> Command {
    let mut program = Command::new(env!("CARGO_BIN_EXE_orthowear"));
    program.env("ORTHOWEAR_CACHE_LIMIT", "0");
    program
}

/// Runs a script of tests/python, and panics with its message if it fails. Returns `false` if Python or one of its packages is
/// missing.
pub fn python(script: &str, argument: &Path) -> bool {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let program =
        std::env::var_os("ORTHOWEAR_PYTHON").map_or_else(|| root.join(".venv/bin/python"), PathBuf::from);
    let works = Command::new(&program).args(["-c", "import meshio, vtkmodules.vtkIOXML"]).output();
    if !works.is_ok_and(|output| output.status.success()) {
        let required = std::env::var("ORTHOWEAR_REQUIRE_TOOLS").is_ok_and(|value| value == "1");
        assert!(
            !required,
            "Python with meshio and VTK is missing, but ORTHOWEAR_REQUIRE_TOOLS=1 requires it"
        );
        eprintln!("SKIPPED: Python with meshio and VTK is missing (scripts/setup makes .venv)");
        return false;
    }
    let output = Command::new(program)
        .arg(root.join("tests/python").join(script))
        .arg(argument)
        .output()
        .expect("starts");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    true
}

/// Runs a script of tests/browser in headless Chromium, and panics with its message if it fails. Returns `false` if the browser or
/// the Python packages for it are missing.
pub fn browser(script: &str, argument: &Path) -> bool {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let program =
        std::env::var_os("ORTHOWEAR_PYTHON").map_or_else(|| root.join(".venv/bin/python"), PathBuf::from);
    let python = Command::new(&program).args(["-c", "import meshio, websocket"]).output();
    let chromium = Command::new("chromium").arg("--version").output();
    if ![python, chromium].into_iter().all(|tried| tried.is_ok_and(|output| output.status.success())) {
        let required = std::env::var("ORTHOWEAR_REQUIRE_TOOLS").is_ok_and(|value| value == "1");
        assert!(
            !required,
            "chromium, or Python with meshio and websocket-client, is missing, but ORTHOWEAR_REQUIRE_TOOLS=1 requires it"
        );
        eprintln!(
            "SKIPPED: chromium, or Python with meshio and websocket-client, is missing (scripts/setup installs them)"
        );
        return false;
    }
    let output = Command::new(program)
        .arg(root.join("tests/browser").join(script))
        .arg(argument)
        .output()
        .expect("starts");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    true
}

/// Runs gmsh in `directory`, and panics with its output if it fails. Returns `false` if gmsh is missing.
pub fn gmsh(arguments: &[&str], directory: &Path) -> bool {
    if Command::new("gmsh").arg("--version").output().is_err() {
        let required = std::env::var("ORTHOWEAR_REQUIRE_TOOLS").is_ok_and(|value| value == "1");
        assert!(!required, "gmsh is missing, but ORTHOWEAR_REQUIRE_TOOLS=1 requires it");
        eprintln!("SKIPPED: gmsh is missing (scripts/setup installs it)");
        return false;
    }
    let output = Command::new("gmsh").args(arguments).current_dir(directory).output().expect("starts");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stdout));
    true
}

pub fn foretold(said: &str) -> f64 {
    let line = said
        .lines()
        .find(|line| line.starts_with("memory"))
        .unwrap_or_else(|| panic!("no memory in\n{said}"));
    let words: Vec<&str> = line.split_once("about ").unwrap().1.split_whitespace().collect();
    assert_eq!(words[1], "MiB", "{line}");
    words[0].parse::<f64>().unwrap() * f64::from(1 << 20)
}

/// Bytes in the message of a run that is refused for lack of memory: needed, allowed, and rest of the scene. The allowed bytes
/// are the memory limit minus the rest. The rest is exact to 0.05 MiB, and 0 if the message omits it.
pub fn refusal(said: &str) -> [f64; 3] {
    let said = said.split_whitespace().collect::<Vec<_>>().join(" ");
    let exactly = |text: &str| {
        let number =
            text.split_once('(').map_or(text, |(_, inside)| inside).split_whitespace().next().unwrap();
        number.parse::<f64>().unwrap_or_else(|_| panic!("{number} in {said}"))
    };
    let after = |words: &str| said.split_once(words).unwrap_or_else(|| panic!("no {words} in {said}")).1;
    let allowed = after(" but the limit of solver.memory_limit is ").split(';').next().unwrap();
    let rest = allowed
        .split_once(" after subtracting the ")
        .map(|(_, rest)| rest)
        .or_else(|| allowed.split_once("the rest of the scene (").map(|(_, rest)| rest));
    let rest = rest.map_or(0.0, |rest| {
        let words: Vec<&str> = rest.split([' ', ')']).collect();
        let unit = match words[1] {
            "KiB" => 1024.0,
            "MiB" => 1024.0 * 1024.0,
            other => panic!("{other} in {said}"),
        };
        words[0].parse::<f64>().unwrap() * unit
    });
    [exactly(after(" needs ")), exactly(allowed), rest]
}

/// Returns the summary without the fields that differ between equal runs.
pub fn timeless(mut summary: Value) -> Value {
    let fields = summary.as_object_mut().unwrap();
    fields.remove("timings").unwrap();
    fields.remove("peak_memory_bytes").unwrap();
    for step in fields["steps"].as_array_mut().unwrap() {
        step.as_object_mut().unwrap().remove("seconds").unwrap();
    }
    summary
}
