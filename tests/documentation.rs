//! Tests of the documentation: links resolve, indexes are complete, examples work as described, and references are
//! current.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

fn documents() -> Vec<PathBuf> {
    let folders = ["", "docs", "meshes", "scenes", "benchmarks"].map(|folder| root().join(folder));
    let entries = folders.iter().filter_map(|folder| fs::read_dir(folder).ok()).flatten();
    let paths = entries.map(|entry| entry.expect("a readable entry").path());
    paths.filter(|path| path.extension().is_some_and(|extension| extension == "md")).collect()
}

fn links(text: &str) -> Vec<&str> {
    text.split("](").skip(1).filter_map(|rest| rest.split_once(')')).map(|(target, _)| target).collect()
}

/// Truth: the file of each relative link in a document exists.
#[test]
fn links_between_documents_lead_somewhere() {
    let mut broken = Vec::new();
    for path in documents() {
        let text = fs::read_to_string(&path).expect("readable");
        for target in links(&text) {
            let file = target.split('#').next().unwrap_or("");
            let folder = path.parent().unwrap_or(Path::new(""));
            if !file.is_empty() && !file.contains("://") && !folder.join(file).exists() {
                broken.push(format!("{}: {target}", path.display()));
            }
        }
    }
    assert!(broken.is_empty(), "links that lead nowhere:\n{}", broken.join("\n"));
}

/// Truth: the last lines of .ci/run are the `cargo run` and `./scripts/test` commands of README.md.
#[test]
fn the_check_runs_the_commands_of_the_readme() {
    let read = |name: &str| fs::read_to_string(root().join(name)).expect("readable");
    let (readme, check) = (read("README.md"), read(".ci/run"));
    let commands: Vec<&str> =
        readme.lines().filter(|line| line.starts_with("cargo run") || *line == "./scripts/test").collect();
    let last: Vec<&str> = check.lines().rev().take(commands.len()).collect();
    assert_eq!(commands.len(), 2);
    assert!(commands.iter().eq(last.iter().rev()), "{commands:?} {last:?}");
}

/// Truth: CITATION.cff contains the version of the crate.
#[test]
fn the_citation_names_the_version() {
    let citation = fs::read_to_string(root().join("CITATION.cff")).expect("readable");
    let version = format!("version: {}", env!("CARGO_PKG_VERSION"));
    assert!(citation.lines().any(|line| line == version), "CITATION.cff lacks {version:?}");
}

/// Truth: docs/README.md links to each Markdown file in docs.
#[test]
fn the_index_names_every_page() {
    let index = fs::read_to_string(root().join("docs/README.md")).expect("an index");
    let listed = links(&index);
    for path in documents() {
        let in_docs = path.parent().is_some_and(|folder| folder.ends_with("docs"));
        let name = path.file_name().and_then(|name| name.to_str()).expect("UTF-8");
        if in_docs && name != "README.md" {
            assert!(listed.contains(&name), "docs/README.md does not list {name}");
        }
    }
}

/// Truth: mkdocs.yml lists each Markdown file in docs once.
#[test]
fn the_book_has_every_page() {
    let contents = fs::read_to_string(root().join("mkdocs.yml")).expect("a list of contents");
    let listed = |name: &str| contents.lines().filter(|line| line.ends_with(&format!(" {name}"))).count();
    for path in documents().iter().filter(|path| path.parent().is_some_and(|folder| folder.ends_with("docs")))
    {
        let name = path.file_name().and_then(|name| name.to_str()).expect("UTF-8");
        assert_eq!(listed(name), 1, "mkdocs.yml: {name}");
    }
}

/// Runs a script of scripts/ with the path of the program as its first argument, and asserts that the script succeeds.
fn script(name: &str, arguments: &[PathBuf]) {
    let program = env!("CARGO_BIN_EXE_orthowear");
    let script = root().join("scripts").join(name);
    let output =
        Command::new("python3").arg(script).arg(program).args(arguments).output().expect("python3 starts");
    let printed = [output.stdout, output.stderr].map(|bytes| String::from_utf8_lossy(&bytes).into_owned());
    assert!(output.status.success(), "{}", printed.concat());
    print!("{}", printed.concat());
}

