//! Runs with little memory: they end with a message, never by a signal.
#![cfg(target_os = "linux")]

use std::fs;
use std::os::unix::process::CommandExt;

use orthowear::body::condensed_flexibility::CondensedFlexibility;
use orthowear::flexibility::Flexibility;
use orthowear::flexibility::cell_matrix::CellMatrix;
use orthowear::frame::{ContactFrame, FaceMap, Side};
use orthowear::mesh::faces::group_faces;

use crate::checkpoints::{SCENE, orthowear};
use crate::meter::measured;
use crate::structured::GradedBlock;

/// Runs the scene on n x n cells with so many bytes of addresses; exit code and messages.
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
        // SAFETY: one of the calls that may be made between fork and exec.
        let done = unsafe { libc::setrlimit(libc::RLIMIT_AS, &raw const limit) };
        if done == 0 { Ok(()) } else { Err(std::io::Error::last_os_error()) }
    };
    // SAFETY: as said there.
    unsafe { command.pre_exec(limit) };
    let output = command.output().expect("a run");
    (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned())
}

/// Truth (rel-memory-limit): with less memory than a run needs it ends with exit code 4 and says how much there is, or is not; with
/// enough it ends as it does elsewhere (here without convergence, for it may iterate twice only).
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

/// Truth: sweeps over single cells ask for room for the entries between them, and take little beside it. The entries are those of the products:
/// rounding, 1e-12.
#[test]
fn entries_of_condensed_bodies_take_little_beside_their_matrix() {
    let n = 16;
    let mesh = GradedBlock::uniform([1.0; 2], 1.0, [n, n, 1]).mesh().expect("a mesh");
    let frame = ContactFrame::grid([1.0; 2], [n; 2], [0.0; 2], 0.0).expect("a frame");
    let faces = group_faces(&mesh, "contact").expect("a contact group");
    let map = FaceMap::new(&frame, &mesh, &faces, Side::Lower).expect("a covered frame");
    let entry = |i: usize, j: usize| 1.0 / (1.0 + i.abs_diff(j) as f64);
    let flexibility = CondensedFlexibility::new(map, entry).expect("memory");
    let m = n * n;
    let cells: Vec<usize> = (0..m).collect();
    let mut matrix = CellMatrix::zeros(m).expect("memory");
    let (added, beside, _) = measured(|| flexibility.add_entries(&cells, &mut matrix));
    assert!(added);
    assert!(beside < CellMatrix::bytes(m) as u64 / 2, "{beside} bytes beside {}", CellMatrix::bytes(m));
    for k in [0, m / 2, m - 1] {
        let mut tractions = vec![0.0; 3 * m];
        tractions[2 * m + k] = 1.0;
        let mut gap = vec![0.0; 3 * m];
        flexibility.apply(&tractions, &mut gap);
        let size = gap.iter().fold(0.0_f64, |most, value| most.max(value.abs()));
        for (value, entry) in gap.iter().zip(matrix.columns(k, &(0..3 * m))[2]) {
            assert!((value - entry).abs() < 1e-12 * size, "{k}: {value} {entry}");
        }
    }
}
