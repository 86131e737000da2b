//! Gaps of meshed surfaces, and cells that are finer than the contact faces, with near fields of half-spaces and of meshes.

use std::fs;

use serde_json::Value;

use crate::near_field::{call, force, place, run};

/// Creates a scene with a block whose top is bent to a spherical cap of radius `radius`. The block has `cells` elements along x
/// and y.
fn cap(radius: f64, cells: usize) -> tempfile::TempDir {
    let (half, depth) = (3.0, 3.0);
    let place = place([half; 2], depth, [cells, cells, cells / 2]);
    let path = place.path().join("block.msh");
    let text = fs::read_to_string(&path).unwrap();
    let (head, rest) = text.split_once("$Nodes\n").unwrap();
    let (nodes, rest) = rest.split_once("$EndNodes").unwrap();
    let bent = nodes.lines().map(|line| {
        let numbers: Vec<f64> = line.split(' ').map(|number| number.parse().unwrap()).collect();
        let [node, x, y, z] = numbers[..] else { return line.to_owned() };
        let fall = radius - (radius * radius - x * x - y * y).sqrt();
        format!("{node} {x} {y} {}", z - (1.0 + z / depth) * fall)
    });
    let bent = bent.collect::<Vec<String>>().join("\n");
    fs::write(path, format!("{head}$Nodes\n{bent}\n$EndNodes{rest}")).unwrap();
    place
}

/// Settings for cells of 0.05 mm on faces of 0.5 mm. The contact radius is 0.45 mm.
const CAP: [&str; 4] = [
    "frame.half_width=[0.8, 0.8]",
    "frame.cells=[32, 32]",
    "steps.press.approach=0.01",
    "gap={kind=\"mesh\"}",
];

fn warning<'a>(summary: &'a Value, words: &str) -> Option<&'a str> {
    let all = summary["warnings"].as_array().unwrap();
    all.iter().filter_map(Value::as_str).find(|text| text.starts_with("WARNING: ") && text.contains(words))
}

/// Truth: a run with the exact sphere as gap gives the same load to 1e-2. The curvature correction is the distance h^2 / 8R of a
/// chord of length h from a circle of radius R, to 2 %. Without this correction, the load would be a third smaller.
#[test]
fn flat_faces_are_bowed_under_a_half_space() {
    let place = cap(20.0, 12);
    let meshed = run(place.path(), &CAP);
    let record = &meshed["near_fields"][0];
    assert_eq!(record["near_field"], "half-space", "{record}");
    let bow = record["bow"].as_f64().unwrap() / (0.25 / 160.0);
    assert!((bow - 1.0).abs() < 0.02, "{bow}");
    assert!(warning(&meshed, "flat").is_none(), "{meshed}");
    let exact = run(place.path(), &[&CAP[..3], &["gap={kind=\"sphere\", radius=20.0, exact=true}"]].concat());
    assert!(exact["near_fields"][0]["bow"].is_null());
    let (meshed, exact) = (force(&meshed, 0)[0], force(&exact, 0)[0]);
    assert!((meshed / exact - 1.0).abs() < 1e-2, "{meshed} {exact}");
    let (code, text) = call("check", place.path(), &CAP);
    assert!(
        code == Some(0) && text.contains("flat contact faces corrected for curvature by up to 1.5"),
        "{text}"
    );
}

/// Truth: the gap of a condensed mesh contains the distance h^2 / 8R of flat faces from the sphere. Under a prescribed force, the
/// warning compares this distance with the resulting approach. For an approach nine times as large, the same faces are fine
/// enough.
#[test]
fn flat_faces_of_a_condensed_mesh_are_doubtful() {
    let place = cap(20.0, 12);
    let mesh = [&CAP[..], &["body1.near_field=\"mesh\"", "frame.cells=[3, 3]"]].concat();
    let summary = run(place.path(), &mesh);
    let words = "the flat contact faces of body1";
    let text = warning(&summary, words).expect("a warning");
    assert!(text.contains("edges of 0.5 mm") && text.contains("second order"), "{text}");
    let number = |after: &str| -> f64 {
        text.split(after).nth(1).unwrap().split(' ').next().unwrap().parse().unwrap()
    };
    assert!(
        (number("radius ") / 20.0 - 1.0).abs() < 0.02
            && (number("up to ") / (0.25 / 160.0) - 1.0).abs() < 0.02
    );
    let (code, said) = call("check", place.path(), &mesh);
    assert!(code == Some(0) && said.contains(words), "{said}");
    let load = force(&summary, 0)[0];
    let pressed = format!("steps.0={{name=\"press\", normal_force={load}}}");
    let summary = run(place.path(), &[&mesh[..], &[&pressed]].concat());
    let text = warning(&summary, words).expect("a warning");
    assert!(text.contains("of the approach of 0.01 mm"), "{text}");
    let deep = [&mesh[..], &["steps.press.approach=0.09"]].concat();
    let (code, said) = call("check", place.path(), &deep);
    assert!(code == Some(0) && !said.contains(words), "{said}");
}

