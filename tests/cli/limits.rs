//! Limits of scenes, and notes near these limits. `check` and `run` report the same.

use std::fs;
use std::path::{Path, PathBuf};

use crate::tools::refusal;

pub(crate) const BLOCK: &str = r#"
[materials.cfrp]
model = "transversely-isotropic"
E1 = 167230.0
E2 = 9544.0
G12 = 5292.0
nu12 = 0.272
nu23 = 0.37
[body1]
kind = "fe"
material = "cfrp"
fibre = { tilt = 30.0 }
mesh = 'MESH'
contact = "contact"
fixed = [{ group = "base" }]
near_field = "mesh"
[body2]
kind = "rigid"
[frame]
kind = "grid"
half_width = [1.2, 1.2]
cells = [4, 4]
[gap]
kind = "sphere"
radius = 50.0
[friction]
law = "coulomb"
mu = 0.4
[[steps]]
name = "indent"
approach = 0.02
[output]
fields = []
"#;

fn block(from: &str, to: &str) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("block.toml");
    let mesh = Path::new(env!("CARGO_MANIFEST_DIR")).join("meshes/cfrp-block-coarse.msh");
    assert!(BLOCK.contains(from));
    fs::write(&path, BLOCK.replace(from, to).replace("MESH", &mesh.display().to_string())).unwrap();
    (folder, path)
}

fn call(command: &str, scene: &Path, options: &[&str]) -> (Option<i32>, String, String) {
    let mut program = crate::tools::orthowear();
    let output = program.arg(command).arg(scene).args(options).output().unwrap();
    let text = |bytes| String::from_utf8(bytes).unwrap();
    (output.status.code(), text(output.stdout), text(output.stderr))
}

#[track_caller]
fn refused(from: &str, to: &str, words: &[&str]) {
    let (_folder, path) = block(from, to);
    for command in ["check", "run"] {
        let (code, _, text) = call(command, &path, &[]);
        assert_eq!(code, Some(2), "{command}: {text}");
        for word in words {
            assert!(text.contains(word), "{command} lacks \"{word}\":\n{text}");
        }
    }
}

#[track_caller]
fn noted(from: &str, to: &str, word: &str, there: bool) {
    let (_folder, path) = block(from, to);
    for command in ["check", "run"] {
        let (code, text, errors) = call(command, &path, &[]);
        assert_eq!(code, Some(0), "{command}: {errors}");
        assert_eq!(text.contains(word), there, "{command}, \"{word}\":\n{text}");
    }
}

/// Truth: linear algebra. The tractions are unique only if the frame does not have more cells than the finer body has contact
/// nodes.
#[test]
fn cells_finer_than_the_elements() {
    refused(
        "[4, 4]",
        "[48, 48]",
        &["frame.cells", "node spacing of the finest body", "not determined", "or fewer"],
    );
    noted("[4, 4]", "[4, 4]", "that belongs to a contact node", false);
}

/// Truth: docs/scene.md: on a condensed mesh no support may fix a node under the frame along the normal, here z.
#[test]
fn supports_under_the_frame() {
    refused(
        "group = \"base\"",
        "group = \"contact\"",
        &["body1.fixed", "`contact`", "along z", "or add components = [\"x\", \"y\"]"],
    );
}

/// Truth: mu = 0 means no friction, so no note mentions the load path. A friction ellipse with one coefficient of zero is
/// refused.
#[test]
fn friction_of_zero() {
    noted("mu = 0.4", "mu = 0.0", "load path", false);
    refused(
        "law = \"coulomb\"\nmu = 0.4",
        "law = \"elliptic\"\nmu1 = 0.4\nmu2 = 0.0",
        &["friction", "at least a hundredth of the larger one"],
    );
}

/// Truth: docs/command-line.md: failures are reported even with --quiet.
#[test]
fn quiet_tells_of_no_convergence() {
    let (_folder, path) = block("fields = []", "fields = []\n[solver]\nmax_iterations = 1");
    let (code, text, errors) = call("run", &path, &["--quiet"]);
    assert_eq!(code, Some(3), "{errors}");
    assert!(text.is_empty() && errors.lines().count() == 1, "{text}{errors}");
    assert!(errors.contains("iterations") && errors.contains("summary.json"), "{errors}");
}

