//! Mutated scenes with their overrides. Names after "Truth" are cases of docs/verification.md.

use std::fs;
use std::path::Path;
use std::process::Command;
use std::sync::LazyLock;

use orthowear::linalg::memory::MemoryLimit;
use orthowear::scene::document::Location;
use orthowear::scene::document::{Document, TomlValue};
use orthowear::scene::{self, MeshCache, Plan};

use crate::harness::{Reader, not_finite, put};
use crate::meshes;

/// Prefix of the lines of an input that contain overrides.
const SET: &str = "#--set ";

pub const MATERIALS: &str = r#"title = "inputs"
[materials.steel]
model = "isotropic"
E = 210e3
nu = 0.3
[materials.cfrp]
model = "transversely-isotropic"
E1 = 167230.0
E2 = 9544.0
G12 = 5292.0
nu12 = 0.272
nu23 = 0.37
strength = { Xt = 2000.0, Xc = 1500.0, Yt = 60.0, Yc = 200.0, S12 = 80.0, S23 = 50.0 }
"#;

const HALF_SPACES: &str = r#"[materials.aniso]
model = "orthotropic"
E1 = 167230.0
E2 = 9544.0
E3 = 9544.0
G12 = 5292.0
G13 = 5292.0
G23 = 3483.0
nu12 = 0.272
nu13 = 0.272
nu23 = 0.369
[body1]
kind = "half-space"
material = "cfrp"
fibre = { tilt = 30.0, azimuth = 10.0 }
[body2]
kind = "half-space"
material = "steel"
[frame]
kind = "grid"
half_width = [1.2, 1.2]
cells = [8, 8]
outline = { shape = "ellipse", semi_axes = [1.0, 0.9] }
grow = false
[gap]
kind = "heights"
file = "heights.csv"
[friction]
law = "frp"
mu_L = 0.4
mu_T = 0.5
mu_N = 0.55
[wear]
law = "energy"
k = 1.25e-9
tolerance = 1e-3
[[steps]]
name = "load"
history = { file = "loads.csv" }
[[steps]]
name = "turn"
rotation = [0.01, 0.0]
twist = 0.1
[[steps]]
name = "fret"
normal_force = 100.0
cycles = { count = 1000, amplitude = 0.05, path = "ellipse", amplitude2 = 0.02, jumps = 4 }
[[steps]]
name = "slide"
sliding = { distance = 3.0, angle = 30.0 }
[solver]
tolerance = 1e-8
memory_limit = "2 GiB"
[output]
fields = ["vtu", "stress"]
checkpoint = { seconds = 5.0, cycles = 10 }
[[output.inside]]
name = "line"
body = 1
from = [0.0, 0.0, -0.1]
to = [0.5, 0.0, -0.1]
points = 5
#--set gap.kind=sphere
#--set gap={kind="sphere", radius=50.0}
#--set steps.fret.cycles.count=20
"#;

const MESHED: &str = r#"[body1]
kind = "fe"
material = "cfrp"
fibre = { file = "axes.csv" }
mesh = "block.msh"
contact = "contact"
fixed = [{ group = "base", components = ["x", "y", "z"] }]
pressure = [{ group = "sides", value = 0.1 }]
element = "hex8-bbar"
near_field = "mesh"
[body2]
kind = "rigid"
[frame]
kind = "grid"
half_width = [0.5, 0.5]
cells = [2, 2]
center = [0.1, 0.0]
[gap]
kind = "ellipsoid"
radii = [20.0, 30.0]
angle = 20.0
[friction]
law = "elliptic"
mu1 = 0.3
mu2 = 0.4
angle = 15.0
[wear]
law = "orthotropic"
i1 = 1e-9
i2 = 2e-9
angle = 10.0
share = 0.5
[[steps]]
name = "press"
normal_force = 10.0
[[steps]]
name = "pull"
tangential_force = [1.0, 0.5]
increments = 3
"#;

