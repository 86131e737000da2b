//! Studies that are interrupted or run in parts give the table and files of an uninterrupted study.

use std::fs;
use std::path::Path;

use serde_json::Value;

use super::study::{TWO_AXES, folder, json, orthowear};

/// Truth: an uninterrupted study gives the same table and curves bit by bit. SIGKILL ends the study during a run. Finished runs
/// stay unchanged, and the interrupted run resumes from its checkpoint.
#[test]
#[cfg(unix)]
fn killed_studies_go_on() {
    let folder = folder(&TWO_AXES.replace("[0, 30.0]", "[0, 15, 30.0]"));
    let arguments = |out: &'static str| {
        let set = ["--set", "steps.fretting.cycles.jumps=16", "--set", "output.checkpoint.seconds=1e-9"];
        [&["study", "study.toml", "--threads", "1", "--out", out][..], &set].concat()
    };
    let (code, _, errors) = orthowear(folder.path(), &arguments("whole"));
    assert_eq!(code, Some(0), "{errors}");
    let names: Vec<String> = json(&folder.path().join("whole/study.json"))["runs"]
        .as_array()
        .unwrap()
        .iter()
        .map(|run| run["folder"].as_str().unwrap().to_owned())
        .collect();
    let out = folder.path().join("killed");
    let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_orthowear"));
    command.current_dir(folder.path()).args(arguments("killed")).arg("--quiet");
    let mut child = command.spawn().unwrap();
    let started = std::time::Instant::now();
    while !out.join(&names[2]).join("checkpoint-2.bin").exists() {
        assert!(started.elapsed().as_secs() < 120, "the third run has no checkpoint");
        std::thread::sleep(std::time::Duration::from_micros(200));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    let summary = |name: &String| fs::read(out.join(name).join("summary.json")).ok();
    let before: Vec<Option<Vec<u8>>> = names.iter().map(summary).collect();
    let done = before.iter().flatten().count();
    assert!((2..names.len()).contains(&done) && !out.join("study.csv").exists(), "{done} runs were done");
    let resumed = [arguments("killed"), vec!["--resume"]].concat();
    for kept in [done, names.len()] {
        let (code, text, errors) = orthowear(folder.path(), &resumed);
        assert_eq!(code, Some(0), "{errors}");
        assert!(text.contains(&format!("6 runs, {kept} kept from an earlier run")), "{text}");
        for (name, before) in names.iter().zip(&before).filter(|(_, before)| before.is_some()) {
            assert_eq!(&summary(name), before, "{name} was computed again");
        }
        let table = |out: &str| fs::read(folder.path().join(out).join("study.csv")).unwrap();
        assert_eq!(table("whole"), table("killed"));
    }
    let curves = |out: &str| {
        let study = json(&folder.path().join(out).join("study.json"));
        study["runs"].as_array().unwrap().iter().map(|run| run["curves"].clone()).collect::<Vec<_>>()
    };
    assert_eq!(curves("whole"), curves("killed"));
    let other = [resumed, vec!["--set", "friction.mu_L=0.45"]].concat();
    let (code, text, errors) = orthowear(folder.path(), &other);
    assert!(
        code == Some(0) && !text.contains("kept from an earlier run"),
        "runs of another scene are no results: {text}{errors}"
    );
}

/// Files of a folder except `summary.json`, because it contains times.
pub(super) fn files(folder: &Path) -> Vec<(String, Vec<u8>)> {
    let entries =
        fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).filter(|path| path.is_file());
    let name = |path: &Path| path.file_name().unwrap().to_string_lossy().into_owned();
    let mut files: Vec<_> = entries.map(|path| (name(&path), fs::read(&path).unwrap())).collect();
    files.retain(|(name, _)| name != "summary.json");
    files.sort();
    files
}

/// Truth: a single run with the values of a run of the study gives the same files bit by bit, except for times.
#[test]
fn runs_of_a_study_are_single_runs() {
    let study = r#"
[study]
scene = "scene.toml"
[[axes]]
keys = ["body1.fibre.tilt"]
values = [0, 30]
[[axes]]
keys = ["steps.fretting.cycles.angle"]
values = [0, 45]
[output]
collect = ["fretting.worn_volume"]
"#;
    let folder = folder(study);
    let fields = ["--set", "output.fields=[\"vtu\"]"];
    let (code, _, errors) =
        orthowear(folder.path(), &[&["study", "study.toml", "--threads", "2"][..], &fields].concat());
    assert_eq!(code, Some(0), "{errors}");
    let study = json(&folder.path().join("study.study/study.json"));
    for run in study["runs"].as_array().unwrap() {
        let mut arguments = vec!["run", "scene.toml", "--out", "alone", "--quiet", fields[0], fields[1]];
        let values = run["values"].as_object().unwrap();
        let sets: Vec<String> = values.iter().map(|(key, value)| format!("{key}={value}")).collect();
        sets.iter().for_each(|set| arguments.extend(["--set", set]));
        assert_eq!(orthowear(folder.path(), &arguments).0, Some(0));
        let (alone, own) = (
            folder.path().join("alone"),
            folder.path().join("study.study").join(run["folder"].as_str().unwrap()),
        );
        let (found, wanted) = (files(&own), files(&alone));
        assert!(wanted.iter().any(|(name, _)| name.ends_with(".vtu")));
        let names =
            |files: &[(String, Vec<u8>)]| files.iter().map(|(name, _)| name.clone()).collect::<Vec<_>>();
        assert_eq!(names(&found), names(&wanted));
        for ((name, found), (_, wanted)) in found.iter().zip(&wanted) {
            // history.csv contains times.
            if name != "history.csv" {
                assert!(found == wanted, "{name} of {}", run["folder"]);
            }
        }
        let (own, alone) = (json(&own.join("summary.json")), json(&alone.join("summary.json")));
        let entries = |summary: &Value| {
            let mut entries = summary["steps"].clone();
            for entry in entries.as_array_mut().unwrap() {
                entry["seconds"] = Value::Null;
            }
            entries
        };
        assert_eq!(entries(&own), entries(&alone));
        for key in ["warnings", "skipped", "status", "files", "frame"] {
            assert_eq!(own[key], alone[key], "{key}");
        }
    }
}

