//! Scenes with reference values, and the settings to compare.

use std::f64::consts::PI;

use super::layer::{self, Mesh};

/// Names of all cases.
pub const NAMES: [&str; 5] = ["hertz", "cattaneo-mindlin", "cfrp", "wear", "layer"];

/// Numbers of cells along the frame.
pub const CELLS: [usize; 10] = [12, 18, 26, 40, 60, 90, 136, 200, 300, 450];
/// Relative errors requested with `accuracy`.
const ACCURACIES: [&str; 6] = ["3e-2", "1e-2", "3e-3", "1e-3", "3e-4", "1e-4"];
/// Maximum number of values of [`CELLS`] and of [`ACCURACIES`] that are used with `--quick`.
const QUICK: usize = 5;

/// Family name of the unchanged scene.
pub const OWN: &str = "as the scene is";

/// Reference value of a case.
pub struct Truth {
    /// Name of the step. The reference is the value at the end of this step.
    pub step: &'static str,
    /// JSON pointer of the value in the last entry of this step in `summary.steps`.
    pub place: &'static str,
    pub value: f64,
    /// The relative error is the difference from `value` divided by `scale`.
    pub scale: f64,
}

#[derive(Debug, Clone)]
pub struct Configuration {
    /// Name of the kind of setting that varies.
    pub family: &'static str,
    pub label: String,
    pub sets: Vec<String>,
    /// Mesh of body 1 that is generated for this run.
    pub mesh: Option<Mesh>,
    pub asked: Option<f64>,
}

