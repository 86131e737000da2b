//! Runs of the files in `scenes/` on coarse grids and meshes, and comparisons of equivalent scenes.

use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;

pub const COARSE: &str = "body1.mesh=\"../meshes/cfrp-block-coarse.msh\"";

pub const MESH: &str = "body1.near_field=\"mesh\"";

pub fn scene(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(name)
}

/// Summary of a run of `scene`, which must converge, with an option `--set` for each of `settings`.
pub fn run(scene: &Path, settings: &[&str]) -> Value {
    let out = tempfile::tempdir().unwrap();
    let output = command("run", scene, settings).arg("--out").arg(out.path()).output().unwrap();
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&std::fs::read(out.path().join("summary.json")).unwrap()).unwrap()
}

pub fn command(verb: &str, scene: &Path, settings: &[&str]) -> Command {
    let mut command = crate::tools::orthowear();
    command.arg(verb).arg(scene).args(["--set", "output.fields=[]"]);
    settings.iter().for_each(|setting| {
        command.args(["--set", setting]);
    });
    command
}

pub fn steps(summary: &Value) -> &[Value] {
    summary["steps"].as_array().unwrap()
}

fn certified(summary: &Value) {
    for step in steps(summary) {
        let certificate = step["certificate"]["natural_residual"].as_f64().unwrap();
        assert!(certificate <= 1e-8, "{}: {certificate:e}", step["name"]);
    }
}

/// Truth: the wear volume is below pi R approach^2, the overlap of the sphere of radius R with the block. The specific wear rate
/// is i = k mu in every direction. The wear volume is therefore k = 1.25e-9 times the friction energy.
#[test]
fn sphere_on_block() {
    let scene = scene("sphere-on-cfrp-block.toml");
    let summary = run(&scene, &[COARSE, "frame.cells=[10, 10]", "steps.fretting.cycles.jumps=2"]);
    certified(&summary);
    let last = steps(&summary).last().unwrap();
    let (volume, energy) = (last["worn_volume"].as_f64().unwrap(), last["dissipation"].as_f64().unwrap());
    assert!(volume > 0.0 && volume < 0.0628, "{volume}");
    assert!((volume - 1.25e-9 * energy).abs() <= 1e-10 * volume, "{volume} {energy}");
}

/// Truth: CalculiX 2.20, an independent program, gives a normal force of 443.37 N after indentation. Its mesh has 20 elements
/// along the contact patch, and its friction coefficient is 0.5 (docs/benchmarks/calculix.csv). The forces agree to 2 %, because
/// the mesh of this test is twice as coarse and its friction depends on the fibre.
#[test]
fn cap_on_block() {
    let scene = scene("steel-cap-on-cfrp-block.toml");
    let summary = run(&scene, &[COARSE, "frame.cells=[6, 6]", MESH]);
    certified(&summary);
    let force = number(&steps(&summary)[0], "normal_force");
    assert!((force / 443.37 - 1.0).abs() < 0.02, "{force}");
}

fn number(step: &Value, key: &str) -> f64 {
    step[key].as_f64().unwrap()
}

/// Truth: Nowell and Hills (values in the scene file). The dissipation of a steady-state cycle agrees to 0.1 %, the stick area to
/// about one cell.
#[test]
fn cylinder_on_a_strained_body() {
    let summary = run(&scene("fretting-fatigue.toml"), &[]);
    certified(&summary);
    let last = steps(&summary).last().unwrap();
    assert!((number(last, "dissipation") / 0.094160 - 1.0).abs() < 1e-3, "{last}");
    let stick = last["stroke_ends"].as_array().unwrap().iter().map(|end| number(end, "stick_area"));
    let wanted = 2.0 * 0.46219 * 0.5_f64.sqrt();
    stick.for_each(|stick| assert!((stick - wanted).abs() < 1.2 / 256.0, "{stick} {wanted}"));
}

