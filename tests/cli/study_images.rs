//! Runs of a study that are mirror images of each other, or turned by right angles: made of one of them, and what they would be by themselves.

use std::fs;
use std::path::Path;

use serde_json::Value;

use super::study::{json, orthowear};
use super::study_parts::files;

/// One of the eight symmetries of a rectangle, by what it does to angles.
#[derive(Clone, Copy)]
struct Turn {
    /// -1 where it reflects.
    hand: f64,
    /// Degrees that are added after that.
    plus: f64,
}

const TURNS: [Turn; 8] = [
    Turn { hand: 1.0, plus: 0.0 },
    Turn { hand: -1.0, plus: 0.0 },
    Turn { hand: -1.0, plus: 180.0 },
    Turn { hand: 1.0, plus: 180.0 },
    Turn { hand: -1.0, plus: 90.0 },
    Turn { hand: -1.0, plus: -90.0 },
    Turn { hand: 1.0, plus: 90.0 },
    Turn { hand: 1.0, plus: -90.0 },
];

impl Turn {
    fn angle(self, degrees: f64) -> f64 {
        (self.hand * degrees + self.plus).rem_euclid(360.0)
    }

    fn vector(self, [x, y]: [f64; 2]) -> [f64; 2] {
        let (sin, cos) = self.plus.to_radians().sin_cos();
        let (cos, sin) = (cos.round(), sin.round());
        [cos * x - sin * self.hand * y, sin * x + cos * self.hand * y]
    }

    /// Of rotations and moments in the surface.
    fn axial(self, vector: [f64; 2]) -> [f64; 2] {
        self.vector(vector).map(|component| self.hand * component)
    }

    fn sides<T: Copy>(self, [x, y]: [T; 2]) -> [T; 2] {
        if self.plus.abs() == 90.0 { [y, x] } else { [x, y] }
    }
}

const MATERIALS: &str = r#"
[materials.steel]
model = "isotropic"
E = 210e3
nu = 0.3
[materials.cfrp]
model = "transversely-isotropic"
E1 = 139e3
E2 = 8.7e3
nu12 = 0.32
nu23 = 0.369
G12 = 4.5e3
[materials.wood]
model = "orthotropic"
E1 = 12e3
E2 = 1.1e3
E3 = 0.6e3
nu12 = 0.4
nu13 = 0.4
nu23 = 0.45
G12 = 0.9e3
G13 = 0.7e3
G23 = 0.06e3
[solver]
tolerance = 1e-11
[output]
fields = ["vtu", "loops"]
"#;

/// A scene, the keys that its images change, and their values by symmetry.
struct Case {
    name: &'static str,
    scene: String,
    keys: &'static [&'static str],
    values: fn(Turn) -> String,
}

