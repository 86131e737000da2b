//! Runs with too little memory end with a message, and never by a signal. Names after "Truth" are cases of
//! docs/verification.md.
#![cfg(target_os = "linux")]

use std::fs;
use std::os::unix::process::CommandExt;

use crate::checkpoints::{SCENE, orthowear};

fn run(n: usize, bytes: u64) -> (Option<i32>, String) {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("scene.toml");
    let scene = SCENE.replace("cells = [6, 6]", &format!("cells = [{n}, {n}]"));
    fs::write(&path, scene).expect("a file");
    let mut command = orthowear();
    command.arg("run").arg(path).args(["--quiet", "--threads", "2", "--set", "solver.max_iterations=2"]);
    command.env("RUST_BACKTRACE", "0");
    let limit = move || {
        let limit = libc::rlimit { rlim_cur: bytes, rlim_max: bytes };
        // SAFETY: POSIX allows setrlimit between fork and exec.
        let done = unsafe { libc::setrlimit(libc::RLIMIT_AS, &raw const limit) };
        if done == 0 { Ok(()) } else { Err(std::io::Error::last_os_error()) }
    };
    // SAFETY: the closure only calls setrlimit.
    unsafe { command.pre_exec(limit) };
    let output = command.output().expect("a run");
    (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned())
}

/// Truth (rel-memory-limit): a run with too little memory ends with exit code 4. With enough memory, the run ends
/// without convergence, because the scene allows only two iterations.
#[test]
fn runs_with_little_memory() {
    let mut refused = 0;
    for (n, bytes) in [
        (8, 64 << 20),
        (8, 128 << 20),
        (256, 200 << 20),
        (512, 300 << 20),
        (1024, 600 << 20),
        (1024, 1 << 30),
        (2048, 1 << 30),
        (2048, 2 << 30),
        (64, 2 << 30),
    ] {
        let (code, text) = run(n, bytes);
        match code {
            Some(3) => {}
            Some(4) => {
                refused += 1;
                assert!(
                    text.contains("memory") && text.contains("bytes"),
                    "{n} cells, {bytes} bytes: {text}"
                );
            }
            _ => panic!("{n} cells, {bytes} bytes: {code:?} {text}"),
        }
        assert!(
            !text.contains("panicked") && !text.contains("backtrace"),
            "{n} cells, {bytes} bytes: {text}"
        );
    }
    assert!(refused >= 3, "{refused}");
    assert_eq!(run(64, 2 << 30).0, Some(3));
}
