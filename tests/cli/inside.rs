//! Stress at points inside bodies (key `output.inside`): output files and refused keys.

use std::fs;

use crate::bad_input::{SOUND, check};
use crate::moved::layer;
use crate::near_field::{call, run};

const LINE: &str = "\n[[output.inside]]\nname = \"axis\"\nbody = 1\nfrom = [0.0, 0.0, 0.0]\nto = [0.0, 0.0, -0.6]\npoints = 11\n";

const CUT: &str = "\n[[output.inside]]\nname = \"cut\"\nbody = 2\nfrom = [-0.4, 0.0, 0.05]\nto = [0.4, 0.0, 0.05]\n\
                   across = [-0.4, 0.0, 0.6]\npoints = [9, 5]\n";

/// Mistakes in the valid scene with [`LINE`] and [`CUT`]: text to replace, replacement, words of the message.
const WRONG: &[(&str, &str, &[&str])] = &[
    ("body = 1", "body = 3", &["output.inside.0.body", "at most 2"]),
    ("name = \"cut\"", "name = \"Axis\"", &["output.inside.1.name", "by an earlier entry"]),
    ("name = \"axis\"", "name = \"a/b\"", &["output.inside.0.name", "cannot be used in a file name"]),
    ("name = \"axis\"", "name = \"\"", &["output.inside.0.name"]),
    ("to = [0.0, 0.0, -0.6]", "to = [0.0, 0.0, 0.6]", &["output.inside.0.to", "outside of body 1", "below"]),
    ("from = [-0.4, 0.0, 0.05]", "from = [-0.4, 0.0, -0.05]", &["output.inside.1.from", "outside of body 2"]),
    ("to = [0.0, 0.0, -0.6]", "to = [0.0, 0.0, 0.0]", &["output.inside.0.to", "same point"]),
    ("points = 11", "points = 1", &["output.inside.0.points", "at least 2"]),
    ("points = 11", "points = -1", &["output.inside.0.points", "at least 2"]),
    ("points = [9, 5]", "points = [9, 1]", &["output.inside.1.points", "at least 2"]),
    ("points = 11", "points = [11, 2]", &["output.inside.0.points", "`across` is missing"]),
    ("points = [9, 5]", "points = 9", &["output.inside.1.points", "needs two"]),
    ("points = 11", "points = \"many\"", &["output.inside.0.points"]),
    (
        "across = [-0.4, 0.0, 0.6]",
        "across = [0.9, 0.0, 0.05]",
        &["output.inside.1.across", "lies on the line"],
    ),
    ("points = 11", "points = 11\ndepth = 1.0", &["output.inside.0.depth"]),
    (
        "cells = [16, 16]",
        "cells = [16, 16]\nperiodic = [true, true]",
        &["output.inside.0.body", "under a periodic frame"],
    ),
];

/// Truth: docs/scene.md: each refusal names the key with the wrong value.
#[test]
fn what_is_refused() {
    let sound = format!("{SOUND}{LINE}{CUT}");
    let (code, text) = check(&sound, &[]);
    assert_eq!(code, Some(0), "{text}");
    for (from, to, words) in WRONG {
        assert!(sound.contains(from), "`{from}` is not in the scene");
        let (code, text) = check(&sound.replacen(from, to, 1), &[]);
        assert_eq!(code, Some(2), "{to}: {text}");
        assert!(words.iter().all(|word| text.contains(word)), "{to}: {words:?} in\n{text}");
    }
    let rigid = sound.replace("kind = \"half-space\"\nmaterial = \"steel\"", "kind = \"rigid\"");
    let (code, text) = check(&rigid, &[]);
    assert!(code == Some(2) && text.contains("output.inside.1.body") && text.contains("rigid"), "{text}");
}

fn columns(text: &str) -> (Vec<String>, Vec<Vec<f64>>) {
    let header = text.lines().next().unwrap().split(',').map(str::to_owned).collect();
    let rows = text.lines().skip(1).map(|line| line.split(',').map(|x| x.parse().unwrap()).collect());
    (header, rows.collect())
}

/// Truth: Hertz (Johnson 3.45): σ_z = -p0 / (1 + z²/a²) on the axis of a circular contact, to 2 % of p0. Here a is the contact
/// radius, p0 the peak pressure. The bodies are equal. By symmetry, the stresses at equal distances from the contact are equal in
/// body 1 and body 2.
#[test]
fn files_of_a_half_space() {
    let folder = tempfile::tempdir().unwrap();
    let scene = format!("{HERTZ}{LINE}{CUT}").replace("from = [0.0, 0.0, 0.0]", "from = [0.0, 0.0, -0.05]");
    fs::write(folder.path().join("scene.toml"), scene).unwrap();
    let summary = run(folder.path(), &[]);
    let out = folder.path().join("scene.out");
    for name in ["inside-axis_0001.csv", "inside-cut_0001.csv", "inside-cut_0001.vtu", "inside-cut.pvd"] {
        assert!(out.join(name).is_file() && summary["files"].to_string().contains(name), "{name}");
    }
    let (header, rows) = columns(&fs::read_to_string(out.join("inside-axis_0001.csv")).unwrap());
    let at = |name: &str| header.iter().position(|column| column == name).unwrap();
    assert_eq!(rows.len(), 11);
    // Two equal bodies have the contact modulus E* = E / (2 (1 - ν²)).
    let modulus: f64 = 210e3 / (2.0 * 0.91);
    let a = f64::cbrt(0.75 * 1000.0 * 10.0 / modulus);
    let p0 = 1.5 * 1000.0 / (std::f64::consts::PI * a * a);
    for row in &rows {
        let exact = -p0 / (1.0 + (row[at("z")] / a).powi(2));
        let found = row[at("stress_zz")];
        assert!((found - exact).abs() < 0.02 * p0, "{found} {exact}");
        let (one, three) = (row[at("principal_1")], row[at("principal_3")]);
        assert!((row[at("largest_shear")] - 0.5 * (one - three)).abs() < 1e-9 * p0);
    }
    let (above, cut) = columns(&fs::read_to_string(out.join("inside-cut_0001.csv")).unwrap());
    assert_eq!((cut.len(), above[4].as_str()), (45, "distance_across"));
    // These points on the axis lie 0.05 mm above and 0.05 mm below the surface.
    let column = above.iter().position(|name| name == "stress_zz").unwrap();
    assert!((cut[4][column] - rows[0][at("stress_zz")]).abs() < 1e-6 * p0);
}

