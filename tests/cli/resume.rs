//! `--resume`: runs that were interrupted, killed or out of disk space end with the results of uninterrupted runs.
#![cfg(unix)]

mod disk;
mod job;

use std::fs;
use std::time::{Duration, Instant};

use crate::moved::{SPHERE, layer};
use job::{Job, assert_whole, results, send, whole};

/// Truth: case `rel-restart-equals-continuous` of docs/verification.md, and docs/checkpoints.md. An uninterrupted run gives the
/// same files byte for byte. The interrupted runs use different numbers of threads.
#[test]
fn interrupted_runs_go_on() {
    let job = Job::new();
    let text = job.interrupt(&["--threads", "1"], 3);
    assert!(text.contains("INTERRUPTED") && text.contains("to resume: orthowear run"), "{text}");
    assert!(text.contains("out --resume\n"), "{text}");
    let entries = job.summary()["steps"].as_array().unwrap().len();
    assert!(job.summary()["status"] == "interrupted" && entries >= 3, "{entries}");
    let text = job.interrupt(&["--threads", "3", "--resume"], 30);
    assert!(text.contains("resuming in step \"press\" after entry "), "{text}");
    assert!(job.summary()["steps"].as_array().unwrap().len() >= entries + 29);
    let (code, text) = job.run(&["--threads", "2", "--resume"]);
    assert_eq!(code, Some(0), "{text}");
    assert_whole(&job.out);
    let names: Vec<_> = fs::read_dir(&job.out).unwrap().map(|entry| entry.unwrap().file_name()).collect();
    assert_eq!(names.len(), whole().len(), "something is left: {names:?}");

    let before = fs::read(job.out.join("summary.json")).unwrap();
    let (code, text) = job.run(&["--resume"]);
    assert!(code == Some(0) && text.contains("already converged"), "{text}");
    assert_eq!(fs::read(job.out.join("summary.json")).unwrap(), before);
}

