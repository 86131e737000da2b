//! Mistakes that only the mesh or the order of the steps reveals. `check` reports them with key and line.

use std::fs;
use std::path::Path;

/// Mesh of two cubes of side 2 mm, one on top of the other. The group "middle" is the common face of the cubes.
pub(crate) const MESH: &str = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n4\n2 1 \"base\"\n2 2 \"top\"\n2 3 \"middle\"\n\
3 4 \"solid\"\n$EndPhysicalNames\n$Nodes\n12\n1 -1 -1 -4\n2 1 -1 -4\n3 1 1 -4\n4 -1 1 -4\n5 -1 -1 -2\n6 1 -1 -2\n7 1 1 -2\n\
8 -1 1 -2\n9 -1 -1 0\n10 1 -1 0\n11 1 1 0\n12 -1 1 0\n$EndNodes\n$Elements\n5\n1 3 2 1 1 1 4 3 2\n2 3 2 2 2 9 10 11 12\n\
3 3 2 3 3 5 6 7 8\n4 5 2 4 4 1 2 3 4 5 6 7 8\n5 5 2 4 4 5 6 7 8 9 10 11 12\n$EndElements\n";

const SCENE: &str = r#"[materials.steel]
model = "isotropic"
E = 210e3
nu = 0.3
[body1]
kind = "fe"
material = "steel"
mesh = "cubes.msh"
contact = "top"
fixed = [{ group = "base" }]
[body2]
kind = "half-space"
material = "steel"
[frame]
kind = "grid"
half_width = [0.5, 0.5]
cells = [4, 4]
[gap]
kind = "sphere"
radius = 10.0
[friction]
law = "coulomb"
mu = 0.3
[[steps]]
name = "press"
approach = 0.001
[[steps]]
name = "pull"
tangential_force = [0.1, 0.0]
[[steps]]
name = "deeper"
approach = 0.002
friction = true
"#;

fn check(changes: &[(&str, &str)], options: &[&str]) -> (Option<i32>, String) {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("cubes.msh"), MESH).unwrap();
    let mut scene = SCENE.to_owned();
    for (from, to) in changes {
        assert!(scene.contains(from), "{from}");
        scene = scene.replacen(from, to, 1);
    }
    fs::write(folder.path().join("scene.toml"), scene).unwrap();
    let output = crate::tools::orthowear()
        .current_dir(folder.path())
        .args(["check", "scene.toml"])
        .args(options)
        .output()
        .unwrap();
    let text = [output.stderr, output.stdout].concat();
    (output.status.code(), String::from_utf8(text).unwrap())
}

#[track_caller]
fn refused(changes: &[(&str, &str)], words: &[&str]) {
    let (code, text) = check(changes, &[]);
    assert_eq!(code, Some(2), "{text}");
    let flat = text.split(['│', '\n']).map(str::trim).collect::<Vec<_>>().join(" ");
    for word in words {
        assert!(text.contains(word) || flat.contains(word), "lacks \"{word}\":\n{text}");
    }
}

const INNER: (&str, &str) = ("contact = \"top\"", "contact = \"middle\"");
const FLOATING: (&str, &str) = ("{ group = \"base\" }", "{ group = \"base\", components = [\"x\"] }");

/// Truth: docs/scene.md: the unchanged scene is valid.
#[test]
fn the_sound_scene_is_accepted() {
    let (code, text) = check(&[], &[]);
    assert_eq!(code, Some(0), "{text}");
}

/// Truth: in `MESH`, the group "middle" lies between two solid elements. A contact surface must lie on the boundary.
#[test]
fn an_inner_contact_face() {
    refused(&[INNER], &["body1.contact", "inner face", "--> scene.toml:9:"]);
}

