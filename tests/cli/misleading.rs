//! Scenes with a misleading result: the program refuses them or gives a warning.

use std::fs;
use std::path::Path;

use super::limits::moved_mesh;
use super::materials::{folder, orthowear};
use super::near_field;

/// Exit code of `check` for a file in `scenes/`, and its output on one line.
fn check(scene: &str, overrides: &[&str]) -> (Option<i32>, String) {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut arguments = vec!["check", scene];
    overrides.iter().for_each(|line| arguments.extend(["--set", line]));
    let (code, text, errors) = orthowear(&root.join("scenes"), &arguments);
    (code, (text + &errors).split_whitespace().collect::<Vec<_>>().join(" "))
}

const FRP: &str = "friction={ law = \"frp\", mu_L = 0.4, mu_T = 0.5, mu_N = 0.55 }";
const PLY: &str = "materials.peek={ model = \"orthotropic\", E1 = 167230.0, E2 = 9544.0, E3 = 9544.0, G12 = 5292.0, \
                   G13 = 5292.0, G23 = 3483.0, nu12 = 0.272, nu13 = 0.272, nu23 = 0.369 }";

/// Truth: geometry. The normals of the half bore deviate by up to 90 degrees from their mean. Fibres along x lie in the surface
/// at the bottom of the bore, and along its normal at the sides. The key `fibre` of the law gives angles relative to the surface,
/// which are valid everywhere.
#[test]
fn frp_laws_in_a_bore() {
    let fibre = "body1.fibre={ tilt = 0.0, azimuth = 0.0 }";
    let (code, text) = check("pin-in-hole.toml", &[PLY, fibre, FRP]);
    assert_eq!(code, Some(2), "{text}");
    for word in ["friction.law", "deviate by up to 8", "limit: 5", "friction.fibre = { tilt"] {
        assert!(text.contains(word), "lacks \"{word}\": {text}");
    }
    let wear = "wear={ law = \"frp\", i_L = 1e-9, i_T = 1e-9, i_N = 1e-9 }";
    let coulomb = "friction={ law = \"coulomb\", mu = 0.3 }";
    let (code, text) = check("pin-in-hole.toml", &[PLY, fibre, coulomb, wear]);
    assert!(code == Some(2) && text.contains("wear.law") && text.contains("wear.fibre = {"), "{text}");
    let given = "friction.fibre={ tilt = 0.0, azimuth = 0.0 }";
    let (code, text) = check("pin-in-hole.toml", &[PLY, fibre, FRP, given]);
    assert_eq!(code, Some(0), "{text}");
}

/// Truth: geometry. The top of the sheared block is plane, but inclined by atan(0.05) = 2.862 degrees. The fibre's tilt out of
/// the plane z = 0 therefore differs from its tilt out of the surface.
#[test]
fn frp_laws_on_an_inclined_plane() {
    let folder = folder("fibre = { tilt = 0.0 }", "", &[]);
    let path = folder.path().join("box.msh");
    let mesh = fs::read_to_string(&path).unwrap();
    let (before, rest) = mesh.split_once("$Nodes\n125\n").unwrap();
    let (nodes, after) = rest.split_once("$EndNodes").unwrap();
    let sheared: String = nodes
        .lines()
        .map(|line| {
            let [number, x, y, z]: [f64; 4] =
                line.split_whitespace().map(|n| n.parse().unwrap()).collect::<Vec<_>>().try_into().unwrap();
            format!("{number} {x} {y} {}\n", z + 0.05 * x)
        })
        .collect();
    fs::write(&path, format!("{before}$Nodes\n125\n{sheared}$EndNodes{after}")).unwrap();
    let check = |overrides: &[&str]| {
        let mut arguments = vec!["check", "scene.toml", "--set", "frame={ kind = \"mesh\" }"];
        overrides.iter().for_each(|line| arguments.extend(["--set", line]));
        let (code, text, errors) = orthowear(folder.path(), &arguments);
        (code, (text + &errors).split_whitespace().collect::<Vec<_>>().join(" "))
    };
    let (code, text) = check(&[]);
    assert!(code == Some(2) && text.contains("mean normal is 2.9 degrees away from z"), "{code:?} {text}");
    let (code, text) = check(&["friction.fibre={ tilt = 2.862 }"]);
    assert_eq!(code, Some(0), "{text}");
}

