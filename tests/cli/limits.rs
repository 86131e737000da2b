//! Limits of what a scene may ask for, and the notes near them; `check` and `run` find the same.

use std::fs;
use std::path::{Path, PathBuf};

const BLOCK: &str = r#"
[materials.cfrp]
model = "transversely-isotropic"
E1 = 167230.0
E2 = 9544.0
G12 = 5292.0
nu12 = 0.272
nu23 = 0.37
[body1]
kind = "fe"
material = "cfrp"
fibre = { tilt = 30.0 }
mesh = 'MESH'
contact = "contact"
fixed = [{ group = "base" }]
[body2]
kind = "rigid"
[frame]
kind = "grid"
half_width = [1.2, 1.2]
cells = [4, 4]
[gap]
kind = "sphere"
radius = 50.0
[friction]
law = "coulomb"
mu = 0.4
[[steps]]
name = "indent"
approach = 0.02
[output]
fields = []
"#;

/// The coarse block under a rigid sphere, with one text replaced by another.
fn block(from: &str, to: &str) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("block.toml");
    let mesh = Path::new(env!("CARGO_MANIFEST_DIR")).join("meshes/cfrp-block-coarse.msh");
    assert!(BLOCK.contains(from));
    fs::write(&path, BLOCK.replace(from, to).replace("MESH", &mesh.display().to_string())).unwrap();
    (folder, path)
}

/// Exit code, standard output and standard error.
fn call(command: &str, scene: &Path, options: &[&str]) -> (Option<i32>, String, String) {
    let mut program = assert_cmd::Command::cargo_bin("orthowear").unwrap();
    let output = program.arg(command).arg(scene).args(options).output().unwrap();
    let text = |bytes| String::from_utf8(bytes).unwrap();
    (output.status.code(), text(output.stdout), text(output.stderr))
}

#[track_caller]
fn refused(from: &str, to: &str, words: &[&str]) {
    let (_folder, path) = block(from, to);
    for command in ["check", "run"] {
        let (code, _, text) = call(command, &path, &[]);
        assert_eq!(code, Some(2), "{command}: {text}");
        for word in words {
            assert!(text.contains(word), "{command} lacks \"{word}\":\n{text}");
        }
    }
}

#[track_caller]
fn noted(from: &str, to: &str, word: &str, there: bool) {
    let (_folder, path) = block(from, to);
    for command in ["check", "run"] {
        let (code, text, errors) = call(command, &path, &[]);
        assert_eq!(code, Some(0), "{command}: {errors}");
        assert_eq!(text.contains(word), there, "{command}, \"{word}\":\n{text}");
    }
}

/// Truth: formulation 3.1, no more points of the frame than degrees of freedom of the finer side.
#[test]
fn cells_finer_than_the_elements() {
    refused("[4, 4]", "[48, 48]", &["frame.cells", "finer than the contact faces", "or fewer"]);
    noted("[4, 4]", "[4, 4]", "cells about as fine", false);
}

/// Truth: docs/scene.md: a node held along z takes no part in contact.
#[test]
fn supports_under_the_frame() {
    refused("group = \"base\"", "group = \"contact\"", &["body1.fixed", "`contact`", "along z"]);
}

/// Truth: an ellipse without extent is no friction; one without extent in one direction is refused.
#[test]
fn friction_of_zero() {
    noted("mu = 0.4", "mu = 0.0", "load path", false);
    refused(
        "law = \"coulomb\"\nmu = 0.4",
        "law = \"elliptic\"\nmu1 = 0.4\nmu2 = 0.0",
        &["friction", "both coefficients positive"],
    );
}

/// Truth: docs/command-line.md: what went wrong is told even with --quiet.
#[test]
fn quiet_tells_of_no_convergence() {
    let (_folder, path) = block("fields = []", "fields = []\n[solver]\nmax_iterations = 1");
    let (code, text, errors) = call("run", &path, &["--quiet"]);
    assert_eq!(code, Some(3), "{errors}");
    assert!(text.is_empty() && errors.lines().count() == 1, "{text}{errors}");
    assert!(errors.contains("iterations") && errors.contains("summary.json"), "{errors}");
}

/// Truth: a folder is no mesh.
#[test]
fn folders_are_no_meshes() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("meshes").display().to_string();
    refused("mesh = 'MESH'", &format!("mesh = '{folder}'"), &["body1.mesh", "is a folder"]);
}

/// Truth: formulation 12: the path counts with any friction; fibres are named only where they are tilted.
#[test]
fn path_dependence_names_tilted_fibres_only() {
    let (_folder, path) = block("[4, 4]", "[4, 4]");
    let (_, text, _) = call("run", &path, &[]);
    assert!(text.contains("load path") && !text.contains("tilted fibres"), "{text}");
}

/// Truth: products of the numbers of a scene must stay within the range of f64, and counts within what f64 counts.
#[test]
fn numbers_of_impossible_sizes() {
    refused("half_width = [1.2, 1.2]", "half_width = [1e300, 1.2]", &["frame.half_width.0", "1e100"]);
    refused("radius = 50.0", "radius = 1e-300", &["gap.radius", "1e-100"]);
    refused("mu = 0.4", "mu = 5e-324", &["friction.mu", "1e-100"]);
    refused(
        "approach = 0.02",
        "approach = 0.02\nincrements = 9223372036854775807",
        &["increments", "at most 1e15"],
    );
}

/// Truth: docs/scene.md: components at most once, names of steps not empty, and a note where two are the same.
#[test]
fn names_given_twice_or_not_at_all() {
    refused(
        "fixed = [{ group = \"base\" }]",
        "fixed = [{ group = \"base\", components = [\"x\", \"x\", \"z\"] }]",
        &["body1.fixed.0.components", "named twice"],
    );
    refused("name = \"indent\"", "name = \" \"", &["steps.0.name", "empty"]);
    let second = "approach = 0.02\n[[steps]]\nname = \"indent\"\napproach = 0.03";
    noted("approach = 0.02", second, "two steps have the name", true);
}