/// Truth: docs/scene.md:
///
/// - A base that is fixed along x only leaves these motions free: translations along y and z, rotations about x and y.
/// - Along a free direction, a step can prescribe a force but not a displacement.
/// - Two bodies that are free along the same direction are refused. An unconstrained body with block coupling is refused too.
#[test]
fn a_floating_body() {
    refused(
        &[FLOATING],
        &[
            "steps.0.approach",
            "body 1 is unconstrained: translation y",
            "`normal_force`",
            "--> scene.toml:26:",
        ],
    );
    let none = ("fixed = [{ group = \"base\" }]\n", "");
    refused(&[none, ("approach = 0.001", "normal_force = 5.0")], &["steps.2.approach", "--> scene.toml:31:"]);
    let forces =
        [none, ("approach = 0.001", "normal_force = 5.0"), ("approach = 0.002", "normal_force = 6.0")];
    let (code, text) = check(&forces, &[]);
    assert_eq!(code, Some(0), "{text}");
    assert!(
        text.contains("body1 has unconstrained rigid-body modes (translation x, translation y, translation z, rotation about x"),
        "{text}"
    );
    let shifted = ("tangential_force = [0.1, 0.0]", "shift = { distance = 0.001 }");
    refused(&[&forces[..], &[shifted]].concat(), &["steps.1.shift", "`tangential_force`"]);
    let slid = ("tangential_force = [0.1, 0.0]", "sliding = { distance = 1.0 }");
    refused(&[&forces[..], &[slid]].concat(), &["steps.1.sliding", "the body is unconstrained"]);
    refused(
        &[&forces[..], &[("[frame]", "[solver]\ncoupling = \"block\"\n[frame]")]].concat(),
        &["solver.coupling", "has unconstrained rigid-body modes"],
    );
    let body1 = &SCENE[SCENE.find("kind = \"fe\"").unwrap()..SCENE.find("[body2]").unwrap()];
    let both = [("kind = \"half-space\"\nmaterial = \"steel\"\n", body1), FLOATING, FLOATING];
    refused(&both, &["--> scene.toml:", "both bodies are unconstrained", "body 2 by translation y"]);
}

/// Truth: docs/scene.md: foundations, prescribed displacements and planes of symmetry may replace `fixed`.
#[test]
fn supports_of_other_kinds() {
    let instead = |keys: &'static str| [("fixed = [{ group = \"base\" }]", keys)];
    for keys in [
        "foundation = [{ group = \"base\", stiffness = [10.0, 10.0, 100.0] }]",
        "displaced = [{ group = \"base\", gradient = [[1e-4, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]] }]",
        "displaced = [{ group = \"base\", value = [0.0, 0.0, 0.1] }]",
    ] {
        let (code, text) = check(&instead(keys), &[]);
        assert_eq!(code, Some(0), "{keys}\n{text}");
    }
    let (code, text) = check(
        &[instead("symmetry = [\"base\"]")[0], ("tangential_force = [0.1, 0.0]", "friction = false")],
        &[],
    );
    assert_eq!(code, Some(0), "{text}");
    assert!(
        text.contains(
            "body1 has unconstrained rigid-body modes (translation x, translation y, rotation about z)"
        ),
        "{text}"
    );
    for (keys, words) in [
        (
            "foundation = [{ group = \"base\", stiffness = 0.0 }]",
            ["body1.foundation.0.stiffness", "not positive"],
        ),
        (
            "foundation = [{ group = \"base\", stiffness = [1.0, 2.0] }]",
            ["body1.foundation.0.stiffness", "2 values"],
        ),
        (
            "foundation = [{ group = \"base\", stiffness = \"soft\" }]",
            ["body1.foundation.0.stiffness", "a number"],
        ),
        ("foundation = [{ group = \"solid\", stiffness = 1.0 }]", ["body1.foundation.0.group", "surfaces"]),
        ("displaced = [{ group = \"base\" }]", ["body1.displaced.0", "neither `value` nor `gradient`"]),
        (
            "displaced = [{ group = \"base\", gradient = [[1.0, 0.0, 0.0]] }]",
            ["body1.displaced.0.gradient", "has 1 entries for 3 components"],
        ),
        ("symmetry = [\"middle\"]", ["body1.symmetry.0", "inner face"]),
    ] {
        refused(&instead(keys), &words);
        refused(&instead(keys), &["--> scene.toml:10:"]);
    }
    let across = "symmetry = [\"base\"]\nbody_force = { value = [0.0, 0.0, 1.0], name = \"weight\" }";
    refused(&instead(across), &["body1.body_force", "across the plane of symmetry \"base\""]);
}

