//! Runs with the cache of flexibilities.

use std::fs;
use std::path::{Path, PathBuf};

use serde_json::Value;

const SCENE: &str = r#"
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
near_field = "mesh"
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

struct Place {
    folder: tempfile::TempDir,
}

impl Place {
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let mesh = Path::new(env!("CARGO_MANIFEST_DIR")).join("meshes/cfrp-block-coarse.msh");
        let scene = SCENE.replace("MESH", &mesh.display().to_string());
        fs::write(folder.path().join("scene.toml"), scene).unwrap();
        Self { folder }
    }

    /// Exit code and output of the program, with the limit `limit` of the cache in MiB.
    fn call(&self, verb: &str, options: &[&str], limit: &str) -> (Option<i32>, String) {
        let mut program = crate::tools::orthowear();
        program.env("XDG_CACHE_HOME", self.folder.path()).env("ORTHOWEAR_CACHE_LIMIT", limit);
        let output =
            program.arg(verb).arg(self.folder.path().join("scene.toml")).args(options).output().unwrap();
        let text = [output.stdout, output.stderr].concat();
        (output.status.code(), String::from_utf8(text).unwrap())
    }

    fn run(&self, options: &[&str]) -> Value {
        let (code, text) = self.call("run", options, "100");
        assert_eq!(code, Some(0), "{text}");
        serde_json::from_slice(&fs::read(self.folder.path().join("scene.out/summary.json")).unwrap()).unwrap()
    }

    fn entries(&self) -> Vec<PathBuf> {
        let Ok(items) = fs::read_dir(self.folder.path().join("orthowear")) else { return Vec::new() };
        items.map(|item| item.unwrap().path()).collect()
    }
}

/// Entries of the summary without their times. The operator check is removed too, because it needs a factorisation.
fn steps(summary: &Value) -> Value {
    let mut steps = summary["steps"].clone();
    for step in steps.as_array_mut().unwrap() {
        step["seconds"] = Value::Null;
        step["certificate"].as_object_mut().unwrap().remove("operator_defect");
    }
    steps
}

fn hit(summary: &Value) -> bool {
    summary["skipped"]
        .as_array()
        .unwrap()
        .iter()
        .any(|skip| skip["why"].as_str().unwrap().contains("the cache contains"))
}

/// Truth: results are equal bit by bit with an empty, filled or damaged cache, and without a cache. A body with another fibre
/// direction gets another cache entry.
#[test]
fn a_second_run_skips_the_factorisation() {
    let place = Place::new();
    let bare = place.run(&["--no-cache"]);
    assert!(place.entries().is_empty() && !hit(&bare));
    let first = place.run(&[]);
    assert!(place.entries().len() == 1 && !hit(&first));
    assert!(place.call("check", &[], "100").1.contains("the cache contains the flexibility"));
    let second = place.run(&[]);
    assert!(hit(&second), "{}", second["skipped"]);
    assert!(!hit(&place.run(&["--no-cache"])));
    let entry = place.entries().remove(0);
    let mut bytes = fs::read(&entry).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 4;
    fs::write(&entry, &bytes).unwrap();
    let rebuilt = place.run(&[]);
    assert!(rebuilt["warnings"].to_string().contains("was damaged (its checksum is wrong)"), "{rebuilt}");
    assert!(!hit(&rebuilt) && hit(&place.run(&[])));
    // Fields in the volume need the factorisation. The cache keeps it for the next run.
    let volume = || fs::read(place.folder.path().join("scene.out/body1_volume_0001.vtu")).unwrap();
    let wanted = ["--set", "output.fields=[\"volume\"]"];
    let fields = place.run(&wanted);
    let factorised = volume();
    assert!(!hit(&fields) && place.entries().len() == 2);
    let text = place.call("check", &wanted, "100").1;
    assert!(text.contains("the flexibility and the factor for fields or loads"), "{text}");
    let restored = place.run(&wanted);
    assert!(hit(&restored) && volume() == factorised);
    let kept = place.entries().into_iter().find(|path| path.extension().is_some_and(|end| end == "factor"));
    let kept = kept.expect("a kept factor");
    let mut bytes = fs::read(&kept).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 4;
    fs::write(&kept, &bytes).unwrap();
    place.run(&wanted);
    assert!(volume() == factorised && fs::read(&kept).unwrap() != bytes);
    for other in [&first, &second, &rebuilt, &fields, &restored] {
        assert_eq!(steps(other), steps(&bare));
    }
    // With a cached flexibility, the run makes no factorisation for the operator check alone.
    let defect = |summary: &Value| summary["steps"][0]["certificate"]["operator_defect"].as_f64();
    assert!(defect(&bare).is_some_and(|defect| defect < 1e-11) && defect(&second).is_none(), "{bare}");
    place.run(&["--set", "body1.fibre.tilt=20.0"]);
    assert_eq!(place.entries().len(), 3);
}

