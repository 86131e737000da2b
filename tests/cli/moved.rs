//! Finite-element meshes whose nodes move with wear (key `wear.move_mesh`).

use std::fmt::Write;
use std::fs;
use std::path::Path;

use serde_json::Value;

use crate::tools::timeless;

/// Scene of a flat rigid body that slides on a layer of thickness 1 mm. The sides of the layer stay in their planes. The wear
/// depth is 1e-8 mm per mm of sliding distance and per MPa of pressure.
pub const LAYER: &str = r#"
[materials.m]
model = "isotropic"
E = 1000.0
nu = 0.3
[body1]
kind = "fe"
material = "m"
mesh = "layer.msh"
contact = "top"
fixed = [
  { group = "base", components = ["z"] },
  { group = "x", components = ["x"] },
  { group = "y", components = ["y"] },
]
[body2]
kind = "rigid"
[frame]
kind = "grid"
half_width = [1.0, 1.0]
cells = [4, 4]
[gap]
kind = "flat"
[wear]
law = "archard"
i = 1e-8
[[steps]]
name = "press"
normal_force = 80.0
wear = false
[[steps]]
name = "slide"
sliding = { distance = 1.5e6, jumps = 2 }
[[steps]]
name = "hold"
wear = false
"#;

/// Compression of the layer in uniaxial strain under 20 MPa, mm: 20 (1 + nu) (1 - 2 nu) / (E (1 - nu)) times its thickness of 1
/// mm.
const GIVES: f64 = 20.0 * 1.3 * 0.4 / (1000.0 * 0.7);

/// Mesh of equal hexahedra with the half-widths `half` along x and y and the extent `depth` below z = 0.
pub fn layer(half: [f64; 2], depth: f64, [nx, ny, nz]: [usize; 3]) -> String {
    let at = |i: usize, j: usize, k: usize| 1 + (i * (ny + 1) + j) * (nz + 1) + k;
    let part = |i: usize, n: usize| i as f64 / n as f64;
    let mut text = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n5\n2 1 \"top\"\n2 2 \"base\"\n2 3 \"x\"\n2 4 \"y\"\n3 5 \
                    \"body\"\n$EndPhysicalNames\n"
        .to_owned();
    write!(text, "$Nodes\n{}\n", (nx + 1) * (ny + 1) * (nz + 1)).unwrap();
    for i in 0..=nx {
        for j in 0..=ny {
            for k in 0..=nz {
                let [x, y] = [half[0] * (2.0 * part(i, nx) - 1.0), half[1] * (2.0 * part(j, ny) - 1.0)];
                writeln!(text, "{} {x} {y} {}", at(i, j, k), depth * (part(k, nz) - 1.0)).unwrap();
            }
        }
    }
    let mut elements: Vec<String> = Vec::new();
    let mut add = |head: &str, nodes: &[usize]| {
        let nodes: Vec<String> = nodes.iter().map(ToString::to_string).collect();
        elements.push(format!("{} {head} {}", elements.len() + 1, nodes.join(" ")));
    };
    for (group, k) in [(1, nz), (2, 0)] {
        for (i, j) in (0..nx * ny).map(|cell| (cell / ny, cell % ny)) {
            let nodes = [at(i, j, k), at(i + 1, j, k), at(i + 1, j + 1, k), at(i, j + 1, k)];
            add(&format!("3 2 {group} {group}"), &nodes);
        }
    }
    for i in [0, nx] {
        for (j, k) in (0..ny * nz).map(|cell| (cell / nz, cell % nz)) {
            add("3 2 3 3", &[at(i, j, k), at(i, j + 1, k), at(i, j + 1, k + 1), at(i, j, k + 1)]);
        }
    }
    for j in [0, ny] {
        for (i, k) in (0..nx * nz).map(|cell| (cell / nz, cell % nz)) {
            add("3 2 4 4", &[at(i, j, k), at(i + 1, j, k), at(i + 1, j, k + 1), at(i, j, k + 1)]);
        }
    }
    for (i, j, k) in (0..nx * ny * nz).map(|cell| (cell / (ny * nz), cell / nz % ny, cell % nz)) {
        let level = |k| [at(i, j, k), at(i + 1, j, k), at(i + 1, j + 1, k), at(i, j + 1, k)];
        add("5 2 5 5", &[level(k), level(k + 1)].concat());
    }
    write!(text, "$EndNodes\n$Elements\n{}\n{}\n$EndElements\n", elements.len(), elements.join("\n"))
        .unwrap();
    text
}

fn run(folder: &Path, out: &str, sets: &[&str]) -> (Option<i32>, String, Value) {
    let out = folder.join(out);
    let mut program = crate::tools::orthowear();
    program.arg("run").arg(folder.join("scene.toml")).arg("--out").arg(&out);
    sets.iter().for_each(|set| {
        program.args(["--set", set]);
    });
    let output = program.output().unwrap();
    let text = String::from_utf8([output.stdout, output.stderr].concat()).unwrap();
    let summary = serde_json::from_slice(&fs::read(out.join("summary.json")).unwrap()).unwrap();
    (output.status.code(), text, summary)
}