/// Truth: the contact surface ends at x = 1 mm, but the frame has a half-width of 1.5 mm.
#[test]
fn a_frame_beyond_the_contact_faces() {
    refused(
        &[("half_width = [0.5, 0.5]", "half_width = [1.5, 0.5]")],
        &["frame.half_width", "covered", "--> scene.toml:16:"],
    );
}

/// Truth: docs/command-line.md: mistakes are reported together.
#[test]
fn several_at_once() {
    refused(
        &[INNER, ("{ group = \"base\" }", "{ group = \"bottom\" }"), ("radius = 10.0", "radius = -10.0")],
        &["body1.contact", "body1.fixed", "gap.radius", "3 errors"],
    );
}

/// Truth: docs/scene.md: a step keeps the prescribed quantities of earlier steps that it does not name. A tangential force needs
/// friction.
#[test]
fn a_held_tangential_force_needs_friction() {
    let off = ("friction = true", "friction = false");
    refused(&[off], &["steps.2.friction", "of step \"pull\" is still active", "--> scene.toml:33:"]);
    let mended = "approach = 0.002\ntangential_force = [0.0, 0.0]";
    let (code, text) = check(&[off, ("approach = 0.002", mended)], &[]);
    assert_eq!(code, Some(0), "{text}");
    refused(
        &[("law = \"coulomb\"\nmu = 0.3", "law = \"none\"")],
        &["steps.1.tangential_force", "needs friction"],
    );
}

/// Truth: docs/scene.md: forces may be prescribed on any frame, including the curved faces of a spherical cap.
#[test]
fn forces_on_a_curved_frame() {
    let mesh = Path::new(env!("CARGO_MANIFEST_DIR")).join("meshes/steel-cap.msh");
    let body2 = format!(
        "kind = \"fe\"\nmaterial = \"steel\"\nmesh = '{}'\ncontact = \"contact\"\nfixed = [{{ group = \"top\" }}]",
        mesh.display()
    );
    let body1 = &SCENE[SCENE.find("kind = \"fe\"").unwrap()..SCENE.find("[body2]").unwrap()];
    let curved = [
        ("kind = \"half-space\"\nmaterial = \"steel\"", body2.as_str()),
        (body1, "kind = \"rigid\"\n"),
        ("kind = \"grid\"\nhalf_width = [0.5, 0.5]\ncells = [4, 4]", "kind = \"mesh\""),
        ("kind = \"sphere\"\nradius = 10.0", "kind = \"mesh\""),
    ];
    let (code, text) = check(&curved, &[]);
    assert_eq!(code, Some(0), "{text}");
    let (code, text) = check(&[&curved[..], &[("approach = 0.001", "normal_force = 10.0")]].concat(), &[]);
    assert_eq!(code, Some(0), "{text}");
}

/// Truth: 10^12 cells exceed the memory of any computer. docs/command-line.md gives the exit code 4.
#[test]
fn a_frame_beyond_the_memory() {
    let (code, text) = check(&[], &["--set", "frame.cells=[1000000, 1000000]"]);
    assert_eq!(code, Some(4), "{text}");
    assert!(text.contains("bytes") && text.contains("use fewer cells"), "{text}");
}

/// Exit code of `check`, and its output on one line.
fn check_mesh(mesh: &str) -> (Option<i32>, String) {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("cubes.msh"), mesh).unwrap();
    fs::write(folder.path().join("scene.toml"), SCENE).unwrap();
    let output =
        crate::tools::orthowear().current_dir(folder.path()).args(["check", "scene.toml"]).output().unwrap();
    let text = String::from_utf8([output.stderr, output.stdout].concat()).unwrap();
    // Excerpts of the scene in messages may break lines anywhere.
    (output.status.code(), text.split(['│', '\n']).map(str::trim).collect::<Vec<_>>().join(" "))
}

