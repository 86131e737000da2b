//! Tests of the imports between modules and files.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::fs;
use std::path::{Path, PathBuf};

use syn::visit::{self, Visit};

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

fn sources(folder: &str) -> Vec<(PathBuf, String)> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join(folder);
    let mut files = Vec::new();
    rust_files(&root, &mut files);
    files
        .into_iter()
        .map(|path| {
            let text = fs::read_to_string(&path).expect("a readable source file");
            (path.strip_prefix(&root).expect("below the folder").to_path_buf(), text)
        })
        .collect()
}

fn layer_of(path: &Path) -> Option<usize> {
    let first = path.components().next()?.as_os_str().to_str()?;
    ORDER.iter().position(|name| *name == first.trim_end_matches(".rs"))
}

/// Truth: modules import only modules that are listed before them in `ORDER`.
#[test]
fn imports_point_back_along_the_data_flow() {
    let mut wrong = Vec::new();
    for (path, text) in sources("src") {
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

/// Truth: every source file is declared by the file of its enclosing module. The file lies at the path where the
/// compiler expects it.
#[test]
fn every_file_is_declared() {
    let files = sources("src");
    let mut places = BTreeSet::new();
    for (path, text) in &files {
        let folder = path.parent().expect("a folder");
        let stem = path.file_stem().and_then(|stem| stem.to_str()).expect("a UTF-8 file name");
        // `name.rs` declares modules in the folder `name`.
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

#[derive(Default)]
struct Imports {
    module: Vec<String>,
    children: BTreeSet<String>,
    paths: Vec<Vec<String>>,
    /// Path of the original item for each re-exported name.
    reexports: BTreeMap<String, Vec<String>>,
}

impl Imports {
    fn of(path: &Path, text: &str) -> Self {
        let mut module: Vec<String> =
            path.with_extension("").iter().map(|part| part.to_str().expect("UTF-8").to_owned()).collect();
        if module.last().is_some_and(|last| ["lib", "main", "mod"].contains(&last.as_str())) {
            module.pop();
        }
        let children = declared(text).map(str::to_owned).collect();
        let mut imports = Self { module, children, ..Self::default() };
        imports.visit_file(&syn::parse_file(text).expect("Rust source"));
        imports
    }

    /// Resolves a path to a path from the root of the crate. `None` for other crates and local items.
    fn resolved(&self, path: &[String]) -> Option<Vec<String>> {
        let ups = path.iter().take_while(|part| *part == "super").count();
        match path.first()?.as_str() {
            "crate" => Some(path[1..].to_vec()),
            "self" => Some([&self.module[..], &path[1..]].concat()),
            "super" => Some([&self.module[..self.module.len() - ups], &path[ups..]].concat()),
            child if self.children.contains(child) => Some([&self.module[..], path].concat()),
            _ => None,
        }
    }
}

impl<'a> Visit<'a> for Imports {
    fn visit_item_mod(&mut self, item: &'a syn::ItemMod) {
        if item.content.is_none() || item.ident != "tests" {
            visit::visit_item_mod(self, item);
        }
    }

    fn visit_item_use(&mut self, item: &'a syn::ItemUse) {
        let mut open = vec![(Vec::new(), &item.tree)];
        while let Some((mut path, tree)) = open.pop() {
            let name = match tree {
                syn::UseTree::Path(part) => {
                    path.push(part.ident.to_string());
                    open.push((path, &part.tree));
                    continue;
                }
                syn::UseTree::Group(group) => {
                    open.extend(group.items.iter().map(|tree| (path.clone(), tree)));
                    continue;
                }
                syn::UseTree::Name(leaf) if leaf.ident == "self" => path.last().cloned().unwrap_or_default(),
                syn::UseTree::Name(leaf) => {
                    path.push(leaf.ident.to_string());
                    leaf.ident.to_string()
                }
                syn::UseTree::Rename(leaf) => {
                    path.push(leaf.ident.to_string());
                    leaf.rename.to_string()
                }
                syn::UseTree::Glob(_) => String::new(),
            };
            let Some(path) = self.resolved(&path) else { continue };
            if matches!(item.vis, syn::Visibility::Inherited) {
                self.paths.push(path);
            } else {
                self.reexports.insert(name, path);
            }
        }
    }

    fn visit_path(&mut self, path: &'a syn::Path) {
        let names: Vec<String> = path.segments.iter().map(|part| part.ident.to_string()).collect();
        if names.len() > 1 {
            self.paths.extend(self.resolved(&names));
        }
        visit::visit_path(self, path);
    }

    fn visit_vis_restricted(&mut self, _: &'a syn::VisRestricted) {}
}

/// Index of the file that defines the item at `path`, which starts at the root of the crate.
fn definition(files: &[Imports], path: &[String]) -> Option<usize> {
    let mut path = path.to_vec();
    // A chain of re-exports has at most as many links as there are files.
    for _ in 0..files.len() {
        let (file, length) = (0..=path.len())
            .rev()
            .find_map(|n| Some((files.iter().position(|file| file.module == path[..n])?, n)))?;
        let Some(target) = path.get(length).and_then(|name| files[file].reexports.get(name)) else {
            return Some(file);
        };
        path = [&target[..], &path[length + 1..]].concat();
    }
    None
}

/// Truth: no file imports itself through other files. Re-exports count as imports of the original item.
#[test]
fn files_do_not_import_each_other_in_circles() {
    for root in ["src", "python/src"] {
        let mut sources = sources(root);
        // The binary imports the library as a separate crate.
        sources.retain(|(path, _)| path != Path::new("main.rs"));
        let files: Vec<Imports> = sources.iter().map(|(path, text)| Imports::of(path, text)).collect();
        let edges: Vec<BTreeSet<usize>> = files
            .iter()
            .enumerate()
            .map(|(own, file)| {
                let used = file.paths.iter().filter_map(|path| definition(&files, path));
                used.filter(|used| *used != own).collect()
            })
            .collect();
        assert!(edges.iter().map(BTreeSet::len).sum::<usize>() > files.len(), "too few imports of {root}");
        for start in 0..files.len() {
            let mut before: BTreeMap<usize, usize> = BTreeMap::new();
            let mut queue = VecDeque::from([start]);
            while let Some(file) = queue.pop_front() {
                for &next in &edges[file] {
                    before.entry(next).or_insert_with(|| {
                        queue.push_back(next);
                        file
                    });
                }
            }
            if before.contains_key(&start) {
                let mut circle = vec![start, before[&start]];
                while circle[circle.len() - 1] != start {
                    circle.push(before[&circle[circle.len() - 1]]);
                }
                let names: Vec<String> =
                    circle.iter().rev().map(|&file| sources[file].0.display().to_string()).collect();
                panic!("{root}: files import each other in a circle: {}", names.join(" -> "));
            }
        }
    }
}
