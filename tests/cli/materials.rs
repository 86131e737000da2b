//! Materials of meshed bodies in scenes: fibre directions from fields and tables, wound bodies, plies, and messages about
//! mistakes.

use std::fs;
use std::path::{Path, PathBuf};

use serde_json::Value;

use crate::tools::usual_or_finest;

/// Mesh of a box of 2 mm x 2 mm x 1 mm below z = 0 with 4 x 4 x 4 hexahedra. The numbers of the hexahedra start at 101.
fn mesh() -> String {
    let node = |i: usize, j: usize, k: usize| 1 + i + 5 * j + 25 * k;
    let mut nodes = String::new();
    let mut elements = Vec::new();
    for (i, j, k) in (0..125).map(|n| (n % 5, n / 5 % 5, n / 25)) {
        let at = |n: usize| 0.5 * n as f64 - 1.0;
        nodes += &format!("{} {} {} {}\n", node(i, j, k), at(i), at(j), 0.25 * k as f64 - 1.0);
    }
    let quads = (0..16).map(|n| (n % 4, n / 4));
    for (group, k) in [(1, 4), (2, 0)] {
        for (i, j) in quads.clone() {
            let corners = [node(i, j, k), node(i + 1, j, k), node(i + 1, j + 1, k), node(i, j + 1, k)];
            elements.push(format!("{} 3 2 {group} {group} {}", elements.len() + 1, joined(&corners)));
        }
    }
    for (n, (i, j, k)) in (0..64).map(|n| (n, (n % 4, n / 4 % 4, n / 16))) {
        let face = |k: usize| [node(i, j, k), node(i + 1, j, k), node(i + 1, j + 1, k), node(i, j + 1, k)];
        elements.push(format!("{} 5 2 3 3 {} {}", 101 + n, joined(&face(k)), joined(&face(k + 1))));
    }
    format!(
        "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n3\n2 1 \"top\"\n2 2 \"base\"\n3 3 \"block\"\n\
         $EndPhysicalNames\n$Nodes\n125\n{nodes}$EndNodes\n$Elements\n{}\n{}\n$EndElements\n",
        elements.len(),
        elements.join("\n")
    )
}

fn joined(numbers: &[usize]) -> String {
    numbers.iter().map(usize::to_string).collect::<Vec<_>>().join(" ")
}

fn element_data(elements: impl Iterator<Item = usize> + Clone, vector: &str) -> String {
    let lines: String = elements.clone().map(|element| format!("{element} {vector}\n")).collect();
    format!("$ElementData\n1\n\"fibre\"\n1\n0.0\n3\n0\n3\n{}\n{lines}$EndElementData\n", elements.count())
}

const SCENE: &str = r#"[materials.im7]
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
kind = "fe"
material = "im7"
mesh = "box.msh"
contact = "top"
fixed = [{ group = "base" }]
# fibre
[body2]
kind = "rigid"
[frame]
kind = "grid"
half_width = [0.75, 0.75]
cells = [3, 3]
[gap]
kind = "sphere"
radius = 20.0
[friction]
law = "frp"
mu_L = 0.4
mu_T = 0.5
mu_N = 0.55
[[steps]]
name = "press"
approach = 0.005
[[steps]]
name = "shift"
shift = { distance = 0.002 }
[output]
fields = []
"#;

/// Creates a folder with the mesh and the scene. `fibre` are further keys of body 1, `after_mesh` are further sections of the
/// mesh file. `files` are pairs (name, text) of further files.
pub fn folder(fibre: &str, after_mesh: &str, files: &[(&str, &str)]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("box.msh"), mesh() + after_mesh).unwrap();
    files.iter().for_each(|(name, text)| fs::write(folder.path().join(name), text).unwrap());
    fs::write(folder.path().join("scene.toml"), SCENE.replace("# fibre", fibre)).unwrap();
    folder
}

pub fn orthowear(folder: &Path, arguments: &[&str]) -> (Option<i32>, String, String) {
    let output = crate::tools::orthowear().current_dir(folder).args(arguments).output().unwrap();
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
    (output.status.code(), text(output.stdout), text(output.stderr))
}

