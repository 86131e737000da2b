//! `orthowear compare`: the variants are the runs they stand for, their differences are named, what cannot be is refused.

use std::fs;
use std::path::Path;

use serde_json::Value;

use super::materials::{folder, orthowear};

fn json(path: &Path) -> Value {
    serde_json::from_slice(&fs::read(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))).unwrap()
}

const STEEL: &str = "fibre = { tilt = 30.0 }\n[materials.steel]\nmodel = \"isotropic\"\nE = 210e3\nnu = 0.3";

/// The results of the steps of a run, without times.
fn results(summary: &Value) -> Vec<Vec<f64>> {
    let keys = ["normal_force", "contact_area", "stick_area", "peak_pressure", "worn_volume"];
    let numbers = |step: &Value| keys.iter().map(|key| step[key].as_f64().unwrap()).collect::<Vec<f64>>();
    summary["steps"].as_array().unwrap().iter().map(numbers).collect()
}

/// Truth: each variant is the run of the scene with the body written as what stands for it, to the last bit; percents
/// are those of the numbers beside them.
#[test]
fn the_variants_are_the_runs_they_stand_for() {
    let folder = folder(STEEL, "", &[]);
    let set_body2 = ["--set", "body2.kind=half-space", "--set", "body2.material=steel"];
    let (code, text, errors) =
        orthowear(folder.path(), &[&["compare", "scene.toml", "--out", "c"][..], &set_body2].concat());
    assert_eq!(code, Some(0), "{errors}");
    let comparison = json(&folder.path().join("c/compare.json"));
    let variants = comparison["variants"].as_array().unwrap();
    let names: Vec<&str> = variants.iter().map(|v| v["name"].as_str().unwrap()).collect();
    assert_eq!(names, ["FE-BE", "BE-BE"]);
    let replaced = "body1={ kind = \"half-space\", material = \"im7\", fibre = { tilt = 30.0 } }";
    for (i, more) in [(0, &[][..]), (1, &["--set", replaced][..])] {
        let arguments = [&["run", "scene.toml", "--out", "r", "--quiet"][..], &set_body2, more].concat();
        let (code, _, errors) = orthowear(folder.path(), &arguments);
        assert_eq!(code, Some(0), "{errors}");
        let alone = results(&json(&folder.path().join("r/summary.json")));
        assert_eq!(results(&variants[i]), alone, "{}", names[i]);
        let own = variants[i]["folder"].as_str().unwrap();
        assert_eq!(results(&json(&folder.path().join("c").join(own).join("summary.json"))), alone);
    }
    let load = |variant: usize| variants[variant]["steps"][0]["normal_force"].as_f64().unwrap();
    let percent = variants[1]["steps"][0]["difference"]["normal_force"].as_f64().unwrap();
    assert!((percent - 100.0 * (load(1) / load(0) - 1.0)).abs() < 1e-10);
    assert!(variants[0]["steps"][0]["difference"].is_null());
    assert!(text.contains(&format!("({percent:+.1} %)")), "{text}");
    let csv = fs::read_to_string(folder.path().join("c/compare.csv")).unwrap();
    let header = csv.lines().next().unwrap();
    assert_eq!(csv.lines().count(), 1 + 2 * 2);
    assert!(csv.lines().all(|line| line.split(',').count() == header.split(',').count()), "{csv}");
    let picture = fs::read_to_string(folder.path().join("c/compare.svg")).unwrap();
    for word in ["FE-BE", "BE-BE", "Pressure after shift, along y"] {
        assert!(picture.contains(word), "the picture lacks {word}");
    }
}

/// Truth: docs/results.md explains every field of compare.json and every column of compare.csv.
#[test]
fn the_documents_explain_the_comparison() {
    let folder = folder("fibre = { tilt = 30.0 }", "", &[]);
    let (code, text, _) = orthowear(folder.path(), &["compare", "scene.toml"]);
    assert_eq!(code, Some(0), "{text}");
    let documented = include_str!("../../docs/results.md");
    let comparison = json(&folder.path().join("scene.compare/compare.json"));
    let mut keys: Vec<String> = Vec::new();
    for table in [&comparison, &comparison["variants"][0], &comparison["variants"][1]["steps"][1]] {
        keys.extend(table.as_object().unwrap().keys().cloned());
    }
    let names: Vec<&str> =
        comparison["variants"].as_array().unwrap().iter().map(|v| v["name"].as_str().unwrap()).collect();
    assert_eq!(names, ["FE-rigid", "BE-rigid"]);
    for key in keys {
        assert!(documented.contains(&format!("`{key}`")), "docs/results.md does not explain `{key}`");
    }
}

