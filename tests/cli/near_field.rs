//! Near fields of meshed bodies in scenes: choice, messages, refusals.

use std::fs;
use std::path::Path;

use serde_json::Value;

use crate::moved::layer;

pub const SCENE: &str = r#"
[materials.steel]
model = "isotropic"
E = 210e3
nu = 0.3
[materials.brass]
model = "isotropic"
E = 100e3
nu = 0.34
[body1]
kind = "fe"
material = "steel"
mesh = "block.msh"
contact = "top"
fixed = [{ group = "base" }]
[body2]
kind = "half-space"
material = "brass"
[frame]
kind = "grid"
half_width = [1.2, 1.2]
cells = [24, 24]
[gap]
kind = "sphere"
radius = 50.0
[friction]
law = "coulomb"
mu = 0.3
[[steps]]
name = "press"
approach = 0.02
[[steps]]
name = "pull"
shift = { distance = 0.002, angle = 20.0 }
[solver]
tolerance = 1e-10
[output]
fields = []
"#;

pub fn place(half: [f64; 2], depth: f64, cells: [usize; 3]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("scene.toml"), SCENE).unwrap();
    fs::write(folder.path().join("block.msh"), layer(half, depth, cells)).unwrap();
    folder
}

pub fn call(verb: &str, folder: &Path, sets: &[&str]) -> (Option<i32>, String) {
    let mut program = crate::tools::orthowear();
    program.arg(verb).arg(folder.join("scene.toml"));
    sets.iter().for_each(|set| {
        program.args(["--set", set]);
    });
    let output = program.output().unwrap();
    (output.status.code(), String::from_utf8([output.stdout, output.stderr].concat()).unwrap())
}

pub fn run(folder: &Path, sets: &[&str]) -> Value {
    let (code, text) = call("run", folder, sets);
    assert_eq!(code, Some(0), "{text}");
    serde_json::from_slice(&fs::read(folder.join("scene.out/summary.json")).unwrap()).unwrap()
}

pub fn force(summary: &Value, step: usize) -> [f64; 3] {
    let step = &summary["steps"][step];
    let tangential = &step["tangential_force"];
    [&step["normal_force"], &tangential[0], &tangential[1]].map(|value| value.as_f64().unwrap())
}

/// Truth: docs/theory-hybrid.md: the near field is the field of a half-space if the indicators of its error are below their
/// limits.
#[test]
fn a_half_space_where_it_is_valid() {
    let place = place([4.0, 4.0], 4.0, [8, 8, 8]);
    let folder = place.path();
    let summary = run(folder, &[]);
    let record = &summary["near_fields"][0];
    assert_eq!((&record["body"], &record["near_field"]), (&1.into(), &"half-space".into()), "{record}");
    let indicator = |name: &str| record["indicators"][name].as_f64().unwrap();
    assert!(indicator("imbalance") <= 1e-4 && indicator("asymmetry") <= 1e-3 && indicator("tail") <= 1e-2);
    assert!(indicator("least_eigenvalue") > 0.0 && indicator("direct_difference") <= 0.1);
    let whole = run(folder, &["solver.skip=false"]);
    for step in 0..2 {
        let (a, b) = (force(&summary, step), force(&whole, step));
        assert!((0..3).all(|c| (a[c] - b[c]).abs() < 1e-7 * a[0]), "{a:?} {b:?}");
    }
    let (code, text) = call("check", folder, &[]);
    assert_eq!(code, Some(0), "{text}");
    assert!(text.contains("half-space, steel, corrected by finite elements: 512 solid cells"), "{text}");
}

/// Truth: equivalence of prescribed approach and prescribed force. The normal force that results from an approach gives this
/// approach.
#[test]
fn held_by_a_load() {
    let place = place([4.0, 4.0], 4.0, [6, 6, 6]);
    let approached = run(place.path(), &[]);
    let load = force(&approached, 0)[0];
    let loaded = run(place.path(), &[&format!("steps.0={{name=\"press\", normal_force={load}}}")]);
    let approach = loaded["steps"][0]["approach"].as_f64().unwrap();
    assert!((approach / 0.02 - 1.0).abs() < 1e-7, "{approach}");
    let (a, b) = (force(&approached, 1), force(&loaded, 1));
    assert!((a[1] / b[1] - 1.0).abs() < 0.05 && (b[0] / load - 1.0).abs() < 1e-9, "{a:?} {b:?} {load}");
}

