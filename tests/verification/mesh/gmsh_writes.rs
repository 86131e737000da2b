//! Files that gmsh writes, in both versions and both file types.

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::fs;
use std::process::Command;

use approx::assert_relative_eq;

use orthowear::mesh::faces::{group_faces, outer_faces};
use orthowear::mesh::quality::check;
use orthowear::mesh::{Mesh, gmsh};

use super::tools;

/// Numbers of cells of each kind, of cells of each group, and of points.
pub fn counts(mesh: &Mesh) -> BTreeMap<String, usize> {
    let kinds = mesh.blocks.iter().map(|b| (b.kind.name().to_string(), b.n_cells()));
    let groups = mesh.groups.iter().map(|g| (format!("{} of dimension {}", g.name, g.dim), g.cells.len()));
    kinds.chain(groups).chain([("points".to_string(), mesh.n_points())]).collect()
}

/// Asserts that each group has the same points in both meshes, to 1e-12 mm. Text of 16 digits changes a coordinate of 12 mm by
/// 1e-15 mm.
pub fn assert_same_group_points(a: &Mesh, b: &Mesh) {
    for group in &a.groups {
        let points = |mesh: &Mesh| -> Vec<[f64; 3]> {
            let group = mesh.group_of_dim(&group.name, group.dim).expect("the same groups");
            let nodes: BTreeSet<usize> =
                group.cells.iter().flat_map(|&c| mesh.cell_nodes(c)).copied().collect();
            nodes.into_iter().map(|n| mesh.points[n]).collect()
        };
        let (of_a, of_b) = (points(a), points(b));
        assert_eq!(of_a.len(), of_b.len(), "{} against {}: {}", a.source, b.source, group.name);
        let slot = |x: [f64; 3], shift: [i64; 3]| [0, 1, 2].map(|k| (x[k] * 1e4).floor() as i64 + shift[k]);
        let mut slots = HashMap::<[i64; 3], Vec<[f64; 3]>>::new();
        of_b.iter().for_each(|&x| slots.entry(slot(x, [0; 3])).or_default().push(x));
        let around = || (0..27).map(|i| [i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1]);
        for x in of_a {
            let mut near = around().filter_map(|shift| slots.get(&slot(x, shift))).flatten();
            let met = near.any(|y| (0..3).all(|k| (x[k] - y[k]).abs() <= 1e-12));
            assert!(met, "{} against {}: {}, {x:?}", a.source, b.source, group.name);
        }
    }
}

const BLOCK: &str = r#"
Point(1) = {0, 0, 0, 0.6}; Point(9) = {5, 5, 5, 1}; Point(2) = {1, 0, 0};
Line(1) = {1, 2}; Transfinite Curve{1} = 3;
face[] = Extrude{0, 1, 0}{Curve{1}; Layers{2}; Recombine;};
body[] = Extrude{0, 0, -1}{Surface{face[1]}; Layers{2}; Recombine;};
Physical Surface("contact face", 7) = {body[0]};
Physical Surface("both", 8) = {body[0], face[1]};
Physical Volume("block", 3) = {body[1]};
Physical Curve(77) = {1};
Physical Point("p", 5) = {1};
"#;

/// Truth: counts by hand. A unit cube of 2 x 2 x 2 elements has 27 points (order 2: 125), 8 solids and 4 faces in "contact face".
/// The group "both" has 8 faces, and the unnamed group 77 has 2 lines. The point at (5, 5, 5) is in no element and is not
/// counted.
#[test]
fn every_format_that_gmsh_writes_gives_the_same_mesh() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    fs::write(dir.path().join("block.geo"), BLOCK).expect("a written file");
    for order in ["1", "2"] {
        for format in ["msh22", "msh41"] {
            for extra in [&[][..], &["-bin"], &["-save_parametric"], &["-bin", "-save_parametric"]] {
                let out = format!("{order}{format}{}.msh", extra.concat());
                let mut arguments = vec!["-3", "block.geo", "-order", order, "-format", format, "-o", &out];
                arguments.extend(extra);
                if !tools::gmsh(&arguments, dir.path()) {
                    return;
                }
                let mesh = gmsh::read(&dir.path().join(&out)).unwrap_or_else(|e| panic!("{out}: {e}"));
                assert_eq!(mesh.n_points(), if order == "1" { 27 } else { 125 }, "{out}");
                assert_eq!(mesh.volume_cells().count(), 8, "{out}");
                let group = |name| mesh.group(name).expect("the group").cells.len();
                assert_eq!(
                    [group("contact face"), group("both"), group("77"), group("p")],
                    [4, 8, 2, 1],
                    "{out}"
                );
                assert_eq!(group("block"), 8, "{out}");
                let faces = group_faces(&mesh, "contact face").expect("outer faces");
                assert!(faces.iter().flat_map(|f| &f.nodes).all(|&n| mesh.points[n][2] == -1.0), "{out}");
            }
        }
    }
}