/// Truth: Lamé (values in the scene file). The pressure and the torque of the sliding shaft agree to 0.5 %. No cell sticks while
/// the shaft slides.
#[test]
fn shaft_in_a_hub() {
    let summary = run(&scene("press-fit.toml"), &[]);
    certified(&summary);
    let (fit, last) = (&steps(&summary)[0], steps(&summary).last().unwrap());
    assert!((number(fit, "peak_pressure") / 36.31 - 1.0).abs() < 5e-3, "{fit}");
    let torque = last["moment"][1].as_f64().unwrap();
    assert!((torque / 28514.0 - 1.0).abs() < 5e-3 && number(last, "stick_area") == 0.0, "{last}");
    assert_eq!(last["loads"]["interference"].as_f64(), Some(1.0));
}

/// Truth: Hertz's line contact and NAFEMS benchmark 1 (values in the scene file). The contact area agrees to one cell, the peak
/// pressure to 3 %.
#[test]
fn roller_on_block() {
    let summary = run(&scene("cylinder-on-flat.toml"), &[]);
    certified(&summary);
    let last = steps(&summary).last().unwrap();
    assert!((number(last, "contact_area") - 6.2146).abs() <= 1.125, "{last}");
    assert!((number(last, "peak_pressure") / 3585.4 - 1.0).abs() < 0.03, "{last}");
    let stick = number(last, "stick_area");
    assert!(stick > 0.0 && stick < number(last, "contact_area"), "{last}");
}

/// Truth: Persson's solution (equations in the scene file) for the computed load. On these coarse meshes, the peak pressure
/// agrees to 5 %, the contact arc to one face of 7.5 degrees.
#[test]
fn pin_in_hole() {
    use std::f64::consts::PI;
    let summary = run(&scene("pin-in-hole.toml"), &[]);
    certified(&summary);
    let last = steps(&summary).last().unwrap();
    let load = 2.0 * number(last, "normal_force");
    let stiffness = 3600.0 / (1.0 - 0.38 * 0.38) * 0.2 / load;
    let (mut low, mut high) = (1e-3f64, 0.9);
    for _ in 0..60 {
        let b: f64 = 0.5 * (low + high);
        let value = (2.0 - (b * b + 1.0).ln() - 2.0 * b.powi(4)) / (PI * (b.powi(4) + b * b));
        if value > stiffness { low = b } else { high = b }
    }
    let root = (1.0 + low * low).sqrt();
    let peak = 2.0 / PI * low / root
        + ((root + low) / (root - low)).ln() / (2.0 * PI * low * low * (1.0 + low * low));
    let found = number(last, "peak_pressure") * 10.0 / load;
    assert!((found / peak - 1.0).abs() < 0.05, "{found} {peak}: {last}");
    let arc = number(last, "contact_area") / 10.0;
    assert!((arc - 2.0 * low.atan()).abs() < PI / 24.0, "{arc} {}: {last}", 2.0 * low.atan());
}

/// Truth: Hertz's peak pressure for the computed load. The peak pressures agree to 10 %, because the faces have sides of 0.3 mm
/// and the contact radius is about 1 mm.
#[test]
fn sphere_on_block_of_finite_elements() {
    let summary = run(&scene("sphere-on-block-fe.toml"), &[COARSE, "frame.body=1"]);
    certified(&summary);
    let last = steps(&summary).last().unwrap();
    let load = number(last, "normal_force");
    let modulus = 210e3 / (2.0 * (1.0 - 0.09));
    let a = (0.75 * load * 50.0 / modulus).cbrt();
    let peak = 1.5 * load / (std::f64::consts::PI * a * a);
    assert!((number(last, "peak_pressure") / peak - 1.0).abs() < 0.1, "{peak}: {last}");
}

/// Truth: Hertz in plane strain (values in the scene file). The contact area agrees to two cells, the peak pressure and the
/// approach to 1e-3.
#[test]
fn line_contact() {
    let summary = run(&scene("hertz-line.toml"), &[]);
    certified(&summary);
    let last = steps(&summary).last().unwrap();
    assert!((number(last, "contact_area") - 0.46978).abs() <= 0.01, "{last}");
    assert!((number(last, "peak_pressure") / 1355.14 - 1.0).abs() < 1e-3, "{last}");
    assert!((number(last, "approach") / 0.0026878 - 1.0).abs() < 1e-3, "{last}");
    assert_eq!(summary["warnings"].as_array().map(Vec::len), Some(0), "{summary}");
}