/// Words that mutations insert: keys and allowed values of the schema, and fragments of TOML.
pub fn words(schema: &serde_json::Value) -> Vec<String> {
    let mut found = Vec::new();
    collect(schema, &mut found);
    found.extend(
        ["true", "false", "[]", "{}", "[[steps]]", "[", "]", "{ ", " }", "\"\"\"", "1979-05-27", SET]
            .map(str::to_owned),
    );
    found.sort();
    found.dedup();
    found
}

fn collect(schema: &serde_json::Value, found: &mut Vec<String>) {
    match schema {
        serde_json::Value::Object(map) => {
            for (key, value) in map {
                match (key.as_str(), value) {
                    ("properties", serde_json::Value::Object(keys)) => found.extend(keys.keys().cloned()),
                    ("const", serde_json::Value::String(word)) => found.push(word.clone()),
                    ("enum", serde_json::Value::Array(words)) => {
                        found.extend(words.iter().filter_map(|word| word.as_str()).map(str::to_owned));
                    }
                    _ => {}
                }
                collect(value, found);
            }
        }
        serde_json::Value::Array(list) => list.iter().for_each(|value| collect(value, found)),
        _ => {}
    }
}

pub fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    let meshes = folder.path().join("meshes");
    fs::create_dir_all(folder.path().join("scenes")).expect("a folder");
    fs::create_dir_all(&meshes).expect("a folder");
    let from = Path::new(env!("CARGO_MANIFEST_DIR")).join("meshes");
    for name in ["pin.msh", "pin-plate.msh", "roller.msh", "roller-block.msh"] {
        fs::copy(from.join(name), meshes.join(name)).expect("a mesh");
    }
    let scenes = folder.path().join("scenes");
    fs::write(scenes.join("block.msh"), meshes::block_text([3, 3, 2])).expect("a file");
    let heights: String =
        (0..8).map(|i| format!("{}\n", [0.01 * f64::from(i); 8].map(|x| x.to_string()).join(","))).collect();
    fs::write(scenes.join("heights.csv"), heights).expect("a file");
    fs::write(scenes.join("loads.csv"), LOADS).expect("a file");
    fs::write(scenes.join("axes.csv"), axes()).expect("a file");
    folder
}

pub const LOADS: &str = "approach,shift_x,shift_y\n0.01,0,0\n0.02,0.001,0\n# more\n0.02,0.002,0.001\n";

pub fn axes() -> String {
    let mesh = meshes::block(crate::structured::BlockElements::Hex8, [3, 3, 2]);
    let tags = mesh.volume_cells().map(|cell| mesh.tag(cell));
    tags.map(|tag| format!("{tag},1,0.1,0.2,0,1,0\n")).collect()
}

pub fn seeds() -> Vec<Vec<u8>> {
    // Only scenes under version control are used, because users may keep their own scenes in the same folder.
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let listed =
        Command::new("git").current_dir(root).args(["ls-files", "scenes/*.toml"]).output().expect("git");
    let names = String::from_utf8(listed.stdout).expect("UTF-8");
    assert!(names.lines().count() > 10, "git lists {names:?}");
    let mut seeds: Vec<Vec<u8>> =
        names.lines().map(|name| fs::read(root.join(name)).expect("a scene")).collect();
    seeds.extend([HALF_SPACES, MESHED].map(|scene| format!("{MATERIALS}{scene}").into_bytes()));
    seeds
}

/// Meshes of all cases, which are read only once.
static MESHES: LazyLock<MeshCache> = LazyLock::new(MeshCache::default);

/// Copy of a plan with an empty document and a fixed memory limit. Such copies of equal plans are equal.
pub fn bare(mut plan: Plan) -> Plan {
    plan.document = Document::new(Path::new("scene"), String::new(), &[]);
    plan.document.folder.clear();
    plan.memory_limit = MemoryLimit::of_scene(1 << 30);
    plan
}

pub fn overrides(bytes: &[u8]) -> Vec<String> {
    let text = String::from_utf8_lossy(bytes);
    text.lines().filter_map(|line| line.strip_prefix(SET)).map(str::to_owned).collect()
}