/// Truth: docs/keys.md equals the text generated from the schemas that the program prints for scenes and studies.
#[test]
fn the_reference_of_keys_is_current() {
    script("keys", &[PathBuf::from("--check")]);
}

/// Truth: commands in the pages of first steps and tasks end with the exit code that the page states, and print what
/// the page shows.
#[test]
fn examples_do_what_the_pages_say() {
    let told = ["README", "install", "first-run", "tutorial", "conventions", "faq"];
    let name = |path: &Path| path.file_stem().and_then(|stem| stem.to_str()).unwrap_or("").to_owned();
    let mut pages = documents();
    pages.retain(|path| told.contains(&name(path).as_str()) || name(path).starts_with("task-"));
    pages.sort();
    assert!(pages.len() >= 11, "{pages:?}");
    script("examples", &pages);
}

/// Collects the names of all members of JSON objects, except the members of `scene` and `timings`.
fn members(value: &serde_json::Value, names: &mut std::collections::BTreeSet<String>) {
    match value {
        serde_json::Value::Object(object) => {
            for (name, inner) in object {
                names.insert(name.clone());
                if name != "scene" && name != "timings" {
                    members(inner, names);
                }
            }
        }
        serde_json::Value::Array(values) => values.iter().for_each(|inner| members(inner, names)),
        _ => {}
    }
}

/// Truth: docs/results.md names each member of the summaries of three runs.
#[test]
fn every_field_of_a_summary_is_explained() {
    let page = fs::read_to_string(root().join("docs/results.md")).expect("a document");
    let explained: Vec<&str> = page.split('`').skip(1).step_by(2).collect();
    let runs: [&[&str]; 3] = [
        &["sphere-on-cfrp-block", "frame.cells=[16, 16]", "output.fields=[\"error\", \"loops\", \"stress\"]"],
        &["rolling-cylinders"],
        &["hertz", "frame.cells=[16, 16]", "accuracy=0.05"],
    ];
    let folder = tempfile::tempdir().expect("a folder");
    let mut names = std::collections::BTreeSet::new();
    for run in runs {
        let out = folder.path().join(run[0]);
        let mut command = Command::new(env!("CARGO_BIN_EXE_orthowear"));
        command
            .arg("run")
            .arg(root().join(format!("scenes/{}.toml", run[0])))
            .arg("--quiet")
            .arg("--out")
            .arg(&out);
        command.args(run[1..].iter().flat_map(|value| ["--set", value]));
        assert!(command.env("ORTHOWEAR_CACHE_LIMIT", "0").status().expect("starts").success(), "{run:?}");
        let text = fs::read_to_string(out.join("summary.json")).expect("a summary");
        members(&serde_json::from_str(&text).expect("JSON"), &mut names);
    }
    let missing: Vec<&String> = names.iter().filter(|name| !explained.contains(&name.as_str())).collect();
    assert!(missing.is_empty(), "docs/results.md does not name {missing:?}");
}

/// Truth: each dependency in Cargo.toml has a line in a table of docs/DESIGN.md.
#[test]
fn every_dependency_is_explained() {
    let manifest = fs::read_to_string(root().join("Cargo.toml")).expect("a manifest");
    let manifest: toml::Table = manifest.parse().expect("valid TOML");
    let design = fs::read_to_string(root().join("docs/DESIGN.md")).expect("a document");
    let table: Vec<&str> = design.lines().filter(|line| line.starts_with("| ")).collect();
    for section in ["dependencies", "build-dependencies", "dev-dependencies"] {
        let dependencies = manifest.get(section).and_then(toml::Value::as_table).expect("a table");
        for name in dependencies.keys() {
            let first_cell = |line: &&str| line.split('|').nth(1).unwrap_or("").to_owned();
            let explained = table
                .iter()
                .any(|line| first_cell(line).split([' ', ',', '(', ')']).any(|word| word == name));
            assert!(explained, "docs/DESIGN.md does not explain the dependency {name}");
        }
    }
}