/// Truth: Carter (values in the scene file). The tangential force agrees to 2 %, the stick area to two cells.
#[test]
fn rolling_cylinders() {
    let summary = run(&scene("rolling-cylinders.toml"), &[]);
    certified(&summary);
    let last = steps(&summary).last().unwrap();
    let force = last["tangential_force"][0].as_f64().unwrap();
    assert!((force / 112.5 - 1.0).abs() < 0.02, "{last}");
    assert!((number(last, "stick_area") - 0.33219).abs() <= 2.0 * 0.8 / 256.0, "{last}");
    assert_eq!(last["rolling"]["creepage"][0].as_f64(), Some(0.0024914), "{last}");
}

/// Truth: cells outside the contact have no effect. The contact radius is 0.29 mm (Hertz), the outline has a radius of 0.4 mm.
#[test]
fn rolling_within_an_outline() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.toml");
    let scene = "[materials.steel]\nmodel = \"isotropic\"\nE = 210e3\nnu = 0.3\n[body1]\nkind = \"half-space\"\nmaterial = \"steel\"\n\
         [body2]\nkind = \"rigid\"\n[frame]\nkind = \"grid\"\nhalf_width = [0.5, 0.5]\ncells = [20, 20]\n\
         [gap]\nkind = \"sphere\"\nradius = 10.0\n[friction]\nlaw = \"coulomb\"\nmu = 0.3\n[[steps]]\nname = \"press\"\nnormal_force = 750.0\n\
         [[steps]]\nname = \"roll\"\nrolling = { direction = 90.0, creepage = [1e-3, 5e-4], spin = 1e-3 }\n";
    std::fs::write(&path, scene).unwrap();
    let [whole, within] = [&[][..], &["frame.outline={ shape = \"circle\", radius = 0.4 }"]]
        .map(|settings| run(&path, settings));
    certified(&within);
    let [whole, within] = [&whole, &within].map(|summary| steps(summary).last().unwrap());
    let sizes =
        [("normal_force", 750.0), ("peak_pressure", 4000.0), ("contact_area", 0.3), ("stick_area", 0.3)];
    for (key, size) in sizes {
        assert!((number(whole, key) - number(within, key)).abs() < 1e-6 * size, "{key}: {whole} {within}");
    }
    for axis in 0..2 {
        let [a, b] = [whole, within].map(|step| step["tangential_force"][axis].as_f64().unwrap());
        assert!((a - b).abs() < 1e-6 * 750.0 && a.abs() > 1.0, "{a} {b}");
    }
}

fn wavy(heights: &str, periodic: &str, steps: &str) -> (Option<i32>, String) {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("heights.csv"), heights).unwrap();
    let scene = format!(
        "[materials.steel]\nmodel = \"isotropic\"\nE = 210e3\nnu = 0.3\n[body1]\nkind = \"half-space\"\nmaterial = \"steel\"\n\
         [body2]\nkind = \"rigid\"\n[frame]\nkind = \"grid\"\nhalf_width = [0.5, 0.5]\ncells = [16, 1]\nperiodic = {periodic}\n\
         [gap]\nkind = \"heights\"\nfile = \"heights.csv\"\n[friction]\nlaw = \"none\"\n[[steps]]\n{steps}\n"
    );
    let path = folder.path().join("scene.toml");
    std::fs::write(&path, scene).unwrap();
    let output = command("run", &path, &[]).output().unwrap();
    let text = [output.stdout, output.stderr].concat();
    (output.status.code(), String::from_utf8_lossy(&text).into_owned())
}

