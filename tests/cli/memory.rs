//! Memory limit of a run, and estimate of its memory.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;

const STUDY: &str =
    "[study]\nscene = \"scene.toml\"\n[[axes]]\nkeys = [\"gap.radius\"]\nvalues = [10.0, 20.0]\n";

fn scene(more: &str) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.toml");
    fs::write(&path, format!("{}\n{more}", fs::read_to_string(repository("hertz")).unwrap())).unwrap();
    fs::write(folder.path().join("study.toml"), STUDY).unwrap();
    (folder, path)
}

fn repository(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(format!("{name}.toml"))
}

fn call(command: &str, path: &Path, options: &[&str]) -> (Option<i32>, String) {
    let output = crate::tools::orthowear().arg(command).arg(path).args(options).output().unwrap();
    let text = String::from_utf8([output.stdout, output.stderr].concat()).unwrap();
    (output.status.code(), text.split_whitespace().collect::<Vec<_>>().join(" "))
}

/// Truth: docs/command-line.md: the message names the option `--max-memory` and the allowed values.
#[test]
fn what_is_no_amount_of_memory() {
    let (folder, path) = scene("");
    for command in ["run", "check", "compare", "refine", "study"] {
        let path = if command == "study" { folder.path().join("study.toml") } else { path.clone() };
        for wrong in ["", "0", "-1", "4 G", "much", "0 %", "101%", "nan%", "80 % of it"] {
            let (code, text) = call(command, &path, &["--max-memory", wrong]);
            assert_eq!(code, Some(2), "{command} {wrong}: {text}");
            for word in ["--max-memory", "4 GiB", "80 %", "percentage of the available memory"] {
                assert!(text.contains(word), "{command} {wrong} lacks {word}: {text}");
            }
        }
    }
    assert!(!folder.path().join("scene.out").exists());
}

/// Truth: docs/command-line.md: the option `--max-memory` replaces the key `solver.memory_limit`, even if the option allows more
/// memory. The message gives the estimate, the limit that applies, and how to raise this limit.
#[test]
fn the_option_wins_over_the_key() {
    let raised = "or raise solver.memory_limit";
    for (key, options, code, words) in [
        (
            "\"2 GB\"",
            &["--max-memory", "1000"][..],
            4,
            ["the limit of --max-memory is 1000 bytes", "or raise --max-memory"],
        ),
        (
            "\"2 GB\"",
            &["--max-memory", "1 KiB"],
            4,
            ["the limit of --max-memory is 1.0 KiB", "or raise --max-memory"],
        ),
        (
            "\"2 GB\"",
            &["--max-memory", "0.00001 %"],
            4,
            ["--max-memory (0.00001 % of the available memory)", "or raise --max-memory"],
        ),
        ("1000", &[], 4, ["the limit of solver.memory_limit is 1000 bytes", raised]),
        ("1e3", &[], 4, ["the limit of solver.memory_limit is 1000 bytes", raised]),
        ("\"1e3\"", &[], 4, ["the limit of solver.memory_limit is 1000 bytes", raised]),
        ("1000", &["--max-memory", "1.5e9"], 0, ["", ""]),
        ("1000", &["--max-memory", "2 GB"], 0, ["", ""]),
        ("1000", &["--max-memory=90%"], 0, ["", ""]),
    ] {
        let (folder, path) = scene(&format!("[solver]\nmemory_limit = {key}\n"));
        for command in ["check", "run", "compare"] {
            let (found, text) = call(command, &path, options);
            assert_eq!(found, Some(code), "{command} {options:?}: {text}");
            assert!(words.iter().all(|word| text.contains(word)), "{command} {options:?}: {text}");
            assert!(code == 0 || text.contains("a frame of 64 x 64"), "{command}: {text}");
        }
        let (found, text) = call("study", &folder.path().join("study.toml"), options);
        assert_eq!(found, Some(code), "study {options:?}: {text}");
    }
}

/// Truth: docs/command-line.md: `check` reports the allowed memory, which is 80 % of the available memory or the value of the
/// option. It also reports the defaults that docs/keys.md gives for `[solver]`.
#[test]
fn check_says_what_is_allowed() {
    let (_folder, path) = scene("");
    for (options, word, shown) in [
        (&[][..], "(80 % of the available memory is", true),
        (&["--max-memory", "50 %"], "(the limit of --max-memory (50 % of the available memory) is", false),
        (&["--max-memory", "3 GiB"], "(the limit of --max-memory is 3.0 GiB)", false),
    ] {
        let (code, text) = call("check", &path, options);
        assert!(code == Some(0) && text.contains(word), "{options:?}: {text}");
        let default = "solver.memory_limit: 80 % of the memory available at the start of the run";
        assert_eq!(text.contains(default), shown, "{options:?}: {text}");
        let solver = ["tolerance: 1e-8", "method: auto", "coupling: schur", "skip: true"];
        assert!(solver.iter().all(|line| text.contains(&format!(" solver.{line} "))), "{text}");
    }
}