/// Returns the normal forces of both steps, the tangential force along x and y of the second step, and the warnings.
fn forces(folder: &tempfile::TempDir) -> ([f64; 4], String) {
    let (code, _, errors) = orthowear(folder.path(), &["run", "scene.toml", "--quiet"]);
    assert_eq!(code, Some(0), "{errors}");
    let path: PathBuf = folder.path().join("scene.out/summary.json");
    let summary: Value = serde_json::from_slice(&fs::read(path).unwrap()).unwrap();
    let force = |step: usize, key: &str| summary["steps"][step][key].as_f64().unwrap();
    let sideways = |axis: usize| summary["steps"][1]["tangential_force"][axis].as_f64().unwrap();
    let all = [force(0, "normal_force"), force(1, "normal_force"), sideways(0), sideways(1)];
    (all, summary["warnings"].to_string())
}

#[track_caller]
fn refused(folder: &tempfile::TempDir, words: &[&str]) {
    let (code, _, text) = orthowear(folder.path(), &["check", "scene.toml"]);
    assert_eq!(code, Some(2), "{text}");
    let flat = text.split_whitespace().collect::<Vec<_>>().join(" ").replace(" │ ", " ");
    for word in words {
        assert!(flat.contains(word), "lacks \"{word}\":\n{text}");
    }
}

/// Truth: invariance. The forces depend on the fibre direction only, not on the way in which the scene gives this direction. They
/// agree to 1e-7 of the normal force. The differences result from rounding of the direction and from the tolerance 1e-8 of the
/// contact solver.
#[test]
fn one_direction_runs_the_same_in_every_way() {
    let (s, c) = 25.0f64.to_radians().sin_cos();
    let vector = format!("{:.17e} {:.17e} 0", 2.0 * c, 2.0 * s);
    let all = 101..165;
    let csv: String = all.clone().map(|e| format!("{e},{}\n", vector.replace(' ', ","))).collect();
    let second: String = all.clone().map(|e| format!("{e}; {vector}; {:e} {:e} 0\n", -s, c)).collect();
    // Values of the surface elements 1 to 32 in the field have no effect.
    let field = element_data((1..33).chain(all.clone()), &vector);
    let view = format!("$MeshFormat\n4.1 0 8\n$EndMeshFormat\n{field}");
    // The near field of a half-space would take seconds for each scene, so only thorough tests use it.
    let near_field = usual_or_finest("near_field = \"mesh\"\n", "");
    let folder = |fibre: &str, after_mesh: &str, files: &[(&str, &str)]| {
        folder(&format!("{near_field}{fibre}"), after_mesh, files)
    };
    let (truth, _) = forces(&folder("fibre = { azimuth = 25.0 }", "", &[]));
    let ways = [
        folder("fibre = { field = \"fibre\" }", &field, &[]),
        folder("fibre = { file = \"view.msh\" }", "", &[("view.msh", &view)]),
        folder("fibre = { file = \"view.msh\", field = \"fibre\" }", "", &[("view.msh", &view)]),
        folder("fibre = { file = \"f.csv\" }", "", &[("f.csv", &format!("element,fx,fy,fz\n# made\n{csv}"))]),
        folder("fibre = { file = \"f.csv\" }", "", &[("f.csv", &second)]),
        folder(
            "layup = { plies = [{ thickness = 0.25, angle = 25.0 }], repeat = 2, symmetric = true }",
            "",
            &[],
        ),
        folder("regions.block.fibre = { azimuth = 25.0 }", "", &[]),
    ];
    for way in &ways {
        let (found, notes) = forces(way);
        for (a, b) in found.iter().zip(truth) {
            assert!((a - b).abs() < 1e-7 * truth[0], "{found:?} {truth:?} {notes}");
        }
        assert!(
            notes.contains("friction uses the mean fibre direction of body 1 under the frame"),
            "{notes}"
        );
        assert!(notes.contains("azimuth 25.00"), "{notes}");
    }
}

