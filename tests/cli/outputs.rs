//! Contents of the output directory after successful and failed runs.

use std::fs;
use std::path::Path;

use orthowear::error::{Error, ErrorKind};
use orthowear::evolution::observer::Observer;
use orthowear::evolution::records::{Divergence, FrameState, IncrementRecord, Outcome};
use orthowear::output::output_dir::OutputDir;
use orthowear::output::recorder::Recorder;
use orthowear::output::summary::{Summary, Units};

fn record(increment: usize) -> IncrementRecord {
    IncrementRecord { name: "indent".into(), increment, normal_force: 290.7, ..Default::default() }
}

/// Writes a run with the given outcome into `dir`. `extra` is the name of a further file with the content `text`. Returns the
/// summary of the run.
fn run_into(
    dir: &Path,
    increments: usize,
    extra: &str,
    text: &str,
    outcome: Result<Outcome, Error>,
) -> Summary {
    let mut output = OutputDir::open(dir).expect("an output directory");
    output
        .write(extra, |file| file.write_all(text.as_bytes()).map_err(|e| Error::resources(e.to_string())))
        .expect("a written file");
    let mut recorder = Recorder::writing_to(Some(output));
    for increment in 1..=increments {
        recorder.increment_done(&record(increment), &FrameState::default()).expect("a record");
    }
    let mut summary = Summary::new("test", "", Units::default());
    summary.set_outcome(&outcome);
    recorder.finish(&mut summary).expect("written results");
    summary
}

fn json(path: &Path) -> serde_json::Value {
    serde_json::from_slice(&fs::read(path).expect("a readable file")).expect("valid JSON")
}

fn names(dir: &Path) -> Vec<String> {
    let entries = fs::read_dir(dir).expect("a readable folder");
    let mut names: Vec<String> =
        entries.map(|entry| entry.expect("an entry").file_name().into_string().expect("UTF-8")).collect();
    names.sort();
    names
}

/// Truth: docs/results.md lists the files of a run. No temporary file remains.
#[test]
fn a_converged_run_leaves_its_files_and_nothing_else() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let out = dir.path().join("new/deep.out");
    run_into(&out, 2, "frame.pvd", "x", Ok(Outcome::Converged));
    assert_eq!(names(&out), ["frame.pvd", "history.csv", "summary.json"]);
    let summary = json(&out.join("summary.json"));
    assert_eq!(summary["status"], "converged");
    assert_eq!(summary["files"], serde_json::json!(["frame.pvd", "history.csv"]));
    assert_eq!(summary["steps"].as_array().map(Vec::len), Some(2));
    assert!(summary["peak_memory_bytes"].as_u64().is_some_and(|bytes| bytes > 0));
}

/// Truth: a run that does not converge keeps the files of the user, and moves the files of the earlier run to the folder
/// previous-1.
#[test]
fn a_run_that_does_not_converge_sets_earlier_results_aside() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    fs::write(dir.path().join("notes.txt"), "mine").expect("a written file");
    run_into(dir.path(), 3, "frame_0003.vtu", "good", Ok(Outcome::Converged));
    let before = fs::read(dir.path().join("summary.json")).expect("a summary");

    run_into(dir.path(), 1, "frame_0001.vtu", "bad", Ok(Outcome::NotConverged(Divergence::Iterations)));
    assert_eq!(json(&dir.path().join("summary.json"))["reason"], "iterations");
    assert_eq!(fs::read(dir.path().join("previous-1/summary.json")).expect("the earlier summary"), before);
    assert!(dir.path().join("previous-1/history.csv").exists());
    assert!(!dir.path().join("frame_0003.vtu").exists(), "an old field beside the new summary");
    assert_eq!(fs::read_to_string(dir.path().join("previous-1/frame_0003.vtu")).expect("kept"), "good");
    assert_eq!(fs::read_to_string(dir.path().join("notes.txt")).expect("untouched"), "mine");
}

/// Truth: a run that ends before its first increment leaves only its summary. The files of the earlier run are in the folder
/// previous-1.
#[test]
fn a_failed_run_leaves_only_its_summary() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    run_into(dir.path(), 1, "frame.pvd", "good", Ok(Outcome::Converged));
    for _ in 0..3 {
        let output = OutputDir::open(dir.path()).expect("an output directory");
        let mut summary = Summary::new("", "", Units::default());
        summary.set_failure(&Error::input("body1.mesh: no such file"));
        Recorder::writing_to(Some(output)).finish(&mut summary).expect("a written summary");
    }
    assert_eq!(names(dir.path()), ["previous-1", "summary.json"]);
    assert_eq!(names(&dir.path().join("previous-1")), ["frame.pvd", "history.csv", "summary.json"]);
    let summary = json(&dir.path().join("summary.json"));
    assert_eq!(
        (&summary["status"], &summary["error"]),
        (&"failed".into(), &"body1.mesh: no such file".into())
    );
}