/// Truth: the source text that a defect of tests/mutants.toml replaces occurs exactly once in its file.
#[test]
fn every_mistake_has_its_place() {
    let list = fs::read_to_string(root().join("tests/mutants.toml")).expect("a list of mistakes");
    let list: toml::Table = list.parse().expect("valid TOML");
    let mutants = list["mutant"].as_array().expect("a list");
    assert!(mutants.len() >= 13);
    for mutant in mutants {
        let text = |key: &str| mutant[key].as_str().expect("a text");
        let source = fs::read_to_string(root().join(text("file"))).expect("a source file");
        assert_eq!(source.matches(text("from")).count(), 1, "{}", text("name"));
    }
}

fn test_sources() -> Vec<(String, String)> {
    let (tests, mut found) = (root().join("tests"), Vec::new());
    let mut folders = vec![tests.clone()];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).expect("a readable folder") {
            let path = entry.expect("a readable entry").path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|ending| ending == "rs") {
                let text = fs::read_to_string(&path).expect("a readable file");
                found.push((path.strip_prefix(&tests).expect("below tests").display().to_string(), text));
            }
        }
    }
    found
}

/// Truth: docs/tests.md names every file whose tests are larger with `--thorough`. It also names every test that runs
/// only with `--thorough`.
#[test]
fn what_thorough_tests_add_is_listed() {
    let page = fs::read_to_string(root().join("docs/tests.md")).expect("a document");
    let ignored = format!("#[{}", "ignore");
    for (path, text) in test_sources() {
        let smaller =
            path != "documentation.rs" && (text.contains("usual_or_finest(") || text.contains(&ignored));
        assert!(!smaller || page.contains(&format!("`{path}`")), "docs/tests.md does not name `{path}`");
        for part in text.split(&ignored).skip(1) {
            let name =
                part.split_once("fn ").and_then(|(_, rest)| rest.split_once('(')).expect("a function").0;
            assert!(page.contains(&format!("`{name}`")), "docs/tests.md does not name `{name}`");
        }
    }
}

/// Truth: each test in tests/quick.txt exists, and each area of the verification has at least one test in this file.
#[test]
fn quick_tests_cover_every_area() {
    let quick = fs::read_to_string(root().join("tests/quick.txt")).expect("a list");
    let sources = test_sources();
    let tests_of = |area: &str| -> Vec<String> {
        let (file, folder) = (format!("verification/{area}.rs"), format!("verification/{area}/"));
        let own = sources.iter().filter(|(path, _)| *path == file || path.starts_with(&folder));
        let mut names = Vec::new();
        for (path, text) in own {
            let module = path["verification/".len()..path.len() - ".rs".len()].trim_end_matches("/mod");
            let after = text.split("#[test]\n").skip(1);
            let name =
                |part: &str| part.trim_start().strip_prefix("fn ")?.split('(').next().map(str::to_owned);
            names.extend(after.filter_map(name).map(|name| format!("{}::{name}", module.replace('/', "::"))));
        }
        names
    };
    let main = &sources.iter().find(|(path, _)| path == "verification/main.rs").expect("a file").1;
    let areas = main.lines().filter_map(|line| line.strip_prefix("mod ")?.strip_suffix(';'));
    let mut known = 0;
    for area in areas {
        let tests = tests_of(area);
        let listed = quick.lines().filter(|line| tests.iter().any(|test| test == line)).count();
        assert!(tests.is_empty() || listed > 0, "tests/quick.txt has no test of {area}");
        known += listed;
    }
    assert_eq!(known, quick.lines().count(), "tests/quick.txt names tests that do not exist");
}
