//! Runs of whole scenes: exit codes, options, and results compared with closed forms and an independent program.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Output;

use serde_json::Value;

use crate::tools::{timeless, usual_or_finest};

fn scene(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(name)
}

fn run(scene: &Path, out: &Path, options: &[&str]) -> Output {
    crate::tools::orthowear().arg("run").arg(scene).arg("--out").arg(out).args(options).output().unwrap()
}

fn summary(out: &Path) -> Value {
    serde_json::from_slice(&fs::read(out.join("summary.json")).unwrap()).unwrap()
}

/// Summary of a run that must converge.
fn converged(scene: &Path, options: &[&str]) -> Value {
    let out = tempfile::tempdir().unwrap();
    let output = run(scene, out.path(), options);
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    let summary = summary(out.path());
    assert_eq!(summary["status"], "converged");
    summary
}

/// Last entry of a step.
fn step<'a>(summary: &'a Value, name: &str) -> &'a Value {
    let steps = summary["steps"].as_array().unwrap();
    steps.iter().rev().find(|step| step["name"] == name).unwrap()
}

#[track_caller]
fn close(value: &Value, truth: f64, relative: f64) {
    let value = value.as_f64().unwrap();
    assert!(
        (value - truth).abs() <= relative * truth.abs(),
        "{value} instead of {truth} (within {relative:e})"
    );
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
kind = "rigid"
[frame]
kind = "grid"
half_width = [0.6, 0.6]
cells = [24, 24]
[gap]
kind = "sphere"
radius = 10.0
[[steps]]
name = "press"
approach = 0.01
[output]
fields = []
"#;

fn hertz(more: &str) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("hertz.toml");
    fs::write(&path, format!("{HERTZ}{more}")).unwrap();
    (folder, path)
}

/// Truth: Hertz (Johnson 1985, chapter 4). The approach agrees to 2e-3 and the peak pressure to 1e-2, the usual error of constant
/// cells with 50 cells across the contact. The contact area agrees to 4 %, half the area of the cells along the contact edge.
#[test]
fn hertz_scene() {
    let summary = converged(&scene("hertz.toml"), &["--set", "output.fields=[]"]);
    let press = step(&summary, "press");
    close(&press["normal_force"], 1000.0, 1e-6);
    close(&press["approach"], 0.010_184_09, 2e-3);
    close(&press["peak_pressure"], 4688.34, 1e-2);
    close(&press["contact_area"], 0.319_94, 0.04);
}

/// Truth: Cattaneo and Mindlin (Johnson 1985, section 7.2). Their solution is exact for nu = 0. The tangential displacement
/// agrees to 5e-3, the stick area to 4 %.
#[test]
fn cattaneo_mindlin_scene() {
    let summary = converged(&scene("cattaneo-mindlin.toml"), &["--set", "output.fields=[]"]);
    let (press, pull) = (step(&summary, "press"), step(&summary, "pull"));
    close(&pull["tangential_force"][0], 270.0, 1e-6);
    close(&pull["shift"][0], 0.004_051_92, 5e-3);
    close(&pull["stick_area"], 0.116_52, 0.04);
    // The bodies have equal elastic constants, so friction does not change the pressure.
    close(&pull["peak_pressure"], press["peak_pressure"].as_f64().unwrap(), 1e-6);
}

/// Truth: the forces of an independent program on 256 x 256 cells. The forces on 64 x 64 cells agree to 5e-4. The independent
/// program's own forces on these two grids differ by at most 3e-4.
#[test]
fn half_space_scene() {
    let summary = converged(&scene("sphere-on-cfrp-halfspaces.toml"), &["--set", "output.fields=[]"]);
    for (name, p, q) in [("indent", 417.878_59, -179.114_16), ("shift", 303.764_35, 131.648_51)] {
        let step = step(&summary, name);
        close(&step["normal_force"], p, 5e-4);
        close(&step["tangential_force"][0], q, 5e-4);
        assert!(step["tangential_force"][1].as_f64().unwrap().abs() < 1e-6 * p);
        assert!(step["certificate"]["natural_residual"].as_f64().unwrap() <= 1e-8);
    }
}