/// A scene with its reference values.
pub struct Case {
    pub name: &'static str,
    pub title: &'static str,
    pub source: &'static str,
    /// Relative error of the reference values.
    pub known: f64,
    /// Scene file, relative to the project folder.
    pub scene: &'static str,
    /// Largest allowed error of the unchanged scene, and the reason for this value.
    pub allowed: (f64, &'static str),
    pub truths: Vec<Truth>,
    pub configurations: Vec<Configuration>,
}

pub fn configuration(family: &'static str, label: impl Into<String>, sets: &[String]) -> Configuration {
    Configuration { family, label: label.into(), sets: sets.to_vec(), mesh: None, asked: None }
}

/// Configuration with the requested accuracy `relative`. `table` is the text of further keys of the `accuracy` table.
fn accuracy(relative: &str, table: &str) -> Configuration {
    let set = format!("accuracy={{ relative = {relative}{table} }}");
    let asked = relative.parse().ok();
    Configuration { asked, ..configuration("accuracy", format!("accuracy {relative}"), &[set]) }
}

/// Relative error 1 - p / p0 = (h / a)^2 / 3 of the peak pressure on a grid. p0 is the peak of Hertz's pressure. p is
/// the mean of Hertz's pressure over a cell of side h with a corner at the centre. a is the contact radius.
pub fn sampled(half_width: f64, cells: f64, a: f64) -> f64 {
    (2.0 * half_width / cells / a).powi(2) / 3.0
}

/// Configurations for the scenes of spheres. `keep` is the setting that the accuracy search does not refine.
fn common(quick: bool, keep: Option<&str>) -> Vec<Configuration> {
    let first = |n: usize| if quick { n.min(QUICK) } else { n };
    let mut all = vec![configuration(OWN, "defaults", &[])];
    for n in &CELLS[..first(CELLS.len())] {
        all.push(configuration("cells", format!("{n} cells"), &[format!("frame.cells=[{n}, {n}]")]));
    }
    for tolerance in ["1e-2", "1e-4", "1e-6", "1e-10"] {
        all.push(configuration(
            "tolerance",
            format!("tolerance {tolerance}"),
            &[format!("solver.tolerance={tolerance}")],
        ));
    }
    for method in ["newton", "cg", "bb"] {
        all.push(configuration("solver", method, &[format!("solver.method=\"{method}\"")]));
    }
    all.push(configuration("solver", "nothing skipped", &["solver.skip=false".to_owned()]));
    let table = keep.map_or_else(String::new, |knob| format!(", keep = [\"{knob}\"]"));
    all.extend(ACCURACIES[..first(ACCURACIES.len())].iter().map(|relative| accuracy(relative, &table)));
    all
}

/// Approach and peak pressure of a sphere (Hertz; Johnson 4.22 to 4.24), and the contact radius. `modulus` is E*.
fn hertz(modulus: f64, radius: f64, force: f64) -> [f64; 3] {
    let a = f64::cbrt(0.75 * force * radius / modulus);
    [a * a / radius, 1.5 * force / (PI * a * a), a]
}

pub fn value(step: &'static str, place: &'static str, value: f64) -> Truth {
    Truth { step, place, value, scale: value.abs() }
}

/// All cases.
pub fn all(quick: bool) -> Vec<Case> {
    let [approach, peak, radius] = hertz(210e3 / 0.91, 10.0, 1000.0);
    let of_hertz = vec![value("press", "/approach", approach), value("press", "/peak_pressure", peak)];
    let [pressed, peak, a] = hertz(105e3, 10.0, 1000.0);
    let moved = 0.9 * 1000.0 * 2.0 / (8.0 * 105e3 * a) * (1.0 - 0.1f64.powf(2.0 / 3.0));
    let of_mindlin = vec![
        value("press", "/approach", pressed),
        value("pull", "/peak_pressure", peak),
        Truth { scale: pressed, ..value("pull", "/shift/0", moved) },
    ];
    // The forces come from an independent program on 128 and 256 cells per side, extrapolated. The tilt is 30 degrees,
    // and each step has one increment.
    let of_cfrp = vec![
        value("indent", "/normal_force", 417.87604),
        value("shift", "/normal_force", 303.76251),
        Truth { scale: 303.76251, ..value("shift", "/tangential_force/0", 131.64758) },
    ];
    let mut wear = vec![configuration(OWN, "defaults", &[])];
    for (integrator, numbers) in
        [("explicit", &[16, 64, 256][..]), ("backward-euler", &[8, 32, 128]), ("sdirk2", &[1, 2, 4, 8])]
    {
        for jumps in numbers.iter().take(if quick { 2 } else { 4 }) {
            let sets =
                [format!("wear.integrator=\"{integrator}\""), format!("steps.fretting.cycles.jumps={jumps}")];
            wear.push(configuration("integrator", format!("{integrator}, jumps {jumps}"), &sets));
        }
    }
    for tolerance in ["1e-2", "1e-4"] {
        wear.push(configuration(
            "tolerance of jumps",
            format!("wear.tolerance {tolerance}"),
            &[format!("wear.tolerance={tolerance}")],
        ));
    }
    for n in &CELLS[..if quick { 3 } else { 7 }] {
        wear.push(configuration("cells", format!("{n} cells"), &[format!("frame.cells=[{n}, {n}]")]));
    }
    let table = ", of = [\"worn_volume\"], keep = [\"increments\"]";
    wear.extend(ACCURACIES[..if quick { 2 } else { 4 }].iter().map(|relative| accuracy(relative, table)));
    vec![
        Case {
            name: "hertz",
            title: "Hertz: a sphere on a half-space, approach and peak pressure",
            source: "closed form",
            known: 0.0,
            scene: "scenes/hertz.toml",
            allowed: (sampled(0.4, 64.0, radius), "a peak between four cells is seen as the mean of one"),
            truths: of_hertz,
            configurations: common(quick, None),
        },
        Case {
            name: "cattaneo-mindlin",
            title: "Cattaneo and Mindlin: partial slip of a sphere, approach, peak pressure and shift",
            source: "closed form",
            known: 0.0,
            scene: "scenes/cattaneo-mindlin.toml",
            allowed: (sampled(0.5, 64.0, a), "a peak between four cells is seen as the mean of one"),
            truths: of_mindlin,
            configurations: common(quick, None),
        },
        Case {
            name: "cfrp",
            title: "Steel sphere on tilted CFRP: indentation and shift with friction, forces",
            source: "independent program, extrapolated from its two finest grids (known to about 1e-5)",
            known: 1e-5,
            scene: "scenes/sphere-on-cfrp-halfspaces.toml",
            allowed: (
                sampled(1.2, 64.0, 1.0),
                "a peak between four cells is seen as the mean of one; forces err by less",
            ),
            truths: of_cfrp,
            configurations: common(quick, Some("increments")),
        },
        Case {
            name: "wear",
            title: "Steel sphere on CFRP: 100 000 fretting cycles in gross slip, worn volume",
            source: "independent program (known to about 5e-5)",
            known: 5e-5,
            scene: "scenes/sphere-wear.toml",
            allowed: (1e-3, "`wear.tolerance`"),
            truths: vec![value("fretting", "/worn_volume", 0.00432749)],
            configurations: wear,
        },
        layer::case(quick),
    ]
}