/// Truth: docs/scene.md: the fibres are wound around an axis parallel to y below the block. At the top of the block they point
/// along x on average. If the axis is close to the block, their directions deviate too much for one mean direction, and the
/// friction law needs its own `fibre`.
#[test]
fn friction_of_directions_that_vary() {
    let near = "fibre = { cylindrical = { axis = \"y\", origin = [0, 0, -20], angle = 90.0 } }";
    let (_, notes) = forces(&folder(near, "", &[]));
    assert!(notes.contains("azimuth 0.00") && notes.contains("deviate from it by up to 2."), "{notes}");
    let tight = "fibre = { cylindrical = { axis = [0, 3, 0], origin = [0, 0, -2], angle = 90.0 } }";
    refused(
        &folder(tight, "", &[]),
        &["friction.law", "deviate by up to", "friction.fibre = {", "--> scene.toml:29"],
    );
    let (code, _, text) = orthowear(
        folder(tight, "", &[]).path(),
        &["check", "scene.toml", "--set", "friction.fibre={ azimuth = 0.0 }"],
    );
    assert_eq!(code, Some(0), "{text}");
}

/// Truth: docs/scene.md: mistakes are reported with file, line and element.
#[test]
fn mistakes_in_tables_and_fields() {
    let commas = folder("fibre = { file = \"f.csv\" }", "", &[("f.csv", "101;0,8;0,6;0,0\n")]);
    refused(&commas, &["f.csv:1: the line has commas as well as semicolons"]);
    let table = |text: &str| folder("fibre = { file = \"f.csv\" }", "", &[("f.csv", text)]);
    refused(
        &table("101,1,0,0\n102,0,0,0\n102,1,x,0\n9,1\n999,1,0,0\n"),
        &[
            "f.csv:2: the fibre",
            "of element 102",
            "f.csv:3: \"x\"",
            "f.csv:4: 2 values",
            "f.csv:5: the mesh has no",
        ],
    );
    let most: String = (101..164).map(|e| format!("{e},1,0,0\n")).collect();
    refused(&table(&most), &["body1.fibre", "element 164 of ./box.msh: it has no fibre in ./f.csv"]);
    refused(&table(&format!("{most}101,1,0,0\n")), &["f.csv:64: element 101 appears twice"]);
    refused(&folder("fibre = { file = \"g.csv\" }", "", &[]), &["body1.fibre.file", "g.csv cannot be read"]);
    let field = |name: &str, data: &str| folder(&format!("fibre = {{ field = \"{name}\" }}"), data, &[]);
    refused(&field("fibre", ""), &["has no field \"fibre\"", "none"]);
    let data = element_data(101..165, "1 0 0");
    refused(&field("fiber", &data), &["did you mean \"fibre\"?"]);
    refused(
        &field("fibre", &data.replace("\n150 1 0 0", "\n150 nan 0 0")),
        &["element 150 has no direction"],
    );
    let line = (mesh() + &data).lines().position(|line| line == "150 1 0 0").unwrap() + 1;
    let place = format!("./box.msh, line {line} (section $ElementData): found \"zero\"");
    refused(&field("fibre", &data.replace("\n150 1 0 0", "\n150 1 zero 0")), &["body1.mesh", &place]);
    refused(&field("fibre", &element_data(101..150, "1 0 0")), &["element 150", "(15 elements in all)"]);
}

