//! Disks without room: a limit on the size of files, so that no file system has to be made.

use std::path::Path;

use super::job::{Job, results, whole};

const NONE: &str = "output.fields=[]";
const ALL: &str = "output.fields=[\"vtu\", \"svg\"]";

/// Every file but the summary is as that of the run that was not interrupted.
#[track_caller]
fn assert_files_of_whole(out: &Path) {
    let (found, expected) = (results(out), whole());
    let same = |(name, content): (&String, &Vec<u8>)| name == "summary.json" || expected[name] == *content;
    assert!(found.len() > 1 && found.iter().all(same), "{:?}", found.keys());
}

/// Truth (rel-disk-full, docs/checkpoints.md): where no more can be written (a limit on the size of files: of none, of small ones, of
/// the checkpoints alone) the run ends with exit code 4 and names the file; the checkpoints stay as they were, and the run goes
/// on once there is room.
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

/// Truth: the same for files that may not get larger, as on a disk that fills up while the run works: the last checkpoint that fitted is gone on with.
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
    assert!(code == Some(0) && text.contains("going on after step") && !text.contains("damaged"), "{text}");
    assert_files_of_whole(&job.out);
}