/// Truth: geometry. On a plane frame, a fibre has one angle to the surface. On the cap with a radius of 50 mm, up to 1.2 mm from
/// its centre, the angle varies by at most 1.4 degrees.
#[test]
fn frp_laws_on_nearly_plane_mesh_frames() {
    for scene in ["steel-cap-on-cfrp-block.toml", "compare-finite-pin.toml"] {
        let (code, text) = check(scene, &[]);
        assert_eq!(code, Some(0), "{text}");
    }
}

/// Truth: geometry. The rigid sphere has the radius 20 mm and the approach 0.005 mm. Its contact radius is at most sqrt(20 *
/// 0.005) = 0.32 mm. A tangential displacement of 0.2 mm exceeds a fifth of this radius, a displacement of 0.002 mm does not.
#[test]
fn sliding_farther_than_the_contact_allows() {
    let folder = folder("fibre = { tilt = 0.0 }\nnear_field = \"mesh\"", "", &[]);
    let said = |distance: &str| {
        let set = format!("steps.shift.shift.distance={distance}");
        let (code, text, errors) = orthowear(folder.path(), &["run", "scene.toml", "--set", &set]);
        assert_eq!(code, Some(0), "{text} {errors}");
        text
    };
    let text = said("0.2");
    assert!(
        text.contains("WARNING: step \"shift\"") && text.contains("displaced tangentially by 0.2000"),
        "{text}"
    );
    assert!(!said("0.002").contains("displaced tangentially"));
}

/// Exit code of `check` for `pin-in-hole.toml` with a pin of radius 9.8 mm times `scale`, and its output on one line.
fn pin_of_other_size(scale: f64, overrides: &[&str]) -> (Option<i32>, String) {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let folder = tempfile::tempdir().unwrap();
    let pin = folder.path().join("pin.msh");
    fs::write(&pin, moved_mesh(&root.join("meshes/pin.msh"), [scale, 1.0, scale], 0.0)).unwrap();
    let mesh = format!("body2.mesh=\"{}\"", pin.display());
    check("pin-in-hole.toml", &[&[mesh.as_str()], overrides].concat())
}

/// Truth: geometry. A pin of radius 10.02 mm overlaps the bore of radius 10 mm by 0.02 mm all round. This overlap is less than a
/// tenth of a cell, but no motion along the normal removes it. The reported overlap is a mean over cells, and is right to 5 %.
///
/// A pin of radius 9.98 mm moves down by 0.02 mm to the bottom of the bore. The flat faces of 1.3 mm and 0.64 mm deviate from the
/// circles by up to 0.02 mm. With the curvature correction, the error of the motion is below 0.002 mm.
#[test]
fn press_fit() {
    let (code, text) = pin_of_other_size(10.02 / 9.8, &[]);
    assert_eq!(code, Some(2), "{text}");
    for word in ["error: gap:", "24 of 24 cells", "interference fit"] {
        assert!(text.contains(word), "lacks \"{word}\": {text}");
    }
    let overlap = text.split("overlap by up to ").nth(1).and_then(|rest| rest.split(' ').next()).unwrap();
    assert!((overlap.parse::<f64>().unwrap() / 0.02 - 1.0).abs() < 0.05, "{text}");
    let (code, text) = pin_of_other_size(10.003 / 9.8, &[]);
    assert!(code == Some(2) && text.contains("interference fit"), "{text}");
    let (code, text) = pin_of_other_size(9.98 / 9.8, &[]);
    assert_eq!(code, Some(0), "{text}");
    let said = text.split_once("body 2 is moved by ").expect("the motion").1;
    let (value, rest) = said.split_once(' ').unwrap();
    let motion: f64 = value.parse().unwrap();
    assert!((motion - 0.02).abs() < 0.002 && rest.starts_with("mm against n = (0, 0, 1)"), "{text}");
}

