//! `--resume`: interrupted, killed and starved runs end as if nothing had happened.
#![cfg(unix)]

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

use serde_json::Value;

/// A scene of some seconds, in a folder of its own.
struct Job {
    folder: tempfile::TempDir,
    out: PathBuf,
}

const SCENE: &str = r#"
title = "interrupted"
[materials.cfrp]
model = "transversely-isotropic"
E1 = 167230.0
E2 = 9544.0
G12 = 5292.0
nu12 = 0.272
nu23 = 0.37
[body1]
kind = "half-space"
material = "cfrp"
fibre = { tilt = 30.0 }
[body2]
kind = "rigid"
[frame]
kind = "grid"
half_width = [1.5, 1.5]
cells = [24, 24]
[gap]
kind = "sphere"
radius = 50.0
[friction]
law = "coulomb"
mu = 0.4
[wear]
law = "archard"
i = 1.0e-8
[[steps]]
name = "press"
normal_force = 200.0
increments = 20
[[steps]]
name = "push"
tangential_force = [40.0, 0.0]
increments = 20
[[steps]]
name = "fret"
cycles = { count = 2000, amplitude = 0.006, jumps = 20 }
[[steps]]
name = "back"
shift = { distance = 0.0, angle = 0.0 }
increments = 10
[output]
fields = ["vtu", "svg"]
checkpoint = { seconds = 1e-9 }
"#;

impl Job {
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("scene.toml"), SCENE).unwrap();
        let out = folder.path().join("out");
        Self { folder, out }
    }

    fn command(&self, more: &[&str]) -> Command {
        let mut command = Command::new(assert_cmd::cargo::cargo_bin("orthowear"));
        command.env("ORTHOWEAR_CACHE_LIMIT", "0").arg("run").arg(self.folder.path().join("scene.toml"));
        command.arg("--out").arg(&self.out).args(more);
        command.stdout(Stdio::piped()).stderr(Stdio::piped());
        command
    }

    fn run(&self, more: &[&str]) -> (Option<i32>, String) {
        said(&self.command(more).output().unwrap())
    }

    /// Starts a run and waits until so many entries are in a checkpoint that was not there before.
    fn start(&self, more: &[&str], checkpoints: u64) -> Child {
        let wanted = self.number() + checkpoints;
        let child = self.command(more).spawn().unwrap();
        let started = Instant::now();
        while self.number() < wanted {
            assert!(started.elapsed().as_secs() < 120, "no checkpoint {wanted}");
            std::thread::sleep(Duration::from_millis(1));
        }
        child
    }

    /// Number of the newest checkpoint; 0 without one.
    fn number(&self) -> u64 {
        let read = |name: &str| fs::read(self.out.join(name)).ok().filter(|bytes| bytes.len() > 28);
        let numbers = ["checkpoint-1.bin", "checkpoint-2.bin"].into_iter().filter_map(read);
        numbers.map(|bytes| u64::from_le_bytes(bytes[20..28].try_into().unwrap())).max().unwrap_or(0)
    }

    /// Interrupts a run after so many checkpoints: what it said.
    fn interrupt(&self, more: &[&str], checkpoints: u64) -> String {
        let child = self.start(more, checkpoints);
        send(&child, libc::SIGTERM);
        let (code, text) = said(&child.wait_with_output().unwrap());
        assert_eq!(code, Some(130), "{text}");
        text
    }

    /// Kills a run after so many checkpoints and `delay`.
    fn kill(&self, more: &[&str], checkpoints: u64, delay: Duration) {
        let child = self.start(more, checkpoints);
        std::thread::sleep(delay);
        send(&child, libc::SIGKILL);
        let _killed = child.wait_with_output().unwrap();
    }

    fn summary(&self) -> Value {
        serde_json::from_slice(&fs::read(self.out.join("summary.json")).unwrap()).unwrap()
    }

    /// Names and contents of the checkpoints.
    fn checkpoints(&self) -> Vec<(String, Vec<u8>)> {
        let names = ["checkpoint-1.bin", "checkpoint-2.bin"].map(str::to_owned);
        names
            .into_iter()
            .filter_map(|name| Some((name.clone(), fs::read(self.out.join(name)).ok()?)))
            .collect()
    }
}

