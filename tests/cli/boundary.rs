//! Finite bodies of boundary elements: results compared with finite elements, and invalid surfaces.

use std::fs;
use std::path::Path;

use crate::moved::layer;
use crate::near_field::{call, force, run};

pub(crate) const SCENE: &str = r#"
[materials.steel]
model = "isotropic"
E = 210e3
nu = 0.3
[body1]
kind = "be"
material = "steel"
mesh = "block.msh"
contact = "top"
fixed = [{ group = "base" }]
element = "constant"
[body2]
kind = "rigid"
[frame]
kind = "grid"
half_width = [1.0, 1.0]
cells = [8, 8]
[gap]
kind = "sphere"
radius = 50.0
[friction]
law = "coulomb"
mu = 0.3
[[steps]]
name = "press"
approach = 0.01
[[steps]]
name = "pull"
shift = { distance = 0.002, angle = 20.0 }
[output]
fields = ["vtu"]
"#;

fn place(mesh: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("scene.toml"), SCENE).unwrap();
    fs::write(folder.path().join("block.msh"), mesh).unwrap();
    folder
}

/// Returns the mesh with each line of its elements replaced by the result of `change`. A result of `None` removes the line.
fn elements(mesh: &str, change: impl Fn(usize, &str) -> Option<String>) -> String {
    let (head, rest) = mesh.split_once("$Elements\n").unwrap();
    let list: Vec<String> = rest
        .lines()
        .skip(1)
        .take_while(|line| !line.starts_with('$'))
        .enumerate()
        .filter_map(|(i, line)| change(i, line))
        .collect();
    format!("{head}$Elements\n{}\n{}\n$EndElements\n", list.len(), list.join("\n"))
}

fn surface(mesh: &str) -> String {
    elements(mesh, |_, line| (line.split(' ').nth(1) == Some("3")).then(|| line.to_owned()))
}

pub(crate) fn block() -> String {
    layer([2.0, 2.0], 2.0, [16, 16, 8])
}

fn grids(folder: &Path) -> Vec<String> {
    let all = fs::read_dir(folder.join("scene.out")).unwrap().map(|entry| entry.unwrap().file_name());
    all.map(|name| name.into_string().unwrap()).filter(|name| name.ends_with(".vtu")).collect()
}

/// Truth: a finite-element model of the same block (docs/theory-hybrid.md) gives the same forces to 3 %. The sides of the
/// constant boundary elements are about a third of the contact radius. A mesh file with surface elements only gives the same
/// forces as a mesh file with solids, to 1e-6.
#[test]
fn the_block_of_finite_elements() {
    let folder = place(&block());
    let by_boundary = run(folder.path(), &[]);
    assert!(grids(folder.path()).iter().any(|name| name.starts_with("body1")), "{:?}", grids(folder.path()));
    let record = &by_boundary["boundary_elements"][0];
    assert_eq!(record["elements"], 2 * 16 * 16 + 4 * 16 * 8);
    assert_eq!(record["unknowns"].as_u64(), record["elements"].as_u64().map(|n| 3 * n));
    assert!(
        record["asymmetry"].as_f64().unwrap() < 0.05 && record["residual"].as_f64().unwrap() < 1e-12,
        "{record}"
    );
    fs::write(folder.path().join("block.msh"), surface(&block())).unwrap();
    let of_surface = run(folder.path(), &[]);
    let said = of_surface["warnings"].to_string();
    assert!(said.contains("pointed into the body and were reversed"), "{said}");
    fs::write(folder.path().join("block.msh"), block()).unwrap();
    let scene = SCENE.replace("kind = \"be\"", "kind = \"fe\"").replace("element = \"constant\"\n", "");
    fs::write(folder.path().join("scene.toml"), scene).unwrap();
    let by_finite = run(folder.path(), &["frame.cells=[16,16]"]);
    for step in 0..2 {
        let [found, same, wanted] =
            [&by_boundary, &of_surface, &by_finite].map(|summary| force(summary, step));
        for c in 0..3 {
            assert!((found[c] - same[c]).abs() < 1e-6 * found[0], "{found:?} {same:?}");
            assert!((found[c] - wanted[c]).abs() < 0.03 * wanted[0], "{found:?} {wanted:?}");
        }
    }
}

/// Truth: equilibrium. A block between smooth walls is free along z. A rigid plane on its top carries the pressures on its base:
/// 30 MPa in the first step, 45 MPa in the second step.
#[test]
fn loads_of_several_names() {
    let folder = place(&layer([1.0, 1.0], 1.0, [4, 4, 3]));
    let loads = "fixed = [{ group = \"x\", components = [\"x\"] }, { group = \"y\", components = [\"y\"] }]\n\
                 pressure = [{ group = \"base\", value = 30.0, name = \"one\" }, { group = \"base\", value = 10.0, name = \"other\" }]";
    let steps =
        "[[steps]]\nnormal_force = 0.0\nloads = { other = 0.0 }\n[[steps]]\nloads = { other = 1.5 }\n";
    let scene = SCENE
        .replace("fixed = [{ group = \"base\" }]", loads)
        .replace("kind = \"sphere\"\nradius = 50.0", "kind = \"flat\"")
        .replace("element = \"constant\"", "element = \"linear\"")
        .replace("cells = [8, 8]", "cells = [4, 4]");
    let scene = scene.split("[friction]").next().unwrap().to_owned() + steps;
    fs::write(folder.path().join("scene.toml"), scene).unwrap();
    let summary = run(folder.path(), &[]);
    for (step, wanted) in [(0, 30.0), (1, 45.0)] {
        let peak = summary["steps"][step]["peak_pressure"].as_f64().unwrap();
        assert!((peak / wanted - 1.0).abs() < 1e-4, "{peak} {wanted}");
    }
}