/// Truth: Hertz's load is (4/3) E* sqrt(R) approach^(3/2). Four times the radius R therefore gives twice the load. The contact
/// and the frame are twice as wide, so both discretised problems are similar and the ratio 2 is exact.
#[test]
fn overrides_change_the_scene() {
    let (_folder, path) = hertz("");
    let plain = converged(&path, &[]);
    let scaled = converged(
        &path,
        &[
            "--set",
            "gap.radius=40.0",
            "--set",
            "frame.half_width=[1.2, 1.2]",
            "--set",
            "steps.press.name=again",
        ],
    );
    let load = step(&plain, "press")["normal_force"].as_f64().unwrap();
    close(&step(&scaled, "again")["normal_force"], 2.0 * load, 1e-6);
    assert_ne!(plain["scene_sha256"], scaled["scene_sha256"]);
}

/// Truth: README: results do not depend on the number of threads, bit by bit. The cases are half-spaces with friction, wear of
/// 100 000 cycles on windows of the frame, and a finite-element block with each near field.
#[test]
fn threads_do_not_change_a_bit() {
    let (half_spaces, wear) = (scene("sphere-on-cfrp-halfspaces.toml"), scene("sphere-wear.toml"));
    let block = coarse_block("");
    let bare = ["--set", "output.fields=[]"];
    let mesh = ["--set", "body1.near_field=\"mesh\""];
    let jump = ["--set", "output.fields=[]", "--set", "steps.fretting.cycles.jumps=1"];
    for (path, options) in
        [(half_spaces.as_path(), &bare[..]), (&wear, &jump), (&block.1, &[]), (&block.1, &mesh)]
    {
        let run = |threads: &str| timeless(converged(path, &[options, &["--threads", threads]].concat()));
        let one = run("1");
        for threads in usual_or_finest(&["2", "3"][..], &["2", "3", "4"]) {
            assert_eq!(one, run(threads), "{} with {threads} threads", path.display());
        }
    }
}

/// Truth: docs/command-line.md: a run that does not converge has the exit code 3 and writes its summary.
#[test]
fn too_few_iterations() {
    let (folder, path) = hertz("");
    let out = folder.path().join("out");
    let output = run(&path, &out, &["--set", "solver.max_iterations=1"]);
    assert_eq!(output.status.code(), Some(3), "{}", String::from_utf8_lossy(&output.stderr));
    let summary = summary(&out);
    assert_eq!(summary["status"], "not-converged");
    assert_eq!(summary["reason"], "iterations");
}

/// Truth: docs/command-line.md: a failed run deletes no results in an output directory.
#[test]
fn a_failed_run_loses_nothing() {
    let (folder, path) = hertz("");
    let out = folder.path().join("hertz.out");
    let command = |options: &[&str]| {
        let mut command = crate::tools::orthowear();
        command.arg("run").arg(&path).args(options).output().unwrap()
    };
    assert_eq!(command(&[]).status.code(), Some(0));
    let (table, before) =
        (fs::read(out.join("history.csv")).unwrap(), fs::read(out.join("summary.json")).unwrap());
    let failed = command(&["--set", "gap.radius=-1"]);
    assert_eq!(failed.status.code(), Some(2));
    let after = summary(&out);
    assert_eq!(after["status"], "failed");
    assert!(after["error"].as_str().unwrap().contains("gap.radius"), "{after}");
    assert!(!out.join("history.csv").exists(), "old results beside the summary of a failed run");
    assert_eq!(fs::read(out.join("previous-1/history.csv")).unwrap(), table);
    assert_eq!(fs::read(out.join("previous-1/summary.json")).unwrap(), before);
}

/// Truth: docs/command-line.md: --quiet prints nothing if all is well.
#[test]
fn quiet_is_quiet() {
    let (folder, path) = hertz("");
    let output = run(&path, &folder.path().join("out"), &["--quiet"]);
    assert_eq!((output.status.code(), output.stdout.len(), output.stderr.len()), (Some(0), 0, 0));
}