/// Truth: a converged run removes the field files of the previous run, but not the files of the user.
#[test]
fn a_converged_run_removes_the_fields_of_the_run_before() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    fs::write(dir.path().join("frame_0009.vtu"), "mine").expect("a written file");
    run_into(dir.path(), 1, "frame_0002.vtu", "old", Ok(Outcome::Converged));
    run_into(dir.path(), 1, "frame_0001.vtu", "new", Ok(Outcome::Converged));
    assert_eq!(names(dir.path()), ["frame_0001.vtu", "frame_0009.vtu", "history.csv", "summary.json"]);
}

/// Truth: an output directory that is dropped before `finish` remains unchanged.
#[test]
fn a_dropped_run_leaves_no_trace() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let mut output = OutputDir::open(dir.path()).expect("an output directory");
    output.write("frame.pvd", |_| Ok(())).expect("a written file");
    drop(output);
    assert!(names(dir.path()).is_empty());
}

/// Truth: docs/checkpoints.md: a resumed run may end again before its next increment. It then keeps the files needed to resume,
/// and the entries of its summary. Files that were moved between the runs are found by their content.
#[test]
fn a_run_that_ends_before_it_goes_on_loses_nothing() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let content = |file: &mut dyn std::io::Write| {
        file.write_all(b"of the first run").map_err(|e| Error::resources(e.to_string()))
    };
    let mut output = OutputDir::open(dir.path()).expect("an output directory");
    output.write("frame_0001.vtu", content).expect("a written file");
    output.keep_staged_files().expect("a lasting folder");
    let files = output.files().to_vec();
    fs::write(dir.path().join("checkpoint-1.bin"), "of this run").expect("a written file");
    drop(output);
    let suspended = |dir: &Path| {
        let mut output = OutputDir::open(dir).expect("an output directory");
        assert!(output.restage(files.clone()).expect("readable files").is_empty(), "a file is missing");
        let mut summary = Summary::new("test", "", Units::default());
        summary.set_outcome(&Ok(Outcome::Interrupted));
        Recorder::writing_to(Some(output))
            .with_records(vec![record(1)])
            .finish(&mut summary)
            .expect("a summary");
        assert_eq!(json(&dir.join("summary.json"))["steps"].as_array().map(Vec::len), Some(1));
        assert!(dir.join(".incoming/frame_0001.vtu").exists() && dir.join("checkpoint-1.bin").exists());
    };
    suspended(dir.path());
    fs::rename(dir.path().join(".incoming/frame_0001.vtu"), dir.path().join("frame_0001.vtu"))
        .expect("moved");
    suspended(dir.path());
    fs::create_dir(dir.path().join("previous-1")).expect("a folder");
    let aside = dir.path().join("previous-1/frame_0001.vtu");
    fs::rename(dir.path().join(".incoming/frame_0001.vtu"), &aside).expect("moved");
    fs::write(dir.path().join("frame_0001.vtu"), "of another one..").expect("a file of the same length");
    suspended(dir.path());
    fs::remove_file(dir.path().join(".incoming/frame_0001.vtu")).expect("removed");
    fs::remove_file(aside).expect("removed");
    let missing = OutputDir::open(dir.path()).and_then(|mut output| output.restage(files.clone()));
    assert_eq!(missing.expect("readable files"), ["frame_0001.vtu"]);
}

/// Truth: docs/results.md: every outcome writes a summary, even if temporary files of the run have vanished.
#[test]
fn vanished_files_fail_the_run() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let mut output = OutputDir::open(dir.path()).expect("an output directory");
    output.write("frame.pvd", |_| Ok(())).expect("a written file");
    fs::remove_file(dir.path().join(".incoming/frame.pvd")).expect("removed");
    let mut summary = Summary::new("test", "", Units::default());
    summary.set_outcome(&Ok(Outcome::Converged));
    let error = output.finish(&mut summary).expect_err("a file is gone");
    assert!(error.exit_code() == 4 && error.to_string().contains("frame.pvd"), "{error}");
    let summary = json(&dir.path().join("summary.json"));
    assert_eq!((&summary["status"], &summary["files"]), (&"failed".into(), &serde_json::json!([])));
}

/// Truth: a result that is not finite makes the run fail with an error, and history.csv is not written.
#[test]
fn numbers_that_are_not_finite_are_never_written_silently() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let mut recorder = Recorder::writing_to(Some(OutputDir::open(dir.path()).expect("an output directory")));
    let wrong = IncrementRecord { peak_pressure: f64::NAN, ..record(1) };
    recorder.increment_done(&wrong, &FrameState::default()).expect("a record");
    let mut summary = Summary::new("", "", Units::default());
    summary.set_outcome(&Ok(Outcome::Converged));
    let error = recorder.finish(&mut summary).expect_err("not finite");
    assert_eq!(error.kind(), ErrorKind::Numerical);
    let written = json(&dir.path().join("summary.json"));
    assert_eq!(written["status"], "failed");
    assert!(written["error"].as_str().is_some_and(|text| text.contains("peak_pressure")), "{written}");
    assert_eq!(names(dir.path()), ["summary.json"]);
}

