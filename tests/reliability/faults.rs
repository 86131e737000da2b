//! Runs in which a file operation fails or the program is killed, for one operation after the other.
//!
//! A preloaded library (`failing.c`) makes the n-th operation on files of the output directory fail. Names after
//! "Truth" are cases of docs/verification.md.
#![cfg(target_os = "linux")]

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

use orthowear::output::checkpoint;
use serde_json::Value;

use crate::checkpoints::{SCENE, orthowear};

fn library() -> &'static Path {
    static LIBRARY: OnceLock<PathBuf> = OnceLock::new();
    LIBRARY.get_or_init(|| {
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR"));
        let path = folder.join(format!("failing-{}.so", std::process::id()));
        let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/reliability/failing.c");
        let made = Command::new("cc")
            .args(["-shared", "-fPIC", "-O1", "-o"])
            .arg(&path)
            .arg(source)
            .arg("-ldl")
            .output();
        let made = made.expect("the C compiler starts");
        assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
        path
    })
}

struct Job {
    folder: tempfile::TempDir,
    out: PathBuf,
}

/// Exit code of a run (`None` if the run was killed), and its output.
type Ended = (Option<i32>, String);

impl Job {
    fn new() -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        let scene =
            SCENE.replace("[60.0, 0.0]", "[10.0, 0.0]").replace("fields = []", "fields = [\"vtu\", \"svg\"]");
        fs::write(folder.path().join("scene.toml"), scene).expect("a file");
        let out = folder.path().join("out");
        Self { folder, out }
    }

    fn command(&self, more: &[&str]) -> Command {
        let mut command = orthowear();
        command.arg("run").arg(self.folder.path().join("scene.toml")).arg("--out").arg(&self.out).args(more);
        command.args(["--threads", "1"]);
        // The library also omits the flush of files to the disk, which saves time.
        command.env("LD_PRELOAD", library()).env("FAULT_UNDER", &self.out);
        command
    }

    fn run(&self, more: &[&str]) -> Ended {
        ended(self.command(more))
    }

    fn fail(&self, mode: &str, at: u64) -> Ended {
        let mut command = self.command(&["--quiet"]);
        command.env("FAULT_MODE", mode).env("FAULT_AT", at.to_string());
        ended(command)
    }

    /// Contents of the result files by name, without times and memory.
    fn results(&self) -> BTreeMap<String, Vec<u8>> {
        let files = fs::read_dir(&self.out).into_iter().flatten().map(|entry| entry.expect("an entry"));
        let files = files.filter(|entry| entry.file_type().is_ok_and(|is| is.is_file()));
        let named = files.map(|file| (file.file_name().to_string_lossy().into_owned(), file.path()));
        let results =
            named.filter(|(name, _)| !name.starts_with('.') && !checkpoint::FILES.contains(&name.as_str()));
        results.map(|(name, path)| (name.clone(), timeless(&name, fs::read(path).expect("a file")))).collect()
    }
}

fn ended(mut command: Command) -> Ended {
    let output = command.output().expect("a run");
    (output.status.code(), String::from_utf8_lossy(&[output.stdout, output.stderr].concat()).into_owned())
}

fn timeless(name: &str, bytes: Vec<u8>) -> Vec<u8> {
    match name {
        "summary.json" => {
            let mut summary: Value = serde_json::from_slice(&bytes).expect("a whole summary");
            let fields = summary.as_object_mut().expect("fields");
            fields.remove("timings");
            fields.remove("peak_memory_bytes");
            fields["steps"]
                .as_array_mut()
                .expect("entries")
                .iter_mut()
                .for_each(|step| step["seconds"] = Value::Null);
            summary.to_string().into_bytes()
        }
        "history.csv" => {
            let text = String::from_utf8(bytes).expect("a text");
            let place =
                text.lines().next().and_then(|line| line.split(',').position(|name| name == "seconds"));
            let row = |line: &str| {
                let cells = line.split(',').enumerate().filter(|(i, _)| Some(*i) != place);
                cells.map(|(_, cell)| cell).collect::<Vec<_>>().join(",")
            };
            text.lines().map(row).collect::<Vec<_>>().join("\n").into_bytes()
        }
        _ => bytes,
    }
}

/// Results of the undisturbed run, and the number of its file operations.
fn whole() -> &'static (BTreeMap<String, Vec<u8>>, u64) {
    static WHOLE: OnceLock<(BTreeMap<String, Vec<u8>>, u64)> = OnceLock::new();
    WHOLE.get_or_init(|| {
        let job = Job::new();
        let count = job.folder.path().join("count");
        let mut command = job.command(&[]);
        command.env("FAULT_COUNT", &count);
        let (code, text) = ended(command);
        assert_eq!(code, Some(0), "{text}");
        let n = fs::read_to_string(count).expect("a count").parse().expect("a number");
        assert!(n > 100, "{n} operations");
        (job.results(), n)
    })
}