/// Truth: docs/scene.md: if surfaces are periodic in both directions, the approach is limited by the distance of their mean planes.
#[test]
fn periodic_surfaces_are_told() {
    let wave: Vec<String> = (0..16)
        .map(|i| format!("{}", 0.001 * (1.0 - (std::f64::consts::PI * f64::from(i) / 8.0).cos())))
        .collect();
    let (code, text) = wavy(&wave.join("\n"), "[true, true]", "approach = 0.0009");
    assert_eq!(code, Some(0), "{text}");
    assert!(!text.contains("not periodic along"), "{text}");
    let (code, text) = wavy(&wave.join("\n"), "[true, true]", "approach = 0.0011");
    assert_eq!(code, Some(2), "{text}");
    assert!(text.contains("mean gap") && text.contains("normal_force"), "{text}");
    let slope: Vec<String> = (0..16).map(|i| format!("{}", 0.0001 * f64::from(i))).collect();
    let (code, text) = wavy(&slope.join("\n"), "[true, true]", "normal_force = 1.0");
    assert_eq!(code, Some(0), "{text}");
    assert!(text.contains("the gap is not periodic along x"), "{text}");
}

#[track_caller]
pub fn same(a: &Value, b: &Value, relative: f64) {
    assert_eq!(steps(a).len(), steps(b).len());
    for (a, b) in steps(a).iter().zip(steps(b)) {
        let values = |step: &Value| {
            let load = step["normal_force"].as_f64().unwrap();
            let q = [0, 1].map(|k| step["tangential_force"][k].as_f64().unwrap());
            let worn = ["worn_volume", "dissipation"].map(|key| step[key].as_f64().unwrap());
            // Without slip, the dissipation is a rounding error of the work of the normal force. This work is then the scale of
            // the comparison.
            let [approach, peak] = ["approach", "peak_pressure"].map(|key| step[key].as_f64().unwrap());
            let energy = worn[1].max(load * approach);
            let forces = [(load, load), (q[0], load), (q[1], load)];
            let others = [(approach, approach), (peak, peak), (worn[0], worn[0]), (worn[1], energy)];
            [&forces[..], &others].concat()
        };
        for ((x, scale), (y, _)) in values(a).into_iter().zip(values(b)) {
            assert!((x - y).abs() <= relative * scale.abs(), "{x} and {y} in {} and {}", a, b);
        }
    }
}

/// Truth: invariance. If frame and fibre are rotated about the normal of half-spaces, the results agree to 1e-7. The tolerance of
/// the solver is 1e-10.
#[test]
fn turned_half_spaces() {
    let scene = scene("sphere-on-cfrp-halfspaces.toml");
    let plain = ["frame.cells=[24, 24]", "solver.tolerance=1e-10", "wear={law=\"energy\", k=1e-6}"];
    let turned = [&plain[..], &["frame.azimuth=20.0", "body1.fibre.azimuth=20.0"]].concat();
    same(&run(&scene, &plain), &run(&scene, &turned), 1e-7);
}

/// Truth: invariance. A quarter turn maps the block and its mesh onto themselves. If frame and fibre are rotated by 90 degrees,
/// the results agree to 1e-7.
#[test]
fn turned_block() {
    let scene = scene("sphere-on-cfrp-block.toml");
    let plain = [COARSE, "frame.cells=[8, 8]", "solver.tolerance=1e-10", "steps.fretting.cycles.jumps=1"];
    let turned = [&plain[..], &["frame.azimuth=90.0", "body1.fibre.azimuth=90.0"]].concat();
    same(&run(&scene, &plain), &run(&scene, &turned), 1e-7);
}

/// Truth: approach and rotation of a rigid circular punch (Boussinesq; Johnson 1985, 3.3; values in the scene file). The approach
/// agrees to 1e-2, because the edge of the circle cuts cells. The rotation depends on the cube of the radius, and agrees to
/// 1.5e-2.
#[test]
fn tilting_punch() {
    let summary = run(&scene("tilting-punch.toml"), &[]);
    certified(&summary);
    let last = steps(&summary).last().unwrap();
    assert!((number(last, "approach") / 0.002_166_7 - 1.0).abs() < 1e-2, "{last}");
    let rotation = last["rotation"][1].as_f64().unwrap();
    assert!((rotation / 0.037_242 - 1.0).abs() < 1.5e-2, "{last}");
    assert_eq!(last["contact_touches_edge"], Value::Bool(false));
}