/// Truth: docs/command-line.md: if the points do not fit into the memory, the exit code is 4, before any computation.
#[test]
fn too_many_points_for_the_memory() {
    let limited = HERTZ.replace("[output]", "[solver]\nmemory_limit = \"60 MiB\"\n[output]");
    let folder = tempfile::tempdir().unwrap();
    for (points, code, word) in [("[400, 400]", 4, "160000 points inside"), ("[40, 40]", 0, "")] {
        let scene = format!("{limited}{}", CUT.replace("[9, 5]", points));
        fs::write(folder.path().join("scene.toml"), scene).unwrap();
        for command in ["check", "run"] {
            let (found, text) = call(command, folder.path(), &[]);
            assert!(found == Some(code) && text.contains(word), "{command} {points}: {found:?} {text}");
        }
    }
}

const HERTZ: &str = r#"
[materials.steel]
model = "isotropic"
E = 210e3
nu = 0.3
[body1]
kind = "half-space"
material = "steel"
[body2]
kind = "half-space"
material = "steel"
[frame]
kind = "grid"
half_width = [0.5, 0.5]
cells = [24, 24]
[gap]
kind = "sphere"
radius = 10.0
[[steps]]
name = "press"
normal_force = 1000.0
[output]
fields = []
"#;

const BLOCK: &str = r#"
[materials.steel]
model = "isotropic"
E = 210e3
nu = 0.3
yield = 400.0
[body1]
kind = "be"
material = "steel"
mesh = "block.msh"
contact = "top"
fixed = [{ group = "base" }]
[body2]
kind = "rigid"
[frame]
kind = "grid"
half_width = [0.75, 0.75]
cells = [4, 4]
[gap]
kind = "sphere"
radius = 50.0
[[steps]]
name = "press"
approach = 0.005
[output]
fields = ["stress"]
[[output.inside]]
name = "axis"
body = 1
from = [0.0, 0.0, 0.0]
to = [0.0, 0.0, -2.0]
points = 5
"#;

/// Truth: docs/results.md: a body of boundary elements has the same arrays and peak values as a body of finite elements, on its
/// surface only. Down to a depth of 1 mm, the compressive stress at a point is below 0.8 times the compressive stress at the next
/// higher point. Points outside of the body are refused.
#[test]
fn a_body_of_boundary_elements() {
    let folder = tempfile::tempdir().unwrap();
    let place = |scene: &str| fs::write(folder.path().join("scene.toml"), scene).unwrap();
    place(BLOCK);
    fs::write(folder.path().join("block.msh"), layer([2.0, 2.0], 2.0, [6, 6, 4])).unwrap();
    let summary = run(folder.path(), &[]);
    let peaks = &summary["bodies"][0];
    let mises = peaks["von_mises"]["value"].as_f64().unwrap();
    assert!(mises > 0.0 && peaks["sigma_tangential"]["value"].is_number(), "{peaks}");
    let index = &peaks["indices"][0];
    assert!((index["value"].as_f64().unwrap() * 400.0 / mises - 1.0).abs() < 1e-9, "{peaks}");
    let out = folder.path().join("scene.out");
    let surface = fs::read(out.join("body1_0001.vtu")).unwrap();
    let text = String::from_utf8_lossy(&surface);
    for name in ["stress", "von_mises", "sigma_tangential", "traction", "displacement"] {
        assert!(text.contains(&format!("Name=\"{name}\"")), "{name}");
    }
    let (header, rows) = columns(&fs::read_to_string(out.join("inside-axis_0001.csv")).unwrap());
    let zz = header.iter().position(|column| column == "stress_zz").unwrap();
    assert!(rows.windows(2).all(|pair| 0.8 * pair[0][zz] < pair[1][zz] || pair[1][2] < -1.2), "{rows:?}");
    place(&BLOCK.replace("to = [0.0, 0.0, -2.0]", "to = [0.0, 0.0, -2.1]"));
    let (code, text) = call("check", folder.path(), &[]);
    assert!(code == Some(2) && text.contains("output.inside.0.to") && text.contains("outside"), "{text}");
    place(&BLOCK.replace("kind = \"be\"", "kind = \"fe\""));
    let (code, text) = call("check", folder.path(), &[]);
    assert!(code == Some(2) && text.contains("Plot Over Line"), "{text}");
}