/// Truth: docs/scene.md: if the near field of a half-space is not valid, the value "auto" uses the mesh and gives the reason. The
/// value "half-space" is refused.
#[test]
fn no_place_for_a_half_space() {
    let place = place([2.0, 2.0], 2.0, [4, 4, 4]);
    let cases: [(&[&str], &str); 4] = [
        (
            &["frame.half_width=[1.9, 1.9]", "frame.cells=[4, 4]"],
            "an edge or a support of the body is at a distance of 0.1 from the frame",
        ),
        (&["frame={kind=\"mesh\", body=1}"], "faces or nodes of a mesh"),
        (
            &["body1.fixed=[{group=\"base\", components=[\"z\"]}]", "steps.1={name=\"hold\", approach=0.02}"],
            "the body has unconstrained rigid-body modes",
        ),
        (&["solver.coupling=\"block\"", "frame.cells=[4, 4]"], "the block system"),
    ];
    for (sets, why) in cases {
        let sets = [&["frame.cells=[6, 6]"], sets].concat();
        let asked = [&sets[..], &["body1.near_field=\"half-space\""]].concat();
        let (code, text) = call("check", place.path(), &asked);
        assert_eq!(code, Some(2), "{why}: {text}");
        assert!(text.contains(why) && text.contains("near_field"), "{why}: {text}");
    }
    let summary = run(
        place.path(),
        &["frame.half_width=[1.5, 1.5]", "frame.cells=[6, 6]", "body1.near_field=\"auto\""],
    );
    assert_eq!(summary["near_fields"][0]["near_field"], "half-space");
    let edge = ["frame.half_width=[1.7, 1.7]", "frame.cells=[6, 6]"];
    let summary = run(place.path(), &edge);
    let record = &summary["near_fields"][0];
    assert!(
        record["near_field"] == "mesh" && record["reason"].as_str().unwrap().contains("0.3 from the frame"),
        "{record}"
    );
    let summary = run(place.path(), &[&edge[..], &["body1.near_field=\"mesh\""]].concat());
    assert_eq!(summary["near_fields"][0]["reason"], "near_field is \"mesh\"");
}

/// Truth: docs/theory-hybrid.md: if an indicator exceeds its limit, the run condenses the mesh. The forces equal the forces with
/// `near_field = "mesh"`.
#[test]
fn a_correction_that_is_not_used() {
    // A single element cannot represent the far field.
    let place = place([2.0, 2.0], 2.0, [1, 1, 1]);
    let sets = ["frame.cells=[1, 1]"];
    let given_up = run(place.path(), &sets);
    let record = &given_up["near_fields"][0];
    assert!(record["near_field"] == "mesh" && record["indicators"].is_object(), "{record}");
    let reason = record["reason"].as_str().unwrap();
    assert!(reason.contains("is allowed"), "{record}");
    assert!(
        given_up["warnings"]
            .to_string()
            .contains(&format!("with its mesh instead of a half-space: {reason}")),
        "{given_up}"
    );
    // The run prints the warning before the solution, and again at its end.
    let (_, text) = call("run", place.path(), &sets);
    let said: Vec<usize> = text
        .match_indices("WARNING: the near field of body1 is computed with its mesh")
        .map(|(at, _)| at)
        .collect();
    assert_eq!(said.len(), 2, "{text}");
    let (code, text) = call("run", place.path(), &["frame.cells=[1, 1]", "body1.near_field=\"half-space\""]);
    assert!(code == Some(2) && text.contains("body1.near_field"), "{text}");
    let words = format!(
        "near_field = \"half-space\" is not possible, because the correction by the mesh is not accurate enough: {reason}"
    );
    assert!(text.contains(&words) && !text.contains("is computed with its mesh"), "{text}");
    let meshed = run(place.path(), &[&sets[..], &["body1.near_field=\"mesh\""]].concat());
    assert_eq!(force(&given_up, 1), force(&meshed, 1));
    let (code, text) = call("run", place.path(), &["frame.cells=[12, 12]", "body2={kind=\"rigid\"}"]);
    assert!(
        code == Some(2) && text.contains("instead of a half-space") && text.contains("frame.cells"),
        "{text}"
    );
}

/// Truth: invariance. The support moves by 0.005 mm towards body 2, and the approach is 0.015 mm. The forces equal the forces of
/// a fixed support and an approach of 0.02 mm.
#[test]
fn supports_that_move() {
    let place = place([4.0, 4.0], 4.0, [6, 6, 6]);
    let still = run(place.path(), &[]);
    let moved = run(
        place.path(),
        &[
            "body1.fixed=[]",
            "body1.displaced=[{group=\"base\", value=[0, 0, 0.005]}]",
            "steps.press.approach=0.015",
        ],
    );
    assert_eq!(moved["near_fields"][0]["near_field"], "half-space");
    for step in 0..2 {
        let (a, b) = (force(&still, step), force(&moved, step));
        assert!((0..3).all(|c| (a[c] - b[c]).abs() < 1e-7 * a[0]), "{a:?} {b:?}");
    }
}

/// Truth: docs/refine.md: the stress of the finite-element correction is singular at the edges of the fixed base. The estimated
/// error is therefore largest at these edges.
#[test]
fn refinement_at_held_edges() {
    let place = place([4.0, 4.0], 4.0, [8, 8, 8]);
    let mut program = crate::tools::orthowear();
    program.arg("refine").arg(place.path().join("scene.toml")).args(["--error", "0.02", "--out"]);
    let output = program.arg(place.path().join("size.pos")).output().unwrap();
    let text = String::from_utf8([output.stdout, output.stderr].concat()).unwrap();
    assert_eq!(output.status.code(), Some(0), "{text}");
    let line = text.lines().find(|line| line.contains("largest at (")).unwrap();
    let at = line.split("largest at (").nth(1).unwrap().split(')').next().unwrap();
    let at: Vec<f64> = at.split(", ").map(|number| number.parse().unwrap()).collect();
    assert!(at[2] < -3.0 && at[0].abs().max(at[1].abs()) > 3.0, "{line}");
}