/// Truth: docs/command-line.md: an interrupted run ends with exit code 130 and keeps its results so far.
#[cfg(unix)]
#[test]
fn an_interrupted_run_keeps_its_results() {
    for (delay, twice) in [(10, false), (60, true), (200, false), (700, true)] {
        assert_keeps_results(delay, twice);
    }
}

/// Interrupts a run `delay` ms after it has created its output directory. If `twice` is true, a second signal follows after 5 ms.
#[cfg(unix)]
fn assert_keeps_results(delay: u64, twice: bool) {
    let (folder, path) = hertz("");
    let out = folder.path().join("out");
    let mut child = std::process::Command::new(env!("CARGO_BIN_EXE_orthowear"))
        .env("ORTHOWEAR_CACHE_LIMIT", "0")
        .arg("run")
        .arg(&path)
        .arg("--out")
        .arg(&out)
        // The whole run would take far longer than the delay before the signal.
        .args(["--quiet", "--set", "frame.cells=[256, 256]", "--set", "steps.press.increments=100000"])
        .spawn()
        .unwrap();
    // The directory is created after the signal handlers are installed.
    let started = std::time::Instant::now();
    while !out.exists() && started.elapsed().as_secs() < 60 {
        std::thread::sleep(std::time::Duration::from_millis(20));
    }
    std::thread::sleep(std::time::Duration::from_millis(delay));
    // SAFETY: `kill` accesses no memory, and the child process has not been waited for.
    let interrupt = || unsafe { libc::kill(libc::pid_t::try_from(child.id()).unwrap(), libc::SIGINT) };
    interrupt();
    // Some programs send a signal to a process and then to its process group. The process then gets the signal twice.
    if twice {
        std::thread::sleep(std::time::Duration::from_millis(5));
        interrupt();
    }
    assert_eq!(child.wait().unwrap().code(), Some(130));
    assert_eq!(summary(&out)["status"], "interrupted");
}

fn coarse_block(more: &str) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("block.toml");
    let mesh = Path::new(env!("CARGO_MANIFEST_DIR")).join("meshes/cfrp-block-coarse.msh");
    let text = format!(
        r#"
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
fibre = {{ tilt = 30.0 }}
mesh = '{}'
contact = "contact"
fixed = [{{ group = "base" }}]
{more}
[body2]
kind = "rigid"
[frame]
kind = "grid"
half_width = [1.2, 1.2]
cells = [8, 8]
[gap]
kind = "sphere"
radius = 50.0
[friction]
law = "frp"
mu_L = 0.4
mu_T = 0.5
mu_N = 0.55
[[steps]]
name = "indent"
approach = 0.02
[output]
fields = []
"#,
        mesh.display()
    );
    fs::write(&path, text).unwrap();
    (folder, path)
}

/// Truth: docs/scene.md: mistakes that only the mesh reveals are reported with key and fix.
#[test]
fn what_the_mesh_does_not_have() {
    let (folder, path) = coarse_block("");
    for (options, words) in [
        (&["--set", "body1.contact=contct"][..], &["body1.contact", "\"contct\"", "contact"][..]),
        (&["--set", "body1.contact=block"], &["body1.contact", "surfaces"]),
        (&["--set", "body1.fixed.0.group=bottom"], &["body1.fixed.0.group", "\"bottom\"", "base"]),
        (
            &["--set", "body1.fixed.0.components=[\"x\"]"],
            &["steps.0.approach", "body 1 is unconstrained: translation y"],
        ),
        (&["--set", "body1.element=tet4"], &["body1.element", "has no elements of that type"]),
        (&["--set", "frame.half_width=[30.0, 30.0]"], &["frame.half_width", "body1"]),
        (
            &["--set", "body1.contact=a", "--set", "body1.fixed.0.group=b", "--set", "gap.radius=-1"],
            &["body1.contact", "body1.fixed.0.group", "gap.radius", "3 errors"],
        ),
    ] {
        let checked = crate::tools::orthowear().arg("check").arg(&path).args(options).output().unwrap();
        let ran = run(&path, &folder.path().join("out"), options);
        for output in [checked, ran] {
            let text = String::from_utf8(output.stderr).unwrap();
            assert_eq!(output.status.code(), Some(2), "{options:?}\n{text}");
            for word in words {
                assert!(text.contains(word), "{options:?} lacks \"{word}\":\n{text}");
            }
        }
    }
}

