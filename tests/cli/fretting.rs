//! Fretting cycles of random scenes, compared with strokes computed in many increments.

use std::fs;

use serde_json::Value;

/// Largest allowed relative error of the wear of a cycle, for strokes along a line and along an ellipse. The reference wear is
/// extrapolated from 32 and 64 increments per stroke (ellipse: 64 and 128). The error of this reference is about 1e-4 (ellipse:
/// about 1e-3).
const WEAR: [f64; 2] = [1e-3, 2e-3];
/// Largest allowed error of the tangential force at a reversal point, relative to the largest force at a reversal point.
const FORCE: f64 = 1e-2;

/// Truth: the same program without `cycles`. The strokes are load points in increments of equal length, repeated until the wear
/// of a cycle does not change any more. The results are in tests/data/fretting-cycles.json, made by
/// `benchmarks/fretting/random_scenes.py`.
///
/// Cycles with the default of `cycles.increments` give the same wear and the same forces. The estimated error of the wear is at
/// least a tenth of the true error.
#[test]
fn cycles_of_random_scenes() {
    let data: Value = serde_json::from_str(include_str!("../data/fretting-cycles.json")).unwrap();
    let scenes = data.as_array().unwrap();
    assert!(scenes.len() >= 8);
    for scene in scenes {
        let name = &scene["number"];
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("scene.toml"), scene["scene"].as_str().unwrap()).unwrap();
        let mut program = crate::tools::orthowear();
        let output = program.current_dir(folder.path()).args(["run", "scene.toml", "--out", "out"]).output();
        assert_eq!(output.unwrap().status.code(), Some(0), "{name}");
        let summary = fs::read(folder.path().join("out/summary.json")).unwrap();
        let summary: Value = serde_json::from_slice(&summary).unwrap();
        let entry = summary["steps"].as_array().unwrap().last().unwrap();
        let number = |value: &Value| value.as_f64().unwrap();
        let wanted = number(&scene["volume"]);
        let error = (number(&entry["worn_volume"]) / wanted - 1.0).abs();
        let allowed = WEAR[usize::from(scene["ellipse"].as_bool().unwrap())];
        assert!(error < allowed, "{name}: {error}");
        assert!(number(&entry["worn_volume_error"]) / wanted > 0.1 * error, "{name}: {error}");
        let force = |value: &Value| [number(&value[0]), number(&value[1])];
        let forces = scene["forces"].as_array().unwrap();
        let largest =
            forces.iter().map(|wanted| force(wanted)[0].hypot(force(wanted)[1])).fold(0.0, f64::max);
        for (end, wanted) in entry["stroke_ends"].as_array().unwrap().iter().zip(forces) {
            let ([x, y], [u, v]) = (force(&end["tangential_force"]), force(wanted));
            let error = (x - u).hypot(y - v) / largest;
            assert!(error < FORCE, "{name}: {error}");
        }
    }
}
