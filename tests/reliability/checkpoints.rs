//! Damaged checkpoints of a small run: with changed bytes, truncated, extended, replaced by other files, and changed
//! with a matching checksum. Names after "Truth" are cases of docs/verification.md.

use std::fs;
use std::path::Path;
use std::process::Command;
use std::sync::OnceLock;

use orthowear::evolution::RunCheckpoint;
use orthowear::output::checkpoint::{self, FILES};
use orthowear::output::checkpoint_writer::CheckpointData;
use sha2::{Digest, Sha256};

use crate::harness::{Reader, put};

const CHECKSUM: usize = 32;

/// Scene of the run. The last step has a force beyond the friction limit, so that the run ends and its checkpoints
/// remain.
pub const SCENE: &str = r#"
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
cells = [6, 6]
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
normal_force = 100.0
increments = 3
[[steps]]
name = "fret"
cycles = { count = 50, amplitude = 0.004, jumps = 4 }
[[steps]]
name = "pull"
tangential_force = [60.0, 0.0]
[output]
fields = []
checkpoint = { seconds = 1e-9 }
"#;

pub fn orthowear() -> Command {
    let mut program = Command::new(env!("CARGO_BIN_EXE_orthowear"));
    program.env("ORTHOWEAR_CACHE_LIMIT", "0");
    program
}

/// The two checkpoints that the run leaves, the older checkpoint first.
pub fn left() -> &'static [Vec<u8>; 2] {
    static LEFT: OnceLock<[Vec<u8>; 2]> = OnceLock::new();
    LEFT.get_or_init(|| {
        let folder = tempfile::tempdir().expect("a folder");
        fs::write(folder.path().join("scene.toml"), SCENE).expect("a file");
        let output =
            orthowear().current_dir(folder.path()).args(["run", "scene.toml", "--out", "out"]).output();
        let output = output.expect("a run");
        assert_eq!(output.status.code(), Some(3), "{}", String::from_utf8_lossy(&output.stderr));
        let mut found =
            FILES.map(|name| fs::read(folder.path().join("out").join(name)).expect("a checkpoint"));
        found.sort_by_key(|bytes| u64::from_le_bytes(std::array::from_fn(|i| bytes[20 + i])));
        found
    })
}

fn read(folder: &Path, bytes: &[u8]) -> Result<Option<CheckpointData<RunCheckpoint>>, String> {
    put(&folder.join(FILES[0]), bytes);
    let found = checkpoint::read(folder).map_err(|error| {
        assert_eq!(error.exit_code(), 2);
        error.to_string()
    })?;
    found.map(|found| found.state().map_err(|error| error.to_string())).transpose()
}

/// Truth (rel-corrupt-checkpoint): each changed byte, each truncation and each extension of a checkpoint is detected,
/// and the previous checkpoint is used.
#[test]
fn every_damage_of_a_checkpoint_is_found() {
    let folder = tempfile::tempdir().expect("a folder");
    let [before, newest] = left();
    let number = |bytes: &[u8]| u64::from_le_bytes(std::array::from_fn(|i| bytes[20 + i]));
    fs::write(folder.path().join(FILES[0]), before).expect("a file");
    let path = folder.path().join(FILES[1]);
    let flipped = (0..newest.len()).map(|at| {
        let mut bytes = newest.clone();
        bytes[at] ^= 1 << (at % 8);
        bytes
    });
    let cut = (0..newest.len()).map(|length| newest[..length].to_vec());
    let longer = [1, 32, 512].map(|more| [newest.clone(), vec![0; more]].concat());
    let foreign = [b"PK\x03\x04 another file".to_vec(), Vec::new(), vec![0; 4096]];
    for bytes in flipped.chain(cut).chain(longer).chain(foreign) {
        put(&path, &bytes);
        let found = checkpoint::read(folder.path()).expect("a checkpoint").expect("a checkpoint");
        assert!(found.number == number(before) && found.warnings.len() == 1, "{:?}", found.warnings);
    }
    fs::write(&path, newest).expect("a file");
    let found = checkpoint::read(folder.path()).expect("a checkpoint").expect("a checkpoint");
    assert!(found.number == number(newest) && found.warnings.is_empty());
}

/// Truth (rel-corrupt-checkpoint, rel-no-panics): a file of wrong bytes with a matching checksum is refused or read.
/// The sizes in the file cause no large allocations.
#[test]
fn checkpoint_files() {
    let folder = tempfile::tempdir().expect("a folder");
    let seeds = left().to_vec();
    for seed in &seeds {
        assert!(read(folder.path(), seed).expect("a checkpoint").is_some());
    }
    let words = ["records", "snapshot", "WearStep", "\u{dc}", "null", "[[[["].map(str::to_owned).to_vec();
    Reader {
        name: "checkpoint",
        read: "as written",
        seeds: seeds.clone(),
        words: words.clone(),
        cases: 2000,
    }
    .check(|bytes| match read(folder.path(), bytes) {
        Err(message) => message,
        Ok(found) => {
            assert!(found.is_some() && left().iter().any(|seed| seed == bytes), "damage was not found");
            "as written".to_owned()
        }
    });
    let seeds = seeds.iter().map(|seed| seed[..seed.len() - CHECKSUM].to_vec()).collect();
    Reader { name: "checkpoint-sealed", read: "", seeds, words, cases: 4000 }.check(|bytes| {
        let sealed = [bytes, Sha256::digest(bytes).as_slice()].concat();
        match read(folder.path(), &sealed) {
            Err(message) => message,
            Ok(found) => format!("{} entries", found.map_or(0, |kept| kept.snapshot.records().len())),
        }
    });
}