/// Truth: docs/command-line.md: `check` reports the planned computation, and computes nothing.
#[test]
fn check_tells_the_plan() {
    for (name, words) in [
        (
            "sphere-on-cfrp-block.toml",
            &["512 solid cells", "1944 unknowns", "128 x 128 = 16384 cells", "8 jumps"][..],
        ),
        (
            "hertz.toml",
            &["rigid", "half-space, steel", "normal force 1000", "tangential unknowns in step \"press\""],
        ),
        ("cattaneo-mindlin.toml", &["tangential force (270, 0)"]),
        ("sphere-on-cfrp-halfspaces.toml", &["64 x 64 = 4096 cells", "ellipse 0.45000 x 0.51667"]),
        ("steel-cap-on-cfrp-block.toml", &["body 2", "7840 solid cells"]),
    ] {
        // The output directory may exist already, with results of earlier runs.
        let results = scene(name).with_extension("out");
        let written = || fs::metadata(&results).and_then(|found| found.modified()).ok();
        let before = written();
        let output = crate::tools::orthowear().arg("check").arg(scene(name)).output().unwrap();
        let text = String::from_utf8(output.stdout).unwrap();
        assert_eq!(output.status.code(), Some(0), "{name}: {}", String::from_utf8_lossy(&output.stderr));
        for word in words.iter().chain(&["memory", "time", "skipped", "no errors found"]) {
            assert!(text.contains(word), "{name} lacks \"{word}\":\n{text}");
        }
        assert_eq!(written(), before, "check leaves results");
    }
}

/// Truth: omitted work changes results by less than the tolerance of the solution.
#[test]
fn skips_do_not_change_answers() {
    let (_folder, path) = hertz("[friction]\nlaw = \"none\"\n");
    let with = converged(&path, &["--set", "solver.tolerance=1e-11"]);
    let without = converged(&path, &["--set", "solver.tolerance=1e-11", "--set", "solver.skip=false"]);
    assert!(!with["skipped"].as_array().unwrap().is_empty());
    let load = step(&with, "press")["normal_force"].as_f64().unwrap();
    close(&step(&without, "press")["normal_force"], load, 1e-9);
}

/// Truth: docs/scene.md explains every key of the schema.
#[test]
fn every_key_is_explained() {
    let output = crate::tools::orthowear().arg("schema").output().unwrap();
    assert_eq!(output.status.code(), Some(0));
    let schema: Value = serde_json::from_slice(&output.stdout).unwrap();
    let text = fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/scene.md")).unwrap();
    let (mut keys, mut words) = (Vec::new(), Vec::new());
    collect(&schema, &mut keys, &mut words);
    assert!(keys.len() > 60 && words.len() > 25, "{} keys, {} words", keys.len(), words.len());
    for key in keys {
        assert!(text.contains(&format!("`{key}`")), "docs/scene.md does not explain `{key}`");
    }
    for word in words {
        assert!(text.contains(&format!("\"{word}\"")), "docs/scene.md does not explain \"{word}\"");
    }
}

fn collect(schema: &Value, keys: &mut Vec<String>, words: &mut Vec<String>) {
    match schema {
        Value::Object(object) => {
            if let Some(Value::Object(properties)) = object.get("properties") {
                keys.extend(properties.keys().cloned());
            }
            words.extend(object.get("const").and_then(Value::as_str).map(str::to_owned));
            object.values().for_each(|inner| collect(inner, keys, words));
        }
        Value::Array(items) => items.iter().for_each(|inner| collect(inner, keys, words)),
        _ => {}
    }
}