/// Exit code and output of the program in an address space of at most `kibibytes` KiB.
fn confined(kibibytes: usize, arguments: &[&str]) -> (Option<i32>, String) {
    let script = format!("ulimit -v {kibibytes}; exec \"$0\" \"$@\"");
    let mut shell = Command::new("sh");
    shell.args(["-c", &script]).arg(env!("CARGO_BIN_EXE_orthowear")).args(arguments);
    let output = shell.env("ORTHOWEAR_CACHE_LIMIT", "0").output().unwrap();
    (output.status.code(), String::from_utf8([output.stdout, output.stderr].concat()).unwrap())
}

/// Truth: docs/command-line.md: a scene that exceeds the memory limit is refused before its memory is allocated. The program runs
/// in 1.5 GB of address space, about a thirtieth of the refused memory.
#[test]
fn refused_before_anything_is_allocated() {
    let (folder, path) = scene("");
    let out = folder.path().join("out").display().to_string();
    let path = path.display().to_string();
    // 64 million cells need tens of GB.
    for command in [&["check"][..], &["run", "--out", &out]] {
        let more = ["--set", "frame.cells=[8000, 8000]", "--max-memory", "2 GB", "--threads", "1"];
        let (code, said) = confined(1_500_000, &[command, &[path.as_str()], &more].concat());
        assert!(code == Some(4) && said.contains("a frame of 8000 x 8000 cells"), "{code:?} {said}");
        let needed =
            said.split(" with its operator needs ").nth(1).unwrap().split(['(', ')']).nth(1).unwrap();
        let needed: f64 = needed.split_whitespace().next().unwrap().parse().unwrap();
        assert!(needed > 30.0 * 1.5e9 && said.contains("--max-memory"), "{said}");
    }
}

fn called(arguments: &[&str]) -> (Option<i32>, String) {
    let output = crate::tools::orthowear().args(arguments).output().unwrap();
    (output.status.code(), String::from_utf8([output.stdout, output.stderr].concat()).unwrap())
}

/// Estimate of `check` and peak memory of the run, bytes.
fn foretold_and_held(path: &Path, sets: &[&str]) -> [f64; 2] {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out").display().to_string();
    let path = path.display().to_string();
    let sets: Vec<&str> = sets.iter().flat_map(|set| ["--set", set]).chain(["--threads", "2"]).collect();
    let (code, said) = called(&[&["check", &path], &sets[..]].concat());
    assert_eq!(code, Some(0), "{said}");
    let foretold = crate::tools::foretold(&said);
    let (code, said) = called(&[&["run", &path, "--quiet", "--out", &out], &sets[..]].concat());
    assert_eq!(code, Some(0), "{said}");
    let summary: Value =
        serde_json::from_slice(&fs::read(Path::new(&out).join("summary.json")).unwrap()).unwrap();
    let held = summary["peak_memory_bytes"].as_f64().unwrap();
    assert!(held > 5e6, "{held}");
    [foretold, held]
}

/// Truth: docs/memory.md: the estimate is within a fifth of the peak memory that the operating system reports.
#[test]
fn estimates_are_within_a_fifth_of_what_is_held() {
    if !cfg!(target_os = "linux") {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let be = folder.path().join("scene.toml");
    fs::write(&be, crate::boundary::SCENE).unwrap();
    fs::write(folder.path().join("block.msh"), crate::boundary::block()).unwrap();
    let points = "output.inside=[{ name = \"cut\", body = 1, from = [-0.4, 0.0, -0.01], to = [0.4, 0.0, -0.01], \
                  across = [-0.4, 0.0, -0.6], points = [200, 200] }]";
    let cases: [(PathBuf, &[&str]); 8] = [
        (repository("hertz"), &["frame.cells=[192, 192]"]),
        (repository("hertz"), &["frame.cells=[192, 192]", "output.fields=[]"]),
        (repository("cattaneo-mindlin"), &["frame.cells=[128, 128]"]),
        (repository("sphere-wear"), &["output.fields=[]"]),
        (repository("pin-in-hole"), &[]),
        (repository("hertz"), &["frame.cells=[12, 12]", "body1.truncated=3.0"]),
        (repository("hertz"), &[points]),
        (be, &[]),
    ];
    for (path, sets) in cases {
        let [foretold, held] = foretold_and_held(&path, sets);
        let ratio = foretold / held;
        assert!((0.8..=1.2).contains(&ratio), "{} {sets:?}: {foretold} {held} {ratio}", path.display());
    }
}
