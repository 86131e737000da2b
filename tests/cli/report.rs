//! `orthowear report`: refused directories, pages of damaged results, and pages in a browser.

use std::fs;
use std::path::Path;
use std::process::Output;

use serde_json::Value;

use crate::bad_input::SOUND;
use crate::tools::{browser, orthowear};

/// A title that would be a script on a page without escaping.
const HOSTILE: &str = "</script><script>alert(1)</script> & \\\"<b>";

fn run(folder: &Path, name: &str, scene: &str, options: &[&str]) -> i32 {
    let path = folder.join(format!("{name}.toml"));
    fs::write(&path, scene).unwrap();
    let mut program = orthowear();
    program.current_dir(folder).arg("run").arg(path).args(["--quiet", "--out", name]).args(options);
    program.output().unwrap().status.code().unwrap()
}

fn sound(folder: &Path) {
    assert_eq!(run(folder, "run", SOUND, &["--set", "output.fields=[\"vtu\", \"svg\"]"]), 0);
}

fn report(folder: &Path, arguments: &[&str]) -> (i32, String) {
    let Output { status, stderr, .. } =
        orthowear().current_dir(folder).arg("report").args(arguments).output().unwrap();
    (status.code().unwrap(), String::from_utf8(stderr).unwrap())
}

fn page(folder: &Path, name: &str) -> String {
    fs::read_to_string(folder.join(name).join("report.html")).unwrap()
}

/// Truth: docs/command-line.md: the message names what was found, what is expected, and the fix.
#[test]
fn directories_without_results_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    fs::create_dir(path.join("empty")).unwrap();
    fs::create_dir_all(path.join("other/.hidden")).unwrap();
    for name in ["a.txt", "b.txt", "c.txt", "d.txt", "e.txt", "f.txt", "g.txt"] {
        fs::write(path.join("other").join(name), "").unwrap();
    }
    fs::create_dir_all(path.join("begun/.incoming")).unwrap();
    let expected = "expected summary.json (of a run), compare.json or study.json";
    let mend = "give the output directory of orthowear run, compare or study";
    for (name, words) in [
        ("empty", [expected, "it is empty", mend]),
        ("other", [expected, "found: a.txt, b.txt, c.txt, d.txt, e.txt and 2 more", mend]),
        ("begun", [expected, "a run is active in it, or was killed before", "--resume"]),
        ("absent", ["absent cannot be read", "No such file", mend]),
        ("other/a.txt", ["a.txt cannot be read", "Not a directory", mend]),
    ] {
        let (code, said) = report(path, &[name]);
        assert_eq!(code, 2, "{said}");
        assert!(words.iter().all(|word| said.contains(word)), "{name}: {said}");
        assert!(!path.join(name).join("report.html").exists());
    }
}

/// Truth: docs/command-line.md: a file that cannot be written gives exit code 4, a directory in its place gives exit code 2.
#[test]
fn places_that_cannot_be_written_are_named() {
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir_all(folder.path().join("run")).unwrap();
    fs::write(folder.path().join("run/summary.json"), "{}").unwrap();
    fs::write(folder.path().join("file"), "").unwrap();
    for (out, code, words) in [
        ("file/page.html", 4, "cannot write"),
        ("absent/page.html", 4, "cannot write"),
        ("run", 2, "is a directory"),
    ] {
        let (found, said) = report(folder.path(), &["run", "--out", out]);
        assert_eq!(found, code, "{said}");
        assert!(said.contains(words) && said.contains(out), "{said}");
    }
    // A report overwrites an earlier report, but no other file.
    let before = fs::read(folder.path().join("run/summary.json")).unwrap();
    for out in ["run/summary.json", "/dev/full"] {
        let (code, said) = report(folder.path(), &["run", "--out", out]);
        assert!(
            code == 2 && said.contains("not recognised as a report of orthowear") && said.contains(out),
            "{said}"
        );
    }
    assert_eq!(fs::read(folder.path().join("run/summary.json")).unwrap(), before);
    assert_eq!(report(folder.path(), &["run", "--out", "page.html"]).0, 0);
    let (code, said) = report(folder.path(), &["run", "--out", "page.html"]);
    assert_eq!(code, 0, "{said}");
    assert!(folder.path().join("page.html").is_file() && !folder.path().join("run/report.html").exists());
}