/// Truth: docs/meshes.md: a support group must contain elements. A name of both a surface group and a volume group is ambiguous.
#[test]
fn groups_of_supports() {
    let empty = MESH.replace("$Elements\n5\n1 3 2 1 1 1 4 3 2\n", "$Elements\n4\n");
    let both = MESH.replace("3 4 \"solid\"", "3 4 \"base\"");
    for (mesh, words) in [(empty, "cubes.msh has no elements"), (both, "a group of volumes and")] {
        let (code, text) = check_mesh(&mesh);
        assert_eq!(code, Some(2), "{text}");
        assert!(text.contains(words) && text.contains("body1.fixed.0.group"), "{text}");
    }
}

/// Truth: in double precision, the elasticity matrix of a material with nu = 0.5 - 1e-15 is singular.
#[test]
fn a_material_that_keeps_its_volume() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("cubes.msh"), MESH).unwrap();
    fs::write(folder.path().join("scene.toml"), SCENE.replace("nu = 0.3", "nu = 0.499999999999999")).unwrap();
    let arguments = ["run", "scene.toml", "--quiet", "--no-cache"];
    let output = crate::tools::orthowear().current_dir(folder.path()).args(arguments).output().unwrap();
    let text = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2), "{text}");
    let flat = text.split(['│', '\n']).map(str::trim).collect::<Vec<_>>().join(" ");
    assert_eq!(
        flat.matches("`steel` (body1, body2) is nearly singular: nu is too close").count(),
        1,
        "{text}"
    );
}

/// Truth: TOML: quoted names may contain dots.
#[test]
fn names_with_dots() {
    let name = ("\"steel\"", "\"T700.epoxy\"");
    let table = ("[materials.steel]", "[materials.\"T700.epoxy\"]");
    let (code, text) = check(&[table, name, name], &["--set", "materials.\"T700.epoxy\".nu=0.2"]);
    assert_eq!(code, Some(0), "{text}");
    refused(&[table, name, name, ("E = 210e3", "E = -1")], &["materials.\"T700.epoxy\"", "--> scene.toml:"]);
}

/// Mesh of a column of `n` cubes of side 2 mm below z = 0. The cubes have the numbers 101, 102, .. from the top down. `order`
/// gives the order of the corners of each cube.
fn column(n: usize, order: impl Fn(usize) -> [usize; 8]) -> String {
    let mut text =
        "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n3\n2 1 \"base\"\n2 2 \"top\"\n3 4 \"solid\"\n\
                    $EndPhysicalNames\n$Nodes\n"
            .to_owned();
    text += &format!("{}\n", 4 * (n + 1));
    for level in 0..=n {
        for (i, [x, y]) in [[-1, -1], [1, -1], [1, 1], [-1, 1]].into_iter().enumerate() {
            text += &format!("{} {x} {y} {}\n", 4 * level + i + 1, -2 * level as i64);
        }
    }
    let base: Vec<String> = [4, 3, 2, 1].map(|i| (4 * n + i).to_string()).to_vec();
    text += &format!("$EndNodes\n$Elements\n{}\n1 3 2 1 1 {}\n2 3 2 2 2 1 2 3 4\n", n + 2, base.join(" "));
    for cell in 0..n {
        let nodes = order(cell).map(|i| (4 * cell + if i < 4 { i + 5 } else { i - 3 }).to_string());
        text += &format!("{} 5 2 4 4 {}\n", 101 + cell, nodes.join(" "));
    }
    text + "$EndElements\n"
}

/// Truth: geometry. The cube and the reference cube both have the side 2, so the Jacobian is 1. If the lower and the upper face
/// of the cube are exchanged, the Jacobian is -1.
#[test]
fn inverted_elements_are_listed() {
    let sound = [0, 1, 2, 3, 4, 5, 6, 7];
    let (code, text) = check_mesh(&column(14, |_| sound));
    assert_eq!(code, Some(0), "{text}");
    let turned = [4, 5, 6, 7, 0, 1, 2, 3];
    let (code, text) = check_mesh(&column(14, |cell| if cell == 1 || cell > 3 { turned } else { sound }));
    assert_eq!(code, Some(2), "{text}");
    for words in [
        "body1.mesh",
        "11 of 14 solid elements of",
        "(11 inverted or folded)",
        "hex8 102, hex8 105, hex8 106, hex8 107, hex8 108, hex8 109, hex8 110, hex8 111, hex8 112, hex8 113, ..",
        "the worst is -1.000e0 (-1.000e0 relative to its edge lengths), of element 102",
        "ReverseMesh",
    ] {
        assert!(text.contains(words), "lacks \"{words}\":\n{text}");
    }
}