/// Truth: docs/scene.md: if a condensed mesh touches a half-space, cells finer than the contact faces make the pressures
/// uncertain. Here the cell area is (0.1 / 1)^2 = 0.01 of the area of a face.
#[test]
fn cells_finer_than_faces_beside_a_half_space() {
    let place = place([4.0, 4.0], 4.0, [8, 8, 8]);
    let words = "the contact faces of body1 are coarser than the cells of the frame";
    let summary = run(place.path(), &["body1.near_field=\"mesh\""]);
    let text = warning(&summary, words).expect("a warning");
    assert!(
        text.contains("(cell area: 0.01 times the area per node)") && !text.contains("cells of at least"),
        "{text}"
    );
    assert!(
        text.contains("if body1 is softer than body2") && text.contains("body1.near_field = \"auto\""),
        "{text}"
    );
    let base = ["frame.half_width=[3.5, 3.5]", "frame.cells=[35, 35]"];
    let (code, text) = call("check", place.path(), &base);
    let reason = "body1 does not allow the near field of a half-space: an edge or a support of the body is at a distance of 0.5 from the frame, but at least 1.05 is needed (0.3 times the smaller half-width of the frame); frame.half_width up to [3.07, 3.07] is allowed";
    assert!(code == Some(0) && text.contains(words) && text.contains(reason), "{text}");
    let (code, text) = call("check", place.path(), &["frame.half_width=[3.5, 3.5]", "frame.cells=[7, 7]"]);
    assert!(code == Some(0) && !text.contains("WARNING"), "{text}");
    // A half-width of 3.07 mm leaves 0.93 mm to the edge, and 0.3 x 3.07 = 0.921 mm are required.
    let (code, text) =
        call("check", place.path(), &["frame.half_width=[3.07, 3.07]", "frame.cells=[35, 35]"]);
    assert!(code == Some(0) && !text.contains(words), "{text}");
    // Cells of 0.097 mm on faces of 1 mm are refused by default, and allowed if the scene chooses the near field of the mesh.
    let finer = ["frame.half_width=[3.5, 3.5]", "frame.cells=[72, 72]"];
    let (code, text) = call("check", place.path(), &finer);
    assert!(
        code == Some(2)
            && text.contains("error: body1.near_field: the cells of the frame are far smaller")
            && text.contains("half_width up to [3.07, 3.07]")
            && text.contains("cells = [7, 7] or fewer"),
        "{text}"
    );
    let (code, text) = call("check", place.path(), &[&finer[..], &["body1.near_field=\"mesh\""]].concat());
    assert!(code == Some(0) && text.contains(words), "{text}");
    let (code, text) = call("check", place.path(), &[&base[..], &["body2={kind=\"rigid\"}"]].concat());
    assert!(
        code == Some(2) && text.contains("tractions are not determined") && text.contains(reason),
        "{text}"
    );
}

/// Truth: geometry: the frame of half-width 1.35 mm is 0.95 mm from the edge of the block. The enlarged frame of half-width 2.025
/// mm is 0.275 mm from this edge, less than 0.3 of its half-width.
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
            && warnings.contains("is at a distance of 0.275 from the frame"),
        "{warnings}"
    );
    assert!(!warnings.contains("tractions are not determined"), "{warnings}");
}

/// Truth: a run with the final frame from the start gives the same results, to 1e-3.
#[test]
fn frames_grow_under_own_loads() {
    let place = place([4.0, 4.0], 4.0, [8, 8, 8]);
    let wears = |half_width: f64, cells: usize| {
        let (half, cells) = (
            format!("frame.half_width=[{half_width}, {half_width}]"),
            format!("frame.cells=[{cells}, {cells}]"),
        );
        let sets = [
            "body2={kind=\"rigid\"}",
            &half,
            &cells,
            "gap.radius=100.0",
            "wear={law=\"archard\", i=1e-8}",
            "body1.body_force=[0.0, 0.0, -0.1]",
            "body1.pressure=[{ group = \"x\", value = 50.0 }]",
            "steps.0={name=\"press\", normal_force=4000.0, wear=false}",
            "steps.1={name=\"slide\", sliding={distance=3000.0, jumps=10}}",
            "solver.tolerance=1e-8",
        ];
        run(place.path(), &sets)
    };
    let (grown, large) = (wears(1.35, 24), wears(2.7, 48));
    assert_eq!(grown["frame"]["cells"], serde_json::json!([48, 48]));
    let last = |summary: &Value, key: &str| {
        summary["steps"].as_array().unwrap().last().unwrap()[key].as_f64().unwrap()
    };
    for key in ["approach", "worn_volume", "contact_area"] {
        let (grown, large) = (last(&grown, key), last(&large, key));
        assert!((grown / large - 1.0).abs() < 1e-3, "{key}: {grown} {large}");
    }
}

/// Truth: linearity. Loads of a body displace its surface. This displacement and its estimated error are proportional to the
/// loads. A large error gives a warning, both with a prescribed approach and with a prescribed force.
#[test]
fn surfaces_that_loads_move() {
    let place = place([3.0, 3.0], 3.0, [6, 6, 6]);
    let with = |pressure: f64| {
        let pressure = format!("body1.pressure=[{{ group = \"x\", value = {pressure} }}]");
        run(place.path(), &[&pressure])
    };
    let words = "displace its surface under the frame with an estimated error";
    let error = |summary: &Value| summary["near_fields"][0]["own_error"]["mean"].as_f64().unwrap();
    let (slight, strong) = (with(20.0), with(20_000.0));
    assert!((error(&strong) / error(&slight) - 1000.0).abs() < 1.0, "{} {}", error(&strong), error(&slight));
    assert!(warning(&slight, words).is_none());
    assert!(
        warning(&strong, words).is_some_and(|text| text.contains("body1") && text.contains("second order"))
    );
    let pressed = [
        "body1.pressure=[{ group = \"x\", value = 20000.0 }]",
        "steps=[{ name = \"press\", normal_force = 100.0 }]",
    ];
    assert!(warning(&run(place.path(), &pressed), words).is_some());
    let none = run(place.path(), &[]);
    assert!(none["near_fields"][0]["own_error"].is_null() && warning(&none, words).is_none());
}
