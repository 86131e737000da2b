//! Report file in a folder of results.

use std::fs::{self, File};
use std::io::Read;
use std::path::Path;

/// Name of the report file.
pub const REPORT: &str = "report.html";

/// Whether the file at `path` is a report of this program.
pub fn is_report(path: &Path) -> bool {
    // Reading from a pipe or device would block.
    if !path.is_file() {
        return false;
    }
    let mut head = [0; 512];
    let read = File::open(path).and_then(|mut file| file.read(&mut head)).unwrap_or(0);
    String::from_utf8_lossy(&head[..read]).contains(r#"<meta name="generator" content="orthowear">"#)
}

/// Removes the report of this program from `directory`. Another file of this name stays.
pub fn remove_stale_report(directory: &Path) {
    let path = directory.join(REPORT);
    if is_report(&path) {
        // A failure is ignored, because the old report still shows the SHA-256 of its scene.
        let _ = fs::remove_file(path);
    }
}
