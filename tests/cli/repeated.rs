//! Periodic frames: complete contact, and outlines of punches.

use std::fs;

use serde_json::Value;

fn scene(gap: &str, frame: &str, steps: &str) -> String {
    format!(
        "[materials.steel]\nmodel = \"isotropic\"\nE = 210e3\nnu = 0.3\n[body1]\nkind = \"half-space\"\nmaterial = \"steel\"\n\
         [body2]\nkind = \"half-space\"\nmaterial = \"steel\"\n[friction]\nlaw = \"coulomb\"\nmu = 0.3\n[gap]\n{gap}\n\
         [frame]\nkind = \"grid\"\nhalf_width = [0.5, 0.5]\n{frame}\n[output]\nfields = []\n{steps}\n"
    )
}

fn call(command: &str, scene: &str) -> (Option<i32>, String, Value) {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("scene.toml"), scene).unwrap();
    let mut program = crate::tools::orthowear();
    program.current_dir(folder.path()).args([command, "scene.toml"]);
    if command == "run" {
        program.args(["--out", "out"]);
    }
    let output = program.output().unwrap();
    let text = String::from_utf8([output.stdout, output.stderr].concat()).unwrap();
    let summary = fs::read(folder.path().join("out/summary.json")).unwrap_or_default();
    let text = text.split_whitespace().collect::<Vec<_>>().join(" ");
    (output.status.code(), text, serde_json::from_slice(&summary).unwrap_or(Value::Null))
}

const PRESS: &str = "[[steps]]\nnormal_force = 10.0\n[[steps]]\n";

/// Truth: flat surfaces on a periodic frame carry the force P on the area A as uniform pressure P / A. This pressure causes no
/// displacement, because the mean displacement is zero (docs/scene.md). Friction carries the prescribed tangential force, or 0.3
/// P against a prescribed motion, to 1e-7.
#[test]
fn level_surfaces_bear_a_uniform_pressure() {
    let flat = "kind = \"flat\"";
    let cylinder = "kind = \"cylinder\"\nradius = 10.0";
    for (gap, cells, step, pulled) in [
        (flat, "[16, 16]", "tangential_force = [2.0, 0.0]", 2.0),
        (flat, "[16, 16]", "shift = { distance = 1e-4 }", 3.0),
        (flat, "[16, 16]", "rolling = { creepage = [0.001, 0.0] }", 3.0),
        (cylinder, "[1, 2]", "tangential_force = [2.0, 0.0]", 2.0),
        (cylinder, "[2, 1]", "shift = { distance = 1e-4 }", 3.0),
    ] {
        let frame = format!("cells = {cells}\nperiodic = [true, true]");
        let (code, text, summary) = call("run", &scene(gap, &frame, &format!("{PRESS}{step}")));
        assert_eq!(code, Some(0), "{gap} {cells} {step}: {text}");
        for entry in summary["steps"].as_array().unwrap() {
            assert!((entry["peak_pressure"].as_f64().unwrap() / 10.0 - 1.0).abs() < 1e-8, "{entry}");
            assert!((entry["contact_area"].as_f64().unwrap() - 1.0).abs() < 1e-12, "{entry}");
            for key in
                ["natural_residual", "max_cone_violation", "normal_gap_energy", "tangential_gap_energy"]
            {
                assert!(entry["certificate"][key].as_f64().unwrap().abs() < 1e-7, "{key} {entry}");
            }
            assert!(entry["certificate"]["operator_defect"].is_null(), "{entry}");
        }
        let force = summary["steps"][1]["tangential_force"][0].as_f64().unwrap();
        assert!((force.abs() / pulled - 1.0).abs() < 1e-7, "{gap} {cells} {step}: {force}");
    }
}

/// Truth: docs/scene.md: the approach is less than the mean gap. Flat surfaces are in complete contact at first touch, so the
/// only possible approach is 0.
#[test]
fn level_surfaces_approach_under_no_pressure() {
    let frame = "cells = [16, 16]\nperiodic = [true, true]";
    let scene =
        |approach: &str| scene("kind = \"flat\"", frame, &format!("[[steps]]\napproach = {approach}"));
    for command in ["check", "run"] {
        let (code, text, _) = call(command, &scene("0.001"));
        assert!(code == Some(2) && text.contains("steps.0.approach") && text.contains("mean gap"), "{text}");
    }
    let (code, text, _) = call("run", &scene("0.0"));
    assert_eq!(code, Some(0), "{text}");
    // Wear would allow a further approach, but there is no wear without sliding.
    let wear = "[wear]\nlaw = \"archard\"\ni = 1e-6\n";
    let (code, text, _) = call("check", &scene("0.001").replace("[output]", &format!("{wear}[output]")));
    assert!(code == Some(2) && text.contains("mean gap"), "{text}");
}

/// Truth: Hertz's line contact has the half-width a = √(4 P R / π L E*) under the force P on the length L. R is the radius, E*
/// the contact modulus. Here 4 N on a period of 4 µm give a contact width of 0.7 mm. The frame has a width of 1 mm.
#[test]
fn a_thin_period_is_no_narrow_frame() {
    let frame = "cells = [64, 1]\nperiodic = [false, true]";
    let noted = |force: &str| {
        let steps = format!("[[steps]]\nnormal_force = {force}");
        let scene =
            scene("kind = \"cylinder\"\nradius = 10.0", frame, &steps).replace("0.5, 0.5", "0.5, 0.002");
        let (code, text, _) = call("check", &scene);
        assert_eq!(code, Some(0), "{text}");
        text.contains("possible unit error")
    };
    assert!(!noted("4.0") && noted("4e3"));
}

/// Truth: docs/scene.md: cells outside an outline stay open, so an approach is possible. On a periodic frame the approach refers
/// to the mean plane, which the load displaces too. The same approach therefore needs more force than without periodicity.
#[test]
fn outlines_on_repeated_frames() {
    let frame = |periodic: &str| {
        format!("cells = [20, 20]\nperiodic = {periodic}\noutline = {{ shape = \"circle\", radius = 0.3 }}")
    };
    let flat = "kind = \"flat\"";
    for periodic in ["[true, true]", "[true, false]", "[false, true]"] {
        let scene = scene(flat, &frame(periodic), "[[steps]]\nnormal_force = 100.0");
        let (code, text, _) = call("check", &scene);
        assert!(code == Some(0) && text.contains("112 inside the outline"), "{periodic}: {text}");
        let (code, text, summary) = call("run", &scene);
        assert_eq!(code, Some(0), "{periodic}: {text}");
        let step = &summary["steps"][0];
        assert!((step["normal_force"].as_f64().unwrap() / 100.0 - 1.0).abs() < 1e-7, "{periodic}: {step}");
        assert!(
            (step["contact_area"].as_f64().unwrap() - 112.0 * 0.0025).abs() < 1e-12,
            "{periodic}: {step}"
        );
    }
    let force = |periodic: &str| {
        let (code, text, summary) =
            call("run", &scene(flat, &frame(periodic), "[[steps]]\napproach = 0.0001"));
        assert_eq!(code, Some(0), "{periodic}: {text}");
        summary["steps"][0]["normal_force"].as_f64().unwrap()
    };
    let [open, repeated] = ["[false, false]", "[true, true]"].map(force);
    assert!(open > 0.0 && repeated > open, "{open} {repeated}");
}