/// Truth: a folder is no mesh file.
#[test]
fn folders_are_no_meshes() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("meshes").display().to_string();
    refused("mesh = 'MESH'", &format!("mesh = '{folder}'"), &["body1.mesh", "is a folder"]);
}

/// Truth: docs/theory-contact.md: with friction, results depend on the load path. Coulomb's law does not depend on fibres, so the
/// note about the load path does not mention them.
#[test]
fn path_dependence_names_tilted_fibres_only() {
    let (_folder, path) = block("[4, 4]", "[4, 4]");
    let (_, text, _) = call("run", &path, &[]);
    assert!(text.contains("load path") && !text.contains("tilted fibres"), "{text}");
}

/// Truth: products of the numbers of a scene must stay within the range of f64. Counts must be integers that f64 represents
/// exactly.
#[test]
fn numbers_of_impossible_sizes() {
    refused("half_width = [1.2, 1.2]", "half_width = [1e300, 1.2]", &["frame.half_width.0", "1e100"]);
    refused("radius = 50.0", "radius = 1e-300", &["gap.radius", "1e-100"]);
    refused("mu = 0.4", "mu = 5e-324", &["friction.mu", "1e-100"]);
    refused(
        "approach = 0.02",
        "approach = 0.02\nincrements = 9223372036854775807",
        &["increments", "at most 1e15"],
    );
}

/// Truth: docs/scene.md: a component must not be named twice, and the name of a step must not be empty. A note reports two steps
/// of the same name.
#[test]
fn names_given_twice_or_not_at_all() {
    refused(
        "fixed = [{ group = \"base\" }]",
        "fixed = [{ group = \"base\", components = [\"x\", \"x\", \"z\"] }]",
        &["body1.fixed.0.components", "named twice"],
    );
    refused("name = \"indent\"", "name = \" \"", &["steps.0.name", "empty"]);
    let second = "approach = 0.02\n[[steps]]\nname = \"indent\"\napproach = 0.03";
    noted("approach = 0.02", second, "two steps are named", true);
}

fn from_repository(name: &str, from: &str, to: &str) -> (tempfile::TempDir, PathBuf) {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let scene = fs::read_to_string(root.join("scenes").join(name)).unwrap();
    assert!(scene.contains(from), "{from}");
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    let scene = scene.replacen(from, to, 1).replace("../meshes", &root.join("meshes").display().to_string());
    fs::write(&path, scene + "\n[output]\nfields = []\n").unwrap();
    (folder, path)
}

/// Truth: docs/scene.md: meshes that overlap before loading are refused. A pin that is larger than its hole is refused too,
/// because no motion along the normal removes its overlap.
#[test]
fn bodies_that_overlap_at_the_start() {
    let plate = "normal = [0.0, 0.0, 1.0]";
    for (scene, from, to, words) in [
        (
            "cylinder-on-flat.toml",
            "../meshes/roller.msh",
            "ROLLER",
            &["gap", "overlap", "8 of 8 cells", "by up to 1.99", "move the mesh of body 2"][..],
        ),
        ("pin-in-hole.toml", plate, "normal = [0.0, 0.0, 0.0]", &["frame.normal", "no direction"]),
        (
            "pin-in-hole.toml",
            "../meshes/pin.msh",
            "PIN",
            &["gap", "overlap", "24 of 24 cells", "interference fit"],
        ),
    ] {
        let (folder, path) = from_repository(scene, from, to);
        for (name, source, scale, drop) in
            [("ROLLER", "roller.msh", [1.0; 3], 2.0), ("PIN", "pin.msh", [1.05, 1.0, 1.05], 0.0)]
        {
            let text = fs::read_to_string(&path).unwrap();
            if text.contains(name) {
                let moved = folder.path().join("moved.msh");
                let mesh = Path::new(env!("CARGO_MANIFEST_DIR")).join("meshes").join(source);
                fs::write(&moved, moved_mesh(&mesh, scale, drop)).unwrap();
                fs::write(&path, text.replace(name, &moved.display().to_string())).unwrap();
            }
        }
        for command in ["check", "run"] {
            let (code, _, text) = call(command, &path, &[]);
            assert_eq!(code, Some(2), "{command}: {text}");
            for word in words {
                assert!(text.contains(word), "{command} lacks \"{word}\":\n{text}");
            }
        }
    }
}

