//! Gaps of meshed surfaces, and cells against faces, where near fields are those of half-spaces or of meshes.

use std::fs;

use serde_json::Value;

use crate::near_field::{call, place, run};

fn warning<'a>(summary: &'a Value, words: &str) -> Option<&'a str> {
    let all = summary["warnings"].as_array().unwrap();
    all.iter().filter_map(Value::as_str).find(|text| text.starts_with("WARNING: ") && text.contains(words))
}

/// Truth: docs/scene.md: cells that are finer than the faces of a condensed mesh beside a half-space put the pressures in doubt, with
/// the ratio of areas (0.1 / 1 mm, squared); the reason why "auto" takes the mesh is said with it. Cells as large as faces are not.
#[test]
fn cells_finer_than_faces_beside_a_half_space() {
    let place = place([4.0, 4.0], 4.0, [8, 8, 8]);
    let words = "the cells of the frame are finer than the contact faces of body1";
    let summary = run(place.path(), &["body1.near_field=\"mesh\""]);
    let text = warning(&summary, words).expect("a warning");
    assert!(text.contains("only 0.01 times") && text.contains("cells = [2, 2] or fewer"), "{text}");
    assert!(
        text.contains("body2 has that of a half-space") && text.contains("body1.near_field = \"auto\""),
        "{text}"
    );
    let base = ["frame.half_width=[3.5, 3.5]", "frame.cells=[35, 35]"];
    let (code, text) = call("check", place.path(), &base);
    let reason = "body1 has no place for the near field of a half-space: an edge of the body, or a support, is 0.5 from the frame";
    assert!(code == Some(0) && text.contains(words) && text.contains(reason), "{text}");
    let (code, text) = call("check", place.path(), &["frame.half_width=[3.5, 3.5]", "frame.cells=[7, 7]"]);
    assert!(code == Some(0) && !text.contains("WARNING"), "{text}");
    // Beside a rigid body the same is refused, for the same reason.
    let (code, text) = call("check", place.path(), &[&base[..], &["body2={kind=\"rigid\"}"]].concat());
    assert!(
        code == Some(2) && text.contains("tractions are not determined") && text.contains(reason),
        "{text}"
    );
}

/// Truth: geometry: the frame of 1.35 mm has 0.95 mm to the edge of the block, the enlarged one of 2.025 mm 0.275 mm, less than 0.3 of
/// half its side: the run stops for this reason, and not for the cells of a mesh that it never had.
#[test]
fn a_frame_that_outgrows_its_half_space() {
    let place = place([2.3, 2.3], 2.3, [6, 6, 6]);
    let sets = [
        "body2={kind=\"rigid\"}",
        "frame.half_width=[1.35, 1.35]",
        "frame.cells=[24, 24]",
        "gap.radius=100.0",
        "wear={law=\"archard\", i=1e-8}",
        "steps.0={name=\"press\", normal_force=4000.0, wear=false}",
        "steps.1={name=\"slide\", sliding={distance=3000.0, jumps=10}}",
        "solver.tolerance=1e-8",
    ];
    let (code, text) = call("run", place.path(), &sets);
    let summary: Value =
        serde_json::from_slice(&fs::read(place.path().join("scene.out/summary.json")).unwrap()).unwrap();
    assert_eq!((code, &summary["reason"]), (Some(3), &"frame-edge".into()), "{text}");
    let warnings = summary["warnings"].to_string();
    assert!(
        warnings.contains("the larger frame would change the near field of body1")
            && warnings.contains("is 0.275 from the frame"),
        "{warnings}"
    );
    assert!(!warnings.contains("tractions are not determined"), "{warnings}");
}