/// Truth: an output path that is a file is an input error. A directory that cannot be created is a resource error.
#[test]
fn places_that_cannot_be_written_are_named() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let file = dir.path().join("taken");
    fs::write(&file, "").expect("a written file");
    let error = OutputDir::open(&file).expect_err("a file");
    assert!(error.kind() == ErrorKind::Input && error.to_string().contains("taken"), "{error}");
    let error = OutputDir::open(&file.join("below")).expect_err("below a file");
    assert!(error.kind() == ErrorKind::Resources && error.to_string().contains("taken"), "{error}");
}

/// Truth: a full disk (/dev/full) is an error with exit code 4 that names the file.
#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_reported_with_the_path() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let mut output = OutputDir::open(dir.path()).expect("an output directory");
    let staging = dir.path().join(&names(dir.path())[0]);
    std::os::unix::fs::symlink("/dev/full", staging.join("history.csv")).expect("a link");
    let error = output
        .write("history.csv", |file| file.write_all(b"a").map_err(|e| Error::resources(e.to_string())))
        .expect_err("a full disk");
    assert_eq!((error.kind(), error.exit_code()), (ErrorKind::Resources, 4));
    let message = error.to_string();
    assert!(message.contains("history.csv") && message.contains("free some space"), "{message}");
}

fn program(out: &Path, more: &[&str]) -> std::process::Output {
    let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/sphere-on-cfrp-halfspaces.toml");
    let mut command = crate::tools::orthowear();
    command
        .arg("run")
        .arg(scene)
        .arg("--quiet")
        .arg("--out")
        .arg(out)
        .args(["--set", "frame.cells=[16, 16]"]);
    command.args(more).output().expect("the program starts")
}

/// Truth: forces in the summary equal the sums of traction times area over the cells. A Python script computes these sums from
/// the field files, which it reads by meshio.
#[test]
fn fields_and_summary_of_a_run_agree() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let output = program(dir.path(), &["--set", "output.fields=[\"vtu\", \"svg\"]"]);
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    let summary = json(&dir.path().join("summary.json"));
    let listed: Vec<&str> =
        summary["files"].as_array().expect("a list").iter().filter_map(|f| f.as_str()).collect();
    let mut there = names(dir.path());
    there.retain(|name| name != "summary.json");
    assert_eq!(
        {
            let mut sorted = listed.clone();
            sorted.sort_unstable();
            sorted
        },
        there
    );
    assert!(
        ["frame.pvd", "body1_0002.vtu", "pressure.svg", "history.csv"].iter().all(|f| listed.contains(f))
    );
    let _checked = crate::tools::python("resultants.py", dir.path());
}

/// Truth: the wear volume of each body is the sum of wear depth times area over the cells in its field file.
#[test]
fn both_bodies_have_their_worn_depth() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/sphere-wear.toml");
    let mut command = crate::tools::orthowear();
    command.arg("run").arg(scene).arg("--quiet").arg("--out").arg(dir.path());
    for set in ["frame.cells=[16, 16]", "wear.share=0.25", "output.fields=[\"vtu\", \"svg\"]"] {
        command.args(["--set", set]);
    }
    let output = command.output().expect("the program starts");
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    let _checked = crate::tools::python("worn.py", dir.path());
    let profiles = fs::read_to_string(dir.path().join("profiles.svg")).expect("profiles");
    assert!(["body 1", "body 2", "both", "q1"].iter().all(|name| profiles.contains(name)), "{profiles}");
    let there = names(dir.path());
    assert!(["slip.svg", "wear.svg"].iter().all(|name| there.iter().any(|file| file == name)), "{there:?}");
}

