//! Full disks, simulated by a limit on the size of files.

use std::path::Path;

use super::job::{Job, results, whole};

const NONE: &str = "output.fields=[]";
const ALL: &str = "output.fields=[\"vtu\", \"svg\"]";

/// Requires that every file except the summary equals the file of the uninterrupted run.
#[track_caller]
fn assert_files_of_whole(out: &Path) {
    let (found, expected) = (results(out), whole());
    let same = |(name, content): (&String, &Vec<u8>)| name == "summary.json" || expected[name] == *content;
    assert!(found.len() > 1 && found.iter().all(same), "{:?}", found.keys());
}

/// Truth: case `rel-disk-full` of docs/verification.md, and docs/checkpoints.md. If the run can write nothing more, it ends with
/// exit code 4. The checkpoints stay unchanged, and the run resumes when there is space again.
#[test]
fn a_full_disk() {
    for (bytes, fields) in [(0, ALL), (4096, ALL), (50_000, ALL), (50_000, NONE)] {
        assert_goes_on_after_a_full_disk(bytes, fields);
    }
}

fn assert_goes_on_after_a_full_disk(bytes: u64, fields: &str) {
    let job = Job::new();
    job.interrupt(&["--set", fields], 25);
    let kept = job.checkpoints();
    let (code, text) = job.limited(&["--resume", "--quiet", "--set", fields], bytes);
    assert!(code == Some(4) && text.contains("writ") && text.contains("/out/"), "{code:?} {text}");
    assert_eq!(text.contains("checkpoint"), fields == NONE, "{text}");
    assert!(job.checkpoints() == kept, "a checkpoint was changed");
    let (code, text) = job.run(&["--resume", "--set", fields]);
    assert_eq!(code, Some(0), "{text}");
    assert_files_of_whole(&job.out);
}

/// Truth: docs/checkpoints.md: a run resumes from its last complete checkpoint.
#[test]
fn a_disk_that_fills_up() {
    let job = Job::new();
    job.interrupt(&["--set", NONE], 5);
    let first = job.checkpoints();
    let room = first.iter().map(|(_, content)| content.len() as u64).max().unwrap() + 15_000;
    let job = Job::new();
    let (code, text) = job.limited(&["--quiet", "--set", NONE], room);
    assert!(code == Some(4) && text.contains("checkpoint") && text.contains("ulimit -f"), "{code:?} {text}");
    let number = job.number();
    assert!((5..70).contains(&number), "{number}");
    assert!(job.checkpoints().iter().all(|(_, content)| content.len() as u64 <= room));
    let (code, text) = job.run(&["--resume", "--set", NONE]);
    assert!(code == Some(0) && text.contains("resuming in step") && !text.contains("damaged"), "{text}");
    assert_files_of_whole(&job.out);
}
