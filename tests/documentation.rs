//! The documents: links lead somewhere, the index is complete.

use std::fs;
use std::path::{Path, PathBuf};

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

/// Markdown files of the project: those at the top and in the folders that hold documents.
fn documents() -> Vec<PathBuf> {
    let folders = ["", "docs", "meshes", "scenes", "benchmarks"].map(|folder| root().join(folder));
    let entries = folders.iter().filter_map(|folder| fs::read_dir(folder).ok()).flatten();
    let paths = entries.map(|entry| entry.expect("a readable entry").path());
    paths.filter(|path| path.extension().is_some_and(|extension| extension == "md")).collect()
}

/// Targets of `](target)` in a text.
fn links(text: &str) -> Vec<&str> {
    text.split("](").skip(1).filter_map(|rest| rest.split_once(')')).map(|(target, _)| target).collect()
}

/// Truth: the files themselves.
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

/// Truth: the folder's list of files.
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

/// Truth: Cargo.toml: every dependency has a line that says why, its licence, and how it would be replaced.
#[test]
fn every_dependency_is_explained() {
    let manifest = fs::read_to_string(root().join("Cargo.toml")).expect("a manifest");
    let manifest: toml::Table = manifest.parse().expect("valid TOML");
    let design = fs::read_to_string(root().join("docs/DESIGN.md")).expect("a document");
    let table: Vec<&str> = design.lines().filter(|line| line.starts_with("| ")).collect();
    for section in ["dependencies", "dev-dependencies"] {
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

/// Truth: tests/mutants.toml: each mistake of `scripts/mutants` still has its place in the sources, once.
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