/// Truth: geometry. At a constant approach δ of a sphere of radius R, the wear volume tends to the overlap of the bodies, π δ² R.
#[test]
fn runs_in_which_nothing_is_left_to_wear() {
    let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/sphere-wear.toml");
    for wears in ["cycles={ count = 2_000_000_000, amplitude = 0.08 }", "sliding={ distance = 1e9 }"] {
        let dir = tempfile::tempdir().expect("a temporary folder");
        let text = fs::read_to_string(&scene).expect("a scene");
        let (before, _) = text.split_once("cycles = {").expect("cycles");
        let file = dir.path().join("scene.toml");
        fs::write(&file, format!("{before}{wears}\n")).expect("a written file");
        let mut command = crate::tools::orthowear();
        command.arg("run").arg(&file).arg("--quiet").arg("--out").arg(dir.path().join("out"));
        for set in ["frame.cells=[16, 16]", "frame.half_width=[2.0, 2.0]", "output.fields=[]"] {
            command.args(["--set", set]);
        }
        let output = command.output().expect("the program starts");
        assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
        let summary = fs::read(dir.path().join("out/summary.json")).expect("a summary");
        let summary: serde_json::Value = serde_json::from_slice(&summary).expect("JSON");
        let last = summary["steps"].as_array().and_then(|steps| steps.last()).expect("entries");
        let volume = last["worn_volume"].as_f64().expect("a number");
        let wanted = std::f64::consts::PI * 0.02 * 0.02 * 50.0;
        assert!((volume / wanted - 1.0).abs() < 0.02, "{volume} {wanted}");
    }
}

/// Truth: docs/results.md: an invalid scene and a run that does not converge keep the files of an earlier successful run.
#[test]
fn failures_of_the_program_lose_nothing() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    assert_eq!(program(dir.path(), &[]).status.code(), Some(0));
    let good: Vec<(String, Vec<u8>)> = names(dir.path())
        .into_iter()
        .map(|name| (name.clone(), fs::read(dir.path().join(&name)).expect("readable")))
        .collect();
    let kept = |number: usize| {
        for (name, content) in &good {
            let aside = dir.path().join(format!("previous-{number}")).join(name);
            let found = fs::read(if aside.exists() { aside } else { dir.path().join(name) }).expect("kept");
            assert!(&found == content, "{name} was changed");
        }
    };

    assert_eq!(program(dir.path(), &["--set", "gap.radius=-1.0"]).status.code(), Some(2));
    let summary = json(&dir.path().join("summary.json"));
    assert!(summary["status"] == "failed" && summary["error"].as_str().is_some_and(|e| e.contains("radius")));
    kept(1);

    assert_eq!(program(dir.path(), &[]).status.code(), Some(0));
    assert_eq!(program(dir.path(), &["--set", "solver.max_iterations=2"]).status.code(), Some(3));
    let summary = json(&dir.path().join("summary.json"));
    assert_eq!((&summary["status"], &summary["reason"]), (&"not-converged".into(), &"iterations".into()));
    assert_eq!(summary["steps"].as_array().map(Vec::len), Some(1), "the entries so far are kept");
}

/// Truth: results that cannot be written give exit code 4 and a message with the path.
#[cfg(target_os = "linux")]
#[test]
fn a_place_that_cannot_be_written_ends_with_code_4() {
    let output = program(Path::new("/proc/orthowear.out"), &[]);
    assert_eq!(output.status.code(), Some(4));
    let message = String::from_utf8_lossy(&output.stderr);
    assert!(message.contains("/proc/orthowear.out"), "{message}");
}

/// Exit code and standard error of the program, started by bash after the commands `limits`.
#[cfg(target_os = "linux")]
fn limited(limits: &str, arguments: &str) -> (Option<i32>, String) {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let line = format!("{limits} {} {arguments}", env!("CARGO_BIN_EXE_orthowear"));
    let output = std::process::Command::new("bash").current_dir(root).args(["-c", &line]).output().unwrap();
    (output.status.code(), String::from_utf8(output.stderr).unwrap())
}

/// Truth: docs/command-line.md: output that does not fit on the disk gives exit code 4. Output to a pipe that its reader has
/// closed is no error.
#[cfg(target_os = "linux")]
#[test]
fn output_that_does_not_fit_is_a_lack_of_resources() {
    for command in ["schema > /dev/full", "check scenes/hertz.toml > /dev/full"] {
        let (code, errors) = limited("", command);
        assert!(
            code == Some(4) && errors.contains("standard output cannot be written"),
            "{command}: {errors}"
        );
    }
    let (code, errors) = limited("", "schema | true; exit ${PIPESTATUS[0]}");
    assert_eq!(code, Some(0), "{errors}");
    let folder = tempfile::tempdir().unwrap();
    let run = format!("run scenes/hertz.toml --quiet --no-cache --out {}", folder.path().display());
    let (code, errors) = limited("ulimit -f 1;", &run);
    assert!(code == Some(4) && errors.contains("File too large"), "{errors}");
}

/// Truth: docs/command-line.md: 1024 threads with stacks of 8 MiB do not fit into an address space of 3 GB.
#[cfg(target_os = "linux")]
#[test]
fn threads_that_cannot_be_started_are_a_lack_of_resources() {
    let (code, errors) = limited("ulimit -v 3000000;", "check scenes/hertz.toml --threads 1024");
    assert!(code == Some(4) && errors.contains("--threads"), "{errors}");
}
