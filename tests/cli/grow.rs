//! Frames that grow, and runs that stop because the frame cannot grow.

use std::fs;
use std::path::Path;

use serde_json::Value;
use std::process::Command;

/// Case `wear-sphere-elastic` of docs/verification.md on coarse cells. Wear increases the contact radius from 1 to 1.408 mm. The
/// half-width of the frame is 1.35 mm.
const SCENE: &str = r#"
[materials.m]
model = "isotropic"
E = 91000.0
nu = 0.3
[body1]
kind = "half-space"
material = "m"
[body2]
kind = "rigid"
[frame]
kind = "grid"
half_width = [1.35, 1.35]
cells = [24, 24]
[gap]
kind = "sphere"
radius = 100.0
[wear]
law = "archard"
i = 1e-8
[[steps]]
name = "press"
normal_force = 1333.3333333333333
wear = false
[[steps]]
name = "slide"
sliding = { distance = 1570.7963267948967, jumps = 10 }
"#;

fn run(folder: &Path, out: &str, more: &[&str]) -> (Option<i32>, String, Value) {
    let scene = folder.join("scene.toml");
    fs::write(&scene, SCENE).unwrap();
    let out = folder.join(out);
    let mut command = Command::new(env!("CARGO_BIN_EXE_orthowear"));
    command.arg("run").arg(&scene).arg("--out").arg(&out).args(more);
    let output = command.output().unwrap();
    let text = String::from_utf8([output.stdout, output.stderr].concat()).unwrap();
    let summary = serde_json::from_slice(&fs::read(out.join("summary.json")).unwrap()).unwrap();
    (output.status.code(), text, summary)
}

fn warned(summary: &Value, words: &[&str]) -> bool {
    let warnings = summary["warnings"].as_array().unwrap();
    warnings.iter().any(|text| words.iter().all(|word| text.as_str().unwrap().contains(word)))
}

fn entries(summary: &Value) -> &[Value] {
    summary["steps"].as_array().unwrap()
}

fn close(a: &Value, b: &Value, tolerance: f64) -> bool {
    let [a, b] = [a, b].map(|value| value.as_f64().unwrap());
    (a - b).abs() <= tolerance * b.abs()
}

fn cells(path: &Path) -> usize {
    let bytes = fs::read(path).unwrap();
    let text = String::from_utf8_lossy(&bytes);
    let rest = text.split("NumberOfCells=\"").nth(1).unwrap();
    rest.split('"').next().unwrap().parse().unwrap()
}

const LARGE: [&str; 4] = ["--set", "frame.half_width=[2.025, 2.025]", "--set", "frame.cells=[36, 36]"];

/// Truth: case `rel-contact-reaches-frame` of docs/verification.md: a run with the large frame from the start. Each field file
/// contains the frame of its entry.
#[test]
fn frames_grow() {
    let folder = tempfile::tempdir().unwrap();
    let (code, text, grown) = run(folder.path(), "grown", &[]);
    assert_eq!(code, Some(0), "{text}");
    assert!(warned(
        &grown,
        &["step \"slide\"", "enlarged from 24 x 24 to 36 x 36 cells, half_width = [2.025, 2.025]"]
    ));
    assert_eq!(grown["frame"]["cells"], serde_json::json!([36, 36]));
    assert!(close(&grown["frame"]["half_width"][0], &2.025.into(), 1e-14));
    let (code, text, large) = run(folder.path(), "large", &LARGE);
    assert_eq!(code, Some(0), "{text}");
    assert_eq!(entries(&grown).len(), entries(&large).len());
    for (a, b) in entries(&grown).iter().zip(entries(&large)) {
        for key in
            ["worn_volume", "contact_area", "approach", "normal_force", "max_wear_depth", "peak_pressure"]
        {
            assert!(close(&a[key], &b[key], 1e-7), "{key}: {} {}", a[key], b[key]);
        }
        assert!(a["contact_touches_edge"] == false && a["distance_slid"] == b["distance_slid"]);
    }
    let file = |number: usize| cells(&folder.path().join(format!("grown/frame_{number:04}.vtu")));
    assert_eq!((file(1), file(11)), (576, 1296));
    assert!(
        folder.path().join("grown/wear.svg").exists() && folder.path().join("grown/profiles.svg").exists()
    );
}

