//! First touch of meshed surfaces. Lengths are in mm.

use super::grids::{boxes, full, growing, raise, serendipity, steps};
use super::nodes::nodal_frame;
use super::pairs::{Part, model, solved};
use crate::common::{indent, steel};
use orthowear::coupling::mesh_distance;
use orthowear::element::ElementKind;
use orthowear::frame::{ContactFrame, FaceMap, MeshedSurface, Side, first_touch};
use orthowear::geometry::Point;
use orthowear::laws::friction::FrictionLaw;
use orthowear::mesh::Mesh;
use orthowear::mesh::faces::{SurfaceFace, group_faces};

const RADIUS: f64 = 50.0;

/// Height at (x, y) of the lower half of a sphere of radius [`RADIUS`]. Its lowest point lies at `vertex`, at the height `lift`.
fn sphere([x, y]: [f64; 2], vertex: [f64; 2], lift: f64) -> f64 {
    let r2 = (x - vertex[0]).powi(2) + (y - vertex[1]).powi(2);
    lift + r2 / (RADIUS + (RADIUS * RADIUS - r2).sqrt())
}

/// A block over [-1.5, 1.5]^2 with a flat top at z = 2. Its lower side has `n` x `n` faces, whose nodes (x, y) lie at the height
/// z = `foot`([x, y]). `raised` maps hexahedra to the element kind of the mesh.
fn above(n: usize, raised: fn(ElementKind) -> ElementKind, foot: impl Fn([f64; 2]) -> f64) -> Mesh {
    let across = steps(-1.5, 1.5, n);
    let mut mesh = raise(&boxes(&[across.clone(), across, growing(0.0, 2.0, 1.0, 2)], false, |x| x), raised);
    for x in &mut mesh.points {
        let foot = foot([x[0], x[1]]);
        x[2] = foot + x[2] * (1.0 - foot / 2.0);
    }
    mesh
}

fn same(kind: ElementKind) -> ElementKind {
    kind
}

fn with_surface<T>(
    frame: &ContactFrame,
    (mesh, group, side): (&Mesh, &str, Side),
    then: impl FnOnce(&MeshedSurface) -> T,
) -> T {
    let faces: Vec<SurfaceFace> = group_faces(mesh, group).unwrap();
    let mean_heights = FaceMap::new(frame, mesh, &faces, side).unwrap().mean_heights(frame, mesh);
    let mesh = std::sync::Arc::new(mesh.clone());
    then(&MeshedSurface { mesh, faces, side, mean_heights, curved_gap: false })
}

fn touch_of(frame: &ContactFrame, mesh: &Mesh) -> f64 {
    with_surface(frame, (mesh, "low2", Side::Upper), |surface| first_touch(frame, [None, Some(surface)], 0.5))
}

/// Truth: a sphere first touches a plane at its vertex, for any position of the vertex among nodes and cells. Flat faces with
/// edges h lie up to 2 h^2 / 8R above a sphere of radius R. The curvature correction from neighbouring nodes reduces this error
/// to less than a 30th. The error of faces of order 2 is of fourth order in h, and less than a 2000th of 2 h^2 / 8R.
#[test]
fn a_sphere_touches_at_its_vertex() {
    for n in [10, 20] {
        let h = 3.0 / n as f64;
        for vertex in [[0.0; 2], [0.5 * h, 0.0], [0.5 * h; 2], [0.31 * h, -0.17 * h]] {
            for (center, cells) in [([0.0; 2], [12; 2]), ([0.05, -0.07], [7, 10])] {
                let frame = ContactFrame::grid([1.1; 2], cells, center, 0.2).unwrap();
                let chord = 2.0 * h * h / (8.0 * RADIUS);
                for (raised, part) in [(same as fn(_) -> _, 30.0), (serendipity, 2000.0), (full, 2000.0)] {
                    let mesh = above(n, raised, |x| sphere(x, vertex, 0.4));
                    let error = touch_of(&frame, &mesh) - 0.4;
                    assert!(error.abs() < chord / part, "{n} {vertex:?} {error:e} {chord:e}");
                }
            }
        }
    }
}

/// Truth: two roofs of plane faces touch where their ridges cross, one roof upside down. Before the motion, the ridges are 0.3 mm
/// apart at this point. A crease must get no curvature correction, so the distance is exact to rounding.
#[test]
fn two_ridges_touch_where_they_cross() {
    for slope in [0.05, 0.6] {
        let roof = above(10, same, |[x, _]| 0.3 + slope * x.abs());
        let uneven = |x: f64| x + 0.04 * (1.5 - x.abs()) * (2.1 * x + 0.4).cos() * x.signum().abs();
        let across = steps(-1.5, 1.5, 11).into_iter().map(uneven).collect();
        let axes = [across, steps(-1.5, 1.5, 10), steps(-2.0, 0.0, 2)];
        let ridge = boxes(&axes, false, |[x, y, z]| [x, y, z - slope * y.abs() * (1.0 + 0.5 * z)]);
        let frame = ContactFrame::grid([1.1; 2], [7; 2], [0.03, 0.05], 0.0).unwrap();
        let found = with_surface(&frame, (&ridge, "high2", Side::Lower), |lower| {
            with_surface(&frame, (&roof, "low2", Side::Upper), |upper| {
                first_touch(&frame, [Some(lower), Some(upper)], 0.5)
            })
        });
        assert!((found - 0.3).abs() < 1e-13, "{slope} {found}");
    }
}