/// Mesh of a cube of side 2 mm with 20 nodes. The middle node of the edge from (-1, -1, -2) to (1, -1, -2) has the x coordinate
/// `x`.
fn curved(x: f64) -> String {
    let corners =
        [[-1, -1, -2], [1, -1, -2], [1, 1, -2], [-1, 1, -2], [-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]];
    let edges =
        [[0, 1], [0, 3], [0, 4], [1, 2], [1, 5], [2, 3], [2, 6], [3, 7], [4, 5], [4, 7], [5, 6], [6, 7]];
    let mut points: Vec<[f64; 3]> = corners.map(|c| c.map(f64::from)).to_vec();
    for [a, b] in edges {
        points.push(std::array::from_fn(|k| 0.5 * (points[a][k] + points[b][k])));
    }
    points[8][0] = x;
    let lines = points.iter().enumerate().map(|(i, [x, y, z])| format!("{} {x} {y} {z}\n", i + 1));
    format!(
        "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n3\n2 1 \"base\"\n2 2 \"top\"\n3 4 \"solid\"\n$EndPhysicalNames\n\
         $Nodes\n20\n{}$EndNodes\n$Elements\n3\n1 16 2 1 1 1 4 3 2 10 14 12 9\n2 16 2 2 2 5 6 7 8 17 19 20 18\n\
         7 17 2 4 4 {}\n$EndElements\n",
        lines.collect::<String>(),
        (1..=20).map(|i| i.to_string()).collect::<Vec<_>>().join(" ")
    )
}

/// Truth: geometry. A quadratic line with nodes at -1, m and 1 has the slope 1 - 2 m x at the reference coordinate x. For m above
/// 1/2, the slope is negative at the end x = 1. The line folds there, and so does the cube.
///
/// The outermost integration points have the coordinates ±s, s = sqrt(3/5). There the shape functions of the edge have the weight
/// ((1 + s) / 2)^2 = 0.787. The Jacobian 1 - 2 m 0.787 s is positive up to m = 0.82.
#[test]
fn folded_curved_elements_are_listed() {
    let (code, text) = check_mesh(&curved(0.49));
    assert!(code == Some(0) && !text.contains("folded"), "{text}");
    let (code, text) = check_mesh(&curved(0.55));
    assert_eq!(code, Some(0), "{text}");
    assert!(
        text.contains("1 of 1 solid elements are folded or flat at a node") && text.contains("element 7")
    );
    let (code, text) = check_mesh(&curved(0.9));
    assert_eq!(code, Some(2), "{text}");
    for words in ["1 of 1 solid elements", "hex20 7", "folded", "-9.771e-2", "straighten"] {
        assert!(text.contains(words), "lacks \"{words}\":\n{text}");
    }
}

/// Truth: two keys prescribe different displacements along z for the same group.
#[test]
fn contradicting_supports_are_named_by_their_keys() {
    let fixed = "fixed = [{ group = \"base\" }]";
    let displaced = "displaced = [{ group = \"base\", components = [\"z\"], value = [0.1] }]";
    refused(
        &[(fixed, &format!("{fixed}\n{displaced}"))],
        &[
            "body1.displaced.0",
            "body1.fixed.0 and body1.displaced.0",
            "both name the group \"base\"",
            "along z: 0 and 0.1",
        ],
    );
    refused(
        &[(fixed, &format!("{displaced}\nsymmetry = [\"base\"]"))],
        &["body1.symmetry.0", "body1.displaced.0 and body1.symmetry.0", "along z: 0.1 and 0"],
    );
    refused(&[(fixed, "symmetry = [\"top\"]")], &["body1.symmetry.0", "`top`", "along z"]);
}

/// Truth: geometry. The base of the cubes faces downward, but body 2 lies above the cubes.
#[test]
fn a_contact_group_that_looks_away_is_the_groups_mistake() {
    let turned =
        [("contact = \"top\"", "contact = \"base\""), ("{ group = \"base\" }", "{ group = \"top\" }")];
    refused(
        &turned,
        &["body1.contact", "none of the 1 faces of `base` is oriented towards body2", "(0, 0, 1)"],
    );
}