/// Truth: the same results give the same page, byte for byte. The page contains values of the summary.
#[test]
fn pages_are_the_same_each_time() {
    let folder = tempfile::tempdir().unwrap();
    sound(folder.path());
    assert_eq!(report(folder.path(), &["run"]).0, 0);
    let first = page(folder.path(), "run");
    assert_eq!(report(folder.path(), &["run"]).0, 0);
    assert_eq!(page(folder.path(), "run"), first);
    assert_eq!(report(folder.path(), &["run", "--out", "elsewhere.html"]).0, 0);
    assert_eq!(fs::read_to_string(folder.path().join("elsewhere.html")).unwrap(), first);
    let summary: serde_json::Value =
        serde_json::from_slice(&fs::read(folder.path().join("run/summary.json")).unwrap()).unwrap();
    assert_eq!(summary["scene"]["steps"][1]["cycles"]["count"], 1000, "the scene is in the summary");
    for words in ["sound", summary["scene_sha256"].as_str().unwrap(), "Converged", "fretting", "body1"] {
        assert!(first.contains(words), "{words}");
    }
    for address in first.split("src=\"").skip(1).chain(first.split("href=\"").skip(1)) {
        assert!(address.starts_with("data:"), "{}", &address[..60]);
    }
}

/// Truth: docs/results.md: a new run removes the report of the earlier run. It keeps a file of the user with the same name.
#[test]
fn pages_of_earlier_results_go_when_there_are_new_ones() {
    let folder = tempfile::tempdir().unwrap();
    sound(folder.path());
    assert_eq!(report(folder.path(), &["run"]).0, 0);
    sound(folder.path());
    assert!(!folder.path().join("run/report.html").exists());
    fs::write(folder.path().join("run/report.html"), "mine").unwrap();
    sound(folder.path());
    assert_eq!(page(folder.path(), "run"), "mine");
}

/// Truth: each damaged or missing file is reported, on standard error and on the page. The page shows the other files.
#[test]
fn damaged_files_are_named_and_the_rest_is_shown() {
    let folder = tempfile::tempdir().unwrap();
    sound(folder.path());
    let out = folder.path().join("run");
    let files = |end: &str| {
        fs::read_dir(&out)
            .unwrap()
            .flatten()
            .filter(|e| e.file_name().to_string_lossy().ends_with(end))
            .count()
    };
    assert!(files(".vtu") > 6 && out.join("pressure.svg").exists());
    let cut = |name: &str, bytes: usize| {
        let content = fs::read(out.join(name)).unwrap();
        fs::write(out.join(name), &content[..bytes]).unwrap();
    };
    cut("frame_0001.vtu", 3000);
    cut("body1_0001.vtu", 200);
    cut("pressure.svg", 500);
    fs::remove_file(out.join("history.svg")).unwrap();
    let (code, said) = report(folder.path(), &["run"]);
    assert_eq!(code, 0, "{said}");
    let whole = page(folder.path(), "run");
    for words in [
        "frame_0001.vtu is damaged and omitted: ",
        "are truncated or damaged",
        "body1_0001.vtu is damaged and omitted: it has no raw appended data",
        "pressure.svg is damaged and omitted: its end is missing",
        "files that summary.json lists are missing: history.svg",
    ] {
        assert!(said.contains(words) && whole.contains(words.split('`').next().unwrap()), "{words}: {said}");
    }
    assert!(
        whole.contains("\"file\":2,") && !whole.contains("\"file\":1,\"mesh\""),
        "frame 2 is on the maps, 1 is not"
    );

    cut("summary.json", 300);
    let (code, said) = report(folder.path(), &["run"]);
    assert_eq!(code, 0, "{said}");
    assert!(said.contains("summary.json is damaged: EOF while parsing"), "{said}");
    let rest = page(folder.path(), "run");
    assert!(
        rest.contains("OUTCOME UNKNOWN: summary.json cannot be read") && rest.contains("id=\"map-canvas\"")
    );
    for (what, words) in
        [("[1, 2]", "it is not a JSON object"), ("{\"steps\": [], \"units\": 3, \"scene\": [1]}", "")]
    {
        fs::write(out.join("summary.json"), what).unwrap();
        let (code, said) = report(folder.path(), &["run"]);
        assert!(code == 0 && said.contains(words), "{said}");
    }
}