/// Truth: the meshes that the installed gmsh makes from the .geo scripts, in each format.
#[test]
fn committed_meshes_are_what_the_scripts_make() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let meshes = tools::root().join("meshes");
    if !tools::gmsh(&["-version"], dir.path()) {
        return;
    }
    tools::run(Command::new(tools::root().join("scripts/meshes")).arg(dir.path()));
    for name in ["cfrp-block.msh", "cfrp-block-coarse.msh", "steel-cap.msh"] {
        let committed = gmsh::read(&meshes.join(name)).expect("a committed mesh");
        let made = gmsh::read(&dir.path().join(name)).expect("a fresh mesh");
        assert_eq!(counts(&committed), counts(&made), "{name}: run scripts/meshes");
        assert_same_group_points(&committed, &made);
        for arguments in [&["msh22"][..], &["msh41"], &["msh41", "-bin"]] {
            let out = format!("{}{name}", arguments.concat());
            let mut all = vec!["-save", name, "-o", &out, "-format"];
            all.extend(arguments);
            tools::gmsh(&all, dir.path());
            let other = gmsh::read(&dir.path().join(&out)).expect("a converted mesh");
            assert_eq!(counts(&committed), counts(&other), "{out}");
            assert_same_group_points(&committed, &other);
        }
    }
    let bytes: u64 = fs::read_dir(&meshes)
        .expect("the folder of meshes")
        .filter_map(|entry| entry.ok()?.metadata().ok())
        .map(|file| file.len())
        .sum();
    assert!(bytes <= 3_200_000, "{bytes} bytes in meshes/");
}

/// Truth: the dimensions in the scripts. The lower nodes of the cap lie on the sphere of radius R = 50 mm about (0, 0, 50), to
/// 1e-12 of R. The exact volume of the cap is 24² x 12 less ∬ (R - √(R² - x² - y²)) dx dy = 560.6 mm³. Plane faces of cells with
/// edges h <= 4.5 mm reduce the volume further. On average their height deviates by at most 2 h²/12R.
#[test]
fn committed_meshes_have_the_dimensions_they_should() {
    let read = |name: &str| gmsh::read(&tools::root().join("meshes").join(name)).expect("a committed mesh");
    for (name, across) in [("cfrp-block.msh", 28), ("cfrp-block-coarse.msh", 10)] {
        let mesh = read(name);
        let quality = check(&mesh).expect("a sound mesh");
        assert_relative_eq!(quality.volume, 24.0 * 24.0 * 12.0, max_relative = 1e-12);
        assert!(quality.coincident_points.is_empty());
        let contact = group_faces(&mesh, "contact").expect("outer faces");
        assert_eq!(contact.len(), across * across);
        let on_patch = |x: [f64; 3]| x[2] == 0.0 && x[0].abs() <= 1.5 + 1e-12 && x[1].abs() <= 1.5 + 1e-12;
        assert!(contact.iter().flat_map(|face| &face.nodes).all(|&node| on_patch(mesh.points[node])));
        assert!(mesh.group_nodes("base").expect("the group").iter().all(|&n| mesh.points[n][2] == -12.0));
        covers_the_skin(&mesh, &["contact", "top", "sides", "base"]);
    }
    let cap = read("steel-cap.msh");
    let quality = check(&cap).expect("a sound mesh");
    let below = simpson(|x| simpson(|y| 50.0 - (2500.0 - x * x - y * y).sqrt()));
    let cut_off = 24.0 * 24.0 * 12.0 - below - quality.volume;
    assert!(cut_off > 0.0 && cut_off < 24.0 * 24.0 * 2.0 * 4.5 * 4.5 / (12.0 * 50.0), "{cut_off}");
    for group in ["contact", "bottom"] {
        for node in cap.group_nodes(group).expect("the group") {
            let [x, y, z] = cap.points[node];
            assert_relative_eq!((x * x + y * y + (z - 50.0).powi(2)).sqrt(), 50.0, max_relative = 1e-12);
        }
    }
    assert!(cap.points.iter().any(|x| x.iter().all(|v| v.abs() < 1e-8)), "it touches z = 0 in a node");
    covers_the_skin(&cap, &["contact", "bottom", "sides", "top"]);
}

fn covers_the_skin(mesh: &Mesh, groups: &[&str]) {
    let covered: usize = groups.iter().map(|name| group_faces(mesh, name).expect("outer faces").len()).sum();
    assert_eq!(covered, outer_faces(mesh).len(), "{}", mesh.source);
}

/// Integral of `f` over [-12, 12] by Simpson's rule.
fn simpson(f: impl Fn(f64) -> f64) -> f64 {
    let n = 100;
    let h = 24.0 / n as f64;
    let weight = |i: usize| if i == 0 || i == n { 1.0 } else { 2.0 + 2.0 * (i % 2) as f64 };
    (0..=n).map(|i| weight(i) * f(-12.0 + h * i as f64)).sum::<f64>() * h / 3.0
}