fn cases() -> [Case; 4] {
    let frame = "[frame]\nkind = \"grid\"\nhalf_width = [1.2, 0.9]\ncells = [16, 12]\ngrow = false\n";
    let fretting = format!(
        r#"{MATERIALS}{frame}
[body1]
kind = "half-space"
material = "cfrp"
fibre = {{ azimuth = 20.0, tilt = 30.0 }}
[body2]
kind = "half-space"
material = "steel"
[gap]
kind = "sphere"
radius = 50.0
offset = [0.1, -0.05]
[friction]
law = "frp"
mu_L = 0.4
mu_T = 0.5
mu_N = 0.6
[wear]
law = "frp"
i_L = 1e-8
i_T = 2e-8
i_N = 3e-8
[[steps]]
name = "indent"
approach = 0.01
[[steps]]
name = "twist"
twist = 0.02
[[steps]]
name = "fretting"
cycles = {{ amplitude = 0.02, angle = 35.0, count = 1000, jumps = 2 }}
"#
    );
    let loads = format!(
        r#"{MATERIALS}{frame}
[body1]
kind = "rigid"
[body2]
kind = "half-space"
material = "wood"
fibre = {{ azimuth = 25.0, tilt = -40.0 }}
[gap]
kind = "ellipsoid"
radii = [60.0, 40.0]
angle = 15.0
[friction]
law = "elliptic"
mu1 = 0.5
mu2 = 0.3
angle = 10.0
[[steps]]
name = "press"
normal_force = 30.0
moment = [2.0, 1.0]
[[steps]]
name = "pull"
tangential_force = [3.0, 1.5]
spin_moment = 0.4
increments = 2
"#
    );
    let rolling = format!(
        r#"{MATERIALS}{frame}
[body1]
kind = "half-space"
material = "steel"
[body2]
kind = "half-space"
material = "steel"
[gap]
kind = "cylinder"
radius = 30.0
angle = 90.0
offset = [0.1, 0.0]
[friction]
law = "coulomb"
mu = 0.3
[[steps]]
name = "press"
approach = 0.004
[[steps]]
name = "roll"
rolling = {{ direction = 0, creepage = [1e-3, 5e-4], spin = 1e-3, distance = 10.0 }}
increments = 2
"#
    );
    let sliding = format!(
        r#"{MATERIALS}{frame}
[frame.outline]
shape = "polygon"
vertices = [[-0.9, -0.7], [0.8, -0.6], [0.9, 0.5], [-0.4, 0.8]]
[body1]
kind = "half-space"
material = "wood"
fibre = {{ azimuth = 60.0, tilt = 90.0 }}
[body2]
kind = "rigid"
[gap]
kind = "cone"
slope = 0.5
offset = [0.05, 0.1]
[friction]
law = "none"
[wear]
law = "orthotropic"
i1 = 1e-7
i2 = 3e-7
angle = 40.0
[[steps]]
name = "press"
approach = 0.008
rotation = [0.05, -0.1]
[[steps]]
name = "slide"
sliding = {{ distance = 50.0, angle = 70.0, jumps = 2 }}
"#
    );
    [
        Case {
            name: "fretting",
            scene: fretting,
            keys: &[
                "frame.cells",
                "frame.half_width",
                "body1.fibre.azimuth",
                "gap.offset",
                "steps.twist.twist",
                "steps.fretting.cycles.angle",
            ],
            values: |turn| {
                let (cells, widths) = (turn.sides([16, 12]), turn.sides([1.2, 0.9]));
                let (fibre, offset) = (turn.angle(20.0), turn.vector([0.1, -0.05]));
                let (twist, angle) = (turn.hand * 0.02, turn.angle(35.0));
                format!("[{cells:?}, {widths:?}, {fibre:?}, {offset:?}, {twist:?}, {angle:?}]")
            },
        },
        Case {
            name: "loads",
            scene: loads,
            keys: &[
                "frame.cells",
                "frame.half_width",
                "body2.fibre.azimuth",
                "gap.angle",
                "friction.angle",
                "steps.press.moment",
                "steps.pull.tangential_force",
                "steps.pull.spin_moment",
            ],
            values: |turn| {
                let (cells, widths) = (turn.sides([16, 12]), turn.sides([1.2, 0.9]));
                let [fibre, gap, law] = [25.0, 15.0, 10.0].map(|angle| turn.angle(angle));
                let (moment, force) = (turn.axial([2.0, 1.0]), turn.vector([3.0, 1.5]));
                let spin = turn.hand * 0.4;
                format!(
                    "[{cells:?}, {widths:?}, {fibre:?}, {gap:?}, {law:?}, {moment:?}, {force:?}, {spin:?}]"
                )
            },
        },
        Case {
            name: "rolling",
            scene: rolling,
            keys: &[
                "frame.cells",
                "frame.half_width",
                "gap.angle",
                "gap.offset",
                "steps.roll.rolling.direction",
                "steps.roll.rolling.creepage",
                "steps.roll.rolling.spin",
            ],
            values: |turn| {
                let (cells, widths) = (turn.sides([16, 12]), turn.sides([1.2, 0.9]));
                let (gap, offset) = (turn.angle(90.0), turn.vector([0.1, 0.0]));
                let (direction, creepage) = (turn.angle(0.0), [1e-3, turn.hand * 5e-4]);
                let spin = turn.hand * 1e-3;
                format!("[{cells:?}, {widths:?}, {gap:?}, {offset:?}, {direction:?}, {creepage:?}, {spin:?}]")
            },
        },
        Case {
            name: "sliding",
            scene: sliding,
            keys: &[
                "frame.cells",
                "frame.half_width",
                "frame.outline.vertices",
                "body1.fibre.azimuth",
                "gap.offset",
                "wear.angle",
                "steps.press.rotation",
                "steps.slide.sliding.angle",
            ],
            values: |turn| {
                let (cells, widths) = (turn.sides([16, 12]), turn.sides([1.2, 0.9]));
                let vertices = [[-0.9, -0.7], [0.8, -0.6], [0.9, 0.5], [-0.4, 0.8]].map(|v| turn.vector(v));
                let [fibre, wear, slide] = [60.0, 40.0, 70.0].map(|angle| turn.angle(angle));
                let (offset, rotation) = (turn.vector([0.05, 0.1]), turn.axial([0.05, -0.1]));
                format!(
                    "[{cells:?}, {widths:?}, {vertices:?}, {fibre:?}, {offset:?}, {wear:?}, {rotation:?}, {slide:?}]"
                )
            },
        },
    ]
}