/// Truth: docs/command-line.md: a half-space needs a plane frame and one direction; what cannot be is named in the
/// table, the others are computed, and the exit code is theirs.
#[test]
fn variants_that_cannot_be_do_not_stop_the_others() {
    let curved = folder("fibre = { tilt = 30.0 }", "", &[]);
    let mesh = fs::read_to_string(curved.path().join("box.msh")).unwrap();
    // The top sinks by a tenth at its corners.
    let bent = mesh.replace("-1 -1 0\n", "-1 -1 -0.1\n").replace("\n125 1 1 0\n", "\n125 1 1 -0.1\n");
    assert_ne!(bent, mesh);
    fs::write(curved.path().join("box.msh"), bent).unwrap();
    let arguments = ["compare", "scene.toml", "--set", "frame={ kind = \"mesh\" }"];
    let (code, text, errors) = orthowear(curved.path(), &arguments);
    assert_eq!(code, Some(0), "{errors}");
    assert!(text.contains("BE-rigid: the contact frame is curved"), "{text}");
    assert!(text.contains("not computed") && text.contains("converged"), "{text}");

    let wound = "fibre = { cylindrical = { axis = \"y\", origin = [0, 0, -2], angle = 90.0 } }";
    let varied = folder(wound, "", &[]);
    let arguments = ["compare", "scene.toml", "--set", "friction.fibre={ azimuth = 0.0 }"];
    let (code, text, errors) = orthowear(varied.path(), &arguments);
    assert_eq!(code, Some(0), "{errors}");
    assert!(text.contains("BE-rigid: the material axes of body1 vary by up to"), "{text}");
}

/// Truth: docs/command-line.md: what has no place in a half-space is named: loads, foundations, displacements, also those
/// that only vary in space. A support at rest is none of these.
#[test]
fn what_a_half_space_has_no_place_for_is_named() {
    let scene = folder("fibre = { tilt = 30.0 }", "", &[]);
    let path = scene.path().join("scene.toml");
    let notes = |settings: &[&str]| -> String {
        let settings: Vec<String> = settings.iter().map(|setting| setting.to_string()).collect();
        let plan = orthowear::scene::read(&path, &settings).unwrap_or_else(|mistakes| panic!("{mistakes}"));
        let (_, variants) =
            orthowear::study::compare::variants(&plan).unwrap_or_else(|f| panic!("{}", f.error));
        variants.into_iter().flat_map(|variant| variant.notes).collect()
    };
    assert_eq!(notes(&[]), "");
    let sides = "body1.fixed=[{ group = \"base\", components = [\"x\", \"y\"] }]";
    let far = "body1.displaced=[{ group = \"base\", components = [\"z\"], gradient = [[1e-4, 0.0, 0.0]] }]";
    for (settings, named) in [
        (&["body1.body_force=[0.0, 0.0, -1e-3]"][..], "the loads of body1"),
        (&["body1.foundation=[{ group = \"base\", stiffness = 10.0 }]"], "the foundations of body1"),
        (&[sides, far], "the prescribed displacements of body1"),
    ] {
        let found = notes(settings);
        assert!(found.contains(named), "{settings:?}: {found}");
    }
}

/// Truth: docs/command-line.md: one variant where nothing is meshed; the worst exit code; mistakes as in `run`.
#[test]
fn one_variant_and_the_worst_exit_code() {
    let folder = folder("fibre = { tilt = 30.0 }", "", &[]);
    let half_space = "body1={ kind = \"half-space\", material = \"im7\", fibre = { tilt = 30.0 } }";
    let (code, text, _) =
        orthowear(folder.path(), &["compare", "scene.toml", "--set", half_space, "--out", "one"]);
    assert_eq!(code, Some(0));
    assert!(text.contains("one variant only") && text.contains("1 variant in"), "{text}");
    let few = ["compare", "scene.toml", "--set", "solver.max_iterations=1", "--out", "few"];
    let (code, text, _) = orthowear(folder.path(), &few);
    assert_eq!(code, Some(3), "{text}");
    assert!(text.contains("NOT CONVERGED") && text.contains("raise solver.max_iterations"), "{text}");
    let (code, _, errors) = orthowear(folder.path(), &["compare", "scene.toml", "--set", "gap.radius=-1"]);
    assert_eq!(code, Some(2));
    assert!(errors.contains("gap.radius"), "{errors}");
}

/// Truth: the sphere of radius 50 that the cap's faces approximate; chords of 0.19 mm miss it by 0.19^2/(4 R) = 2e-4 mm,
/// the gap in the frame's corners is 0.024 mm.
#[test]
fn half_spaces_keep_the_gap_of_the_meshes() {
    let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/steel-cap-on-cfrp-block.toml");
    let plan = orthowear::scene::read(&scene, &[]).unwrap_or_else(|mistakes| panic!("{mistakes}"));
    let (frame, variants) =
        orthowear::study::compare::variants(&plan).unwrap_or_else(|f| panic!("{}", f.error));
    let names: Vec<&str> = variants.iter().map(|variant| variant.name.as_str()).collect();
    assert_eq!(names, ["FE-FE", "FE-BE", "BE-FE", "BE-BE"]);
    for variant in &variants[1..] {
        let gap = variant.plan.as_ref().unwrap().gap.evaluate(&frame).unwrap();
        for (cell, found) in gap.iter().enumerate() {
            let [x, y] = frame.plane_coordinates(cell);
            let exact = 50.0 - (2500.0 - x * x - y * y).sqrt();
            assert!((found - exact).abs() < 3e-4, "{}: {found} instead of {exact}", variant.name);
        }
    }
}
