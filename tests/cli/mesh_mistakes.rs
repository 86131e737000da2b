//! Mistakes that only the mesh or the sequence of steps reveals: found by `check`, with key and line.

use std::fs;
use std::path::Path;

/// Two cubes of side 2 on top of one another; "middle" is the face between them.
const MESH: &str = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n4\n2 1 \"base\"\n2 2 \"top\"\n2 3 \"middle\"\n\
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

/// Exit code and messages of `check` for `SCENE` with replacements.
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
    for word in words {
        assert!(text.contains(word), "lacks \"{word}\":\n{text}");
    }
}

const INNER: (&str, &str) = ("contact = \"top\"", "contact = \"middle\"");
const FLOATING: (&str, &str) = ("{ group = \"base\" }", "{ group = \"base\", components = [\"x\"] }");

/// Truth: docs/scene.md; the base of the cases below has no mistake.
#[test]
fn the_sound_scene_is_accepted() {
    let (code, text) = check(&[], &[]);
    assert_eq!(code, Some(0), "{text}");
}

/// Truth: the mesh above: its group "middle" lies between two solids (lines of the keys in the scene above).
#[test]
fn an_inner_contact_face() {
    refused(&[INNER], &["body1.contact", "inner face", "[scene.toml:9:"]);
}

/// Truth: docs/scene.md: a surface held along x only leaves two translations and a rotation free; a displacement along
/// those has no meaning, a force has, and no support at all is well too; the other body may not float along them.
#[test]
fn a_floating_body() {
    refused(
        &[FLOATING],
        &["steps.0.approach", "body 1 floats by translation y", "`normal_force`", "[scene.toml:26:"],
    );
    let none = ("fixed = [{ group = \"base\" }]\n", "");
    refused(&[none, ("approach = 0.001", "normal_force = 5.0")], &["steps.2.approach", "[scene.toml:31:"]);
    let forces =
        [none, ("approach = 0.001", "normal_force = 5.0"), ("approach = 0.002", "normal_force = 6.0")];
    let (code, text) = check(&forces, &[]);
    assert_eq!(code, Some(0), "{text}");
    assert!(
        text.contains("body1 floats by translation x, translation y, translation z, rotation about x"),
        "{text}"
    );
    let shifted = ("tangential_force = [0.1, 0.0]", "shift = { distance = 0.001 }");
    refused(&[&forces[..], &[shifted]].concat(), &["steps.1.shift", "`tangential_force`"]);
    refused(
        &[&forces[..], &[("[frame]", "[solver]\ncoupling = \"block\"\n[frame]")]].concat(),
        &["solver.coupling", "floats"],
    );
    let body1 = &SCENE[SCENE.find("kind = \"fe\"").unwrap()..SCENE.find("[body2]").unwrap()];
    let both = [("kind = \"half-space\"\nmaterial = \"steel\"\n", body1), FLOATING, FLOATING];
    refused(&both, &["[scene.toml:", "both bodies float", "body 2 by translation y"]);
}

/// Truth: docs/scene.md: supports of other kinds than `fixed`, and what is wrong with some of them.
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
    assert!(text.contains("body1 floats by translation x, translation y, rotation about z"), "{text}");
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
            ["body1.displaced.0.gradient", "1 gradients"],
        ),
        ("symmetry = [\"middle\"]", ["body1.symmetry.0", "inner face"]),
    ] {
        refused(&instead(keys), &words);
        refused(&instead(keys), &["[scene.toml:10:"]);
    }
}

/// Truth: the contact surface reaches to 1.
#[test]
fn a_frame_beyond_the_contact_faces() {
    refused(
        &[("half_width = [0.5, 0.5]", "half_width = [1.5, 0.5]")],
        &["frame.half_width", "covered", "[scene.toml:16:"],
    );
}

/// Truth: docs/command-line.md: mistakes are reported together.
#[test]
fn several_at_once() {
    refused(
        &[INNER, ("{ group = \"base\" }", "{ group = \"bottom\" }"), ("radius = 10.0", "radius = -10.0")],
        &["body1.contact", "body1.fixed", "gap.radius", "3 mistakes"],
    );
}

/// Truth: docs/scene.md: what a step does not name stays as before; a tangential force needs friction.
#[test]
fn a_held_tangential_force_needs_friction() {
    let off = ("friction = true", "friction = false");
    refused(&[off], &["steps.2.friction", "held from step \"pull\"", "[scene.toml:33:"]);
    let mended = "approach = 0.002\ntangential_force = [0.0, 0.0]";
    let (code, text) = check(&[off, ("approach = 0.002", mended)], &[]);
    assert_eq!(code, Some(0), "{text}");
    refused(
        &[("law = \"coulomb\"\nmu = 0.3", "law = \"none\"")],
        &["steps.1.tangential_force", "needs friction"],
    );
}

/// Truth: docs/scene.md: forces may be prescribed on any frame, the curved faces of a sphere cap included.
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

/// Truth: a million million cells fit into no memory; exit codes of docs/command-line.md.
#[test]
fn a_frame_beyond_the_memory() {
    let (code, text) = check(&[], &["--set", "frame.cells=[1000000, 1000000]"]);
    assert_eq!(code, Some(4), "{text}");
    assert!(text.contains("bytes") && text.contains("use fewer cells"), "{text}");
}