/// Truth: the table of a study in one process. The runs may be computed in parts and in any order. Runs whose results come from
/// another scene count as not run.
#[test]
fn parts_of_a_study_make_its_table() {
    let folder = folder(TWO_AXES);
    let run =
        |arguments: &[&str]| orthowear(folder.path(), &[&["study", "study.toml"][..], arguments].concat());
    assert_eq!(run(&["--out", "whole", "--quiet"]).0, Some(0));
    for part in ["4,2", "3"] {
        let (code, text, errors) = run(&["--out", "parts", "--only", part]);
        assert_eq!(code, Some(0), "{errors}");
        assert!(text.contains("--collect` writes the table"), "{text}");
    }
    assert!(!folder.path().join("parts/study.csv").exists());
    let (code, text, errors) = run(&["--out", "parts", "--collect"]);
    assert_eq!(code, Some(1), "{errors}");
    assert!(
        text.contains("4 runs, 3 of them finished") && text.contains("tilt-0_depth-0.02--50.0: not run"),
        "{text}"
    );
    assert_eq!(run(&["--out", "parts", "--only", "1", "--quiet"]).0, Some(0));
    assert_eq!(run(&["--out", "parts", "--collect", "--quiet"]).0, Some(0));
    let table = |out: &str| fs::read(folder.path().join(out).join("study.csv")).unwrap();
    assert_eq!(table("whole"), table("parts"));
    let (code, text, errors) = run(&["--out", "parts", "--collect", "--set", "friction.mu_L=0.45"]);
    assert!(
        code == Some(1) && text.contains("not run: the results in its folder are from another scene"),
        "{text}{errors}"
    );
    let (code, _, errors) = run(&["--out", "prats", "--collect"]);
    assert!(code == Some(2) && errors.contains("the folder prats does not exist"), "{errors}");
    assert!(!folder.path().join("prats").exists());
    assert_eq!(run(&["--out", "parts", "--collect", "--quiet"]).0, Some(0));
    let npz = |out: &str| fs::read(folder.path().join(out).join("study.npz")).unwrap();
    assert_eq!(npz("whole"), npz("parts"));
    let (code, _, errors) = run(&["--only", "3-5"]);
    assert!(code == Some(2) && errors.contains("the study has runs 1 to 4"), "{errors}");
    let (code, _, errors) = run(&["--only", "0"]);
    assert!(code == Some(2) && errors.contains("numbers from 1"), "{errors}");
}

/// Truth: the table of a study in one process. The test runs the script under bash, with a substitute for Slurm's sbatch.
#[test]
#[cfg(unix)]
fn the_script_for_slurm_runs_the_study() {
    use std::os::unix::fs::PermissionsExt;
    let folder = folder(TWO_AXES);
    assert_eq!(orthowear(folder.path(), &["study", "study.toml", "--out", "whole", "--quiet"]).0, Some(0));
    let arguments =
        ["study", "study.toml", "--out", "it's", "--emit", "slurm", "--jobs", "3", "--threads", "2"];
    let (code, script, errors) = orthowear(folder.path(), &arguments);
    assert_eq!(code, Some(0), "{errors}");
    assert!(!folder.path().join("it's").exists(), "nothing is made");
    assert!(script.contains("#SBATCH --cpus-per-task=2\n"), "{script}");
    fs::write(folder.path().join("study.slurm"), script).unwrap();
    let sbatch = "#!/bin/bash\n\
        for word; do case $word in\n\
        --array=1-*) for task in $(seq 1 \"${word#--array=1-}\"); do SLURM_ARRAY_TASK_ID=$task SLURM_CPUS_PER_TASK=2 bash \"${@: -1}\" || exit; done\n\
        echo '77;cluster';;\n\
        --dependency=*) [ \"$word\" = --dependency=afterany:77 ] && ORTHOWEAR_COLLECT=1 bash \"${@: -1}\";;\n\
        --export=ALL,ORTHOWEAR_COLLECT=1) ;;\n\
        esac; done\n";
    let fake = folder.path().join("sbatch");
    fs::write(&fake, sbatch).unwrap();
    fs::set_permissions(&fake, fs::Permissions::from_mode(0o755)).unwrap();
    let path = format!("{}:{}", folder.path().display(), std::env::var("PATH").unwrap());
    let output = std::process::Command::new("bash")
        .arg("study.slurm")
        .current_dir(folder.path())
        .env("PATH", path)
        .env("ORTHOWEAR", env!("CARGO_BIN_EXE_orthowear"))
        .output()
        .unwrap();
    let text =
        String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{text}");
    assert!(text.contains("4 runs, 4 of them finished"), "{text}");
    let table = |out: &str| fs::read(folder.path().join(out).join("study.csv")).unwrap();
    assert_eq!(table("whole"), table("it's"));
}