/// Returns a binary mesh in gmsh's format 2.2, scaled along the axes and then lowered along z by `drop`.
pub(super) fn moved_mesh(path: &Path, scale: [f64; 3], drop: f64) -> Vec<u8> {
    let mut bytes = fs::read(path).unwrap();
    let head = b"$Nodes\n";
    let start = bytes.windows(head.len()).position(|window| window == head).unwrap() + head.len();
    let line = bytes[start..].iter().position(|&byte| byte == b'\n').unwrap();
    let count: usize = std::str::from_utf8(&bytes[start..start + line]).unwrap().trim().parse().unwrap();
    let first = start + line + 1;
    for node in 0..count {
        for (axis, factor) in scale.into_iter().enumerate() {
            let at = first + node * 28 + 4 + 8 * axis;
            let value = f64::from_le_bytes(bytes[at..at + 8].try_into().unwrap());
            let moved = factor * value - if axis == 2 { drop } else { 0.0 };
            bytes[at..at + 8].copy_from_slice(&moved.to_le_bytes());
        }
    }
    bytes
}

/// Truth: docs/scene.md: a mesh frame omits faces without an opposite surface. The contact surface of the narrowed roller is 0.8
/// x 9 = 7.2 mm long. Of the block's 12 faces with sides of 0.75 mm, 3 faces reach beyond this length.
#[test]
fn faces_left_out_of_the_frame() {
    let grid = "kind = \"grid\"\nhalf_width = [4.5, 0.5]\ncenter = [4.5, 0.5]\ncells = [8, 1]";
    let (folder, path) =
        from_repository("cylinder-on-flat.toml", grid, "kind = \"mesh\"\nbody = 1\npoints = \"faces\"");
    let mesh = Path::new(env!("CARGO_MANIFEST_DIR")).join("meshes/roller.msh");
    let narrow = folder.path().join("narrow.msh");
    fs::write(&narrow, moved_mesh(&mesh, [0.8, 1.0, 1.0], 0.0)).unwrap();
    let text = fs::read_to_string(&path).unwrap();
    fs::write(&path, text.replace(&mesh.display().to_string(), &narrow.display().to_string())).unwrap();
    let (code, text, errors) = call("check", &path, &[]);
    assert_eq!(code, Some(0), "{errors}");
    let line: String = text.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(
        line.contains("3 of the 12 faces of `contact`") && line.contains("omitted from the frame"),
        "{text}"
    );
}

/// Truth: docs/scene.md, docs/command-line.md: a run that does not fit into the memory limit is refused before it starts. The
/// message gives the allowed bytes and the bytes of the rest of the scene. Their sum is the limit.
#[test]
fn memory_is_refused_beforehand() {
    let told = |limit: &str| {
        let (_folder, path) = block("fields = []", &format!("fields = []\n[solver]\nmemory_limit = {limit}"));
        let [check, run] = ["check", "run"].map(|command| {
            let (code, _, text) = call(command, &path, &[]);
            assert_eq!(code, Some(4), "{command}: {text}");
            text
        });
        assert_eq!(check, run);
        check
    };
    let text = told("1000");
    for word in ["a frame of 4 x 4", "1000 bytes", "raise solver.memory_limit"] {
        assert!(text.contains(word), "lacks \"{word}\":\n{text}");
    }
    // The first of the next two limits suffices for the frame only. The second limit suffices for the assembled stiffness matrix
    // too, but not for its condensation.
    let [frame, ..] = refusal(&text);
    let [assembling, _, rest] = refusal(&told(&format!("{}", frame + 1.0)));
    let limit = (assembling + rest).round() + f64::from(1 << 20);
    let text = told(&format!("{limit}"));
    for word in ["body1", "by conjugate gradients", "of the rest of the scene", "solver.memory_limit"] {
        assert!(text.contains(word), "lacks \"{word}\":\n{text}");
    }
    let [needed, allowed, rest] = refusal(&text);
    assert!((allowed + rest - limit).abs() <= 0.051 * f64::from(1 << 20), "{allowed} {rest} {limit}");
    assert!(needed > allowed, "{needed} {allowed}");
    for limit in ["\"4 G\"", "\"much\"", "0", "-3", "2.5", "true"] {
        refused("fields = []", &format!("fields = []\n[solver]\nmemory_limit = {limit}"), &["memory_limit"]);
    }
    noted("fields = []", "fields = []\n[solver]\nmemory_limit = \"2 GB\"", "80 %", false);
}