/// Runs the study of a case into `whole`, and without images into `alone`.
fn run_case(case: &Case, folder: &Path) {
    fs::write(folder.join("scene.toml"), &case.scene).unwrap();
    let values: Vec<String> = TURNS.map(case.values).into();
    for (name, symmetry) in [("whole", true), ("alone", false)] {
        let study = format!(
            "[study]\nscene = \"scene.toml\"\nsymmetry = {symmetry}\n[[axes]]\nname = \"image\"\nkeys = {:?}\nvalues = [{}]\n",
            case.keys,
            values.join(", ")
        );
        fs::write(folder.join("study.toml"), study).unwrap();
        let (code, text, errors) = orthowear(folder, &["study", "study.toml", "--out", name]);
        assert_eq!(code, Some(0), "{}: {text}{errors}", case.name);
        assert_eq!(
            text.contains("8 runs, 7 obtained from other runs by symmetry"),
            symmetry,
            "{}: {text}",
            case.name
        );
    }
}

/// The largest difference of the numbers of two values of the same form over the largest of their names, but for what tells of the computation.
fn differences(a: &Value, b: &Value, path: &str, found: &mut Vec<(String, f64, f64)>) {
    match (a, b) {
        (Value::Number(a), Value::Number(b)) => {
            found.push((path.to_owned(), a.as_f64().unwrap(), b.as_f64().unwrap()));
        }
        (Value::Array(a), Value::Array(b)) => {
            assert_eq!(a.len(), b.len(), "{path}");
            a.iter().zip(b).for_each(|(a, b)| differences(a, b, path, found));
        }
        (Value::Object(a), Value::Object(b)) => {
            for (key, a) in a {
                let computed = ["certificate", "method", "iterations", "operator_applications", "seconds"];
                let computed = computed.contains(&key.as_str());
                if !computed && !["jump", "worn_volume_error", "wear_depth_error"].contains(&key.as_str()) {
                    differences(a, &b[key], &format!("{path}.{key}"), found);
                }
            }
        }
        (a, b) => assert_eq!(a, b, "{path}"),
    }
}

