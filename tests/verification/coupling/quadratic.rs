//! Contact faces of order 2: the map from their nodes to the cells.

use super::bricks::{Brick, wavy};
use super::grids::{boxes, full, growing, raise, serendipity, steps};
use nalgebra::Vector3;
use orthowear::element::{ElementKind, Quad8, Quad9, ShapeFunctions, Tri6};
use orthowear::frame::{ContactFrame, FaceMap, Side};
use orthowear::mesh::Mesh;
use orthowear::mesh::faces::group_faces;
use orthowear::quadrature::gauss_legendre;

fn brick(tetrahedra: bool) -> Mesh {
    let cells = [5, 4, 1];
    let z = [-1.0, 0.0];
    Brick { width: [2.0, 1.5], z, cells, contact_on_top: true, distortion: wavy, tetrahedra }.mesh()
}

/// Integrals of the shape functions over all contact faces, exact on straight faces. Gauss points of a square are mapped to
/// triangles by Duffy's transformation.
fn nodal_areas(mesh: &Mesh) -> Vec<f64> {
    fn add<S: ShapeFunctions<N, 2>, const N: usize>(
        mesh: &Mesh,
        nodes: &[usize],
        areas: &mut [f64],
        xi: [f64; 2],
        weight: f64,
    ) {
        let mut tangents = [Vector3::zeros(); 2];
        for (node, gradient) in nodes.iter().zip(S::gradients(xi)) {
            (0..2).for_each(|k| tangents[k] += gradient[k] * Vector3::from(mesh.points[*node]));
        }
        let jacobian = tangents[0].cross(&tangents[1]).norm();
        nodes.iter().zip(S::values(xi)).for_each(|(&node, n)| areas[node] += n * jacobian * weight);
    }
    let mut areas = vec![0.0; mesh.points.len()];
    for face in group_faces(mesh, "contact").expect("a contact group") {
        for (s, a) in gauss_legendre(5) {
            for (t, b) in gauss_legendre(5) {
                let (x, y) = (0.5 * (1.0 + s), 0.5 * (1.0 + t));
                match face.kind {
                    ElementKind::Tri6 => {
                        add::<Tri6, 6>(
                            mesh,
                            &face.nodes,
                            &mut areas,
                            [x, y * (1.0 - x)],
                            0.25 * a * b * (1.0 - x),
                        );
                    }
                    ElementKind::Quad8 => add::<Quad8, 8>(mesh, &face.nodes, &mut areas, [s, t], a * b),
                    _ => add::<Quad9, 9>(mesh, &face.nodes, &mut areas, [s, t], a * b),
                }
            }
        }
    }
    areas
}

fn map(mesh: &Mesh, frame: &ContactFrame) -> FaceMap {
    let faces = group_faces(mesh, "contact").expect("a contact group");
    FaceMap::new(frame, mesh, &faces, Side::Lower).expect("a covered frame")
}

/// Truth: if the cells tile the contact face, sum_I A_I m_Ij = int N_j dS for every node j (docs/theory-coupling.md). A_I is the
/// area of cell I, and m_Ij is the mean of the shape function N_j over the cell. The integrals are negative at the corners of quad8
/// and zero at the corners of tri6. The tolerance is 1e-12 of the area of the face (rounding).
#[test]
fn weights_sum_to_the_consistent_loads() {
    let meshes =
        [raise(&brick(true), serendipity), raise(&brick(false), serendipity), raise(&brick(false), full)];
    for mesh in meshes {
        let expected = nodal_areas(&mesh);
        let grid = |cells| ContactFrame::grid([2.0, 1.5], cells, [0.0, 0.0], 0.0).unwrap();
        let faces = ContactFrame::from_faces(&mesh, "contact", Side::Lower, [0.0; 2], 0.3).unwrap();
        for frame in [grid([7, 9]), grid([1, 1]), grid([23, 14]), faces] {
            let map = map(&mesh, &frame);
            let mut sums = vec![0.0; map.nodes().len()];
            map.integrate_to_nodes(&vec![1.0; frame.n_cells()], &mut sums);
            for (sum, &node) in sums.iter().zip(map.nodes()) {
                assert!((sum - expected[node]).abs() < 1e-12 * 12.0, "{sum} {}", expected[node]);
            }
        }
        let least = expected.iter().copied().fold(0.0, f64::min);
        let serendipity = mesh.blocks.iter().any(|block| block.kind == ElementKind::Quad8);
        assert_eq!(least < -0.01, serendipity, "{least}");
    }
}

/// Truth: faces of order 2 reproduce quadratic fields, if they are straight parallelograms or triangles. The average of a field
/// over an a x b rectangle is its value at the centre plus (a² ∂²/∂x² + b² ∂²/∂y²) / 24 of the field. The tolerance 1e-13 covers
/// rounding.
#[test]
fn averages_reproduce_quadratic_fields() {
    let field = |x: f64, y: f64| 0.3 + 1.7 * x - 0.6 * y + 0.4 * x * x - 0.9 * x * y + 0.2 * y * y;
    let straight = |tetrahedra| {
        let distortion = super::bricks::straight;
        Brick {
            width: [2.0, 1.5],
            z: [-1.0, 0.0],
            cells: [5, 4, 1],
            contact_on_top: true,
            distortion,
            tetrahedra,
        }
        .mesh()
    };
    for mesh in [
        raise(&straight(true), serendipity),
        raise(&straight(false), serendipity),
        raise(&straight(false), full),
    ] {
        let frame = ContactFrame::grid([0.9, 0.8], [6, 5], [0.3, -0.2], 0.0).unwrap();
        let map = map(&mesh, &frame);
        let nodal: Vec<f64> =
            map.nodes().iter().map(|&node| field(mesh.points[node][0], mesh.points[node][1])).collect();
        let mut cells = vec![0.0; frame.n_cells()];
        map.average(&nodal, &mut cells);
        for (value, center) in cells.iter().zip(&frame.centers) {
            let [a, b] = [1.8 / 6.0, 1.6 / 5.0];
            let mean = field(center.x, center.y) + 0.4 * a * a / 12.0 + 0.2 * b * b / 12.0;
            assert!((value - mean).abs() < 1e-13, "{value} {mean}");
        }
    }
}

