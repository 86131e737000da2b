//! Loads of meshed bodies in scenes: names, preloads, refused keys, and the table of `check`.

use crate::materials::{folder, orthowear};
use crate::moved::layer;
use crate::near_field::run;

const LOADS: &str = "pressure = [{ group = \"top\", value = 50.0, name = \"clamp\" }]";

fn check(keys: &str, overrides: &[&str]) -> (Option<i32>, String) {
    let folder = folder(&format!("fibre = {{ tilt = 0.0 }}\n{keys}"), "", &[]);
    let mut arguments = vec!["check", "scene.toml"];
    overrides.iter().for_each(|line| arguments.extend(["--set", line]));
    let (code, text, errors) = orthowear(folder.path(), &arguments);
    (code, (text + &errors).split_whitespace().collect::<Vec<_>>().join(" "))
}

/// Truth: docs/scene.md: contradictions between names and preloads are refused. The message gives the key.
#[test]
fn what_is_refused() {
    let preloaded = LOADS.replace("\"clamp\"", "\"clamp\", preload = true");
    let traction = "traction = [{ group = \"top\", value = [1.0, 0.0, 0.0], name = \"clamp\" }]";
    for (keys, overrides, words) in [
        (LOADS.to_owned(), &["steps.0.loads.clam=1.0"][..], ["steps.0.loads.clam", "named loads: clamp"]),
        (LOADS.replace("clamp", ""), &[], ["body1.pressure.0.name", "empty name"]),
        (format!("{preloaded}\n{traction}"), &[], ["\"clamp\" has `preload` in one place", "body1"]),
        (
            LOADS.replace(", name = \"clamp\"", ""),
            &["steps.0.loads.clamp=1.0"],
            ["no load has a name", "clamp"],
        ),
        (LOADS.to_owned(), &["steps.0.loads.interference=1.0"], ["interference", "named loads: clamp"]),
        ("body_force = { name = \"weight\" }".to_owned(), &[], ["body1.body_force", "lacks `value`"]),
        ("body_force = 3.0".to_owned(), &[], ["body1.body_force", "a list or a table"]),
        (
            "displaced = [{ group = \"base\", value = [1e-3, 0.0, 0.0], name = \"one\" }, { group = \"base\", value = [1e-3, 0.0, 0.0], name = \"two\" }]".to_owned(),
            &["body1.fixed=[]"],
            ["body1.displaced.1", "different loads"],
        ),
    ] {
        let (code, text) = check(&keys, overrides);
        assert_eq!(code, Some(2), "{keys} {overrides:?}: {text}");
        assert!(words.iter().all(|word| text.contains(word)), "{keys}: {words:?} in\n{text}");
    }
}

/// Truth: docs/scene.md: the amplitude of a load grows from 0 to 1 in the first step, unless this step names the load. Later
/// steps keep the amplitude. A preload has the amplitude 1 from the start.
#[test]
fn amplitudes_in_the_table() {
    let two =
        format!("{LOADS}\nbody_force = {{ value = [0.0, 0.0, -0.1], name = \"weight\", preload = true }}");
    let (code, text) = check(&two, &["steps.0.loads={ clamp = 0.25 }", "steps.1.loads={ weight = 0.0 }"]);
    assert_eq!(code, Some(0), "{text}");
    assert!(text.contains("clamp 0.25 weight 1") && text.contains("clamp 0.25 weight 0"), "{text}");
    let (_, text) = check(&LOADS.replace(", name = \"clamp\"", ""), &[]);
    assert!(text.contains("loads of body1 1"), "{text}");
}

/// Truth: docs/scene.md: a load that grows in the first step, while the contact grows, gives a WARNING. A preload gives no
/// WARNING. A load that grows in a later step, while the bodies are in contact, gives no WARNING either.
#[test]
fn loads_that_grow_with_the_contact() {
    let said = |keys: &str, overrides: &[&str]| {
        let folder = folder(&format!("fibre = {{ tilt = 0.0 }}\nnear_field = \"mesh\"\n{keys}"), "", &[]);
        let mut arguments = vec!["run", "scene.toml"];
        overrides.iter().for_each(|line| arguments.extend(["--set", line]));
        let (code, text, errors) = orthowear(folder.path(), &arguments);
        assert_eq!(code, Some(0), "{text} {errors}");
        (text + &errors).contains("loads of the bodies change while the contact grows")
    };
    assert!(said(LOADS, &[]));
    assert!(!said(&LOADS.replace("\"clamp\"", "\"clamp\", preload = true"), &[]));
    assert!(!said(LOADS, &["steps.0.loads={ clamp = 0.0 }", "steps.1.loads={ clamp = 1.0 }"]));
}