/// Truth: geometry. The bore has the radius R = 10 mm and flat faces of length h = 1.3 mm. The faces lie up to h^2 / 8R = 0.021
/// mm inside the circle. The mean over a cell, reduced by the mean for the pin's shorter faces, is half of this distance. A pin
/// with a clearance of 0.01 mm therefore overlaps the bore at an approach of 0, and a warning reports this.
#[test]
fn load_of_flat_faces_at_the_first_touch() {
    let words = "WARNING: when the curved surfaces first touch, their flat mesh faces already overlap elsewhere by up to 0.01";
    let (code, text) = pin_of_other_size(9.99 / 9.8, &["steps.press.approach=0.0"]);
    assert!(code == Some(0) && text.contains(words), "{text}");
    let (code, text) = pin_of_other_size(9.99 / 9.8, &["steps.press.approach=0.05"]);
    assert!(
        code == Some(0)
            && !text.contains("flat mesh faces already overlap")
            && text.contains("of the approach of 0.05"),
        "{text}"
    );
}

/// Truth: geometry. The pin lies 0.5 mm above its concentric position and has a clearance of 0.2 mm. The motion to the first
/// touch is u = 0.7 mm. The frame has the radius R = 10 mm. The motion causes an error of u^2 / R = 0.05 mm, a fifth of the
/// approach.
#[test]
fn long_motion_to_the_first_touch() {
    let words = "WARNING: the frame is curved, and moving body 2 by 0.";
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let folder = tempfile::tempdir().unwrap();
    let pin = folder.path().join("pin.msh");
    fs::write(&pin, moved_mesh(&root.join("meshes/pin.msh"), [1.0; 3], -0.5)).unwrap();
    let (code, text) = check("pin-in-hole.toml", &[&format!("body2.mesh=\"{}\"", pin.display())]);
    assert!(code == Some(0) && text.contains(words), "{text}");
    let (code, text) = check("pin-in-hole.toml", &[]);
    assert!(code == Some(0) && !text.contains(words), "{text}");
}

/// Truth: geometry. A mesh 0.1 mm above the block is moved down by 0.1 mm. A mesh that overlaps the block by 0.01 mm is moved up
/// by 0.01 mm.
#[test]
fn meshes_moved_to_the_first_touch() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let folder = tempfile::tempdir().unwrap();
    for (drop, said) in [
        (-0.1, "moved by 0.1 mm against n = (0, 0, 1)"),
        (
            0.01,
            "moved by 0.01 mm along n = (0, 0, 1) to the first touch of the surfaces, because the meshes overlap",
        ),
        (0.0, ""),
    ] {
        let roller = folder.path().join("roller.msh");
        fs::write(&roller, moved_mesh(&root.join("meshes/roller.msh"), [1.0; 3], drop)).unwrap();
        let (code, text) = check("cylinder-on-flat.toml", &[&format!("body2.mesh=\"{}\"", roller.display())]);
        assert_eq!(code, Some(0), "{text}");
        assert!(text.contains(said) && text.contains("body 2 is moved") == (drop != 0.0), "{drop}: {text}");
    }
}

/// Truth: geometry. The half bore and its mirror image at x = 0 form a closed ring. A motion along x opens the contact on one
/// side and closes it on the opposite side.
#[test]
fn contact_that_a_plane_of_symmetry_closes() {
    let planes = ["body1", "body2"].map(|body| {
        format!(
            "{body}.fixed=[{{ group = \"held\" }}, {{ group = \"body\", components = [\"y\"] }}]\n{body}.symmetry=[\"mirror\"]"
        )
    });
    let planes: Vec<&str> = planes.iter().flat_map(|lines| lines.split('\n')).collect();
    let (code, text) = check("pin-in-hole.toml", &[&planes[..], &["frame.normal=[-1.0, 0.0, 0.0]"]].concat());
    assert!(
        code == Some(2) && text.contains("error: gap:") && text.contains("closes around body 2"),
        "{text}"
    );
    let (code, text) = check("pin-in-hole.toml", &planes);
    assert_eq!(code, Some(0), "{text}");
}