/// Truth: docs/study.md: a job requests the memory of the largest run, or the limit of --max-memory.
#[test]
fn jobs_have_the_memory_of_the_largest_run() {
    let cells = |values: &str| format!("[[axes]]\nkeys = [\"frame.cells\"]\nvalues = {values}\n");
    let memory_of_axes = |scene: &str, axes: &str, more: &[&str]| {
        let folder = folder(&format!("[study]\nscene = '{scene}'\n{axes}"));
        let arguments = [&["study", "study.toml", "--emit", "slurm"], more].concat();
        let (code, script, errors) = orthowear(folder.path(), &arguments);
        assert_eq!(code, Some(0), "{errors}");
        let line = script.lines().find_map(|line| line.strip_prefix("#SBATCH --mem=")?.strip_suffix('M'));
        line.unwrap_or_else(|| panic!("{script}")).parse::<u64>().unwrap()
    };
    let memory = |values: &str, more: &[&str]| memory_of_axes("scene.toml", &cells(values), more);
    let large = memory("[[2000, 2000]]", &[]);
    assert!(large > 2000, "{large}");
    assert_eq!(memory("[[16, 16], [2000, 2000]]", &["--jobs", "2"]), large);
    assert_eq!(memory("[[2000, 2000], [16, 16]]", &["--jobs", "2"]), large);
    assert_eq!(memory("[[16, 16]]", &["--max-memory", "64GiB"]), 64 << 10);
    // Friction needs most of the memory. The estimate must not depend on the position of the run with friction.
    let hertz = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/hertz.toml");
    let axis = cells("[[1000, 1000]]") + "[[axes]]\nkeys = [\"friction\"]\n";
    let [none, coulomb] = ["{ \"law\" = \"none\" }", "{ \"law\" = \"coulomb\", \"mu\" = 0.3 }"];
    let orders = [format!("[{none}, {coulomb}]"), format!("[{coulomb}, {none}]")];
    let [first, second] =
        orders.map(|values| memory_of_axes(hertz, &format!("{axis}values = {values}\n"), &[]));
    assert_eq!(first, second);
}

/// Truth: `--collect` has the exit code of the study. The runs of this study were refused for lack of memory, with exit code 4.
#[test]
fn collected_runs_have_the_exit_code_they_ended_with() {
    let folder = folder(TWO_AXES);
    let study = ["study", "study.toml", "--max-memory", "1MB", "--quiet"];
    let (code, _, errors) = orthowear(folder.path(), &study);
    assert_eq!(code, Some(4), "{errors}");
    let (code, _, errors) = orthowear(folder.path(), &["study", "study.toml", "--collect", "--quiet"]);
    assert_eq!(code, Some(4), "{errors}");
}

/// Truth: a panel has one axis as x axis, a second axis as family of curves, and one value of the third axis. Three axes with 2,
/// 2 and 7 values therefore give 2 (2 + 2 + 7) = 22 panels.
#[test]
fn pictures_say_how_many_panels_are_missing() {
    let axis = |key: &str, values: &str| format!("[[axes]]\nkeys = [\"{key}\"]\nvalues = {values}\n");
    let axes = axis("body1.fibre.tilt", "[0, 30]")
        + &axis("steps.indent.approach", "[0.01, 0.02]")
        + &axis("gap.radius", "[40, 42, 44, 46, 48, 50, 52]");
    let folder = folder(&format!(
        "[study]\nscene = \"scene.toml\"\n{axes}[output]\ncollect = [\"indent.normal_force\"]\n"
    ));
    let press = fs::read_to_string(folder.path().join("scene.toml")).unwrap();
    let (before, rest) = press.split_once("[[steps]]\nname = \"fretting\"").unwrap();
    let press = format!("{before}{}", &rest[rest.find("[solver]").unwrap()..]).replace("[16, 16]", "[8, 8]");
    fs::write(folder.path().join("scene.toml"), press).unwrap();
    let (code, _, errors) = orthowear(folder.path(), &["study", "study.toml"]);
    assert_eq!(code, Some(0), "{errors}");
    let picture = fs::read_to_string(folder.path().join("study.study/indent.normal_force.svg")).unwrap();
    assert!(picture.contains("the first 12 of 22 panels; all numbers are in study.csv"));
}
