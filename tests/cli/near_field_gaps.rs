//! Gaps of meshed surfaces, and cells against faces, where near fields are those of half-spaces or of meshes.

use std::fs;

use serde_json::Value;

use crate::near_field::{call, place};

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
