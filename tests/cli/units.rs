//! Probable unit errors raise a warning with the numbers. Consistent scenes raise none.

use std::fs;
use std::path::Path;
use std::process::Command;

use super::materials::{folder, orthowear};

fn notes(options: &[&str]) -> String {
    let folder = folder("fibre = { tilt = 30.0 }", "", &[]);
    let (code, text, errors) = orthowear(folder.path(), &[&["check", "scene.toml"][..], options].concat());
    assert_eq!(code, Some(0), "{errors}");
    text.lines().filter(|line| line.contains("possible unit error:")).collect::<Vec<_>>().join("\n")
}

/// Truth: the scene has ordinary materials and sizes: radius 20 mm, half-width 0.75 mm, approach 0.005 mm, height of the mesh 1
/// mm. Each case makes one number implausible, for example by another unit.
#[test]
fn each_mixed_up_number_is_named() {
    assert_eq!(notes(&[]), "");
    let set = |what: &str, words: &[&str]| {
        let found = notes(&["--set", what]);
        for word in words {
            assert!(found.contains(word), "{what}: lacks \"{word}\": {found}");
        }
    };
    let body2 = "body2={ kind = \"half-space\", material = \"steel\" }";
    for (e, words) in [
        ("210.0", ["`steel` is 2.1000e2 MPa", "was it given in GPa?"]),
        ("210e9", ["`steel` is 2.1000e11 MPa", "was it given in Pa?"]),
    ] {
        let material = format!("materials.steel={{ model = \"isotropic\", E = {e}, nu = 0.3 }}");
        let found = notes(&["--set", &material, "--set", body2]);
        words.iter().for_each(|word| assert!(found.contains(word), "{found}"));
    }
    let soft = "materials.steel={ model = \"isotropic\", E = 0.5, nu = 0.49 }";
    let found = notes(&["--set", soft, "--set", body2]);
    assert!(
        found.contains("use kind = \"rigid\" for the stiffer body") && !found.contains("was it given in"),
        "{found}"
    );
    set(
        "gap.radius=0.02",
        &["radius of the gap is 2.0000e-2", "half-width of the contact frame is 7.5000e-1"],
    );
    set("gap.radius=2e7", &["radius of the gap is 2.0000e7"]);
    set(
        "steps.press.approach=5.0",
        &["approach 5.0000e0 mm gives a contact", "height of the mesh of body1 along the normal, 1.0000e0"],
    );
    set("steps.press.approach=1e-9", &["much smaller than a cell"]);
    set("steps.shift.shift.distance=20.0", &["displacement of body 2 is 2.0000e1"]);
    let forced = "steps=[{ normal_force = 1e9 }]";
    set(forced, &["force 1.0000e9 N gives a contact"]);
}

/// Truth: geometry. The slices of pin and hole are 1 mm thick along y, but 40 mm high along the normal. An approach of 0.31 mm is
/// therefore plausible.
#[test]
fn thin_slices_may_approach_along_their_plane() {
    let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/pin-in-hole.toml");
    let options = ["check", scene.to_str().unwrap(), "--set", "steps.press.approach=0.31"];
    let (code, text, errors) = orthowear(Path::new("."), &options);
    assert_eq!(code, Some(0), "{errors}");
    assert!(!text.contains("possible unit error"), "{text}");
}

/// Truth: the scene defines a second material, which no body uses.
#[test]
fn a_material_that_nothing_is_made_of_is_noted() {
    let folder = folder("fibre = { tilt = 30.0 }", "", &[]);
    let steel = "materials.steel={ model = \"isotropic\", E = 210e3, nu = 0.3 }";
    let (code, text, _) = orthowear(folder.path(), &["check", "scene.toml", "--set", steel]);
    assert_eq!(code, Some(0));
    assert!(
        text.contains("the material `steel` is not used by any body") && !text.contains("`im7`"),
        "{text}"
    );
}

/// Truth: the scenes of the repository are consistent, so no unit error is reported.
#[test]
fn ready_scenes_are_not_warned_about() {
    // Only scenes that git tracks are tested, because the folder may also contain scenes of the user.
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let listed = Command::new("git").current_dir(root).args(["ls-files", "scenes/*.toml"]).output().unwrap();
    let names = String::from_utf8(listed.stdout).unwrap();
    assert!(names.lines().count() > 10, "git lists {names:?}");
    for name in names.lines() {
        let path = root.join(name);
        if fs::read_to_string(&path).unwrap().contains("\n[study]\n") {
            let study = orthowear::sweep::read(&path, &[]);
            assert!(study.is_ok_and(|study| !study.runs.is_empty()), "{}", path.display());
            continue;
        }
        let plan = orthowear::scene::read(&path, &[]).unwrap_or_else(|mistakes| panic!("{mistakes}"));
        assert!(
            plan.notes.iter().all(|note| !note.text.contains("possible unit error:")),
            "{}: {:?}",
            path.display(),
            plan.notes
        );
    }
}

/// Truth: Hertz. The contact area is π R δ = 3.14e-13 m² for the radius R and the approach δ. The computed area agrees to 3 %,
/// because the contact edge cuts cells.
#[test]
fn results_in_metres_are_shown() {
    let scene = r#"
[units]
length = "m"
force = "N"
[materials.steel]
model = "isotropic"
E = 210e9
nu = 0.3
[body1]
kind = "half-space"
material = "steel"
[body2]
kind = "rigid"
[frame]
kind = "grid"
half_width = [5e-7, 5e-7]
cells = [64, 64]
[gap]
kind = "sphere"
radius = 1e-3
[[steps]]
name = "indent"
approach = 1e-10
"#;
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("scene.toml"), scene).unwrap();
    let (code, text, errors) = orthowear(folder.path(), &["run", "scene.toml", "--out", "out"]);
    assert_eq!(code, Some(0), "{errors}");
    let lines: Vec<&str> = text.lines().skip_while(|line| !line.starts_with("step")).collect();
    assert!(lines[1].split_whitespace().any(|unit| unit == "Pa"), "{text}");
    // Pairs in brackets contain a blank, which would split them in two columns.
    let row = lines[2].replace("(0, 0)", "0");
    let area: f64 = row.split_whitespace().nth(5).and_then(|cell| cell.parse().ok()).unwrap();
    assert!((area / (std::f64::consts::PI * 1e-13) - 1.0).abs() < 0.03, "{text}");
}