/// Truth: geometry. The faces of the pin are 0.64 mm long, the faces of the bore 1.31 mm. A steel plate is 58 times as stiff as
/// the pin and hardly deforms, so the length of its faces has little influence.
#[test]
fn coarse_partner_of_a_fine_mesh() {
    let warned = "WARNING: the contact faces of body1 are coarser than the cells of the frame";
    let (code, text) = check("pin-in-hole.toml", &["frame.body=2"]);
    assert!(code == Some(0) && text.contains(warned) && text.contains("(frame.body = 1)"), "{text}");
    let (code, text) = check("pin-in-hole.toml", &["frame.body=1"]);
    assert!(code == Some(0) && !text.contains("coarser than the cells"), "{text}");
    let steel = "materials.steel={ model = \"isotropic\", E = 210e3, nu = 0.3 }";
    let (code, text) = check("pin-in-hole.toml", &["frame.body=2", steel, "body1.material=\"steel\""]);
    assert!(code == Some(0) && !text.contains("coarser than the cells"), "{text}");
}

/// Summary of a run of a file in `scenes/`, and the output of the run on one line.
fn run(scene: &str, overrides: &[&str]) -> (serde_json::Value, String) {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().display().to_string();
    let mut arguments = vec!["run", scene, "--out", &out, "--set", "output.fields=[]"];
    overrides.iter().for_each(|line| arguments.extend(["--set", line]));
    let (code, text, errors) = orthowear(&root.join("scenes"), &arguments);
    assert_eq!(code, Some(0), "{text} {errors}");
    let summary = serde_json::from_slice(&fs::read(folder.path().join("summary.json")).unwrap()).unwrap();
    (summary, text.split_whitespace().collect::<Vec<_>>().join(" "))
}

/// Truth: Hertz. A contact radius of 0.32 mm exceeds a frame with a half-width of 0.2 mm, on half-spaces and in the middle of a
/// meshed block. A contact that ends at the flanks of a slice, at a plane of symmetry or at the edges of a body is complete.
#[test]
fn contact_cut_off_at_the_edge_of_the_frame() {
    let warned =
        "the contact reaches the edge of the frame, although the bodies continue beyond it. Contact outside";
    let cut = |summary: &serde_json::Value| summary["steps"][0]["contact_touches_edge"] == true;
    let small = ["frame.half_width=[0.2, 0.2]", "frame.cells=[16, 16]"];
    let (summary, text) = run("hertz.toml", &small);
    assert!(cut(&summary) && text.contains(&format!("WARNING: step \"press\" (1): {warned}")), "{text}");
    let (summary, text) = run("hertz.toml", &[]);
    assert!(!cut(&summary) && !text.contains(warned), "{text}");
    let place = near_field::place([4.0, 4.0], 4.0, [8, 8, 8]);
    let summary = near_field::run(place.path(), &small);
    assert!(cut(&summary) && summary["warnings"].to_string().contains(warned), "{summary}");
    let (summary, text) = run("pin-in-hole.toml", &[]);
    assert!(!cut(&summary) && !text.contains(warned), "{text}");
    let all = ["frame={ kind = \"mesh\", body = 1 }", "gap.kind=\"flat\"", "body2={ kind = \"rigid\" }"];
    let flat: Vec<&str> = all.iter().copied().filter(|line| !line.starts_with("gap")).collect();
    let summary = near_field::run(place.path(), &[&flat[..], &["gap={ kind = \"flat\" }"]].concat());
    assert!(!cut(&summary) && !summary["warnings"].to_string().contains(warned), "{summary}");
    // The half-space continues beyond the frame, so its contact is cut off.
    let sets = [&flat[..], &["gap={ kind = \"flat\" }"]].concat();
    let mut arguments = vec!["compare", "scene.toml", "--variants", "FE-rigid,HS-rigid", "--out", "c"];
    sets.iter().for_each(|line| arguments.extend(["--set", line]));
    let (_, text, errors) = orthowear(place.path(), &arguments);
    assert!(text.contains("HS-rigid: WARNING: step \"press\" (1)"), "{text} {errors}");
    assert!(!text.contains("FE-rigid: WARNING: step \"press\" (1)"), "{text}");
}

