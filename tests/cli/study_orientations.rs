//! Studies of fibre orientations, compared with an independent program and by symmetry.

use std::fs;
use std::path::Path;

use serde_json::Value;

use super::study::{csv, folder, json, orthowear};
use crate::tools::usual_or_finest;

/// Truth: the forces on body 1 from an independent program, for two half-spaces on up to 256 x 256 cells. The forces on 32 x 32
/// cells agree to 3e-3 of the normal force. With fibres along the normal (tilt 90), the tangential force is the same for all
/// directions of the shift.
#[test]
fn contact_of_orientations() {
    let study = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/contact-orientation.toml");
    let folder = tempfile::tempdir().unwrap();
    let study = study.display().to_string();
    let arguments = ["study", study.as_str(), "--out", "o", "--quiet", "--set", "frame.cells=[32, 32]"];
    let (code, _, errors) = orthowear(folder.path(), &arguments);
    assert_eq!(code, Some(0), "{errors}");
    let (heads, rows) = csv(&folder.path().join("o/study.csv"));
    assert_eq!(rows.len(), 28);
    let columns =
        ["indent.normal_force", "shift.normal_force", "shift.tangential_force.0", "shift.tangential_force.1"];
    let columns = columns.map(|name| heads.iter().position(|head| head == name).unwrap());
    let forces = |tilt: &str, angle: &str| -> [f64; 4] {
        let row = rows.iter().find(|row| row[..2] == [tilt, angle]).unwrap();
        columns.map(|column| row[column].parse().unwrap())
    };
    for (tilt, angle, wanted) in [
        ("0", "0", [295.371, 291.623, 115.335, 0.0]),
        ("0", "45", [295.371, 291.513, 102.172, 64.125]),
        ("30", "0", [417.879, 303.764, 131.649, 0.0]),
        ("30", "45", [417.879, 326.589, 68.476, 82.652]),
        ("60", "0", [895.999, 707.402, -84.807, 0.0]),
        ("60", "45", [895.999, 759.221, -154.770, 97.164]),
        ("90", "0", [1186.597, 1182.764, 148.288, 0.0]),
        ("90", "45", [1186.597, 1182.765, 104.856, 104.856]),
    ] {
        let found = forces(tilt, angle);
        for (found, wanted_one) in found.iter().zip(wanted) {
            assert!((found - wanted_one).abs() < 3e-3 * wanted[1], "{tilt} {angle}: {found} {wanted_one}");
        }
    }
    let across = |angle: &str| forces("90", angle)[2].hypot(forces("90", angle)[3]);
    for angle in ["30", "45", "90"] {
        assert!((across(angle) / across("0") - 1.0).abs() < 1e-3, "{angle}");
    }
}

/// Truth: the wear volumes after 100 000 cycles along the fibre, from an independent program on up to 256 x 256 cells with small
/// wear jumps. The wear volumes on 32 x 32 cells with 4 jumps agree to 1 %. With fibres along the normal, all sliding directions
/// give the same wear volume. At 45 degrees the grid causes a difference below 2e-3.
#[test]
fn wear_of_orientations() {
    let scenes = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    let folder = tempfile::tempdir().unwrap();
    let study = fs::read_to_string(scenes.join("wear-orientation.toml")).unwrap();
    let tilts = "values = [0, 15, 30, 45, 60, 75, 90]";
    assert!(study.contains(tilts));
    let study = study.replace(tilts, usual_or_finest("values = [0, 90]", tilts));
    let study = study.replace("sphere-wear.toml", &scenes.join("sphere-wear.toml").display().to_string());
    fs::write(folder.path().join("study.toml"), study).unwrap();
    let coarse = ["--set", "frame.cells=[32, 32]", "--set", "steps.fretting.cycles.jumps=4"];
    let arguments = [&["study", "study.toml", "--out", "o", "--quiet"][..], &coarse].concat();
    let (code, _, errors) = orthowear(folder.path(), &arguments);
    assert_eq!(code, Some(0), "{errors}");
    let (heads, rows) = csv(&folder.path().join("o/study.csv"));
    assert_eq!(rows.len(), usual_or_finest(6, 21));
    let column = heads.iter().position(|head| head == "fretting.worn_volume").unwrap();
    let worn = |tilt: &str, angle: &str| -> f64 {
        let row = rows.iter().find(|row| row[..2] == [tilt, angle]).unwrap();
        row[column].parse().unwrap()
    };
    for (tilt, volume) in [("0", 0.004_327_49), ("90", 0.013_524_563)] {
        assert!((worn(tilt, "0") / volume - 1.0).abs() < 0.01, "{tilt}: {}", worn(tilt, "0"));
    }
    assert!((worn("90", "90") / worn("90", "0") - 1.0).abs() < 1e-6);
    assert!((worn("90", "45") / worn("90", "0") - 1.0).abs() < 2e-3);
}

/// Truth: symmetry. The plane of fibre and normal is a mirror plane. With fibres along the normal, a transversely isotropic
/// material on a square frame is invariant under a quarter turn. The wear volumes agree to 1e-6.
#[test]
fn symmetric_orientations_wear_alike() {
    let study = r#"
[study]
scene = "scene.toml"
[[axes]]
keys = ["body1.fibre.tilt"]
values = [30, 90]
[[axes]]
keys = ["steps.fretting.cycles.angle"]
values = [0, 90, 35, -35]
[output]
collect = ["fretting.worn_volume"]
"#;
    let folder = folder(study);
    let (code, _, errors) =
        orthowear(folder.path(), &["study", "study.toml", "--quiet", "--set", "wear.k=1e-8"]);
    assert_eq!(code, Some(0), "{errors}");
    let result = json(&folder.path().join("study.study/study.json"));
    let worn = |tilt: i64, angle: i64| {
        let runs = result["runs"].as_array().unwrap();
        let values = |run: &Value| {
            let number = |key: &str| run["values"][key].as_i64().unwrap();
            [number("body1.fibre.tilt"), number("steps.fretting.cycles.angle")]
        };
        let run = runs.iter().find(|run| values(run) == [tilt, angle]).unwrap();
        run["results"]["fretting.worn_volume"].as_f64().unwrap()
    };
    let close = |a: f64, b: f64| assert!((a - b).abs() < 1e-6 * a && a > 0.0, "{a} {b}");
    close(worn(30, 35), worn(30, -35));
    close(worn(90, 35), worn(90, -35));
    close(worn(90, 0), worn(90, 90));
    assert!((worn(30, 0) - worn(30, 90)).abs() > 1e-3 * worn(30, 0), "tilted fibres have a direction");
}