/// A block whose lower side follows a sphere of radius 50 mm. The lower side has `n` x `n` faces. `raised` returns the kind of
/// the elements.
fn cap(n: usize, raised: fn(ElementKind) -> ElementKind) -> Mesh {
    let across = steps(-1.5, 1.5, n);
    let axes = [across.clone(), across, growing(0.0, 2.0, 1.0, 2)];
    let sphere = |[x, y]: [f64; 2]| 50.0 - (2500.0 - x * x - y * y).sqrt();
    let mut mesh = raise(&boxes(&axes, false, |x| x), raised);
    for x in &mut mesh.points {
        let foot = sphere([x[0], x[1]]);
        x[2] = foot + x[2] * (1.0 - foot / 2.0);
    }
    mesh
}

/// Truth: the mean height of a sphere over a cell. The error decreases with the second power of the face size for faces of order
/// 1, and with the fourth power for faces of order 2. Half the face size thus divides the error of quad9 by about 16. The bound
/// is only 12, because cells and faces do not match. In addition, quad8 has no term x² y², which is also of fourth order.
#[test]
fn gaps_of_curved_faces() {
    let frame = ContactFrame::grid([1.1; 2], [9; 2], [0.0; 2], 0.3).unwrap();
    let error = |n: usize, raised: fn(ElementKind) -> ElementKind| {
        let mesh = cap(n, raised);
        let faces = group_faces(&mesh, "low2").unwrap();
        let heights = FaceMap::new(&frame, &mesh, &faces, Side::Upper).unwrap().mean_heights(&frame, &mesh);
        let mut worst: f64 = 0.0;
        for (cell, height) in heights.iter().enumerate() {
            let mut mean = 0.0;
            for (s, a) in gauss_legendre(8) {
                for (t, b) in gauss_legendre(8) {
                    let side = frame.areas[cell].sqrt();
                    let x = frame.centers[cell]
                        + frame.triads[cell].to_global(&Vector3::new(0.5 * side * s, 0.5 * side * t, 0.0));
                    mean += 0.25 * a * b * (50.0 - (2500.0 - x.x * x.x - x.y * x.y).sqrt());
                }
            }
            worst = worst.max((height - mean).abs());
        }
        worst
    };
    for raised in [serendipity as fn(ElementKind) -> ElementKind, full] {
        let (coarse, fine) = (error(4, raised), error(8, raised));
        assert!(coarse / fine > 12.0 && fine < 1e-7, "{coarse:e} {fine:e}");
    }
    let (linear, quadratic) = (error(4, |kind| kind), error(4, full));
    assert!(linear > 100.0 * quadratic, "{linear:e} {quadratic:e}");
}

/// Truth: cells are polygons through all corner and middle nodes of a face. They tile the faces even if edges are bent in their
/// plane. The rows of the map sum to 1 up to rounding (1e-13), so nodal forces balance cell forces. The rows reproduce linear
/// fields up to an error of the order bend² / face size.
#[test]
fn faces_with_bent_edges() {
    let mut mesh = raise(&brick(false), serendipity);
    let faces = group_faces(&mesh, "contact").unwrap();
    let outline = |x: [f64; 3]| x[0].abs() > 1.999 || x[1].abs() > 1.499;
    for node in
        faces.iter().flat_map(|face| face.nodes[4..].to_vec()).collect::<std::collections::BTreeSet<usize>>()
    {
        let x = mesh.points[node];
        if !outline(x) {
            mesh.points[node][0] += 0.02 * (7.0 * x[1]).sin();
            mesh.points[node][1] += 0.02 * (5.0 * x[0]).cos();
        }
    }
    let frame = ContactFrame::from_faces(&mesh, "contact", Side::Lower, [0.0; 2], 0.0).unwrap();
    assert!((frame.areas.iter().sum::<f64>() - 12.0).abs() < 1e-13);
    assert!(frame.all_corners().any(|corners| corners.len() == 8));
    assert_eq!(frame.edge_cells().iter().filter(|rim| !**rim).count(), 6);
    let map = map(&mesh, &frame);
    let ones = vec![1.0; map.nodes().len()];
    let mut means = vec![0.0; frame.n_cells()];
    map.average(&ones, &mut means);
    assert!(means.iter().all(|mean| (mean - 1.0).abs() < 1e-13));
    for cell in 0..frame.n_cells() {
        assert_eq!(map.row(cell).count(), 8);
    }
    let x: Vec<f64> = map.nodes().iter().map(|&node| mesh.points[node][0]).collect();
    map.average(&x, &mut means);
    for (mean, center) in means.iter().zip(&frame.centers) {
        // The tolerance is 4 bend² / h with the bend of 0.02 mm. The length h = 0.5 mm is below the shortest side of a face.
        assert!((mean - center.x).abs() < 0.02 * 0.02 / 0.5 * 4.0, "{mean} {}", center.x);
    }
}
