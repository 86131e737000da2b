//! Bodies that are condensed by conjugate gradients, because a factorisation does not fit into the memory.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use orthowear::error::Result;
use orthowear::evolution::observer::Observer;
use orthowear::evolution::records::{FrameState, IncrementRecord};
use serde_json::Value;

#[derive(Default)]
struct Tractions(Vec<Vec<f64>>);

impl Observer for Tractions {
    fn increment_done(&mut self, _record: &IncrementRecord, state: &FrameState) -> Result<()> {
        self.0.push(state.tractions.clone());
        Ok(())
    }
}

fn scene() -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("block.toml");
    let mesh = Path::new(env!("CARGO_MANIFEST_DIR")).join("meshes/cfrp-block-coarse.msh");
    let text = crate::limits::BLOCK.replace("MESH", &mesh.display().to_string());
    let shift = "approach = 0.02\n[[steps]]\nname = \"shift\"\nshift = { distance = 0.004, angle = 30.0 }";
    let text = text.replace("approach = 0.02", shift) + "[solver]\ntolerance = 1e-11\n";
    fs::write(&path, text).unwrap();
    (folder, path)
}

fn call(command: &str, scene: &Path, limit: &str) -> (Option<i32>, String) {
    let mut program = crate::tools::orthowear();
    let set = format!("solver.memory_limit={limit}");
    let output = program.arg(command).arg(scene).args(["--threads", "2", "--set", &set]).output().unwrap();
    (output.status.code(), String::from_utf8([output.stdout, output.stderr].concat()).unwrap())
}

/// Memory limit, and the part of this limit that frame and program need, bytes. Under this limit, conjugate gradients on two
/// threads fit into the memory, but a factorisation does not.
fn limit(scene: &Path) -> [u64; 2] {
    // Smaller limits than the one found do not suffice for the assembled body, and their message does not mention conjugate
    // gradients.
    let refusal = |limit: u64| {
        let (code, text) = call("check", scene, &limit.to_string());
        (code == Some(4) && text.contains("by conjugate gradients")).then_some((limit, text))
    };
    let (limit, text) = (20..80).find_map(|megabytes| refusal(1_000_000 * megabytes)).unwrap();
    let mut bytes = text.split(" needs ").nth(1).unwrap().split('(').skip(1);
    let mut bytes = || bytes.next().unwrap().split_whitespace().next().unwrap().parse::<u64>().unwrap();
    let (needed, left) = (bytes(), bytes());
    [needed + limit - left, limit - left]
}

fn tractions(scene: &Path, limit: u64) -> Vec<Vec<f64>> {
    let plan = orthowear::scene::read(scene, &[format!("solver.memory_limit={limit}")]).ok().unwrap();
    let study = orthowear::simulation::build(&plan, &mut |_| {}, &AtomicBool::new(false));
    let mut seen = Tractions::default();
    study.ok().unwrap().run(&mut seen).unwrap();
    seen.0
}

/// Truth: the same scene with a factorisation. Forces and tractions agree to 1e-8 of the largest value. The contact solver has
/// the tolerance 1e-11. The columns of the flexibility from conjugate gradients have relative errors of 1e-11 in the energy norm.
#[test]
fn a_small_memory_limit_changes_no_result() {
    let (folder, path) = scene();
    let [limit, rest] = limit(&path);
    let (code, text) = call("check", &path, &limit.to_string());
    assert_eq!(code, Some(0), "{text}");
    assert!(text.contains("; conjugate gradients") && text.contains("a factorisation would need"), "{text}");
    let run = |limit: u64| -> Value {
        let (code, text) = call("run", &path, &limit.to_string());
        assert_eq!(code, Some(0), "{text}");
        let summary = fs::read(folder.path().join("block.out/summary.json")).unwrap();
        serde_json::from_slice(&summary).unwrap()
    };
    let (iterative, direct) = (run(limit), run(4 << 30));
    let [how, other] = [&iterative, &direct].map(|summary| summary["condensation"][0].clone());
    assert_eq!((&how["method"], &other["method"]), (&"conjugate-gradients".into(), &"factorisation".into()));
    let bytes = ["needed_bytes", "allowed_bytes"].map(|key| how[key].as_u64().unwrap());
    assert!(bytes[0] > bytes[1] && bytes[1] == limit - rest && how["iterations"].as_u64().unwrap() > 5);
    assert!(how["reason"].as_str().unwrap().contains(&bytes[0].to_string()), "{how}");
    assert!(iterative["warnings"].to_string().contains("condensed by conjugate gradients"));
    for step in 0..2 {
        let [a, b] = [&iterative, &direct].map(|summary| summary["steps"][step].clone());
        let force = b["normal_force"].as_f64().unwrap();
        for pointer in ["/normal_force", "/tangential_force/0", "/tangential_force/1", "/peak_pressure"] {
            let [a, b] = [&a, &b].map(|step| step.pointer(pointer).unwrap().as_f64().unwrap());
            assert!((a - b).abs() < 1e-8 * b.abs().max(force), "{pointer}: {a} {b}");
        }
    }
    // The memory limit is just large enough for conjugate gradients on two threads, so this pool has two threads.
    let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build().unwrap();
    let (a, b) = pool.install(|| (tractions(&path, limit), tractions(&path, 4 << 30)));
    for (a, b) in a.iter().zip(&b) {
        let largest = b.iter().fold(0.0f64, |most, t| most.max(t.abs()));
        let difference = a.iter().zip(b).fold(0.0f64, |most, (a, b)| most.max((a - b).abs()));
        assert!(largest > 0.0 && difference < 1e-8 * largest, "{difference:e} of {largest:e}");
        assert!(a != b, "both were factorised");
    }
}
