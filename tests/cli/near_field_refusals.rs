//! Bodies that do not allow the near field of a half-space. `near_field = "half-space"` is then refused, and the default is the
//! near field of the mesh.

use std::fs;
use std::path::Path;

use crate::near_field::{call, place, run};

/// Replaces each line of a section of block.msh by the result of `line`. Its arguments are the numbers and the text of the line.
fn rewrite(folder: &Path, section: &str, line: impl Fn(&[f64], &str) -> String) {
    let path = folder.join("block.msh");
    let text = fs::read_to_string(&path).unwrap();
    let (begin, end) = (format!("${section}\n"), format!("$End{section}"));
    let (head, rest) = text.split_once(&begin).unwrap();
    let (lines, rest) = rest.split_once(&end).unwrap();
    let changed = lines.lines().map(|old| {
        let numbers: Vec<f64> = old.split(' ').map(|number| number.parse().unwrap()).collect();
        line(&numbers, old) + "\n"
    });
    let changed: String = changed.collect();
    fs::write(path, format!("{head}{begin}{changed}{end}{rest}")).unwrap();
}

/// Moves the solids of the lowest `level` layers (of eight) into a volume group "core".
fn core(folder: &Path, level: usize) {
    rewrite(folder, "Elements", |numbers, old| {
        let is_core = numbers.get(1) == Some(&5.0) && (numbers[5] as usize - 1) % 9 < level;
        if is_core { old.replacen(" 5 2 5 5 ", " 5 2 6 6 ", 1) } else { old.to_owned() }
    });
    let path = folder.join("block.msh");
    let text = fs::read_to_string(&path).unwrap();
    let text = text.replacen("$PhysicalNames\n5\n", "$PhysicalNames\n6\n3 6 \"core\"\n", 1);
    fs::write(path, text).unwrap();
}

/// Requires that `near_field = "half-space"` is refused for the reason `why`, and that the default is the near field of the mesh.
fn refused(folder: &Path, sets: &[&str], why: &str) {
    let sets = [&["frame.cells=[4, 4]"], sets].concat();
    let asked = [&sets[..], &["body1.near_field=\"half-space\""]].concat();
    for verb in ["check", "run"] {
        let (code, text) = call(verb, folder, &asked);
        let words = format!("body1 does not allow the near field of a half-space: {why}");
        assert!(
            code == Some(2) && text.contains(&words) && text.contains("body1.near_field"),
            "{why}: {text}"
        );
    }
    let record = &run(folder, &sets)["near_fields"][0];
    assert_eq!(record["near_field"], "mesh", "{why}: {record}");
    assert!(record["reason"].as_str().unwrap().starts_with(why), "{why}: {record}");
}

fn block() -> tempfile::TempDir {
    place([4.0, 4.0], 4.0, [8, 8, 8])
}

/// Truth: the unchanged block allows the near field of a half-space. The other tests change this block.
#[test]
fn nothing_is_wrong_with_the_block() {
    assert_eq!(run(block().path(), &["frame.cells=[4, 4]"])["near_fields"][0]["near_field"], "half-space");
}

/// Truth: invariance. A body and its frame far from the origin give the same forces. At 3e5 mm the coordinates are rounded to
/// 6e-11 mm, far less than the cells of 0.3 mm.
#[test]
fn bodies_may_lie_far_from_the_origin() {
    let near = block();
    let far = block();
    rewrite(far.path(), "Nodes", |numbers, old| match numbers {
        [node, x, y, z] => format!("{node} {} {y} {z}", x + 3e5),
        _ => old.to_owned(),
    });
    let force = |folder: &Path, more: &[&str]| {
        let sets = [&["frame.cells=[8, 8]", "body1.near_field=\"mesh\""], more].concat();
        run(folder, &sets)["steps"][0]["normal_force"].as_f64().unwrap()
    };
    let (expected, found) = (force(near.path(), &[]), force(far.path(), &["frame.center=[3e5, 0.0]"]));
    assert!((found / expected - 1.0).abs() < 1e-6, "{found} {expected}");
}

/// Truth: docs/theory-hybrid.md, range of validity: the surface beside the contact must be free of tractions, so no foundation
/// may lie on it.
#[test]
fn a_foundation_in_the_plane_of_the_contact() {
    let springs = "body1.foundation=[{group=\"top\", stiffness=100.0}]";
    refused(block().path(), &[springs], "a foundation lies in the plane of the contact");
}

/// Truth: geometry. The core fills seven of eight layers, each 0.5 mm high, and ends 0.5 mm below the contact. A frame with a
/// half-width of 1.2 mm needs a distance of 0.48 mm. A frame with a half-width of 1.8 mm needs 0.72 mm.
#[test]
fn another_material_too_near() {
    let place = block();
    core(place.path(), 7);
    let brass = "body1.regions={core={material=\"brass\"}}";
    let near = run(place.path(), &["frame.cells=[4, 4]", brass]);
    assert_eq!(near["near_fields"][0]["near_field"], "half-space");
    refused(
        place.path(),
        &["frame.half_width=[1.8, 1.8]", brass],
        "another material is at a distance of 0.5 from the frame, but at least 0.72 is needed (0.4 times the smaller half-width of the frame)",
    );
}

/// Truth: docs/theory-hybrid.md: a half-space has no material above its plane, so the body must not extend above its contact
/// plane.
#[test]
fn a_body_that_rises_above_its_contact() {
    let place = block();
    rewrite(place.path(), "Nodes", |numbers, old| match numbers {
        [node, x, y, z] if *x == -4.0 && *z == 0.0 => format!("{node} {x} {y} 0.3"),
        _ => old.to_owned(),
    });
    refused(place.path(), &[], "the body extends above its contact plane");
}

/// Truth: docs/theory-hybrid.md: supports must lie on the boundary of the body.
#[test]
fn a_support_inside_the_body() {
    let place = block();
    core(place.path(), 2);
    refused(place.path(), &["body1.fixed=[{group=\"core\"}]"], "a support fixes nodes inside the body");
}

/// Truth: a mesh point that belongs to no solid element is no part of the body.
#[test]
fn a_lone_point_above_the_contact() {
    let place = block();
    let path = place.path().join("block.msh");
    let text = fs::read_to_string(&path).unwrap();
    let mut added = text.clone();
    for (section, line) in [("Nodes", "9001 0 0 5"), ("Elements", "9001 15 2 0 0 9001")] {
        let (head, rest) = added.split_once(&format!("${section}\n")).unwrap();
        let (count, lines) = rest.split_once('\n').unwrap();
        let count = count.parse::<usize>().unwrap() + 1;
        added = format!("{head}${section}\n{count}\n{line}\n{lines}");
    }
    fs::write(path, added).unwrap();
    let half_space = "body1.near_field=\"half-space\"";
    let summary = run(place.path(), &["frame.cells=[4, 4]", half_space]);
    assert_eq!(summary["near_fields"][0]["near_field"], "half-space", "{summary}");
}
