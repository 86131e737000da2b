//! Runs that are interrupted, killed or limited in file size, and the files of an uninterrupted run.

use std::collections::BTreeMap;
use std::fs;
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

use serde_json::Value;

use crate::tools::timeless;

/// A scene whose run takes some seconds, in its own folder.
pub struct Job {
    pub folder: tempfile::TempDir,
    pub out: PathBuf,
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
    pub fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("scene.toml"), SCENE).unwrap();
        let out = folder.path().join("out");
        Self { folder, out }
    }

    pub fn command(&self, more: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_orthowear"));
        command.env("ORTHOWEAR_CACHE_LIMIT", "0").arg("run").arg(self.folder.path().join("scene.toml"));
        command.arg("--out").arg(&self.out).args(more);
        command.stdout(Stdio::piped()).stderr(Stdio::piped());
        command
    }

    pub fn run(&self, more: &[&str]) -> (Option<i32>, String) {
        said(&self.command(more).output().unwrap())
    }

    pub fn limited(&self, more: &[&str], bytes: u64) -> (Option<i32>, String) {
        let mut command = self.command(more);
        let limit = move || {
            let limit = libc::rlimit { rlim_cur: bytes, rlim_max: bytes };
            // SAFETY: both calls are allowed between fork and exec.
            let done = unsafe {
                libc::signal(libc::SIGXFSZ, libc::SIG_IGN);
                libc::setrlimit(libc::RLIMIT_FSIZE, &raw const limit)
            };
            if done == 0 { Ok(()) } else { Err(std::io::Error::last_os_error()) }
        };
        // SAFETY: `limit` makes only calls that are allowed between fork and exec.
        unsafe { command.pre_exec(limit) };
        said(&command.output().unwrap())
    }

    /// Starts a run and waits until it has written `checkpoints` further checkpoints.
    pub fn start(&self, more: &[&str], checkpoints: u64) -> Child {
        let wanted = self.number() + checkpoints;
        let child = self.command(more).spawn().unwrap();
        let started = Instant::now();
        while self.number() < wanted {
            assert!(started.elapsed().as_secs() < 120, "no checkpoint {wanted}");
            std::thread::sleep(Duration::from_millis(1));
        }
        child
    }

    /// Number of the newest checkpoint, or 0 without a checkpoint.
    pub fn number(&self) -> u64 {
        let read = |name: &str| fs::read(self.out.join(name)).ok().filter(|bytes| bytes.len() > 28);
        let numbers = ["checkpoint-1.bin", "checkpoint-2.bin"].into_iter().filter_map(read);
        numbers.map(|bytes| u64::from_le_bytes(bytes[20..28].try_into().unwrap())).max().unwrap_or(0)
    }

    /// Interrupts a run by SIGTERM after `checkpoints` further checkpoints. Returns the output of the run.
    pub fn interrupt(&self, more: &[&str], checkpoints: u64) -> String {
        let child = self.start(more, checkpoints);
        send(&child, libc::SIGTERM);
        let (code, text) = said(&child.wait_with_output().unwrap());
        assert_eq!(code, Some(130), "{text}");
        text
    }

    /// Kills a run by SIGKILL, `delay` after it has written `checkpoints` further checkpoints.
    pub fn kill(&self, more: &[&str], checkpoints: u64, delay: Duration) {
        let child = self.start(more, checkpoints);
        std::thread::sleep(delay);
        send(&child, libc::SIGKILL);
        let _killed = child.wait_with_output().unwrap();
    }

    pub fn summary(&self) -> Value {
        serde_json::from_slice(&fs::read(self.out.join("summary.json")).unwrap()).unwrap()
    }

    pub fn checkpoints(&self) -> Vec<(String, Vec<u8>)> {
        let names = ["checkpoint-1.bin", "checkpoint-2.bin"].map(str::to_owned);
        names
            .into_iter()
            .filter_map(|name| Some((name.clone(), fs::read(self.out.join(name)).ok()?)))
            .collect()
    }
}

pub fn said(output: &Output) -> (Option<i32>, String) {
    let text = [&*output.stdout, &*output.stderr].concat();
    (output.status.code(), String::from_utf8(text).unwrap())
}

pub fn send(child: &Child, signal: libc::c_int) {
    // SAFETY: `kill` accesses no memory, and the child process has not been waited for.
    unsafe { libc::kill(libc::pid_t::try_from(child.id()).unwrap(), signal) };
}

/// Files of an output directory without the values that depend on time and memory.
pub fn results(out: &Path) -> BTreeMap<String, Vec<u8>> {
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
    serde_json::to_vec(&timeless(serde_json::from_slice(text).unwrap())).unwrap()
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

pub fn whole() -> &'static BTreeMap<String, Vec<u8>> {
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
pub fn assert_whole(out: &Path) {
    let (found, expected) = (results(out), whole());
    assert_eq!(found.keys().collect::<Vec<_>>(), expected.keys().collect::<Vec<_>>());
    for (name, content) in expected {
        if found[name] != *content {
            let [a, b] = [&found[name], content].map(|text| String::from_utf8_lossy(text));
            panic!("{name} differs:\n{}\n{}", &a[..a.len().min(3000)], &b[..b.len().min(3000)]);
        }
    }
}
