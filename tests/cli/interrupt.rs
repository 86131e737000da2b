//! Signals to runs that assemble and factorise a large body, and to runs of many increments.
#![cfg(unix)]

use std::fmt::Write;
use std::fs;
use std::path::Path;
use std::process::Stdio;
use std::time::{Duration, Instant};

/// Number of elements along each side of the cube. The factorisation of this cube takes seconds.
const N: usize = 30;

/// Mesh of a cube of `N`³ hexahedra with sides of 1 mm. The upper face lies in z = 0.
fn cube() -> String {
    let at = |i: usize, j: usize, k: usize| (i * (N + 1) + j) * (N + 1) + k + 1;
    let mut text =
        String::from("$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n3\n2 1 \"base\"\n2 2 \"top\"\n");
    text.push_str(&format!("3 3 \"solid\"\n$EndPhysicalNames\n$Nodes\n{}\n", (N + 1).pow(3)));
    for (i, j, k) in triples(N + 1) {
        let z = k as f64 - N as f64;
        writeln!(text, "{} {} {} {z}", at(i, j, k), i as f64 - 0.5 * N as f64, j as f64 - 0.5 * N as f64)
            .unwrap();
    }
    text.push_str(&format!("$EndNodes\n$Elements\n{}\n", N.pow(3) + 2 * N * N));
    let mut tag = 0;
    for (group, k) in [(1, 0), (2, N)] {
        for (i, j) in (0..N * N).map(|cell| (cell / N, cell % N)) {
            tag += 1;
            let nodes =
                [at(i, j, k), at(i + 1, j, k), at(i + 1, j + 1, k), at(i, j + 1, k)].map(|n| n.to_string());
            writeln!(text, "{tag} 3 2 {group} {group} {}", nodes.join(" ")).unwrap();
        }
    }
    for (i, j, k) in triples(N) {
        tag += 1;
        let level = |k| [at(i, j, k), at(i + 1, j, k), at(i + 1, j + 1, k), at(i, j + 1, k)];
        let nodes: Vec<String> = [level(k), level(k + 1)].concat().iter().map(ToString::to_string).collect();
        writeln!(text, "{tag} 5 2 3 3 {}", nodes.join(" ")).unwrap();
    }
    text + "$EndElements\n"
}

fn triples(n: usize) -> impl Iterator<Item = (usize, usize, usize)> {
    (0..n.pow(3)).map(move |cell| (cell / (n * n), cell / n % n, cell % n))
}

const SCENE: &str = r#"[materials.steel]
model = "isotropic"
E = 210e3
nu = 0.3
[body1]
kind = "fe"
material = "steel"
mesh = "cube.msh"
contact = "top"
fixed = [{ group = "base" }]
[body2]
kind = "rigid"
[frame]
kind = "grid"
half_width = [14.0, 14.0]
cells = [8, 8]
[gap]
kind = "sphere"
radius = 100.0
[[steps]]
name = "press"
approach = 0.1
increments = 100000
"#;

/// Runs the scene and sends SIGTERM `delay` after the output directory appears. Returns exit code, standard error, and time from
/// the signal to the end of the run.
fn interrupted(folder: &Path, delay: Duration) -> (Option<i32>, String, Duration) {
    let out = folder.join("out");
    let mut child = std::process::Command::new(env!("CARGO_BIN_EXE_orthowear"))
        .env("XDG_CACHE_HOME", folder.join("cache"))
        .env_remove("ORTHOWEAR_CACHE_LIMIT")
        .args(["run", "--quiet", "--threads", "1", "--out"])
        .args([&out, &folder.join("scene.toml")])
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    // The program creates the directory after it has installed its signal handlers and read the mesh.
    let started = Instant::now();
    while !out.exists() && started.elapsed().as_secs() < 60 {
        std::thread::sleep(Duration::from_millis(5));
    }
    std::thread::sleep(delay);
    // SAFETY: `kill` accesses no memory, and the child process has not been waited for.
    unsafe { libc::kill(libc::pid_t::try_from(child.id()).unwrap(), libc::SIGTERM) };
    let signalled = Instant::now();
    let code = child.wait().unwrap().code();
    let elapsed = signalled.elapsed();
    let mut text = String::new();
    std::io::Read::read_to_string(&mut child.stderr.take().unwrap(), &mut text).unwrap();
    (code, text, elapsed)
}

/// Truth: docs/command-line.md: an interrupted run ends within about a second, and leaves no incomplete entry in the cache. The
/// test allows 20 s, because the machine may do other work at the same time. Without the signal, the run would take hours.
#[test]
fn signals_are_heard_while_a_body_is_made() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("cube.msh"), cube()).unwrap();
    fs::write(folder.path().join("scene.toml"), SCENE).unwrap();
    for delay in [50, 700, 1500, 3000] {
        let (code, text, elapsed) = interrupted(folder.path(), Duration::from_millis(delay));
        println!("{delay} ms: {elapsed:?}");
        assert_eq!(code, Some(130), "{text}");
        assert!(text.contains("interrupted: stopping") && elapsed.as_secs() < 20, "{elapsed:?}: {text}");
        let summary = fs::read(folder.path().join("out/summary.json")).unwrap();
        let summary: serde_json::Value = serde_json::from_slice(&summary).unwrap();
        assert_eq!(
            (&summary["status"], &summary["error"]),
            (&"interrupted".into(), &serde_json::Value::Null)
        );
        let left = fs::read_dir(folder.path().join("out"))
            .unwrap()
            .filter_map(|entry| entry.unwrap().file_name().into_string().ok());
        assert!(left.into_iter().all(|name| !name.starts_with(".incoming")));
        let kept = fs::read_dir(folder.path().join("cache/orthowear")).into_iter().flatten();
        assert!(kept.into_iter().all(|entry| entry.unwrap().path().extension().unwrap() != "unfinished"));
    }
}

/// Truth: docs/command-line.md: an interrupted run ends within about a second, even if its increments need no iterations. Without
/// the signal, the run would take days.
#[test]
fn signals_are_heard_between_increments() {
    let folder = tempfile::tempdir().unwrap();
    let punch = "[materials.steel]\nmodel = \"isotropic\"\nE = 210e3\nnu = 0.3\n[body1]\nkind = \"half-space\"\nmaterial = \"steel\"\n\
                 [body2]\nkind = \"rigid\"\n[frame]\nkind = \"grid\"\nhalf_width = [1.1, 1.1]\ncells = [16, 16]\n\
                 outline = { shape = \"circle\", radius = 1.0 }\n[gap]\nkind = \"flat\"\n[[steps]]\nname = \"press\"\n\
                 normal_force = 1000.0\nincrements = 1000000000\n[output]\nfields = []\n";
    fs::write(folder.path().join("scene.toml"), punch).unwrap();
    let (code, text, elapsed) = interrupted(folder.path(), Duration::from_millis(500));
    assert_eq!(code, Some(130), "{text}");
    assert!(elapsed.as_secs() < 20, "{elapsed:?}");
}
