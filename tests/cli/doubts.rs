//! Warnings about uncertain results, and about results that refinement cannot improve.

use std::fs;
use std::path::{Path, PathBuf};

use serde_json::Value;

use super::limits::BLOCK;

fn block(changes: &[(&str, &str)]) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("block.toml");
    let mesh = Path::new(env!("CARGO_MANIFEST_DIR")).join("meshes/cfrp-block-coarse.msh");
    let mut text = BLOCK.replace("MESH", &mesh.display().to_string());
    for (from, to) in changes {
        assert!(text.contains(from), "{from}");
        text = text.replacen(from, to, 1);
    }
    fs::write(&path, text).unwrap();
    (folder, path)
}

fn call(verb: &str, scene: &Path) -> (Option<i32>, String, Vec<String>) {
    let output = crate::tools::orthowear().arg(verb).arg(scene).output().unwrap();
    let text = String::from_utf8([output.stdout, output.stderr].concat()).unwrap();
    let summary = fs::read(scene.with_extension("out").join("summary.json")).unwrap_or_default();
    let summary: Value = serde_json::from_slice(&summary).unwrap_or_default();
    let warnings = summary["warnings"].as_array().cloned().unwrap_or_default();
    (output.status.code(), text, warnings.iter().map(|w| w.as_str().unwrap().to_owned()).collect())
}

/// Truth: the contact surface of the block has one quadrilateral face per node. Displacements of the nodes cannot follow
/// tractions that alternate from face to face. Against a rigid body, cells around nodes are therefore the default.
#[test]
fn a_cell_per_face_under_a_rigid_body_is_doubtful() {
    let grid = "kind = \"grid\"\nhalf_width = [1.2, 1.2]\ncells = [4, 4]";
    let (_folder, path) = block(&[(grid, "kind = \"mesh\"\npoints = \"faces\"")]);
    for verb in ["check", "run"] {
        let (code, text, warnings) = call(verb, &path);
        assert_eq!(code, Some(0), "{text}");
        assert!(
            text.contains("WARNING: the area of a cell of the frame is 1.00 times the area that belongs to a contact node, but should be at least 2 times that area"),
            "{text}"
        );
        assert!(text.contains("use frame.points = \"nodes\"") && !text.contains("note: WARNING"), "{text}");
        assert_eq!(warnings.iter().any(|w| w.starts_with("WARNING: the area of a cell")), verb == "run");
    }
    let (_folder, path) = block(&[(grid, "kind = \"mesh\"")]);
    let (code, text, _) = call("check", &path);
    assert!(code == Some(0) && text.contains("node cells") && !text.contains("WARNING"), "{text}");
}

/// Truth: geometry. A cell needs at least twice the area of a contact node, (0.3 mm)^2. A frame with a width of 2.4 mm therefore
/// allows at most 5 cells per direction. A warning that asks for smaller cells must ask for smaller contact faces too.
#[test]
fn hints_about_the_number_of_cells_agree() {
    for (approach, hint) in [("0.02", "reaches the edge"), ("0.004", "cells lie in contact")] {
        let approach = format!("approach = {approach}");
        let (_folder, path) = block(&[("cells = [4, 4]", "cells = [6, 6]"), ("approach = 0.02", &approach)]);
        let (code, text, warnings) = call("run", &path);
        assert_eq!(code, Some(0), "{text}");
        assert!(text.contains("cells = [5, 5] or fewer"), "{text}");
        let warning = warnings.iter().find(|w| w.contains(hint)).unwrap_or_else(|| panic!("{text}"));
        assert!(
            warning.contains("smaller cells") && warning.contains("contact faces no larger than the cells")
        );
        assert!(!text.contains("increase frame.cells"), "{text}");
    }
}