/// Truth: an uninterrupted run gives the same files byte for byte. The frame grows in the wear jump of entry 50, between the
/// interrupts.
#[test]
fn runs_go_on_whose_frame_has_grown() {
    let sets = ["wear.i=2e-6", "frame.half_width=[1.1, 1.1]", "frame.cells=[18, 18]"];
    let sets: Vec<&str> = sets.iter().flat_map(|set| ["--set", *set]).collect();
    let whole = Job::new();
    let (code, text) = whole.run(&sets);
    assert_eq!(code, Some(0), "{text}");
    assert_eq!(whole.summary()["frame"]["cells"], serde_json::json!([28, 28]));
    let more = |others: &[&'static str]| [&sets, others].concat();
    let job = Job::new();
    job.interrupt(&more(&["--threads", "1"]), 43);
    let entries = job.summary()["steps"].as_array().unwrap().len() as u64;
    job.interrupt(&more(&["--threads", "3", "--resume"]), 54_u64.saturating_sub(entries).max(1));
    assert_eq!(job.summary()["frame"]["cells"], serde_json::json!([28, 28]));
    job.interrupt(&more(&["--threads", "2", "--resume"]), 3);
    let (code, text) = job.run(&more(&["--threads", "1", "--resume"]));
    assert_eq!(code, Some(0), "{text}");
    let [found, expected] = [&job, &whole].map(|job| results(&job.out));
    assert_eq!(found.keys().collect::<Vec<_>>(), expected.keys().collect::<Vec<_>>());
    for (name, content) in &expected {
        assert!(found[name] == *content, "{name} differs");
    }
}

/// Truth: an uninterrupted run gives the same files byte for byte. The interrupts come before and after moves of the mesh.
#[test]
fn runs_go_on_whose_meshes_have_moved() {
    let place = || {
        let job = Job::new();
        let scene =
            format!("{SPHERE}[output]\nfields = [\"vtu\", \"volume\"]\ncheckpoint = {{ seconds = 1e-9 }}\n");
        fs::write(job.folder.path().join("scene.toml"), scene).unwrap();
        fs::write(job.folder.path().join("layer.msh"), layer([2.4; 2], 1.2, [18, 18, 4])).unwrap();
        job
    };
    let whole = place();
    let (code, text) = whole.run(&["--threads", "2"]);
    assert_eq!(code, Some(0), "{text}");
    assert!(whole.summary()["mesh_moves"].as_u64() > Some(2), "{text}");
    let job = place();
    job.interrupt(&["--threads", "1"], 1);
    assert_eq!(job.summary()["mesh_moves"], 0);
    let more = ["--threads", "2", "--resume"];
    while job.summary()["mesh_moves"].as_u64() < Some(2) {
        job.interrupt(&more, 2);
    }
    job.interrupt(&["--threads", "1", "--resume"], 1);
    let (code, text) = job.run(&["--resume"]);
    assert_eq!(code, Some(0), "{text}");
    let [found, expected] = [&job, &whole].map(|job| results(&job.out));
    assert_eq!(found.keys().collect::<Vec<_>>(), expected.keys().collect::<Vec<_>>());
    for (name, content) in &expected {
        assert!(found[name] == *content, "{name} differs");
    }
}

/// Truth: case `rel-kill-any-time` of docs/verification.md. The files equal those of an uninterrupted run byte for byte,
/// although SIGKILL ends this run at random moments. Only the entries after the last checkpoint are lost.
#[test]
fn killed_runs_go_on() {
    let job = Job::new();
    let mut random = 20_261_122_u64;
    let mut next = |below: u64| {
        // Linear congruential generator with Knuth's multiplier.
        random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (random >> 33) % below
    };
    for kill in 0..6 {
        let before = job.number();
        let more: &[&str] = if kill == 0 { &["--quiet"] } else { &["--quiet", "--resume"] };
        job.kill(more, 1 + next(6), Duration::from_micros(next(8_000)));
        assert!(job.number() > before, "checkpoints before the kill are lost");
        assert!(!job.out.join("summary.json").exists(), "results before the end");
    }
    let (code, text) = job.run(&["--resume"]);
    assert_eq!(code, Some(0), "{text}");
    assert_whole(&job.out);
}

/// Truth: docs/checkpoints.md: without a checkpoint, a run with `--resume` starts from the beginning and reports this.
#[test]
fn without_a_checkpoint() {
    let job = Job::new();
    let (code, text) = job.run(&["--resume", "--set", "output.fields=[]"]);
    assert!(
        code == Some(0) && text.contains("no checkpoint in") && text.contains("starts from the beginning"),
        "{text}"
    );
}

/// Truth: docs/checkpoints.md: a checkpoint of another scene or version is refused. The message lists the differences, and the
/// checkpoint stays unchanged. The title may differ.
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

    let found = orthowear::output::checkpoint::read(&job.out).unwrap().unwrap();
    let mut origin = found.provenance.clone();
    origin.version = "0.0.9".to_owned();
    orthowear::output::checkpoint::write(&job.out, found.number + 1, &origin, &"of another version").unwrap();
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

/// Truth: case `rel-corrupt-checkpoint` of docs/verification.md, and docs/checkpoints.md. A damaged checkpoint is reported, and
/// the run resumes from the previous checkpoint.
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

/// Truth: docs/checkpoints.md: a new run moves an unfinished run to the folder previous-1, where it can be resumed.
#[test]
fn a_new_run_sets_an_unfinished_one_aside() {
    let job = Job::new();
    job.kill(&[], 30, Duration::ZERO);
    let small = ["--set", "steps.press.increments=1", "--set", "steps.fret.cycles.jumps=1"];
    let (code, text) = job.run(&small);
    assert!(
        code == Some(0)
            && text.contains("previous-1")
            && text.contains("To resume it: the same command with --resume --out "),
        "{text}"
    );
    let aside = Job { out: job.out.join("previous-1"), folder: job.folder };
    let (code, text) = aside.run(&["--resume"]);
    assert_eq!(code, Some(0), "{text}");
    assert_whole(&aside.out);
}

/// Truth: docs/checkpoints.md: only one run at a time may write into a directory.
#[test]
fn one_run_at_a_time() {
    let job = Job::new();
    let first = job.start(&["--quiet"], 1);
    // The first run is stopped while the second run tries to start.
    send(&first, libc::SIGSTOP);
    let (code, text) = job.run(&["--set", "steps.press.increments=1"]);
    send(&first, libc::SIGCONT);
    assert!(code == Some(4) && text.contains("another run is writing into"), "{text}");
    assert_eq!(first.wait_with_output().unwrap().status.code(), Some(0));
    assert_whole(&job.out);
}

/// Truth: an uninterrupted run gives the same files byte for byte. The interrupt comes while the run evaluates the points inside
/// the body.
#[test]
fn points_inside_may_be_interrupted() {
    let scene = r#"
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
half_width = [0.5, 0.5]
cells = [16, 16]
[gap]
kind = "sphere"
radius = 10.0
[[steps]]
name = "press"
normal_force = 1000.0
increments = 3
[output]
fields = []
checkpoint = { seconds = 1e-9 }
[[output.inside]]
name = "cut"
body = 1
from = [-0.4, 0.0, -0.1]
to = [0.4, 0.0, -0.1]
across = [-0.4, 0.0, -0.6]
points = [100, 60]
"#;
    let [whole, job] = [(); 2].map(|()| Job::new());
    for job in [&whole, &job] {
        fs::write(job.folder.path().join("scene.toml"), scene).unwrap();
    }
    let (code, text) = whole.run(&[]);
    assert_eq!(code, Some(0), "{text}");
    job.interrupt(&["--threads", "1"], 1);
    let names = |job: &Job, end: &str| results(&job.out).keys().filter(|name| name.ends_with(end)).count();
    let done = job.summary()["steps"].as_array().unwrap().len();
    assert!(done < 3 && names(&job, ".csv") == done + 1 && names(&job, ".vtu") == done, "{done}");
    let (code, text) = job.run(&["--resume"]);
    assert_eq!(code, Some(0), "{text}");
    let [found, expected] = [&job, &whole].map(|job| results(&job.out));
    assert_eq!(found.keys().collect::<Vec<_>>(), expected.keys().collect::<Vec<_>>());
    for (name, content) in &expected {
        assert!(found[name] == *content, "{name} differs");
    }
}

/// Truth: an uninterrupted run gives the same files byte for byte. The interrupts come while the run computes the fields of the
/// body, after it has written the fields of the frame.
#[test]
fn fields_of_bodies_may_be_interrupted() {
    let scene = r#"
[materials.steel]
model = "isotropic"
E = 210e3
nu = 0.3
[body1]
kind = "fe"
material = "steel"
mesh = "layer.msh"
contact = "top"
fixed = [{ group = "base" }]
[body2]
kind = "rigid"
[frame]
kind = "grid"
half_width = [1.0, 1.0]
cells = [12, 12]
[gap]
kind = "sphere"
radius = 50.0
[[steps]]
name = "press"
approach = 0.006
increments = 6
[output]
fields = ["vtu", "volume", "error", "svg"]
"#;
    let [whole, job] = [(); 2].map(|()| Job::new());
    for job in [&whole, &job] {
        fs::write(job.folder.path().join("layer.msh"), layer([2.4; 2], 1.2, [24, 24, 8])).unwrap();
        fs::write(job.folder.path().join("scene.toml"), scene).unwrap();
    }
    let (code, text) = whole.run(&[]);
    assert_eq!(code, Some(0), "{text}");
    for (k, more) in [(1, &["--threads", "1"][..]), (2, &["--threads", "1", "--resume"])] {
        let child = job.command(more).spawn().unwrap();
        let frame = job.out.join(format!(".incoming/frame_{k:04}.vtu"));
        let started = Instant::now();
        while !frame.exists() {
            assert!(started.elapsed().as_secs() < 120, "no {}", frame.display());
        }
        send(&child, libc::SIGINT);
        child.wait_with_output().unwrap();
    }
    let (code, text) = job.run(&["--resume"]);
    assert_eq!(code, Some(0), "{text}");
    let [found, expected] = [&job, &whole].map(|job| results(&job.out));
    assert_eq!(found.keys().collect::<Vec<_>>(), expected.keys().collect::<Vec<_>>());
    for (name, content) in &expected {
        assert!(found[name] == *content, "{name} differs");
    }
}

/// Truth: docs/checkpoints.md: the message names the missing files of an interrupted run, and the run resumes.
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