/// Truth: docs/results.md: the operator check compares the operator with a direct solution, in the first entry for which a
/// factorisation exists. With a flexibility from the cache, the factorisation is made only for the fields at the end of a step.
#[test]
fn the_operator_is_checked_once_the_factor_is_there() {
    let place = Place::new();
    let two_steps =
        "[output]\nfields = [\"volume\"]\n[[steps]]\nname = \"pull\"\nshift = { distance = 0.001 }\n";
    place.run(&[]);
    let path = place.folder.path().join("scene.toml");
    let scene = fs::read_to_string(&path).unwrap();
    fs::write(&path, scene.replace("[output]\nfields = []\n", two_steps)).unwrap();
    let summary = place.run(&[]);
    let defect = |step: usize| summary["steps"][step]["certificate"]["operator_defect"].as_f64();
    assert!(!hit(&summary) && defect(0).is_none(), "{summary}");
    assert!(defect(1).is_some_and(|defect| defect < 1e-11), "{summary}");
}

/// Truth: the stored table of the field inside a half-space gives the same results as a new one, bit by bit.
#[test]
fn the_field_inside_a_half_space() {
    let place = Place::new();
    let scene = SCENE.replace("kind = \"fe\"", "kind = \"half-space\"");
    let mesh = scene.find("mesh = ").unwrap()..scene.find("[body2]").unwrap();
    let mut scene = scene.replace(&scene[mesh], "");
    scene.push_str(
        "inside = [{ name = \"axis\", body = 1, from = [0, 0, -0.1], to = [0, 0, -0.5], points = 3 }]\n",
    );
    fs::write(place.folder.path().join("scene.toml"), scene).unwrap();
    let points = || fs::read(place.folder.path().join("scene.out/inside-axis_0001.csv")).unwrap();
    place.run(&[]);
    let (made, entry) = (points(), place.entries().remove(0));
    place.run(&[]);
    assert!(points() == made && place.entries().len() == 1);
    let mut bytes = fs::read(&entry).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 4;
    fs::write(&entry, &bytes).unwrap();
    let rebuilt = place.run(&[]);
    assert!(rebuilt["warnings"].to_string().contains("was damaged"), "{}", rebuilt["warnings"]);
    assert!(points() == made);
}

/// Truth: docs/command-line.md: the limit 0 means no cache.
#[test]
fn the_limit_is_the_users() {
    let place = Place::new();
    assert_eq!(place.call("run", &[], "0").0, Some(0));
    assert!(place.entries().is_empty());
    for verb in ["run", "check"] {
        let (code, text) = place.call(verb, &[], "2 GB");
        assert!(code == Some(2) && text.contains("ORTHOWEAR_CACHE_LIMIT"), "{text}");
    }
}

/// Truth: if the cache cannot be written, the run continues without it and reports this.
#[test]
fn a_cache_that_cannot_be_written() {
    let place = Place::new();
    fs::write(place.folder.path().join("orthowear"), "a file where the folder should be").unwrap();
    let summary = place.run(&[]);
    assert!(summary["warnings"].to_string().contains("cannot be written"), "{}", summary["warnings"]);
}