fn place(scene: &str, mesh: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("scene.toml"), scene).unwrap();
    fs::write(folder.path().join("layer.msh"), mesh).unwrap();
    folder
}

fn of_layer(cells: usize) -> tempfile::TempDir {
    place(LAYER, &layer([1.0; 2], 1.0, [5, 4, cells]))
}

fn number(entry: &Value, key: &str) -> f64 {
    entry[key].as_f64().unwrap()
}

fn entries(summary: &Value) -> &[Value] {
    summary["steps"].as_array().unwrap()
}

fn warned(summary: &Value, words: &[&str]) -> usize {
    let warnings = summary["warnings"].as_array().unwrap().iter();
    warnings.filter(|text| words.iter().all(|word| text.as_str().unwrap().contains(word))).count()
}

/// Elastic compression of each entry: approach minus wear depth.
fn elastic(summary: &Value) -> Vec<f64> {
    entries(summary).iter().map(|entry| number(entry, "approach") - number(entry, "max_wear_depth")).collect()
}

/// Truth: uniaxial strain. The pressure p compresses a layer of thickness H and modulus M by p (H - d) / M. Here d is the wear
/// depth at the last move of the mesh, or 0 without moves.
#[test]
fn a_worn_layer_is_stiffer() {
    let folder = of_layer(4);
    let (code, text, moved) = run(folder.path(), "moved", &["wear.move_mesh=0.2"]);
    assert_eq!(code, Some(0), "{text}");
    assert_eq!(moved["mesh_moves"], 2, "{text}");
    for (found, left) in elastic(&moved).iter().zip([1.0, 1.0, 0.85, 0.7]) {
        assert!((found / (left * GIVES) - 1.0).abs() < 1e-9, "{found} {}", left * GIVES);
    }
    let last = &entries(&moved)[3];
    let [depth, force] = ["max_wear_depth", "normal_force"].map(|key| number(last, key));
    // The tolerance of the force is the rounding error of the sum over 16 cells.
    assert!(
        (depth - 0.3).abs() < 1e-9 && (force / 80.0 - 1.0).abs() < 16.0 * f64::EPSILON,
        "{depth} {force}"
    );
    assert_eq!(
        warned(
            &moved,
            &["the mesh was moved with wear in step \"slide\" after entry 1", "body1 by up to 0.15"]
        ),
        1
    );
    assert_eq!(
        warned(
            &moved,
            &["the mesh was moved with wear in step \"slide\" after entry 2", "body1 by up to 0.3"]
        ),
        1
    );
    let (code, text, still) = run(folder.path(), "still", &[]);
    assert_eq!(code, Some(0), "{text}");
    for found in elastic(&still) {
        assert!((found / GIVES - 1.0).abs() < 1e-9, "{found}");
    }
    assert!(still.get("mesh_moves").is_none() && warned(&still, &["mesh was moved"]) == 0);
    let skipped = |summary: &Value| summary["skipped"].to_string().contains("moving meshes with wear");
    assert!(skipped(&still) && !skipped(&moved));
}

/// Truth: a layer of thickness H and modulus M has the weight b per volume, the wear depth d and the pressure p. Body 2 has the
/// constant approach A. The compression is A - d = (p (H - d) + b (H - d)^2 / 2) / M.
#[test]
fn worn_layers_under_their_weight() {
    let folder = of_layer(4);
    let (weight, approach) = (20.0, 0.3);
    let sets = [
        "wear.move_mesh=0.2",
        &format!("body1.body_force=[0.0, 0.0, -{weight}]"),
        &format!("steps.press={{ approach = {approach}, wear = false }}"),
        "steps.slide.sliding={ distance = 1e5, jumps = 2 }",
    ];
    let (code, text, summary) = run(folder.path(), "out", &sets);
    assert_eq!((code, &summary["mesh_moves"]), (Some(0), &2.into()), "{text}");
    let (modulus, hold) = (20.0 / GIVES, &entries(&summary)[3]);
    let left = 1.0 - number(hold, "max_wear_depth");
    let wanted = 4.0 * (modulus * (approach - (1.0 - left)) - 0.5 * weight * left * left) / left;
    assert!((number(hold, "normal_force") / wanted - 1.0).abs() < 1e-7, "{} {wanted}", hold["normal_force"]);
    assert!(left < 0.9 && (number(hold, "approach") - approach).abs() < 1e-12, "{left}");
}

fn unmoved(summary: &Value) -> Value {
    let mut summary = timeless(summary.clone());
    for name in ["scene", "scene_sha256", "mesh_moves", "near_fields", "skipped"] {
        summary.as_object_mut().unwrap().remove(name);
    }
    summary
}