/// Truth: for a step with cycles, the output line shows the values at the + reversal point, which `stroke_ends` of the summary
/// contains. The mean tangential displacement over both reversal points would be 0.
#[test]
fn a_line_of_cycles_shows_one_state() {
    let steps = "steps=[{ name = \"press\", approach = 0.01 }, { name = \"fret\", cycles = { count = 10, amplitude = 0.002, jumps = 1 } }]";
    let laws = ["friction={ law = \"coulomb\", mu = 0.3 }", "wear={ law = \"archard\", i = 1e-9 }"];
    let (summary, text) = run("hertz.toml", &[steps, laws[0], laws[1], "frame.cells=[16, 16]"]);
    let record = summary["steps"].as_array().unwrap().last().unwrap();
    let plus = &record["stroke_ends"][0];
    assert!(text.contains("values at the + reversal point of the last cycle"), "{text}");
    let line = text.split("fret 10 ").nth(1).expect("the line of the cycles");
    let load: f64 = line.split(' ').next().unwrap().parse().unwrap();
    let expected = plus["normal_force"].as_f64().unwrap();
    assert!((load / expected - 1.0).abs() < 1e-4, "{load} {expected}");
    let shift: f64 = line.split('(').nth(1).unwrap().split(',').next().unwrap().parse().unwrap();
    assert!((shift / plus["shift"][0].as_f64().unwrap() - 1.0).abs() < 1e-4, "{line}");
}

/// Scene of a steel sphere in fretting along y on a unidirectional CFRP half-space. The fibres lie in the surface, at an angle to
/// x.
const OBLIQUE: &str = r#"
[materials.cfrp]
model = "transversely-isotropic"
E1 = 140e3
E2 = 9.5e3
G12 = 5.0e3
nu12 = 0.3
nu23 = 0.4
[materials.steel]
model = "isotropic"
E = 210e3
nu = 0.3
[body1]
kind = "half-space"
material = "cfrp"
fibre = { tilt = 0.0, azimuth = 30.0 }
[body2]
kind = "half-space"
material = "steel"
[frame]
kind = "grid"
half_width = [0.8, 0.8]
cells = [16, 16]
[gap]
kind = "sphere"
radius = 4.0
[friction]
law = "frp"
mu_L = 0.25
mu_T = 0.35
mu_N = 0.4
[wear]
law = "frp"
i_L = 4.0e-9
i_T = 6.0e-9
i_N = 7.0e-9
[[steps]]
name = "press"
normal_force = 500.0
[[steps]]
name = "fret"
cycles = { count = 2000, amplitude = 0.1, angle = 90.0 }
[output]
fields = []
"#;

/// Truth: gross sliding along y, with fibres at the azimuth t to x. In the axes of the fibre, the friction ellipse is M =
/// diag(mL, mT) = diag(0.25, 0.35). The associated slip rule gives the traction q = p M^2 v / |M v| for the pressure p and the
/// sliding velocity v.
///
/// Let P be the normal force and m^2 = mL^2 sin^2 t + mT^2 cos^2 t. The tangential force is P m along the stroke. Across the
/// stroke it is P (mL^2 - mT^2) sin t cos t / m. The tolerance is 2 %, because tractions reach their final direction only after
/// sliding by several elastic displacements.
#[test]
fn oblique_fretting() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("scene.toml"), OBLIQUE).unwrap();
    for azimuth in [30.0_f64, 60.0] {
        let set = format!("body1.fibre.azimuth={azimuth:.1}");
        let summary = near_field::run(folder.path(), &[&set]);
        let (sin, cos) = azimuth.to_radians().sin_cos();
        let mu = (0.0625 * sin * sin + 0.1225 * cos * cos).sqrt();
        let expected = [500.0 * (0.0625 - 0.1225) * sin * cos / mu, 500.0 * mu];
        let record = summary["steps"].as_array().unwrap().last().unwrap();
        for (k, expected) in expected.into_iter().enumerate() {
            let found = record["tangential_force"][k].as_f64().unwrap();
            assert!((found / expected - 1.0).abs() < 0.02, "{azimuth}, {k}: {found} {expected}");
        }
        let minus = record["stroke_ends"][1]["tangential_force"][0].as_f64().unwrap();
        assert!((minus / -expected[0] - 1.0).abs() < 0.02, "{minus}");
    }
    // The friction law is homogeneous in the pressure. The ratio of the force components is therefore the same at a hundredth of
    // the normal force.
    let summary = near_field::run(folder.path(), &["steps.fret.normal_force=5.0"]);
    for record in summary["steps"].as_array().unwrap().iter().skip(1) {
        let [x, y] = [0, 1].map(|k| record["tangential_force"][k].as_f64().unwrap());
        let load = record["stroke_ends"][0]["normal_force"].as_f64().unwrap();
        assert!(x.hypot(y) < 0.35 * load && (x / y + 0.2417).abs() < 0.025, "{x} {y} {load}");
    }
}