/// Truth: geometry. The centres of the innermost cells with sides of 0.6 mm are 0.42 mm from the axis. At this distance, the
/// sphere of radius 50 mm is 1.8e-3 mm above its lowest point. The approach of 1e-3 mm is smaller, so no cell touches.
#[test]
fn an_approach_that_no_cell_feels_is_a_warning() {
    let (_folder, path) = block(&[("approach = 0.02", "approach = 1e-3")]);
    let (code, text, warnings) = call("run", &path);
    assert_eq!(code, Some(0), "{text}");
    let warning = warnings.iter().find(|w| w.starts_with("WARNING: step \"indent\" (1)")).expect("a warning");
    for words in [
        "none of the 16 cells",
        "moved 1.0000e-3 past the first touch",
        "the smallest gap is 8.0000e-4",
        "an approach above 1.8000e-3",
    ] {
        assert!(warning.contains(words), "lacks \"{words}\": {warning}");
    }
    assert!(text.contains("\nWARNING: step"), "{text}");
}

/// Truth: uniaxial stress in a prism with nu = 0. Finite elements represent this stress exactly on any mesh, so refinement has no
/// benefit.
#[test]
fn a_body_of_constant_stress_need_not_be_refined() {
    let (folder, path) = block(&[
        (
            "model = \"transversely-isotropic\"\nE1 = 167230.0\nE2 = 9544.0\nG12 = 5292.0\nnu12 = 0.272\nnu23 = 0.37",
            "model = \"isotropic\"\nE = 1e4\nnu = 0.0",
        ),
        ("fibre = { tilt = 30.0 }\n", ""),
        ("half_width = [1.2, 1.2]\ncells = [4, 4]", "half_width = [1.0, 1.0]\ncells = [1, 1]"),
        ("kind = \"sphere\"\nradius = 50.0", "kind = \"flat\""),
    ]);
    let mesh = folder.path().join("cubes.msh");
    fs::write(&mesh, super::mesh_mistakes::MESH.replace("\"top\"", "\"contact\"")).unwrap();
    let set = format!("body1.mesh=\"{}\"", mesh.display());
    let sizes = folder.path().join("sizes.pos");
    let output = crate::tools::orthowear()
        .arg("refine")
        .arg(&path)
        .args(["--set", &set, "--out"])
        .arg(&sizes)
        .output()
        .unwrap();
    let text = String::from_utf8([output.stdout, output.stderr].concat()).unwrap();
    assert_eq!(output.status.code(), Some(0), "{text}");
    assert!(
        text.contains("at rounding level: nothing to refine") && text.contains("no size field was written"),
        "{text}"
    );
    assert!(!sizes.exists() && !text.contains("refine the mesh there"), "{text}");
}

/// Truth: geometry. Of 3 x 3 cells with sides of 0.8 mm, only the middle cell lies on the axis. At the centres of its neighbours,
/// the gap to the sphere of radius 50 mm is 6.4e-3 mm. The approach of 1e-3 mm is smaller, so only the middle cell touches.
#[test]
fn a_contact_of_one_cell_is_told() {
    let (_folder, path) =
        block(&[("cells = [4, 4]", "cells = [3, 3]"), ("approach = 0.02", "approach = 1e-3")]);
    let (code, text, warnings) = call("run", &path);
    assert_eq!(code, Some(0), "{text}");
    assert!(warnings.iter().any(|w| w.contains("only 1 cell lies in contact")), "{warnings:?}");
    let (_folder, path) = block(&[("approach = 0.02", "approach = 0.04")]);
    let (_, _, warnings) = call("run", &path);
    assert!(!warnings.iter().any(|w| w.contains("in contact")), "{warnings:?}");
    // A load history is one step. It gives at most one warning, about its last row.
    let file = "approach = 0.02";
    let history = "history = { file = \"loads.csv\", columns = [\"approach\"] }";
    let (folder, path) = block(&[("cells = [4, 4]", "cells = [3, 3]"), (file, history)]);
    for (rows, count) in [("0.0009\n0.00095\n0.001\n", 1), ("0.0009\n0.001\n0.04\n", 0)] {
        fs::write(folder.path().join("loads.csv"), rows).unwrap();
        let (code, text, warnings) = call("run", &path);
        assert_eq!(code, Some(0), "{text}");
        let found = warnings.iter().filter(|w| w.contains("lies in contact"));
        assert_eq!(found.count(), count, "{warnings:?}");
    }
}
