//! The scenes, what is known of them, and the settings that are tried.

use std::f64::consts::PI;

/// Names of all cases.
pub const NAMES: [&str; 4] = ["hertz", "cattaneo-mindlin", "cfrp", "wear"];

/// Cells along the frame, and the accuracies asked for; the last ones are left out of the quick form.
const CELLS: [usize; 10] = [12, 18, 26, 40, 60, 90, 136, 200, 300, 450];
const ACCURACIES: [&str; 6] = ["3e-2", "1e-2", "3e-3", "1e-3", "3e-4", "1e-4"];
const QUICK: usize = 5;

/// A value that is known.
pub struct Truth {
    /// At the end of this step.
    pub step: &'static str,
    /// Place in its last entry of `summary.steps`.
    pub place: &'static str,
    pub value: f64,
    /// What errors are relative to.
    pub scale: f64,
}

/// Settings of a run.
#[derive(Debug, Clone)]
pub struct Configuration {
    /// Which knob is turned.
    pub family: &'static str,
    pub label: String,
    pub sets: Vec<String>,
}

/// A scene with what is known of it.
pub struct Case {
    pub name: &'static str,
    pub title: &'static str,
    /// Where the values come from.
    pub source: &'static str,
    /// File in scenes/.
    pub scene: &'static str,
    pub truths: Vec<Truth>,
    pub configurations: Vec<Configuration>,
}

fn configuration(family: &'static str, label: impl Into<String>, sets: &[String]) -> Configuration {
    Configuration { family, label: label.into(), sets: sets.to_vec() }
}

/// The scene as it is, finer and coarser cells, tolerances, solvers and accuracies; `keep`: what the accuracy leaves.
fn common(quick: bool, keep: Option<&str>) -> Vec<Configuration> {
    let first = |n: usize| if quick { n.min(QUICK) } else { n };
    let mut all = vec![configuration("as the scene is", "defaults", &[])];
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
    for accuracy in &ACCURACIES[..first(ACCURACIES.len())] {
        let set = match keep {
            Some(knob) => format!("accuracy={{ relative = {accuracy}, keep = [\"{knob}\"] }}"),
            None => format!("accuracy={accuracy}"),
        };
        all.push(configuration("accuracy", format!("accuracy {accuracy}"), &[set]));
    }
    all
}

/// Approach and peak pressure of a sphere (Hertz; Johnson 4.22 to 4.24), and the radius of the contact.
fn hertz(modulus: f64, radius: f64, force: f64) -> [f64; 3] {
    let a = f64::cbrt(0.75 * force * radius / modulus);
    [a * a / radius, 1.5 * force / (PI * a * a), a]
}

fn value(step: &'static str, place: &'static str, value: f64) -> Truth {
    Truth { step, place, value, scale: value.abs() }
}

/// All cases.
pub fn all(quick: bool) -> Vec<Case> {
    let [approach, peak, _] = hertz(210e3 / 0.91, 10.0, 1000.0);
    let of_hertz = vec![value("press", "/approach", approach), value("press", "/peak_pressure", peak)];
    // Two bodies of steel that do not contract across: nothing couples pressure and friction.
    let [pressed, peak, a] = hertz(105e3, 10.0, 1000.0);
    let moved = 0.9 * 1000.0 * 2.0 / (8.0 * 105e3 * a) * (1.0 - 0.1f64.powf(2.0 / 3.0));
    let of_mindlin = vec![
        value("press", "/approach", pressed),
        value("pull", "/peak_pressure", peak),
        Truth { scale: pressed, ..value("pull", "/shift/0", moved) },
    ];
    // An independent program on 128 and 256 cells, extrapolated; tilt 30, one increment for each step.
    let of_cfrp = vec![
        value("indent", "/normal_force", 417.87604),
        value("shift", "/normal_force", 303.76251),
        Truth { scale: 303.76251, ..value("shift", "/tangential_force/0", 131.64758) },
    ];
    let mut wear = vec![configuration("as the scene is", "defaults", &[])];
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
    for accuracy in &ACCURACIES[..if quick { 2 } else { 4 }] {
        let set =
            format!("accuracy={{ relative = {accuracy}, of = [\"worn_volume\"], keep = [\"increments\"] }}");
        wear.push(configuration("accuracy", format!("accuracy {accuracy}"), &[set]));
    }
    vec![
        Case {
            name: "hertz",
            title: "Hertz: a sphere on a half-space, approach and peak pressure",
            source: "closed form",
            scene: "hertz.toml",
            truths: of_hertz,
            configurations: common(quick, None),
        },
        Case {
            name: "cattaneo-mindlin",
            title: "Cattaneo and Mindlin: partial slip of a sphere, approach, peak pressure and shift",
            source: "closed form",
            scene: "cattaneo-mindlin.toml",
            truths: of_mindlin,
            configurations: common(quick, None),
        },
        Case {
            name: "cfrp",
            title: "Steel sphere on tilted CFRP: indentation and shift with friction, forces",
            source: "independent program, extrapolated from its two finest grids (known to about 1e-5)",
            scene: "sphere-on-cfrp-halfspaces.toml",
            truths: of_cfrp,
            configurations: common(quick, Some("increments")),
        },
        Case {
            name: "wear",
            title: "Steel sphere on CFRP: 100 000 fretting cycles in gross slip, worn volume",
            source: "independent program (known to about 5e-5)",
            scene: "sphere-wear.toml",
            truths: vec![value("fretting", "/worn_volume", 0.00432749)],
            configurations: wear,
        },
    ]
}
