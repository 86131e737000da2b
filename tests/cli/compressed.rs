//! Half-spaces on mesh frames with many cells, whose operator is compressed.

use std::fmt::Write;
use std::fs;
use std::path::Path;

use serde_json::Value;

use crate::tools::refusal;

const FACES: usize = 32;

/// Mesh of a plate with one layer of hexahedra, `FACES` of them along x and along y.
fn plate() -> String {
    let nodes = FACES + 1;
    let at = |i: usize, j: usize, k: usize| (k * nodes + i) * nodes + j + 1;
    let mut text = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n3\n2 1 \"base\"\n2 2 \"contact\"\n3 3 \"plate\"\n\
                    $EndPhysicalNames\n$Nodes\n"
        .to_owned();
    writeln!(text, "{}", 2 * nodes * nodes).unwrap();
    let along = |i: usize| {
        let x = 2.0 * i as f64 / FACES as f64 - 1.0;
        x * (0.6 + 0.4 * x * x)
    };
    for (i, j, k) in (0..2 * nodes * nodes).map(|n| (n / nodes % nodes, n % nodes, n / (nodes * nodes))) {
        writeln!(text, "{} {} {} {}", at(i, j, k), along(i), along(j), k as f64 - 1.0).unwrap();
    }
    writeln!(text, "$EndNodes\n$Elements\n{}", 3 * FACES * FACES).unwrap();
    let mut tag = 0;
    for (i, j) in (0..FACES * FACES).map(|n| (n / FACES, n % FACES)) {
        let level =
            |k| [at(i, j, k), at(i + 1, j, k), at(i + 1, j + 1, k), at(i, j + 1, k)].map(|n| n.to_string());
        for (kind, group, nodes) in
            [(3, 1, level(0).to_vec()), (3, 2, level(1).to_vec()), (5, 3, [level(0), level(1)].concat())]
        {
            tag += 1;
            writeln!(text, "{tag} {kind} 2 {group} {group} {}", nodes.join(" ")).unwrap();
        }
    }
    text + "$EndElements\n"
}

const SCENE: &str = r#"[materials.steel]
model = "isotropic"
E = 210e3
nu = 0.3
[body1]
kind = "fe"
material = "steel"
mesh = "plate.msh"
contact = "contact"
fixed = [{ group = "base" }]
[body2]
kind = "half-space"
material = "steel"
[frame]
kind = "mesh"
[gap]
kind = "sphere"
radius = 20.0
[friction]
law = "coulomb"
mu = 0.4
[[steps]]
name = "press"
approach = 0.006
[[steps]]
name = "shift"
shift = { distance = 0.001, angle = 30.0 }
"#;

fn call(command: &str, folder: &Path, options: &[&str]) -> (Option<i32>, String, String) {
    let mut program = crate::tools::orthowear();
    let output = program.arg(command).arg(folder.join("scene.toml")).args(options).output().unwrap();
    let text = |bytes| String::from_utf8(bytes).unwrap();
    (output.status.code(), text(output.stdout), text(output.stderr))
}

fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("plate.msh"), plate()).unwrap();
    fs::write(folder.path().join("scene.toml"), SCENE).unwrap();
    folder
}

/// Truth: docs/scene.md: above 1000 cells the operator of a half-space is compressed, unless `solver.skip` is false. Results with
/// and without compression agree within the tolerance of the compression.
#[test]
fn compressed_half_spaces_are_told_and_change_nothing() {
    let folder = folder();
    let (code, text, errors) = call("check", folder.path(), &[]);
    assert_eq!(code, Some(0), "{errors}");
    assert!(text.contains("its operator is compressed with the tolerance 1e-8"), "{text}");
    assert!(text.contains("compressed with the tolerance 1e-8 (solver.compression_tolerance)"), "{text}");
    let (_, text, _) = call("check", folder.path(), &["--set", "solver.skip=false"]);
    assert!(!text.contains("compressed with"), "{text}");
    let answer = |options: &[&str]| -> Value {
        let out = folder.path().join("out");
        let all = [&["--quiet", "--out", out.to_str().unwrap()], options].concat();
        let (code, _, errors) = call("run", folder.path(), &all);
        assert_eq!(code, Some(0), "{errors}");
        assert!(out.join("summary.json").exists() && fs::read_dir(&out).unwrap().count() > 3);
        serde_json::from_slice(&fs::read(out.join("summary.json")).unwrap()).unwrap()
    };
    let compressed = answer(&[]);
    let exact = answer(&["--set", "solver.skip=false"]);
    let told = |summary: &Value| {
        let entries = summary["skipped"].as_array().unwrap();
        entries
            .iter()
            .any(|entry| entry["why"].as_str().unwrap().contains("compressed with the tolerance 1e-8"))
    };
    assert!(told(&compressed) && !told(&exact));
    let coarse = answer(&["--set", "solver.compression_tolerance=1e-3"]);
    // The exact operator is checked by a direct solution of the plate, in the first entry only. The compressed operator is
    // checked in every step.
    let defect = |summary: &Value, step: usize| {
        summary["steps"][step].pointer("/certificate/operator_defect").and_then(Value::as_f64)
    };
    for step in 0..2 {
        let [fine, rough] = [&compressed, &coarse].map(|summary| defect(summary, step).unwrap());
        assert!(fine < 1e-8 && rough > 1e-9 && rough < 1e-3, "{fine} {rough}");
        assert_eq!(defect(&exact, step).is_some(), step == 0);
        let number =
            |summary: &Value, path: &str| summary["steps"][step].pointer(path).unwrap().as_f64().unwrap();
        let force = number(&exact, "/normal_force");
        for path in ["/normal_force", "/tangential_force/0", "/tangential_force/1"] {
            let wanted = number(&exact, path);
            assert!((number(&compressed, path) - wanted).abs() < 1e-8 * force, "{path}");
            let apart = (number(&coarse, path) - wanted).abs();
            assert!(
                apart < 1e-3 * force && (path != "/normal_force" || apart > 1e-11 * force),
                "{path}: {apart}"
            );
        }
    }
}

/// Truth: docs/scene.md: the tolerance of the compression lies between 1e-12 and 1e-2. If the compressed operator exceeds the
/// memory limit, the exit code is 4 and the message advises a larger tolerance.
#[test]
fn what_cannot_be_compressed_is_refused() {
    let folder = folder();
    for wrong in ["1e-13", "0.1", "0", "\"fine\""] {
        let (code, _, text) =
            call("check", folder.path(), &["--set", &format!("solver.compression_tolerance={wrong}")]);
        assert_eq!(code, Some(2), "{wrong}: {text}");
        assert!(text.contains("compression_tolerance"), "{wrong}: {text}");
    }
    let turned = SCENE
        .replace("body1", "meshed")
        .replace("body2", "body1")
        .replace("meshed", "body2")
        .replace("contact = \"contact\"", "contact = \"base\"")
        .replace("group = \"base\"", "group = \"contact\"");
    fs::write(folder.path().join("scene.toml"), turned).unwrap();
    let [needed, _, rest] = refusal(&call("check", folder.path(), &["--set", "solver.memory_limit=1000"]).2);
    let limit = format!("solver.memory_limit={}", (0.9 * needed + rest).round());
    for command in ["check", "run"] {
        let (code, _, text) = call(command, folder.path(), &["--set", &limit]);
        assert_eq!(code, Some(4), "{text}");
        assert!(refusal(&text)[1] < needed, "{text}");
        assert!(text.contains("the operator on 1024 cells needs"), "{text}");
        assert!(text.contains("raise solver.compression_tolerance, or raise solver.memory_limit"), "{text}");
    }
}