/// Truth: gmsh saves a mesh without its volumes if only surfaces have physical groups.
#[test]
fn a_mesh_of_surfaces_only() {
    let (start, end) = (MESH.find("4 5 2 4 4").unwrap(), MESH.find("$EndElements").unwrap());
    let mesh = format!("{}{}", &MESH[..start], &MESH[end..]).replace("$Elements\n5", "$Elements\n3");
    let (code, text) = check_mesh(&mesh);
    assert_eq!(code, Some(2), "{text}");
    for words in ["body1.mesh", "no solid elements but 3 surface elements", "Physical Volume(", "gmsh -3"] {
        assert!(text.contains(words), "lacks \"{words}\":\n{text}");
    }
    assert!(!text.contains("body1.fixed") && !text.contains("body1.contact"), "{text}");
}

/// Truth: a plane mesh has no volume. The advice is therefore to extrude it.
#[test]
fn a_plane_mesh_is_to_be_extruded() {
    let (start, end) = (MESH.find("1 3 2 1 1").unwrap(), MESH.find("$EndElements").unwrap());
    let faces = "1 3 2 1 1 1 2 3 4\n2 3 2 2 2 1 2 3 4\n3 3 2 3 3 1 2 3 4\n";
    let mesh = format!("{}{faces}{}", &MESH[..start], &MESH[end..]).replace("$Elements\n5", "$Elements\n3");
    let nodes = &mesh[mesh.find("5 -1 -1 -2\n").unwrap()..mesh.find("$EndNodes").unwrap()];
    let (code, text) = check_mesh(&mesh.replace(nodes, "").replace("$Nodes\n12", "$Nodes\n4"));
    assert_eq!(code, Some(2), "{text}");
    for words in
        ["body1.mesh", "no solid elements but 1 surface elements. All have the same z", "Extrude {0, 0, 1}"]
    {
        assert!(text.contains(words), "lacks \"{words}\":\n{text}");
    }
}

/// Truth: cubes with sides of 2 mm, given in metres, have sides of 0.002. The program takes this number as 0.002 mm, far below
/// the half-width of 0.5 mm of the frame.
#[test]
fn a_mesh_in_other_units_is_hinted_at_where_it_bites() {
    let mut text = MESH[..MESH.find("$Nodes").unwrap()].to_owned();
    text.push_str("$Nodes\n12\n");
    let square = [[-1, -1], [1, -1], [1, 1], [-1, 1]];
    for (level, z) in ["-0.004", "-0.002", "0"].into_iter().enumerate() {
        for (corner, [x, y]) in square.into_iter().enumerate() {
            text.push_str(&format!("{} {x}e-3 {y}e-3 {z}\n", 4 * level + corner + 1));
        }
    }
    text.push_str(&MESH[MESH.find("$EndNodes").unwrap()..]);
    let (code, found) = check_mesh(&text);
    assert_eq!(code, Some(2), "{found}");
    assert!(
        found.contains("possible unit error: the contact surface of body1 is only 2.0000e-3 mm wide"),
        "{found}"
    );
}

/// Truth: two blocks without common nodes are separate bodies, even if four pairs of nodes have the same position.
#[test]
fn unmerged_nodes_are_told_with_the_mistake() {
    // The upper cube gets new nodes in place of nodes 5 to 8.
    let extra = "13 -1 -1 -2\n14 1 -1 -2\n15 1 1 -2\n16 -1 1 -2\n$EndNodes";
    let mesh = MESH
        .replace("$Nodes\n12", "$Nodes\n16")
        .replace("$EndNodes", extra)
        .replace("$Elements\n5", "$Elements\n4")
        .replace("3 3 2 3 3 5 6 7 8\n", "")
        .replace("5 5 2 4 4 5 6 7 8 9 10 11 12", "5 5 2 4 4 13 14 15 16 9 10 11 12");
    let (code, text) = check_mesh(&mesh);
    assert_eq!(code, Some(2), "{text}");
    assert!(
        text.contains("8 nodes around (0, 0, -1)") && text.contains("4 nodes coincide with another node"),
        "{text}"
    );
}

