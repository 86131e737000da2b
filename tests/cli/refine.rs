//! `orthowear refine`: size fields for gmsh from the estimated error, compared with uniform refinement.

use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;

use super::tools::gmsh;

/// Settings of all runs: no friction, no wear, 16 x 16 cells, estimated error, near field of the mesh.
const SETTINGS: [&str; 5] = [
    "friction={law=\"none\"}",
    "wear={law=\"none\"}",
    "frame.cells=[16, 16]",
    "output.fields=[\"error\"]",
    "body1.near_field=\"mesh\"",
];

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn program(verb: &str, scene: &Path, mesh: &Path) -> Command {
    let mut command = crate::tools::orthowear();
    command.arg(verb).arg(scene).args(["--set", &format!("body1.mesh=\"{}\"", mesh.display())]);
    SETTINGS.iter().for_each(|setting| {
        command.args(["--set", setting]);
    });
    command
}

/// Writes `sphere-on-cfrp-block.toml` with its first step only into `folder`. Returns the path.
fn scene(folder: &Path) -> PathBuf {
    let text = std::fs::read_to_string(root().join("scenes/sphere-on-cfrp-block.toml")).unwrap();
    let second = text.match_indices("[[steps]]").nth(1).unwrap().0;
    let rest = text.find("[solver]").or(text.find("[output]")).map_or("", |start| &text[start..]);
    let path = folder.join("block.toml");
    std::fs::write(&path, format!("{}{rest}", &text[..second])).unwrap();
    path
}

fn mesh(folder: &Path, name: &str, arguments: &[&str]) -> Option<PathBuf> {
    let out = folder.join(name);
    let geo = root().join("meshes/cfrp-tets.geo");
    let mut all = vec!["-3", "-nt", "1", "-v", "1", "-format", "msh22", "-bin"];
    all.extend(arguments);
    all.extend(["-o", out.to_str().unwrap(), geo.to_str().unwrap()]);
    gmsh(&all, folder).then_some(out)
}

/// Number of displacement unknowns, normal force in N, and estimated relative error of a run with the given mesh.
fn solve(folder: &Path, scene: &Path, mesh: &Path) -> (usize, f64, f64) {
    let out = folder.join("out");
    let output = program("run", scene, mesh).arg("--out").arg(&out).output().unwrap();
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    let summary: Value = serde_json::from_slice(&std::fs::read(out.join("summary.json")).unwrap()).unwrap();
    let points = orthowear::mesh::gmsh::read(mesh).unwrap().n_points();
    let error = summary["bodies"][0]["error"]["relative"].as_f64().unwrap();
    (3 * points, summary["steps"][0]["normal_force"].as_f64().unwrap(), error)
}

/// Truth: displacement finite elements are too stiff. Of two loads for the same approach, the smaller load is closer to the exact
/// load. After three rounds of refinement, load and estimated error are smaller than with a uniform mesh of at least as many
/// unknowns.
#[test]
fn the_size_field_beats_uniform_refinement() {
    let folder = tempfile::tempdir().unwrap();
    let (folder, scene) = (folder.path(), scene(folder.path()));
    let Some(mut current) = mesh(folder, "round0.msh", &[]) else { return };
    let uniform = mesh(folder, "uniform.msh", &["-setnumber", "size", "2"]).unwrap();
    let field = folder.join("size.pos");
    for round in 1..=3 {
        let output = program("refine", &scene, &current).arg("--out").arg(&field).output().unwrap();
        let text = String::from_utf8_lossy(&output.stdout);
        assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
        println!("{text}");
        assert!(text.contains("refine the mesh there") && text.contains("-bgm"), "{text}");
        let arguments = [
            "-bgm",
            field.to_str().unwrap(),
            "-setnumber",
            "Mesh.CharacteristicLengthFromPoints",
            "0",
            "-setnumber",
            "Mesh.CharacteristicLengthExtendFromBoundary",
            "0",
        ];
        current = mesh(folder, &format!("round{round}.msh"), &arguments).unwrap();
    }
    let start = solve(folder, &scene, &folder.join("round0.msh"));
    let (adapted, uniform) = (solve(folder, &scene, &current), solve(folder, &scene, &uniform));
    println!("unknowns, load, error: start {start:.4?}, uniform {uniform:.4?}, adapted {adapted:.4?}");
    assert!(adapted.0 <= uniform.0, "unknowns {} {}", adapted.0, uniform.0);
    assert!(adapted.1 < uniform.1 && uniform.1 < start.1);
    assert!(adapted.2 < 0.8 * uniform.2 && uniform.2 < start.2);
}

/// Truth: docs/command-line.md: impossible requests are refused before any computation.
#[test]
fn refine_refuses_what_it_cannot_do() {
    let refused = |scene: &str, arguments: &[&str]| {
        let mut command = crate::tools::orthowear();
        command.arg("refine").arg(root().join("scenes").join(scene)).args(arguments);
        let output = command.output().unwrap();
        assert_eq!(output.status.code(), Some(2));
        String::from_utf8(output.stderr).unwrap()
    };
    assert!(refused("hertz.toml", &[]).contains("the scene has no finite-element body"));
    assert!(
        refused("sphere-on-cfrp-block.toml", &["--body", "2"])
            .contains("body 2 is not a finite-element body")
    );
    assert!(refused("sphere-on-cfrp-block.toml", &["--step", "press"]).contains("indent, shift, fretting"));
    assert!(refused("sphere-on-cfrp-block.toml", &["--error", "2"]).contains("between 0 and 1"));
    let cycles =
        ["--set", "steps=[{ name = \"rub\", approach = 0.01, cycles = { count = 10, amplitude = 0.01 } }]"];
    assert!(refused("sphere-on-cfrp-block.toml", &cycles).contains("the first step, `rub`, has cycles"));
    assert!(refused("steel-cap-on-cfrp-block.toml", &["--out", "x.pos"]).contains("--body 1 or --body 2"));
}