fn said(output: &Output) -> (Option<i32>, String) {
    let text = [&*output.stdout, &*output.stderr].concat();
    (output.status.code(), String::from_utf8(text).unwrap())
}

fn send(child: &Child, signal: libc::c_int) {
    // SAFETY: sends a signal to the child that was started, which has not been waited for.
    unsafe { libc::kill(libc::pid_t::try_from(child.id()).unwrap(), signal) };
}

/// Everything in a directory of results but what depends on time and memory.
fn results(out: &Path) -> BTreeMap<String, Vec<u8>> {
    let entries = fs::read_dir(out).unwrap().map(|entry| entry.unwrap());
    let files = entries.filter(|entry| entry.file_type().unwrap().is_file()).map(|entry| {
        let name = entry.file_name().into_string().unwrap();
        let content = fs::read(entry.path()).unwrap();
        let content = match name.as_str() {
            "summary.json" => timeless_summary(&content),
            "history.csv" => timeless_table(&content),
            _ => content,
        };
        (name, content)
    });
    files.collect()
}

fn timeless_summary(text: &[u8]) -> Vec<u8> {
    let mut summary: Value = serde_json::from_slice(text).unwrap();
    let fields = summary.as_object_mut().unwrap();
    fields.remove("timings").unwrap();
    fields.remove("peak_memory_bytes").unwrap();
    for step in fields["steps"].as_array_mut().unwrap() {
        step.as_object_mut().unwrap().remove("seconds").unwrap();
    }
    serde_json::to_vec(&summary).unwrap()
}

fn timeless_table(text: &[u8]) -> Vec<u8> {
    let text = std::str::from_utf8(text).unwrap();
    let place = text.lines().next().unwrap().split(',').position(|name| name == "seconds").unwrap();
    let without = |line: &str| -> String {
        let cells = line.split(',').enumerate().filter(|(i, _)| *i != place).map(|(_, cell)| cell);
        cells.collect::<Vec<_>>().join(",") + "\n"
    };
    text.lines().map(without).collect::<String>().into_bytes()
}

/// A run that was not interrupted.
fn whole() -> &'static BTreeMap<String, Vec<u8>> {
    static WHOLE: std::sync::OnceLock<BTreeMap<String, Vec<u8>>> = std::sync::OnceLock::new();
    WHOLE.get_or_init(|| {
        let job = Job::new();
        let (code, text) = job.run(&["--threads", "2"]);
        assert_eq!(code, Some(0), "{text}");
        let files = results(&job.out);
        assert!(files.len() > 140 && !files.contains_key("checkpoint-1.bin"), "{}", files.len());
        files
    })
}

#[track_caller]
fn assert_whole(out: &Path) {
    let (found, expected) = (results(out), whole());
    assert_eq!(found.keys().collect::<Vec<_>>(), expected.keys().collect::<Vec<_>>());
    for (name, content) in expected {
        if found[name] != *content {
            let [a, b] = [&found[name], content].map(|text| String::from_utf8_lossy(text));
            panic!("{name} differs:\n{}\n{}", &a[..a.len().min(3000)], &b[..b.len().min(3000)]);
        }
    }
}

/// Truth (rel-restart-equals-continuous, docs/checkpoints.md): the run that was not interrupted, byte for byte, after a chain of
/// interrupts with other numbers of threads; each says how to go on. A run that has ended is not computed again.
#[test]
fn interrupted_runs_go_on() {
    let job = Job::new();
    let text = job.interrupt(&["--threads", "1"], 3);
    assert!(text.contains("INTERRUPTED") && text.contains("to go on: orthowear run"), "{text}");
    assert!(text.contains("out --resume\n"), "{text}");
    let entries = job.summary()["steps"].as_array().unwrap().len();
    assert!(job.summary()["status"] == "interrupted" && entries >= 3, "{entries}");
    let text = job.interrupt(&["--threads", "3", "--resume"], 30);
    assert!(text.contains("going on after step \"press\" ("), "{text}");
    assert!(job.summary()["steps"].as_array().unwrap().len() >= entries + 29);
    let (code, text) = job.run(&["--threads", "2", "--resume"]);
    assert_eq!(code, Some(0), "{text}");
    assert_whole(&job.out);
    let names: Vec<_> = fs::read_dir(&job.out).unwrap().map(|entry| entry.unwrap().file_name()).collect();
    assert_eq!(names.len(), whole().len(), "something is left: {names:?}");

    let before = fs::read(job.out.join("summary.json")).unwrap();
    let (code, text) = job.run(&["--resume"]);
    assert!(code == Some(0) && text.contains("has converged before"), "{text}");
    assert_eq!(fs::read(job.out.join("summary.json")).unwrap(), before);
}