fn examine(path: &Path, bytes: &[u8]) -> String {
    put(path, bytes);
    let plan = match scene::read_with_meshes(path, &overrides(bytes), &MESHES) {
        Ok(plan) => plan,
        Err(mistakes) => {
            assert!(!mistakes.list.is_empty(), "refused without a mistake");
            for mistake in &mistakes.list {
                assert!(!mistake.message.is_empty());
                assert!(!mistake.message.starts_with("internal error"), "{mistakes}");
                if let Location::File(range) = &mistake.location {
                    assert!(
                        mistakes.text.get(range.clone()).is_some(),
                        "{range:?} of {} bytes",
                        mistakes.text.len()
                    );
                }
            }
            return format!("{}: {}", mistakes.list[0].key, mistakes.list[0].message);
        }
    };
    check_plan(path, plan)
}

/// Asserts that all numbers of a plan are finite. Then writes the document of the plan, reads it again, and asserts
/// that the plan is the same.
pub fn check_plan(path: &Path, plan: Plan) -> String {
    let TomlValue::Table(entries) = &plan.document.root.value else { panic!("a document without a table") };
    let key = |name: &str| serde_json::Value::from(name).to_string().replace('\u{7f}', "\\u007f");
    let written: String =
        entries.iter().map(|entry| format!("{} = {}\n", key(&entry.name), entry.node.to_toml())).collect();
    let plan = bare(plan);
    let debug = format!("{plan:?}");
    if let Some(place) = not_finite(&debug, true) {
        panic!("the plan contains a number that is not finite: {place}");
    }
    put(path, written.as_bytes());
    match scene::read_with_meshes(path, &[], &MESHES) {
        Ok(again) => {
            let same = parts(&format!("{:?}", bare(again))) == parts(&debug);
            assert!(same, "another plan is read from\n{written}");
        }
        Err(mistakes) => panic!("refused after writing it again: {mistakes}\n{written}"),
    }
    format!("a plan of {} steps {:?}", plan.steps.len(), plan.notes)
}

/// Words of a debug text. They are sorted, because maps have no order.
fn parts(debug: &str) -> Vec<&str> {
    let is_part = |c: char| c.is_alphanumeric() || ".-+_".contains(c);
    let mut parts: Vec<&str> = debug.split(|c| !is_part(c)).collect();
    parts.sort_unstable();
    parts
}

/// Truth (rel-no-panics, rel-nan-guard, rel-input-validation): a scene is refused with messages that refer to places in
/// its text. Otherwise, the scene gives a plan of finite numbers, and writing and reading its keys gives the same plan.
#[test]
fn scene_files() {
    let folder = folder();
    let path = folder.path().join("scenes/scene.toml");
    for seed in seeds().iter().rev().take(2) {
        fs::write(&path, seed).expect("a file");
        let read = scene::read(&path, &[]);
        assert!(read.is_ok(), "{}", read.expect_err("mistakes"));
    }
    let words = words(scene::schema::json_schema());
    let reader = Reader { name: "scene", read: "", seeds: seeds(), words, cases: 8000 };
    reader.check(|bytes| examine(&path, bytes));
}

/// Truth (rel-no-panics): deeply nested keys and lists are read or refused on a stack of the size that the program's
/// threads have.
#[test]
fn deep_scenes() {
    let folder = folder();
    let path = folder.path().join("scenes/scene.toml");
    let deep = |open: &str, close: &str, n: usize| format!("{}1{}", open.repeat(n), close.repeat(n));
    let n = 40_000;
    let texts = [
        format!("{} = 1\n", vec!["a"; n].join(".")),
        format!("[{}]\nb = 1\n", vec!["a"; n].join(".")),
        format!("[[{}]]\nb = 1\n", vec!["steps"; n].join(".")),
        format!("a = {}\n", deep("[", "]", n)),
        format!("a = {}\n", deep("{ a = ", " }", n)),
        format!("#--set {}=1\n", vec!["a"; n].join(".")),
        format!("#--set a={}\n", deep("[", "]", n)),
        format!("#--set steps={}\n", deep("{ a = ", " }", n)),
    ];
    let reader = Reader {
        name: "deep",
        read: "",
        seeds: texts.map(String::into_bytes).to_vec(),
        words: Vec::new(),
        cases: 0,
    };
    reader.check(|bytes| examine(&path, bytes));
}