/// Truth: each run by itself, with laws, bodies, gaps, frames and loads under all symmetries of a rectangle; each number to 1e-7 of the largest
/// of its name. The ledger says of which run it is the image.
#[test]
fn images_are_what_they_would_be_alone() {
    for case in cases() {
        let folder = tempfile::tempdir().unwrap();
        run_case(&case, folder.path());
        let runs = json(&folder.path().join("whole/study.json"))["runs"].clone();
        let names = runs.as_array().unwrap().iter().map(|run| run["folder"].as_str().unwrap().to_owned());
        let names: Vec<String> = names.collect();
        for (number, name) in names.iter().enumerate() {
            let summary = |out: &str| json(&folder.path().join(out).join(name).join("summary.json"));
            let (image, alone) = (summary("whole"), summary("alone"));
            let ledger = image["skipped"].as_array().unwrap();
            let told = ledger.iter().any(|entry| {
                entry["what"] == "all steps" && entry["why"].as_str().unwrap().ends_with(&names[0])
            });
            assert_eq!(told, number > 0, "{} {name}", case.name);
            let mut found = Vec::new();
            for key in ["steps", "loops"] {
                differences(&image[key], &alone[key], key, &mut found);
            }
            assert!(found.len() > 40);
            for (path, a, b) in &found {
                let size = found.iter().filter(|(other, ..)| other == path);
                let size = size.map(|(_, a, _)| a.abs()).fold(0.0, f64::max);
                assert!((a - b).abs() <= 1e-7 * size.max(1e-9), "{} {name} {path}: {a} {b}", case.name);
            }
        }
    }
}

/// Directions of cycles about a fibre along x, of which the last two are images of the first two; all press alike before.
const DIRECTIONS: &str = r#"
[study]
scene = "scene.toml"
[[axes]]
keys = ["steps.fretting.cycles.angle"]
values = [30, 50, -50, -30]
[output]
collect = ["indent.normal_force", "fretting.worn_volume", "fretting.stroke_ends.1.tangential_force.1"]
"#;

/// Files of a folder, but for times.
fn results(folder: &Path) -> Vec<(String, Vec<u8>)> {
    let mut files = files(folder);
    for (_, bytes) in files.iter_mut().filter(|(name, _)| name == "history.csv") {
        let text = String::from_utf8(bytes.clone()).unwrap();
        let seconds = text.lines().next().unwrap().split(',').position(|head| head == "seconds").unwrap();
        let row = |line: &str| {
            let cells = line.split(',').enumerate().filter(|(column, _)| *column != seconds);
            cells.map(|(_, cell)| cell).collect::<Vec<_>>().join(",")
        };
        *bytes = text.lines().map(row).collect::<Vec<_>>().join("\n").into_bytes();
    }
    files
}

fn folders(study: &Path) -> Vec<String> {
    let runs = json(&study.join("study.json"))["runs"].clone();
    runs.as_array().unwrap().iter().map(|run| run["folder"].as_str().unwrap().to_owned()).collect()
}