/// Truth: equilibrium. The contact carries the tangential load of an unconstrained body. At the reversal points of the cycles,
/// the tangential force is this load plus and minus the amplitude.
#[test]
fn cycles_of_an_unconstrained_body_about_its_load() {
    let keys = "fibre = { tilt = 0.0 }\nnear_field = \"mesh\"\ntraction = [{ group = \"base\", value = [0.1, 0.05, 0.0] }]";
    let folder = folder(keys, "", &[]);
    let path = folder.path().join("scene.toml");
    let scene = std::fs::read_to_string(&path).unwrap();
    let steps = "[[steps]]\nname = \"press\"\napproach = 0.005\n[[steps]]\nname = \"shake\"\n\
                 cycles = { count = 2, force_amplitude = 0.2, angle = 30.0, jumps = 1 }\n[output]\nfields = []\n";
    let scene = scene
        .split("[[steps]]")
        .next()
        .unwrap()
        .replace("fixed = [{ group = \"base\" }]", "fixed = [{ group = \"base\", components = [\"z\"] }]");
    std::fs::write(&path, scene + steps).unwrap();
    let summary = run(folder.path(), &[]);
    // Cells that stick fix the position of the body, so the summary has no warning about ratcheting or a missing steady-state
    // cycle.
    let said = summary["warnings"].to_string();
    assert!(!said.contains("ratcheting") && !said.contains("steady-state"), "{said}");
    let force = |entry: &serde_json::Value| [0, 1].map(|k| entry["tangential_force"][k].as_f64().unwrap());
    let [press, shake] = [0, 1].map(|step| &summary["steps"][step]);
    let (load, [plus, minus]) = (force(press), [0, 1].map(|end| force(&shake["stroke_ends"][end])));
    let amplitude = [30.0_f64.to_radians().cos(), 30.0_f64.to_radians().sin()].map(|part| 0.2 * part);
    assert!(load[0].abs() > 0.1 && (load[1] / load[0] - 0.5).abs() < 1e-6, "{load:?}");
    for k in 0..2 {
        let errors = [plus[k] - load[k] - amplitude[k], minus[k] - load[k] + amplitude[k]];
        assert!(errors.iter().all(|error| error.abs() < 1e-6), "{load:?} {plus:?} {minus:?}");
    }
}

/// Scene with an unconstrained plate of 16 mm x 16 mm. A pressure of 2 MPa on its base presses the plate on a rigid plane. The
/// first step is "press".
const PLATE: &str = r#"
[materials.al]
model = "isotropic"
E = 70e3
nu = 0.3
[body1]
kind = "fe"
material = "al"
mesh = "plate.msh"
contact = "top"
pressure = [{ group = "base", value = 2.0, name = "p" }]
[body2]
kind = "rigid"
[frame]
kind = "mesh"
body = 1
[gap]
kind = "flat"
[friction]
law = "elliptic"
mu1 = 0.4
mu2 = 0.1
[output]
fields = []
[[steps]]
name = "press"
"#;

/// Truth: the strokes of the cycles, computed as separate steps. The plate carries a tangential force of 100 N at 20 degrees to
/// x. The friction ellipse allows 123 N in this direction under the normal force of 512 N. The plate slips in the first strokes
/// and then sticks. Steady-state cycles therefore dissipate nothing.
#[test]
fn force_cycles_of_a_free_plate() {
    let (sin, cos) = 20.0_f64.to_radians().sin_cos();
    let stroke = |sign: f64| {
        format!("[[steps]]\ntangential_force = [{:?}, {:?}]\n", sign * 100.0 * cos, sign * 100.0 * sin)
    };
    let strokes: String = [1.0, -1.0, 1.0, -1.0, 1.0].map(stroke).concat();
    let cycles = "[[steps]]\nwear = false\ncycles = { count = 2, force_amplitude = 100.0, angle = 20.0 }\n";
    let dissipation = |steps: &str| -> Vec<f64> {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("plate.msh"), layer([8.0; 2], 0.5, [12, 12, 1])).unwrap();
        std::fs::write(folder.path().join("scene.toml"), format!("{PLATE}{steps}")).unwrap();
        let summary = run(folder.path(), &[]);
        let steps = summary["steps"].as_array().unwrap();
        steps.iter().map(|step| step["dissipation"].as_f64().unwrap()).collect()
    };
    let marched = dissipation(&strokes);
    let first = marched[1] - marched[0];
    assert!(first > 0.0 && marched[5] - marched[3] < 1e-3 * first, "{marched:?}");
    let cycled = dissipation(cycles);
    assert!(cycled[1] - cycled[0] < 1e-3 * first, "{cycled:?} {marched:?}");
}

/// Truth: without its pressure, an unconstrained plate is not pressed on the plane, and its position is arbitrary. The run ends
/// with `contact-lost` and keeps the entry of the first step. The normal force of this entry is 2 MPa x 256 mm² = 512 N.
#[test]
fn unloaded_bodies_lose_contact() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("plate.msh"), layer([8.0; 2], 0.5, [6, 6, 1])).unwrap();
    let scene = format!("{PLATE}[[steps]]\nname = \"unload\"\nloads = {{ p = 0.0 }}\n");
    std::fs::write(folder.path().join("scene.toml"), scene).unwrap();
    let (code, text, errors) = orthowear(folder.path(), &["run", "scene.toml", "--quiet"]);
    assert!(code == Some(3) && (text + &errors).contains("contact-lost"), "{errors}");
    let summary = std::fs::read_to_string(folder.path().join("scene.out/summary.json")).unwrap();
    let summary: serde_json::Value = serde_json::from_str(&summary).unwrap();
    let force = summary["steps"][0]["normal_force"].as_f64().unwrap();
    assert!((force / 512.0 - 1.0).abs() < 1e-6, "{force}");
}

/// Truth: docs/scene.md: the amplitude of an interference must not be negative, because a negative amplitude would separate
/// bodies whose meshes overlap. A very large interference gives a warning.
#[test]
fn negative_interference() {
    let scene = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/press-fit.toml");
    let scene = scene.to_str().unwrap();
    let negative = ["check", scene, "--set", "steps.0.loads.interference=-0.5"];
    let (code, text, errors) = orthowear(std::path::Path::new("."), &negative);
    let words = text + &errors;
    assert!(code == Some(2) && words.contains("the amplitude of the interference is negative"), "{words}");
    let large = ["check", scene, "--set", "steps.0.loads.interference=100.0"];
    let (code, text, errors) = orthowear(std::path::Path::new("."), &large);
    let words = (text + &errors).split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(code == Some(0) && words.contains("is more than 1 % of the size of the frame"), "{words}");
}
