//! The order of modules: a module may use modules before it in `src/lib.rs`, never modules after it.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

const ORDER: [&str; 29] = [
    "error",
    "cancel",
    "omitted",
    "npy",
    "csv",
    "geometry",
    "linalg",
    "flexibility",
    "quadrature",
    "element",
    "mesh",
    "material",
    "laws",
    "fem",
    "bem",
    "frame",
    "body",
    "coupling",
    "contact",
    "evolution",
    "output",
    "scene",
    "simulation",
    "estimate",
    "adaptive",
    "compare",
    "sweep",
    "report",
    "cli",
];

/// Remaining imports against the order: file, module, reason. A line is removed with its import. No line may be added.
const EXCEPTIONS: [(&str, &str, &str); 2] = [
    ("output/output_dir.rs", "report", "a new run removes the report of the run before"),
    ("sweep/run.rs", "report", "a new study removes the report of the study before"),
];

fn rust_files(dir: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(dir).expect("a readable source folder") {
        let path = entry.expect("a readable entry").path();
        if path.is_dir() {
            rust_files(&path, found);
        } else if path.extension().is_some_and(|e| e == "rs") {
            found.push(path);
        }
    }
}

fn sources() -> Vec<(PathBuf, String)> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut files = Vec::new();
    rust_files(&root, &mut files);
    files
        .into_iter()
        .map(|path| {
            let text = fs::read_to_string(&path).expect("a readable source file");
            (path.strip_prefix(&root).expect("below src").to_path_buf(), text)
        })
        .collect()
}

fn layer_of(path: &Path) -> Option<usize> {
    let first = path.components().next()?.as_os_str().to_str()?;
    ORDER.iter().position(|name| *name == first.trim_end_matches(".rs"))
}

/// Truth: modules import only modules before them in `ORDER`, apart from `EXCEPTIONS`.
#[test]
fn imports_point_back_along_the_data_flow() {
    let (mut wrong, mut unused) = (Vec::new(), BTreeSet::from(EXCEPTIONS));
    for (path, text) in sources() {
        let Some(layer) = layer_of(&path) else { continue };
        for (number, line) in text.lines().enumerate() {
            let code = line.split("//").next().unwrap_or("");
            for piece in code.split("crate::").skip(1) {
                let names: Vec<&str> = if let Some(list) = piece.strip_prefix('{') {
                    list.split(',').map(str::trim).collect()
                } else {
                    vec![piece]
                };
                for name in names {
                    let name = name.split(|c: char| !(c.is_alphanumeric() || c == '_')).next().unwrap_or("");
                    if let Some(used) = ORDER.iter().position(|n| *n == name)
                        && used > layer
                    {
                        let listed = EXCEPTIONS
                            .iter()
                            .find(|(file, module, _)| path == Path::new(file) && name == *module);
                        if let Some(exception) = listed {
                            unused.remove(exception);
                            continue;
                        }
                        wrong.push(format!(
                            "{}:{}: {} uses {}",
                            path.display(),
                            number + 1,
                            ORDER[layer],
                            name
                        ));
                    }
                }
            }
        }
    }
    assert!(wrong.is_empty(), "imports against the data flow:\n{}", wrong.join("\n"));
    assert!(unused.is_empty(), "exceptions that no import needs: {unused:?}");
}

/// Modules that a file declares (`mod name;`).
fn declared(text: &str) -> impl Iterator<Item = &str> {
    text.lines().filter_map(|line| {
        let line = line.trim();
        let line = ["pub(crate) ", "pub(super) ", "pub "]
            .iter()
            .find_map(|prefix| line.strip_prefix(prefix))
            .unwrap_or(line);
        line.strip_prefix("mod ")?.strip_suffix(';')
    })
}

/// Truth: every source file belongs to the crate. The file of the enclosing module declares it, at the path where the compiler
/// looks for it.
#[test]
fn every_file_is_declared() {
    let files = sources();
    let mut places = BTreeSet::new();
    for (path, text) in &files {
        let folder = path.parent().expect("a folder");
        let stem = path.file_stem().and_then(|stem| stem.to_str()).expect("a UTF-8 file name");
        // Modules that lib.rs or mod.rs declares lie beside this file, modules that name.rs declares in the folder `name`.
        let inside =
            if ["lib", "main", "mod"].contains(&stem) { folder.to_owned() } else { folder.join(stem) };
        for name in declared(text) {
            places.insert(inside.join(format!("{name}.rs")));
            places.insert(inside.join(name).join("mod.rs"));
        }
    }
    for (path, _) in &files {
        let is_root = ["lib.rs", "main.rs"].iter().any(|name| path == Path::new(name));
        assert!(is_root || places.contains(path), "{} is declared by no `mod`", path.display());
    }
}

/// Truth: `src/lib.rs` lists the modules in the order of `ORDER`.
#[test]
fn lib_lists_the_modules_in_order() {
    let text = include_str!("../src/lib.rs");
    let listed: Vec<&str> = text
        .lines()
        .filter_map(|l| l.trim_start_matches("pub ").strip_prefix("mod ")?.strip_suffix(';'))
        .collect();
    assert_eq!(listed, ORDER);
}