/// Runs the program with the fault `mode` at one file operation per run, and resumes each run. The operations have the
/// smallest stride that gives at most `most` runs. With `ORTHOWEAR_FUZZ_SECONDS`, all operations are tested.
fn at_each(mode: &str, most: u64, check: impl Fn(&Job, u64, Ended)) {
    let n = whole().1;
    let all = std::env::var_os("ORTHOWEAR_FUZZ_SECONDS").is_some();
    let stride = if all { 1 } else { n.div_ceil(most) };
    for at in (1..=n).rev().step_by(stride as usize) {
        let job = Job::new();
        let ended = job.fail(mode, at);
        check(&job, at, ended);
        resumed(&job, &format!("{mode} at operation {at}"));
    }
}

fn resumed(job: &Job, what: &str) {
    let (code, text) = job.run(&["--resume"]);
    assert!(code == Some(0) && !text.contains("damaged"), "{what}: {text}");
    let found = job.results();
    let differing: Vec<&String> = whole()
        .0
        .iter()
        .filter(|(name, content)| found.get(*name) != Some(content))
        .map(|(name, _)| name)
        .collect();
    assert!(differing.is_empty(), "{what}: {differing:?} differ");
    // A converged run is not resumed. Hidden temporary files that it could not remove therefore remain.
    let hidden = fs::read_dir(&job.out).expect("a folder").map(|entry| entry.expect("an entry").file_name());
    let left: Vec<_> = hidden.filter(|name| name.to_string_lossy().starts_with('.')).collect();
    assert!(left.is_empty() || text.contains("already converged"), "{what}: {left:?} are left");
}

/// Asserts that a failed operation is reported with exit code 4, or does not change the results. No incomplete file may
/// have a final name.
fn told(job: &Job, at: u64, (code, text): Ended) {
    let place = job.out.display().to_string();
    match code {
        Some(0) => assert!(job.results() == whole().0, "operation {at}: other results"),
        Some(4) => assert!(text.contains(&place) && text.contains("No space left"), "operation {at}: {text}"),
        _ => panic!("operation {at}: {code:?} {text}"),
    }
    for (name, content) in job.results() {
        // Collections and tables of an unfinished run may be shorter. The fields of an entry must be complete.
        let text = String::from_utf8_lossy(&content);
        let is_whole = match name.rsplit('.').next() {
            Some("pvd") => text.trim_end().ends_with("</VTKFile>"),
            Some("svg") => text.trim_end().ends_with("</svg>"),
            Some("csv" | "json") => !content.is_empty(),
            _ => whole().0.get(&name) == Some(&content),
        };
        assert!(is_whole, "operation {at}: half of {name}");
    }
    let found = checkpoint::read(&job.out).unwrap_or_else(|error| panic!("operation {at}: {error}"));
    assert!(found.is_none_or(|found| found.warnings.is_empty()), "operation {at}: a damaged checkpoint");
}

/// Truth (rel-disk-full): a failing file operation is reported with path, reason and exit code 4, or has no effect.
/// After `--resume`, the run has the results of the undisturbed run.
#[test]
fn each_operation_fails() {
    for mode in ["once", "ever", "half"] {
        at_each(mode, 40, told);
    }
}

/// Truth (rel-kill-any-time): the program is killed between any two file operations. After `--resume`, the run has the
/// results of the undisturbed run.
#[test]
fn killed_at_each_operation() {
    at_each("kill", 60, |_, at, (code, text)| assert!(code.is_none(), "operation {at}: {code:?} {text}"));
}

/// Truth (rel-disk-full): if the output directory is removed, the run ends with exit code 4 and a message with the
/// path.
#[test]
fn a_directory_that_vanishes() {
    let job = Job::new();
    let more =
        ["--quiet", "--set", "steps.fret.cycles.count=100000", "--set", "steps.fret.cycles.jumps=100000"];
    let mut command = job.command(&more);
    command.stderr(std::process::Stdio::piped());
    let child = command.spawn().expect("a run");
    while !checkpoint::are_in(&job.out) {
        std::thread::sleep(std::time::Duration::from_millis(1));
    }
    // The removal is repeated, because the run may create a file meanwhile.
    while fs::remove_dir_all(&job.out).is_err() {}
    let output = child.wait_with_output().expect("an end");
    let text = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.code() == Some(4) && text.contains(&job.out.display().to_string()), "{text}");
}