/// Mesh of a ring of radii 6 mm and 10 mm, one element thick along y. Its lowest line lies in z = 0. The group "outer" contains
/// the outer faces. The group "lower" contains the outer faces whose normals point down, at more than 2.9 degrees to the
/// horizontal.
fn ring(n: usize) -> String {
    let (mut nodes, mut elements) = (String::new(), Vec::new());
    let number = |layer: usize, i: usize, y: usize| 1 + y + 2 * (layer + 2 * (i % n));
    for (i, layer, y) in (0..n).flat_map(|i| (0..4).map(move |k| (i, k / 2, k % 2))) {
        let (angle, radius) = (2.0 * std::f64::consts::PI * i as f64 / n as f64, [6.0, 10.0][layer]);
        let node = number(layer, i, y);
        nodes += &format!("{node} {} {y} {}\n", radius * angle.sin(), 10.0 - radius * angle.cos());
    }
    for i in 0..n {
        let side = |layer: usize| [(i, 0), (i, 1), (i + 1, 1), (i + 1, 0)].map(|(i, y)| number(layer, i, y));
        let middle = 2.0 * std::f64::consts::PI * (i as f64 + 0.5) / n as f64;
        let words = |list: &[usize]| list.iter().map(|x| format!(" {x}")).collect::<String>();
        elements.push(format!("3 2 1 1{}", words(&side(1))));
        if middle.cos() > 0.05 {
            elements.push(format!("3 2 2 2{}", words(&side(1))));
        }
        elements.push(format!("3 2 3 3{}", words(&side(0))));
        elements.push(format!("5 2 4 4{}", words(&[side(0), side(1)].concat())));
    }
    let elements: String =
        elements.iter().enumerate().map(|(i, line)| format!("{} {line}\n", i + 1)).collect();
    format!(
        "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n4\n2 1 \"outer\"\n2 2 \"lower\"\n2 3 \"inner\"\n3 4 \"ring\"\n\
         $EndPhysicalNames\n$Nodes\n{}\n{nodes}$EndNodes\n$Elements\n{}\n{elements}$EndElements\n",
        4 * n,
        elements.lines().count()
    )
}

/// Truth: only the lower half of the ring faces the plane. With the whole outer surface as contact group, the normal force is
/// therefore the same as with the lower half.
#[test]
fn rings_are_pressed_on_a_plane() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("ring.msh"), ring(64)).unwrap();
    let pressed = |group: &str| {
        let scene = format!(
            "[materials.steel]\nmodel = \"isotropic\"\nE = 210e3\nnu = 0.3\n[body1]\nkind = \"rigid\"\n[body2]\nkind = \"fe\"\n\
             material = \"steel\"\nmesh = \"ring.msh\"\ncontact = \"{group}\"\nfixed = [{{ group = \"inner\" }}, {{ group = \"ring\", \
             components = [\"y\"] }}]\n[frame]\nkind = \"mesh\"\nbody = 2\npoints = \"faces\"\n[gap]\nkind = \"mesh\"\n[[steps]]\napproach = 0.05\n"
        );
        fs::write(folder.path().join("scene.toml"), scene).unwrap();
        let mut program = crate::tools::orthowear();
        let output = program.current_dir(folder.path()).args(["run", "scene.toml"]).output().unwrap();
        let text = String::from_utf8([output.stdout, output.stderr].concat()).unwrap();
        assert_eq!(output.status.code(), Some(0), "{text}");
        let summary = fs::read(folder.path().join("scene.out/summary.json")).unwrap();
        let summary: serde_json::Value = serde_json::from_slice(&summary).unwrap();
        (summary["steps"][0]["normal_force"].as_f64().unwrap(), text)
    };
    let ((whole, said), (lower, _)) = (pressed("outer"), pressed("lower"));
    assert!(said.contains("34 of the 64 faces of `outer` do not face the plane of body1"), "{said}");
    assert!(lower > 100.0 && (whole / lower - 1.0).abs() < 1e-9, "{whole} {lower}");
}