/// Truth: docs/scene.md: a scene must give the fibre direction in exactly one way, and the plies must fill the mesh.
#[test]
fn contradictions_are_named() {
    refused(&folder("fibre = { tilt = 1.0, field = \"a\" }", "", &[]), &["more than one way"]);
    refused(
        &folder("fibre = { cylindrical = { axis = \"z\" } }", "", &[]),
        &["neither `angle` nor `layers`"],
    );
    refused(&folder("fibre = { cylindrical = { axis = \"w\", angle = 1 } }", "", &[]), &["`axis` = \"w\""]);
    refused(
        &folder("fibre = { cylindrical = { axis = [0, 1], angle = 1 } }", "", &[]),
        &["a list of 3 values"],
    );
    refused(
        &folder("fibre = {}\nlayup = { plies = [{ thickness = 1.0 }] }", "", &[]),
        &["`fibre` and `layup` are both given"],
    );
    refused(
        &folder(
            "layup = { plies = [{ thickness = 0.5 }, { thickness = 0.25, material = \"im8\" }] }",
            "",
            &[],
        ),
        &["body1.layup.plies.1.material", "did you mean `im7`?"],
    );
    refused(
        &folder("layup = { plies = [{ thickness = 0.5 }, { thickness = 0.25 }] }", "", &[]),
        &["body1.layup", "outside all plies (16 elements in all)"],
    );
    let taken = "fibre = {}\n[body1.regions.block]\nmaterial = \"im7\"\nfibre = { tilt = 0.0 }";
    let layup = "layup = { plies = [{ thickness = 1.0, angle = 0.0 }] }";
    let unknown = folder(layup, "", &[]);
    let scene = unknown.path().join("scene.toml");
    let text = fs::read_to_string(&scene).unwrap().replacen("material = \"im7\"", "material = \"im9\"", 1);
    fs::write(&scene, text).unwrap();
    refused(&unknown, &["body1.material: the material `im9` is not defined"]);
    refused(
        &folder(&taken.replace("fibre = {}", layup), "", &[]),
        &["body1.layup", "no elements are left for this layup"],
    );
    let many = layup.replace(" }", ", repeat = 1000000000 }").replacen(", repeat = 1000000000 }", " }", 1);
    refused(&folder(&many, "", &[]), &["body1.layup.repeat"]);
    let plies = vec!["{ thickness = 1.0 }"; 1001].join(", ");
    let many = format!("layup = {{ plies = [{plies}], repeat = 100 }}");
    refused(&folder(&many, "", &[]), &["body1.layup.repeat", "100100 plies", "at most 100000 plies"]);
    let across = folder("layup = { plies = [{ thickness = 0.6 }, { thickness = 0.4 }] }", "", &[]);
    let (code, text, _) = orthowear(across.path(), &["check", "scene.toml"]);
    assert_eq!(code, Some(0));
    assert!(text.contains("16 of 64 elements extend beyond the ply"), "{text}");
}

/// Truth: the strain energy of an orthotropic material is positive only if nu12^2 is below E1/E2.
#[test]
fn an_indefinite_material_is_named_with_its_group_and_bound() {
    let bad = "regions.block = { material = \"bad\" }\n[materials.bad]\nmodel = \"orthotropic\"\nE1 = 100.0e3\nE2 = 10e3\n\
               E3 = 10e3\nG12 = 5e3\nG13 = 5e3\nG23 = 3e3\nnu12 = 3.3\nnu13 = 0.3\nnu23 = 0.4";
    refused(
        &folder(bad, "", &[]),
        &["`bad` (group \"block\" of body1) is not admissible", "nu12^2 must be below E1/E2 = 10.000000"],
    );
}

/// Truth: in double precision, the elasticity matrices of these materials cannot be distinguished from singular matrices.
#[test]
fn nearly_singular_materials_are_refused() {
    let orthotropic = |g12: &str, g13: &str, g23: &str, nu: &str| {
        format!(
            "model = \"orthotropic\"\nE1 = 1e3\nE2 = 1e3\nE3 = 1e3\nG12 = {g12}\nG13 = {g13}\nG23 = {g23}\n\
             nu12 = {nu}\nnu13 = {nu}\nnu23 = {nu}"
        )
    };
    let transverse = "model = \"transversely-isotropic\"\nE1 = 1e5\nE2 = 1e4\nG12 = 5e3\nnu12 = 0.0\nnu23 = 0.99999999999999989";
    let cases = [
        (orthotropic("333.0", "334.0", "333.5", "0.49999999999999994"), "the Poisson's ratios are too close"),
        (orthotropic("400.0", "400.0", "1e-99", "0.3"), "G23 = 1e-99 is too small compared with E"),
        (orthotropic("400.0", "400.0", "1e-15", "0.3"), "G23 = 1e-15 is too small"),
        (transverse.to_owned(), "the Poisson's ratios are too close"),
        ("model = \"isotropic\"\nE = 1e3\nnu = 0.49999999999999994".to_owned(), "nu is too close"),
    ];
    for (bad, words) in cases {
        let bad = format!("[materials.bad]\n{bad}");
        let of_group = folder(&format!("regions.block = {{ material = \"bad\" }}\n{bad}"), "", &[]);
        let of_body = folder(&format!("fibre = {{}}\n{bad}"), "", &[]);
        let body2 = ["check", "scene.toml", "--set", "body2={ kind = \"half-space\", material = \"bad\" }"];
        for (place, arguments) in [(of_group, &body2[..2]), (of_body, &body2)] {
            let (code, _, errors) = orthowear(place.path(), arguments);
            assert_eq!(code, Some(2), "{errors}");
            assert!(errors.contains("nearly singular") && errors.contains(words), "{words}: {errors}");
        }
    }
}
