//! Half-spaces with truncated, meshed surfaces in scenes.

use std::fs;
use std::path::Path;

use serde_json::Value;

const SCENE: &str = r#"
[materials.steel]
model = "isotropic"
E = 210e3
nu = 0.3
[body1]
kind = "half-space"
material = "steel"
truncated = 4.0
[body2]
kind = "rigid"
[frame]
kind = "grid"
half_width = [0.5, 0.5]
cells = [8, 8]
[gap]
kind = "sphere"
radius = 10.0
[[steps]]
name = "press"
normal_force = 500.0
[output]
fields = ["vtu"]
"#;

fn call(folder: &Path, arguments: &[&str]) -> (Option<i32>, String) {
    let output = crate::tools::orthowear().current_dir(folder).args(arguments).output().unwrap();
    let text = [output.stdout, output.stderr].map(|bytes| String::from_utf8(bytes).unwrap()).concat();
    (output.status.code(), text)
}

/// Truth: the approach under the same force differs from the approach of the exact half-space by at most 3 %. Under uniform
/// tractions, the difference is 1.6 % or less, if the surface is at least 3 times as wide as the frame
/// (docs/theory-boundary-elements.md).
#[test]
fn beside_the_exact_half_space() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("scene.toml"), SCENE).unwrap();
    let (code, text) = call(folder.path(), &["compare", "scene.toml", "--out", "c"]);
    assert_eq!(code, Some(0), "{text}");
    let summary = |variant: &str| -> Value {
        let path = folder.path().join("c").join(variant).join("summary.json");
        serde_json::from_slice(&fs::read(path).unwrap()).unwrap()
    };
    let [found, exact] = ["ths-rigid", "hs-rigid"].map(summary);
    let approach = |summary: &Value| summary["steps"][0]["approach"].as_f64().unwrap();
    let off = approach(&found) / approach(&exact) - 1.0;
    assert!(off != 0.0 && off.abs() < 0.03, "{off}");
    assert!(exact["truncations"].is_null());
    let of = |key: &str| found["truncations"][0][key].as_f64().unwrap();
    assert!(of("difference") > 0.0 && of("difference") < 0.03 && of("residual") < 1e-12);
    assert!((of("compliance") / of("exact_compliance") - 1.0).abs() < 0.03);
}

/// Truth: docs/scene.md: the frame must be a grid without periodic directions, and the truncated surface must be larger than the
/// frame.
#[test]
fn what_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("scene.toml"), SCENE).unwrap();
    let inside = "output.inside=[{ name = \"a\", body = 1, from = [0.0, 0.0, 0.0], to = [0.0, 0.0, -1.0], points = 3 }]";
    for (setting, key, words) in [
        ("body1.truncated=0.5", "body1.truncated", "use a value from 0.55"),
        ("body1.truncated=-1.0", "body1.truncated", "must be above 0"),
        ("frame.periodic=[true, false]", "body1.truncated", "remove frame.periodic"),
        (inside, "output.inside", "remove body1.truncated"),
    ] {
        for verb in ["check", "run"] {
            let (code, text) = call(folder.path(), &[verb, "scene.toml", "--set", setting]);
            let text = text.split_whitespace().collect::<Vec<_>>().join(" ");
            assert_eq!(code, Some(2), "{verb} {setting}: {text}");
            assert!(text.contains(key) && text.contains(words), "{verb} {setting}: {text}");
        }
    }
}