/// Truth: the whole study, file by file to the last bit: images whose originals are not wanted, so that these are computed for them alone, with the
/// steps that they have in common; and images of runs that went on from others that were killed.
#[test]
#[cfg(unix)]
fn images_have_the_same_bits_in_any_part() {
    let folder = super::study::folder(DIRECTIONS);
    let arguments = |out: &'static str| {
        let set = ["--set", "steps.indent.increments=30", "--set", "output.checkpoint.seconds=1e-9"];
        [&["study", "study.toml", "--threads", "1", "--out", out][..], &set].concat()
    };
    let (code, text, errors) = orthowear(folder.path(), &arguments("whole"));
    assert_eq!(code, Some(0), "{errors}");
    assert!(text.contains("4 runs, 2 obtained from other runs by symmetry"), "{text}");
    let whole = folder.path().join("whole");
    let names = folders(&whole);
    let (code, text, errors) = orthowear(folder.path(), &[arguments("part"), vec!["--only", "3-4"]].concat());
    assert_eq!(code, Some(0), "{errors}");
    assert!(text.contains("2 runs, 2 obtained from other runs by symmetry"), "{text}");
    let part = folder.path().join("part");
    for name in &names[2..] {
        assert_eq!(results(&part.join(name)), results(&whole.join(name)), "{name}");
    }
    assert_eq!(fs::read_dir(&part).unwrap().count(), 2, "originals leave nothing");
    let (code, text, errors) =
        orthowear(folder.path(), &[arguments("part"), vec!["--only", "3-4", "--resume"]].concat());
    assert_eq!(code, Some(0), "{errors}");
    assert!(text.contains("2 runs, 2 kept from before"), "{text}");

    let killed = folder.path().join("killed");
    let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_orthowear"));
    command.current_dir(folder.path()).args(arguments("killed")).arg("--quiet");
    let mut child = command.spawn().unwrap();
    let started = std::time::Instant::now();
    while !killed.join(&names[0]).join("checkpoint-2.bin").exists() {
        assert!(started.elapsed().as_secs() < 120, "the first run has no checkpoint");
        std::thread::sleep(std::time::Duration::from_micros(200));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    assert!(!killed.join(&names[1]).exists(), "the first run was over already");
    let (code, text, errors) = orthowear(folder.path(), &[arguments("killed"), vec!["--resume"]].concat());
    assert_eq!(code, Some(0), "{errors}");
    assert!(text.contains("2 obtained from other runs by symmetry"), "{text}");
    for name in &names {
        assert_eq!(results(&killed.join(name)), results(&whole.join(name)), "{name}");
    }
    assert_eq!(fs::read(killed.join("study.csv")).unwrap(), fs::read(whole.join("study.csv")).unwrap());
}

/// Truth: the run by itself: what it tells names directions, which an image would have wrong, so that it is none; nor is one of an original that does
/// not converge.
#[test]
fn some_runs_have_no_images() {
    let folder = tempfile::tempdir().unwrap();
    let [_, loads, ..] = cases();
    fs::write(folder.path().join("scene.toml"), &loads.scene).unwrap();
    let study = |keys: &str, values: &str| {
        let text = format!(
            "[study]\nscene = \"scene.toml\"\n[[axes]]\nname = \"image\"\nkeys = {keys}\nvalues = {values}\n"
        );
        fs::write(folder.path().join("study.toml"), text).unwrap();
        orthowear(folder.path(), &["study", "study.toml", "--out", "o"])
    };
    // A row of cells, which turns freely about itself.
    let keys = r#"["frame.cells", "frame.half_width", "body2.fibre.azimuth", "gap.angle", "friction.angle", "steps.press.moment", "steps.pull.tangential_force"]"#;
    let rows = "[[[16, 1], [1.2, 0.06], 0, 0, 0, [0, 0], [3, 0]], [[1, 16], [0.06, 1.2], 90, 90, 90, [0, 0], [0, 3]]]";
    let (code, text, errors) = study(keys, rows);
    assert_eq!(code, Some(0), "{text}{errors}");
    assert!(text.contains("2 runs, ") && !text.contains("by symmetry"), "{text}");
    let told: Vec<String> = folders(&folder.path().join("o"))
        .iter()
        .map(|name| json(&folder.path().join("o").join(name).join("summary.json"))["warnings"].to_string())
        .collect();
    assert!(told[0].contains("rotation about x") && told[1].contains("rotation about y"), "{told:?}");
    // Forces beyond friction.
    let (code, text, errors) = study(
        r#"["body2.fibre.azimuth", "gap.angle", "friction.angle", "steps.press.moment", "steps.pull.tangential_force", "steps.pull.spin_moment"]"#,
        "[[25, 15, 10, [2, 1], [90, 0], 0], [-25, -15, -10, [-2, 1], [90, 0], 0]]",
    );
    assert_eq!(code, Some(3), "{text}{errors}");
    assert!(text.contains("2 runs, ") && !text.contains("by symmetry"), "{text}");
}