/// Truth: equilibrium. A block between smooth walls is free along z. The pressure of 40 MPa on its base of 4 mm² acts uniformly
/// on the rigid plane on its top. With friction the scene is refused (docs/theory-boundary-elements.md).
#[test]
fn a_block_that_floats() {
    let folder = place(&layer([1.0, 1.0], 1.0, [4, 4, 3]));
    let walls = "fixed = [{ group = \"x\", components = [\"x\"] }, { group = \"y\", components = [\"y\"] }]\n\
                 pressure = [{ group = \"base\", value = 40.0 }]";
    let scene = SCENE
        .replace("fixed = [{ group = \"base\" }]", walls)
        .replace("kind = \"sphere\"\nradius = 50.0", "kind = \"flat\"")
        .replace("approach = 0.01", "normal_force = 0.0");
    let scene = scene.split("[[steps]]\nname = \"pull\"").next().unwrap().to_owned();
    fs::write(folder.path().join("scene.toml"), scene).unwrap();
    let sets = ["output.fields=[]", "frame.cells=[4,4]", "body1.element=\"linear\""];
    let (code, text) = call("check", folder.path(), &sets);
    assert_eq!(code, Some(2), "{text}");
    assert!(
        text.contains("unconstrained rigid-body modes (translation z), which friction does not allow"),
        "{text}"
    );
    let summary = run(folder.path(), &[&sets[..], &["friction={law=\"none\"}"]].concat());
    let step = &summary["steps"][0];
    let [load, peak] = ["normal_force", "peak_pressure"].map(|key| step[key].as_f64().unwrap());
    assert!((load - 160.0).abs() < 1e-3 && (peak - 40.0).abs() < 1e-3, "{load} {peak}");
    // A normal force of the step replaces the pressure on the base.
    let pressed = ["friction={law=\"none\"}", "body1.pressure=[]", "steps.0.normal_force=160.0"];
    let other = run(folder.path(), &[&sets[..], &pressed].concat());
    let load = other["steps"][0]["normal_force"].as_f64().unwrap();
    assert!((load - 160.0).abs() < 1e-3, "{load}");
    let said = summary["warnings"].to_string();
    assert!(said.contains("unconstrained rigid-body modes (translation z)"), "{said}");
}

/// Truth: each scene has one mistake. `check` and `run` refuse the scene with a message about this mistake.
#[test]
fn surfaces_and_supports_that_are_wrong() {
    let refused = |mesh: &str, sets: &[&str], words: &[&str]| {
        let folder = place(mesh);
        for verb in ["check", "run"] {
            let (code, text) = call(verb, folder.path(), sets);
            let text = text.split_whitespace().filter(|word| *word != "│").collect::<Vec<_>>().join(" ");
            assert_eq!(code, Some(2), "{verb} {words:?}: {text}");
            assert!(words.iter().all(|word| text.contains(word)), "{verb} {words:?}: {text}");
        }
    };
    let small = layer([2.0, 2.0], 2.0, [8, 8, 4]);
    let cells = "frame.cells=[4,4]";
    let skin = surface(&small);
    let open = elements(&skin, |i, line| (i > 0).then(|| line.to_owned()));
    refused(&open, &[cells], &["is open at 4 edges", "body1.mesh"]);
    let turned = elements(&skin, |i, line| {
        let words: Vec<&str> = line.split(' ').collect();
        Some(if i == 20 {
            [&words[..5], &[words[8], words[7], words[6], words[5]]].concat().join(" ")
        } else {
            line.to_owned()
        })
    });
    refused(&turned, &[cells], &["inconsistently oriented", "4 edges", "21"]);
    refused(&small, &[cells, "body1.fixed=[{group=\"body\"}]"], &["body1.fixed.0", "volumes"]);
    refused(&small, &[cells, "body1.fixed=[{group=\"top\"}]"], &["fixes faces under the contact frame"]);
    refused(&small, &[cells, "solver.coupling=\"block\""], &["solver.coupling", "boundary elements"]);
    refused(&small, &[cells, "body1.contact=\"base\""], &["is oriented towards"]);
    refused(&small, &[cells, "body1.near_field=\"mesh\""], &["near_field"]);
    let displaced = "body1.displaced=[{group=\"base\",components=[\"z\"],value=[0.1]}]";
    refused(&small, &[cells, displaced], &["prescribe different displacements along z"]);
}

/// Truth: a body that exceeds the memory limit is refused.
#[test]
fn too_little_memory() {
    let folder = place(&block());
    for verb in ["check", "run"] {
        let (code, text) = call(verb, folder.path(), &["solver.memory_limit=60000000"]);
        let text = text.split_whitespace().collect::<Vec<_>>().join(" ");
        assert_eq!(code, Some(4), "{text}");
        assert!(text.contains("boundary-element body of 3072 unknowns") && text.contains("memory"), "{text}");
    }
}