/// Truth (rel-kill-any-time): the same after SIGKILL at random moments, in and between the checkpoints that follow every entry;
/// nothing but the entries after the last checkpoint is lost.
#[test]
fn killed_runs_go_on() {
    let job = Job::new();
    let mut random = 20_261_122_u64;
    let mut next = |below: u64| {
        // Knuth's multiplier: the upper bits are good.
        random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (random >> 33) % below
    };
    for kill in 0..6 {
        let before = job.number();
        let more: &[&str] = if kill == 0 { &["--quiet"] } else { &["--quiet", "--resume"] };
        job.kill(more, 1 + next(9), Duration::from_micros(next(20_000)));
        assert!(job.number() > before, "checkpoints before the kill are lost");
        assert!(!job.out.join("summary.json").exists(), "results before the end");
    }
    let (code, text) = job.run(&["--resume"]);
    assert_eq!(code, Some(0), "{text}");
    assert_whole(&job.out);
}

/// Truth: docs/checkpoints.md: without a checkpoint a run begins at the start and says so.
#[test]
fn without_a_checkpoint() {
    let job = Job::new();
    let (code, text) = job.run(&["--resume", "--set", "output.fields=[]"]);
    assert!(code == Some(0) && text.contains("no checkpoint in") && text.contains("at the start"), "{text}");
}

/// Truth: docs/checkpoints.md: a checkpoint of another scene or version is refused with exit code 2 and what differs; it stays as it
/// is, whatever mistake is made, and the title is free.
#[test]
fn other_scenes_are_refused() {
    let job = Job::new();
    job.interrupt(&[], 2);
    let kept = job.checkpoints();
    let more = [
        "--resume",
        "--set",
        "gap.radius=25.0",
        "--set",
        "steps.push.increments=9",
        "--set",
        "solver.skip=false",
    ];
    let (code, text) = job.run(&more);
    assert_eq!(code, Some(2), "{text}");
    let lines = [
        "gap.radius: 50 then, 25 now",
        "steps.push.increments: 20 then, 9 now",
        "solver.skip: not given then, false now",
    ];
    assert!(lines.iter().all(|line| text.contains(line)), "{text}");
    let (code, text) = job.run(&["--resume", "--set", "gap.radius=-1.0"]);
    assert!(code == Some(2) && text.contains("radius"), "{text}");
    assert_eq!(job.checkpoints(), kept);

    let found = orthowear::results::checkpoint::read(&job.out).unwrap().unwrap();
    let mut origin = found.origin.clone();
    origin.version = "0.0.9".to_owned();
    orthowear::results::checkpoint::write(&job.out, found.number + 1, &origin, &"of another version")
        .unwrap();
    let (code, text) = job.run(&["--resume"]);
    assert!(code == Some(2) && text.contains("orthowear 0.0.9 then, "), "{text}");

    for (name, content) in kept {
        fs::write(job.out.join(name), content).unwrap();
    }
    let (code, text) = job.run(&["--resume", "--set", "title=other"]);
    assert_eq!((code, job.summary()["title"].as_str()), (Some(0), Some("other")), "{text}");
    let files = results(&job.out);
    let same = |(name, content): (&String, &Vec<u8>)| name == "summary.json" || files[name] == *content;
    assert!(files.len() == whole().len() && whole().iter().all(same));
}

/// Truth (rel-corrupt-checkpoint, docs/checkpoints.md): damage is told and the checkpoint before is taken; with both damaged
/// the run is refused with exit code 2.
#[test]
fn damaged_checkpoints() {
    let job = Job::new();
    job.interrupt(&[], 4);
    let newest = if job.number().is_multiple_of(2) { "checkpoint-2.bin" } else { "checkpoint-1.bin" };
    let path = job.out.join(newest);
    let mut bytes = fs::read(&path).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 4;
    fs::write(&path, &bytes).unwrap();
    let (code, text) = job.run(&["--resume"]);
    assert!(code == Some(0) && text.contains(newest) && text.contains("is damaged"), "{text}");
    assert_whole(&job.out);

    let job = Job::new();
    job.interrupt(&[], 2);
    let broken = ["checkpoint-1.bin", "checkpoint-2.bin"];
    for name in broken {
        fs::write(job.out.join(name), &bytes[..bytes.len() - 1]).unwrap();
    }
    let (code, text) = job.run(&["--resume"]);
    assert!(code == Some(2) && broken.iter().all(|name| text.contains(name)), "{text}");
}