/// Truth: case `rel-contact-reaches-frame` of docs/verification.md. With `frame.grow = false` the run stops before the contact
/// reaches the edge of the frame. The contact radii come from a run with the large frame. The stopped run then resumes with
/// `frame.grow = true`. Its results equal the results of a run without this stop.
#[test]
fn runs_stop_at_the_edge() {
    let folder = tempfile::tempdir().unwrap();
    let (code, text, stopped) = run(folder.path(), "out", &["--set", "frame.grow=false"]);
    assert_eq!((code, &stopped["reason"]), (Some(3), &"frame-edge".into()), "{text}");
    assert!(
        warned(&stopped, &["edge of the frame between", "not applied"])
            && warned(&stopped, &["frame.grow is false"])
    );
    assert!(folder.path().join("out/checkpoint-1.bin").exists(), "no checkpoint");
    let (_, _, large) = run(folder.path(), "large", &LARGE);
    let radius = |entry: &Value| (entry["contact_area"].as_f64().unwrap() / std::f64::consts::PI).sqrt();
    let count = entries(&stopped).len();
    let cell = 2.7 / 24.0;
    // The outermost cells begin one cell side inside the half-width of 1.35 mm. The error of the contact radius is half a cell
    // side.
    let [before, after] = [count - 1, count].map(|k| radius(&entries(&large)[k]));
    assert!(before < 1.35 - 0.5 * cell && after > 1.35 - 1.5 * cell && before < after, "{before} {after}");
    for (a, b) in entries(&stopped).iter().zip(entries(&large)) {
        assert!(close(&a["contact_area"], &b["contact_area"], 1e-7) && a["converged"] == true);
    }
    let (code, text, resumed) = run(folder.path(), "out", &["--resume", "--set", "frame.grow=true"]);
    assert_eq!(code, Some(0), "{text}");
    let (_, _, grown) = run(folder.path(), "grown", &[]);
    let timeless = |summary: &Value| {
        let mut steps = entries(summary).to_vec();
        steps.iter_mut().for_each(|step| step["seconds"] = 0.into());
        (steps, summary["warnings"].clone(), summary["frame"].clone(), summary["files"].clone())
    };
    assert_eq!(timeless(&resumed), timeless(&grown));
}

/// Truth: docs/theory-wear.md: a frame grows to at most four times its initial number of cells. A frame with measured heights
/// cannot grow, because the heights cover only the initial frame.
#[test]
fn frames_that_cannot_grow() {
    let folder = tempfile::tempdir().unwrap();
    let (code, text, summary) = run(
        folder.path(),
        "far",
        &[
            "--set",
            "wear.i=1e-7",
            "--set",
            "frame.half_width=[1.125, 1.125]",
            "--set",
            "frame.cells=[20, 20]",
        ],
    );
    assert_eq!((code, &summary["reason"]), (Some(3), &"frame-edge".into()), "{text}");
    assert_eq!(summary["frame"]["cells"], serde_json::json!([40, 40]));
    assert!(
        warned(&summary, &["was enlarged twice"]) && warned(&summary, &["from 20 x 20 to 30 x 30"]),
        "{text}"
    );
    let at = |k: usize| (k as f64 + 0.5) * 2.7 / 24.0 - 1.35;
    let row = |i: usize| {
        (0..24).map(|j| format!("{}", (at(i) * at(i) + at(j) * at(j)) / 200.0)).collect::<Vec<_>>().join(",")
    };
    fs::write(folder.path().join("heights.csv"), (0..24).map(row).collect::<Vec<_>>().join("\n")).unwrap();
    let gap = ["--set", "gap={ kind = \"heights\", file = \"heights.csv\" }"];
    let (code, text, summary) = run(folder.path(), "heights", &gap);
    assert_eq!((code, &summary["reason"]), (Some(3), &"frame-edge".into()), "{text}");
    assert!(warned(&summary, &["the frame is not enlarged: ", "heights"]), "{text}");
    assert!(entries(&summary).len() > 2 && summary["frame"]["cells"] == serde_json::json!([24, 24]));
    let last = folder.path().join(format!("heights/frame_{:04}.vtu", entries(&summary).len()));
    assert_eq!(cells(&last), 576);
    assert!(folder.path().join("heights/wear.svg").exists(), "{text}");
}

/// Scene of half a block with the plane of symmetry x = -2. Along y, the block extends beyond the frame.
const HALF_MODEL: &str = r#"
[materials.m]
model = "isotropic"
E = 91000.0
nu = 0.3
[body1]
kind = "fe"
material = "m"
mesh = "layer.msh"
contact = "top"
fixed = [{ group = "base" }]
symmetry = ["x"]
[body2]
kind = "rigid"
[frame]
kind = "grid"
half_width = [2.0, 1.0]
cells = [8, 4]
[gap]
kind = "cylinder"
radius = 100.0
angle = 0.0
[[steps]]
approach = 0.01
"#;

/// Truth: the plane of symmetry is an edge of the frame. The frame ends at x = -2 mm before and after it grows along y.
#[test]
fn grown_frames_keep_their_planes_of_symmetry() {
    let folder = tempfile::tempdir().unwrap();
    let [nx, ny, nz] = [4, 8, 2];
    let mesh = crate::moved::layer([2.0, 4.0], 1.0, [nx, ny, nz]);
    // The group contains only the faces in the plane of symmetry x = -2. Faces at x = 2 are removed from the group.
    let mesh = mesh.replace(" 3 2 3 3 ", " 3 2 9 9 ").replacen(" 3 2 9 9 ", " 3 2 3 3 ", ny * nz);
    fs::write(folder.path().join("layer.msh"), mesh).unwrap();
    let path = folder.path().join("scene.toml");
    fs::write(&path, HALF_MODEL).unwrap();
    let plan = orthowear::scene::read(&path, &[]).unwrap_or_else(|mistakes| panic!("{mistakes}"));
    let frame = |growths| orthowear::simulation::grown_frame::grown_frame(&plan, growths).expect("a frame");
    let (start, grown) = (frame(0), frame(1));
    assert_eq!((start.n_cells(), grown.n_cells()), (8 * 4, 8 * 6));
    assert_eq!(start.symmetry_bounds, [true, false, false]);
    assert_eq!(grown.symmetry_bounds, start.symmetry_bounds);
}