/// Truth: the number of a field file is the number of its entry in `summary.steps`, counted from 1. Missing files do not change
/// this number.
#[test]
fn entries_keep_their_names_without_the_files_of_others() {
    let folder = tempfile::tempdir().unwrap();
    sound(folder.path());
    for name in ["frame_0002.vtu", "body1_0002.vtu"] {
        fs::remove_file(folder.path().join("run").join(name)).unwrap();
    }
    let (code, said) = report(folder.path(), &["run"]);
    assert!(code == 0 && said.contains("files that summary.json lists are missing"), "{said}");
    let page = page(folder.path(), "run");
    let (_, data) = page.split_once("<script type=\"application/json\" id=\"data\">").unwrap();
    let data: Value = serde_json::from_str(data.split_once("</script>").unwrap().0).unwrap();
    let pairs = |list: &str| -> Vec<[u64; 2]> {
        let pair = |item: &Value| ["file", "entry"].map(|key| item[key].as_u64().unwrap());
        data[list].as_array().unwrap().iter().map(pair).collect()
    };
    let frames = pairs("frames");
    assert!(
        frames.len() >= 4 && frames.iter().all(|[file, entry]| *file == entry + 1 && *file != 2),
        "{frames:?}"
    );
    assert!(data["bodies"].as_array().unwrap().iter().any(|body| body["body"] == 1 && body["file"] == 1));
}

/// Truth: a report reads no file outside of its directory, even if the summary names the file.
#[test]
fn files_outside_of_the_directory_are_not_read() {
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join("run")).unwrap();
    fs::write(folder.path().join("secret.svg"), "<svg>secret</svg>").unwrap();
    let summary = "{\"status\": \"converged\", \"steps\": [], \"files\": [\"../secret.svg\"]}";
    fs::write(folder.path().join("run/summary.json"), summary).unwrap();
    assert_eq!(report(folder.path(), &["run"]).0, 0);
    let page = page(folder.path(), "run");
    assert!(!page.contains("data:image/svg+xml"), "{page}");
}

/// The scene `SOUND` with a hostile title and step name, and with a tangential force beyond the friction limit.
fn sliding() -> String {
    let scene = SOUND.replace("title = \"sound\"", &format!("title = \"{HOSTILE}\""));
    let scene = scene.replace("name = \"indent\"", &format!("name = \"{HOSTILE}\""));
    let pull = "[[steps]]\nname = \"pull\"\ntangential_force = [1e5, 0.0]\n[solver]";
    scene
        .replace("cycles = { count = 1000, amplitude = 0.05, jumps = 4 }", "shift = { distance = 0.002 }")
        .replace("[solver]", pull)
}

/// Truth: HTML. Texts of the user are escaped in tags and in the data block, so they remain texts.
#[test]
fn texts_are_escaped() {
    let folder = tempfile::tempdir().unwrap();
    assert_eq!(run(folder.path(), "run", &sliding(), &["--set", "output.fields=[\"vtu\", \"svg\"]"]), 3);
    assert_eq!(report(folder.path(), &["run"]).0, 0);
    let page = page(folder.path(), "run");
    assert!(!page.contains("<script>alert(1)") && !page.contains("<b>"));
    assert!(page.contains("&lt;script&gt;alert(1)") && page.contains("\\u003cscript>alert(1)"));
    assert!(page.contains("NOT CONVERGED. The results so far are shown."));
}

/// Truth: in a browser, the values of the page equal the values read by meshio and the summary (tests/browser/report.py).
#[test]
fn reports_in_a_browser() {
    let folder = tempfile::tempdir().unwrap();
    let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/compare-sphere-on-block.toml");
    let path = folder.path();
    sound(path);
    let fields = ["--set", "output.fields=[\"vtu\", \"svg\"]"];
    assert_eq!(run(path, "sliding", &sliding(), &fields), 3);
    assert_eq!(run(path, "failed", &SOUND.replace("radius = 50.0", "radius = -50.0"), &[]), 2);
    let meshed = |command: &str, out: &str, options: &[&str]| {
        let mut program = orthowear();
        program.current_dir(path).arg(command).arg(&scene).args(["--quiet", "--out", out]).args(options);
        assert_eq!(program.output().unwrap().status.code(), Some(0));
    };
    meshed("run", "meshed", &["--set", "output.fields=[\"vtu\", \"svg\", \"stress\"]"]);
    meshed("compare", "compare", &["--variants", "FE-FE,HS-HS"]);
    for name in ["run", "sliding", "failed", "meshed", "compare"] {
        let (code, said) = report(path, &[name]);
        assert!(code == 0 && said.is_empty(), "{name}: {said}");
    }
    browser("report.py", path);
}