/// Truth: a paraboloid first touches a plane at its vertex, for any position of the vertex in a cell. A single face of order 2
/// represents the paraboloid exactly. The cells belong to the nodes of an irregular mesh, and some cells are not convex. The
/// tolerance is 1e-9, because the search ends within 1e-5 of a cell's size and the height is quadratic in this distance.
#[test]
fn a_vertex_touches_within_any_cell_around_a_node() {
    let (n, h) = (6, 0.5);
    let axes = [steps(-1.5, 1.5, n), steps(-1.5, 1.5, n), steps(-2.0, 0.0, 2)];
    let scatter = |x: f64, y: f64| 0.27 * h * (91.0 * x + 57.0 * y + 1.0).sin();
    let inside = |x: f64| if x.abs() < 1.4 { 1.0 } else { 0.0 };
    let block = boxes(&axes, false, |[x, y, z]| {
        let moved = inside(x) * inside(y);
        [x + moved * scatter(x, y), y + moved * scatter(y, -x), z]
    });
    let frame = nodal_frame(&block, "high2");
    let places: Vec<Point> =
        frame.all_corners().flat_map(|corners| beside_notches(&corners, 0.02 * h * h)).collect();
    assert!(places.len() > 10, "{}", places.len());
    let foot = above(1, serendipity, |[x, y]| 0.3 + 0.15 * ((x - 0.75).powi(2) + (y - 0.75).powi(2)));
    with_surface(&frame, (&block, "high2", Side::Lower), |lower| {
        for place in &places {
            let mut vertex = foot.clone();
            for x in &mut vertex.points {
                (x[0], x[1]) = (4.0 * (x[0] - 0.75) + place.x, 4.0 * (x[1] - 0.75) + place.y);
            }
            let found = with_surface(&frame, (&vertex, "low2", Side::Upper), |upper| {
                first_touch(&frame, [Some(lower), Some(upper)], 0.5)
            });
            assert!((found - 0.3).abs() < 1e-9, "{place:?} {found}");
        }
    });
}

/// Points of a cell next to each of its reentrant corners. At a reentrant corner, the cross product of the two edges is below
/// -`least`.
fn beside_notches(corners: &[Point], least: f64) -> Vec<Point> {
    let m = corners.len();
    let edge = |i: usize| corners[(i + 1) % m] - corners[i % m];
    let notches = (0..m).filter(|&i| edge(i).cross(&edge(i + 1)).z < -least);
    notches.map(|i| corners[(i + 1) % m] + 0.3 * (edge(i) + edge(i + 1))).collect()
}

/// Truth: a flat foot with a bevelled edge touches with all of its flat part at once. The tolerance 1e-14 covers rounding.
#[test]
fn a_bevelled_foot_is_flat() {
    let frame = ContactFrame::grid([1.1; 2], [9; 2], [0.0; 2], 0.0).unwrap();
    let mesh = above(10, same, |[x, y]| 0.2 + 0.3 * (x.abs().max(y.abs()) - 0.9).max(0.0));
    let found = touch_of(&frame, &mesh);
    assert!((found - 0.2).abs() < 1e-14, "{found}");
    let gap = with_surface(&frame, (&mesh, "low2", Side::Upper), |upper| {
        mesh_distance(&frame, [None, Some(upper)]).unwrap().distance
    });
    assert!(gap.iter().all(|g| *g > -1e-14) && gap[40].abs() < 1e-14);
}

/// Truth: a cylinder, meshed by a row of faces one element wide, touches along its lowest line. Flat faces with edges h deviate
/// from a cylinder of radius R by h^2 / 8R. The error is below a 30th of this height.
#[test]
fn a_strip_of_a_cylinder() {
    for n in [14, 15] {
        let axes = [steps(-1.5, 1.5, n), vec![0.0, 0.2], vec![0.0, 1.0]];
        let mesh =
            boxes(&axes, false, |[x, y, z]| [x, y, sphere([x, 0.0], [0.0; 2], 0.1) * (1.0 - z) + 2.0 * z]);
        let frame = ContactFrame::grid([1.1, 0.1], [12, 1], [0.0, 0.1], 0.0).unwrap();
        let (found, h) = (touch_of(&frame, &mesh), 3.0 / n as f64);
        assert!((found - 0.1).abs() < h * h / (8.0 * RADIUS) / 30.0, "{n} {found}");
    }
}

/// Truth: the force on a sphere does not depend on the positions of its mesh nodes, to 2 % with four elements along the contact
/// radius. Without the curvature correction of first touch, the force would change by up to 6 %.
#[test]
fn the_force_does_not_depend_on_where_the_nodes_lie() {
    let material = steel();
    let force = |vertex: [f64; 2]| {
        let across = steps(-1.5, 1.5, 12);
        let down = growing(0.0, 2.0, 0.25, 4).into_iter().rev().map(|z| -z).collect();
        let block = boxes(&[across.clone(), across, down], false, |x| x);
        let cap = above(12, same, |x| sphere([x[0] - vertex[0], x[1] - vertex[1]], [0.0; 2], 0.0));
        let frame = nodal_frame(&block, "high2");
        let supports = [("low2", [true; 3])];
        let lower = Part { mesh: &block, contact: "high2", material: &material, supports: &supports };
        let supports = [("high2", [true; 3])];
        let upper = Part { mesh: &cap, contact: "low2", material: &material, supports: &supports };
        solved(&model([&lower, &upper], &frame, FrictionLaw::None), &[indent(0.02)]).records[0].normal_force
    };
    let on_a_node = force([0.0; 2]);
    for vertex in [[0.125, 0.0], [0.125; 2]] {
        let between = force(vertex);
        println!("{on_a_node} {between}");
        assert!((between / on_a_node - 1.0).abs() < 0.02, "{between} {on_a_node}");
    }
}