/// Truth: geometry. The heights (x^2 + y^2) / 20 mm approximate a sphere of radius 10 mm. Heights in micrometres have a slope of
/// 40 instead of 0.04 at 0.4 mm from the centre. A map of ±0.25 mm does not cover a frame of ±0.4 mm.
#[test]
fn maps_of_heights() {
    let folder = tempfile::tempdir().unwrap();
    let said = |n: i32, factor: f64, decimal: &str| {
        let at = |i: i32| 0.05 * f64::from(i - n / 2);
        let row = |i: i32| -> Vec<String> {
            (0..n).map(|j| format!("{:.9}", factor * (at(i) * at(i) + at(j) * at(j)) / 20.0)).collect()
        };
        let lines: Vec<String> = (0..n).map(|i| row(i).join(";").replace('.', decimal)).collect();
        let file = folder.path().join("map.csv");
        fs::write(&file, lines.join("\n")).unwrap();
        let gap =
            format!("gap={{ kind = \"heights\", file = \"{}\", spacing = [0.05, 0.05] }}", file.display());
        check("hertz.toml", &[&gap])
    };
    let (code, text) = said(21, 1.0, ".");
    assert_eq!(code, Some(0), "{text}");
    let radius = text.split("the best-fit sphere has a radius of ").nth(1).expect("a sphere");
    let radius: f64 = radius.split(' ').next().unwrap().parse().unwrap();
    assert!((radius / 10.0 - 1.0).abs() < 0.01 && !text.contains("WARNING"), "{text}");
    let (code, text) = said(21, 1000.0, ".");
    assert!(code == Some(0) && text.contains("WARNING: the heights of the gap rise by up to"), "{text}");
    let (code, text) = said(21, -1.0, ".");
    assert!(
        code == Some(0) && text.contains("WARNING: the heights of the gap are largest in the middle"),
        "{text}"
    );
    let (code, text) = said(11, 1.0, ".");
    assert!(code == Some(2) && text.contains("gap heights extend 0.25 from their centre"), "{text}");
    let (code, text) = said(21, 1.0, ",");
    assert!(code == Some(2) && text.contains("decimal commas are not read"), "{text}");
}

/// Truth: geometry. Flat faces deviate from the circles by up to 0.02 mm, far more than the approach of 0.0001 mm. With a
/// clearance of 0.1 mm, flat faces do not overlap the bore at the first touch.
#[test]
fn flat_faces_that_touch_nothing() {
    let (code, text) = pin_of_other_size(9.9 / 9.8, &["steps.press.approach=0.0001"]);
    assert!(code == Some(0) && text.contains("of the approach of 0.0001"), "{text}");
}

/// Truth: geometry. Some cells of the bore have the same position in a view along n. A profile over the position would therefore
/// jump between these cells, and a rectangle would misrepresent the frame.
#[test]
fn figures_of_a_curved_frame() {
    let (code, text) = check("pin-in-hole.toml", &[]);
    assert!(code == Some(0) && text.contains("x = (1, 0, 0), y = (0, 1, 0), n = (0, 0, 1)"), "{text}");
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    for (scene, drawn) in [("pin-in-hole.toml", false), ("hertz.toml", true)] {
        let folder = tempfile::tempdir().unwrap();
        let out = folder.path().display().to_string();
        let (code, text, errors) =
            orthowear(&root, &["run", scene, "--out", &out, "--set", "output.fields=[\"svg\"]"]);
        assert_eq!(code, Some(0), "{text} {errors}");
        assert!(folder.path().join("history.svg").exists());
        assert_eq!(folder.path().join("profiles.svg").exists(), drawn, "{scene}");
        let (code, text, errors) = orthowear(&root, &["report", &out]);
        assert_eq!(code, Some(0), "{text} {errors}");
        let page = fs::read_to_string(folder.path().join("report.html")).unwrap();
        assert_eq!(page.contains("The contact frame from above"), drawn, "{scene}");
    }
}