/// Truth: a run without `wear.move_mesh` gives the same results bit by bit, if no wear depth reaches the limit for a move.
#[test]
fn meshes_that_do_not_wear_deep_enough() {
    let folder = of_layer(1);
    // Both runs use the near field of the mesh and report the same reason for this choice.
    let mesh = "body1.near_field=\"mesh\"";
    // The wear depth reaches 0.3 of the element height, which is below the limit of 0.31.
    let (code, text, moving) = run(folder.path(), "moving", &["wear.move_mesh=0.31", mesh]);
    assert_eq!(code, Some(0), "{text}");
    let (_, _, still) = run(folder.path(), "still", &[mesh]);
    assert_eq!(moving["mesh_moves"], 0);
    assert_eq!(unmoved(&moving), unmoved(&still));
    for entry in 1..=4 {
        let [a, b] = ["moving", "still"]
            .map(|out| fs::read(folder.path().join(format!("{out}/frame_{entry:04}.vtu"))).unwrap());
        assert!(a == b, "fields of entry {entry}");
    }
}

/// Truth: a move that would reduce the height of an element by more than nine tenths is omitted. The mesh keeps the shape of its
/// last move, at the wear depth d. The compression is then p (H - d) / M.
#[test]
fn meshes_that_would_get_too_flat() {
    let folder = of_layer(1);
    let sets = ["wear.move_mesh=0.1", "steps.slide.sliding={ distance = 4.75e6, jumps = 5 }"];
    let (code, text, summary) = run(folder.path(), "out", &sets);
    assert_eq!((code, &summary["mesh_moves"]), (Some(0), &4.into()), "{text}");
    assert_eq!(
        warned(&summary, &["no longer moved with wear in step \"slide\" after entry 5", "nine tenths"]),
        1,
        "{text}"
    );
    let left = [1.0, 1.0, 0.81, 0.62, 0.43, 0.24, 0.24];
    assert_eq!(entries(&summary).len(), left.len());
    for (found, left) in elastic(&summary).iter().zip(left) {
        assert!((found / (left * GIVES) - 1.0).abs() < 1e-8, "{found} {}", left * GIVES);
    }
    assert_eq!(entries(&summary)[6]["name"], "hold");
}

/// Truth: docs/scene.md: only the mesh of a finite-element body that wears can move. `wear.move_mesh` is at most 0.5. It is the
/// ratio of wear depth to element height that causes a move.
#[test]
fn moves_that_make_no_sense() {
    let folder = of_layer(1);
    for (sets, words) in [
        (["wear.move_mesh=0.6", "title=a"], "0.5"),
        (["wear.move_mesh=0.0", "title=a"], "move_mesh"),
        (["wear.move_mesh=0.2", "wear.share=0.0"], "needs a finite-element body that wears"),
    ] {
        let (code, text, _) = run(folder.path(), "out", &sets);
        assert!(code == Some(2) && text.contains(words), "{text}");
    }
    let mut program = crate::tools::orthowear();
    program.arg("check").arg(folder.path().join("scene.toml")).args(["--set", "wear.move_mesh=0.2"]);
    let text = String::from_utf8(program.output().unwrap().stdout).unwrap();
    assert!(
        text.contains(
            "the mesh of body1 is moved when the wear depth exceeds 0.2 of the height of its elements there"
        ),
        "{text}"
    );
}

/// Scene of a rigid sphere on a block, with cells of 0.3 mm. Wear increases the contact radius from 0.8 to 1.2 mm.
pub const SPHERE: &str = r#"
[materials.m]
model = "isotropic"
E = 1000.0
nu = 0.3
[body1]
kind = "fe"
material = "m"
mesh = "layer.msh"
contact = "top"
fixed = [{ group = "base" }]
[body2]
kind = "rigid"
[frame]
kind = "grid"
half_width = [1.2, 1.2]
cells = [8, 8]
[gap]
kind = "sphere"
radius = 10.0
[friction]
law = "coulomb"
mu = 0.3
[wear]
law = "archard"
i = 1e-6
move_mesh = 0.05
[[steps]]
name = "press"
normal_force = 80.0
wear = false
[[steps]]
name = "fret"
cycles = { count = 2000, amplitude = 0.3, jumps = 8 }
[[steps]]
name = "hold"
wear = false
"#;

/// Truth: a run with the large frame from the start gives the same results to 1e-6.
#[test]
fn frames_grow_over_moved_meshes() {
    let folder = place(SPHERE, &layer([2.4; 2], 1.2, [18, 18, 4]));
    let (code, text, grown) = run(folder.path(), "grown", &[]);
    assert_eq!(code, Some(0), "{text}");
    let large = ["frame.half_width=[1.8, 1.8]", "frame.cells=[12, 12]"];
    let (code, text, large) = run(folder.path(), "large", &large);
    assert_eq!(code, Some(0), "{text}");
    assert_eq!(grown["frame"], large["frame"]);
    assert!(warned(&grown, &["enlarged"]) == 1 && grown["mesh_moves"].as_u64() > Some(1), "{text}");
    assert_eq!(grown["mesh_moves"], large["mesh_moves"]);
    assert_eq!(entries(&grown).len(), entries(&large).len());
    for (a, b) in entries(&grown).iter().zip(entries(&large)) {
        for key in ["worn_volume", "contact_area", "approach", "max_wear_depth", "peak_pressure"] {
            let [a, b] = [a, b].map(|entry| number(entry, key));
            assert!((a - b).abs() <= 1e-6 * b.abs(), "{key}: {a} {b}");
        }
        assert_eq!(a["contact_touches_edge"], false);
    }
}