/// Truth (rel-disk-full, docs/checkpoints.md): where no more can be written (a limit on the size of files: of none, of small ones, of
/// the checkpoints alone) the run ends with exit code 4 and names the file; the checkpoints stay as they were, and the run goes
/// on once there is room.
#[rstest::rstest]
fn a_full_disk(#[values((0, "vtu"), (8, "vtu"), (100, "vtu"), (100, ""))] (blocks, fields): (usize, &str)) {
    let job = Job::new();
    let fields = if fields.is_empty() { "output.fields=[]" } else { "output.fields=[\"vtu\", \"svg\"]" };
    job.interrupt(&["--set", fields], 25);
    let kept = job.checkpoints();
    let mut command = Command::new("sh");
    command.args(["-c", "trap '' XFSZ; ulimit -f \"$1\"; shift; exec \"$@\"", "sh", &blocks.to_string()]);
    let inner = job.command(&["--resume", "--quiet", "--set", fields]);
    command.arg(inner.get_program()).args(inner.get_args()).env("ORTHOWEAR_CACHE_LIMIT", "0");
    let (code, text) = said(&command.output().unwrap());
    assert!(code == Some(4) && text.contains("writ") && text.contains("/out/"), "{code:?} {text}");
    assert_eq!(text.contains("checkpoint"), fields == "output.fields=[]", "{text}");
    assert!(job.checkpoints() == kept, "a checkpoint was changed");
    let (code, text) = job.run(&["--resume", "--set", fields]);
    assert_eq!(code, Some(0), "{text}");
    let (found, expected) = (results(&job.out), whole());
    let same = |(name, content): (&String, &Vec<u8>)| name == "summary.json" || expected[name] == *content;
    assert!(found.len() > 1 && found.iter().all(same), "{:?}", found.keys());
}

/// Truth: docs/checkpoints.md: a run that begins anew sets the unfinished one aside, which goes on from there.
#[test]
fn a_new_run_sets_an_unfinished_one_aside() {
    let job = Job::new();
    job.kill(&[], 30, Duration::ZERO);
    let small = ["--set", "steps.press.increments=1", "--set", "steps.fret.cycles.jumps=1"];
    let (code, text) = job.run(&small);
    assert!(code == Some(0) && text.contains("previous-1") && text.contains("goes on with it"), "{text}");
    let aside = Job { out: job.out.join("previous-1"), folder: job.folder };
    let (code, text) = aside.run(&["--resume"]);
    assert_eq!(code, Some(0), "{text}");
    assert_whole(&aside.out);
}

/// Truth: docs/checkpoints.md: a directory takes one run at a time; the first one is not disturbed.
#[test]
fn one_run_at_a_time() {
    let job = Job::new();
    let first = job.start(&["--quiet"], 1);
    // It waits while the other one is tried.
    send(&first, libc::SIGSTOP);
    let (code, text) = job.run(&["--set", "steps.press.increments=1"]);
    send(&first, libc::SIGCONT);
    assert!(code == Some(4) && text.contains("another run writes into"), "{text}");
    assert_eq!(first.wait_with_output().unwrap().status.code(), Some(0));
    assert_whole(&job.out);
}

/// Truth: docs/checkpoints.md: files of an interrupted run that are gone are named, and the run goes on.
#[test]
fn missing_field_files() {
    let job = Job::new();
    job.interrupt(&[], 5);
    fs::remove_file(job.out.join("frame_0002.vtu")).unwrap();
    let (code, text) = job.run(&["--resume"]);
    assert!(code == Some(0) && text.contains("missing") && text.contains("frame_0002.vtu"), "{text}");
    let collection = fs::read_to_string(job.out.join("frame.pvd")).unwrap();
    assert!(!collection.contains("frame_0002") && collection.contains("frame_0003"));
}
