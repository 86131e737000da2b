//! Maps between frame cells and face nodes (docs/theory-coupling.md).

use super::bricks::{Brick, straight, wavy};
use orthowear::element::ElementKind;
use orthowear::frame::{ContactFrame, FaceMap, Side};
use orthowear::mesh::Mesh;
use orthowear::mesh::faces::group_faces;

fn brick(distorted: bool, tetrahedra: bool) -> Mesh {
    let distortion = if distorted { wavy } else { straight };
    let cells = [5, 4, 1];
    Brick { width: [2.0, 1.5], z: [-1.0, 0.0], cells, contact_on_top: true, distortion, tetrahedra }.mesh()
}

/// Integrals of the shape functions N_j over all faces. On quadrangles 2 x 2 Gauss points are exact, because N_j times the
/// Jacobian has degree 2 in each coordinate.
fn nodal_areas(mesh: &Mesh) -> Vec<f64> {
    let mut areas = vec![0.0; mesh.points.len()];
    let at = |node: usize| nalgebra::Vector3::from(mesh.points[node]);
    for face in group_faces(mesh, "contact").expect("a contact group") {
        let x: Vec<_> = face.nodes.iter().map(|&node| at(node)).collect();
        if face.kind == ElementKind::Tri3 {
            let area = 0.5 * (x[1] - x[0]).cross(&(x[2] - x[0])).norm();
            face.nodes.iter().for_each(|&node| areas[node] += area / 3.0);
            continue;
        }
        let g = 1.0 / 3f64.sqrt();
        for [s, t] in [[-g, -g], [g, -g], [g, g], [-g, g]] {
            let dx = 0.25 * ((1.0 - t) * (x[1] - x[0]) + (1.0 + t) * (x[2] - x[3]));
            let dy = 0.25 * ((1.0 - s) * (x[3] - x[0]) + (1.0 + s) * (x[2] - x[1]));
            let jacobian = dx.cross(&dy).norm();
            for (&node, [a, b]) in face.nodes.iter().zip([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
            {
                areas[node] += 0.25 * (1.0 + a * s) * (1.0 + b * t) * jacobian;
            }
        }
    }
    areas
}

fn map(mesh: &Mesh, frame: &ContactFrame) -> FaceMap {
    let faces = group_faces(mesh, "contact").expect("a contact group");
    FaceMap::new(frame, mesh, &faces, Side::Lower).expect("a covered frame")
}

/// Truth: if the cells tile the contact face, sum_I A_I I_Ij = int N_j dS for every node j (docs/theory-coupling.md). A_I is the
/// area of cell I, and I_Ij is the mean of the shape function N_j over the cell. The tolerance is 1e-12 of the area of the face
/// (rounding).
#[test]
fn weights_sum_to_the_integrals_of_the_shape_functions() {
    for (distorted, tetrahedra) in [(false, false), (true, false), (true, true)] {
        let mesh = brick(distorted, tetrahedra);
        let expected = nodal_areas(&mesh);
        for cells in [[7, 9], [1, 1], [10, 4], [40, 33]] {
            let frame = ContactFrame::grid([2.0, 1.5], cells, [0.0, 0.0], 0.0).unwrap();
            let map = map(&mesh, &frame);
            let mut sums = vec![0.0; map.nodes().len()];
            map.integrate_to_nodes(&vec![1.0; frame.n_cells()], &mut sums);
            for (sum, &node) in sums.iter().zip(map.nodes()) {
                assert!((sum - expected[node]).abs() < 1e-12 * 12.0, "{sum} {}", expected[node]);
            }
            assert_eq!(map.nodes().len(), 30);
        }
    }
}

/// Truth: the cell average of a linear field is its value at the centre of the cell. The tolerance 1e-13 covers rounding.
#[test]
fn averages_reproduce_linear_fields() {
    let mesh = brick(true, false);
    let frame = ContactFrame::grid([0.9, 0.8], [6, 5], [0.3, -0.2], 0.5).unwrap();
    let map = map(&mesh, &frame);
    let field = |x: &[f64]| 0.3 + 1.7 * x[0] - 0.6 * x[1];
    let nodal: Vec<f64> = map.nodes().iter().map(|&node| field(&mesh.points[node])).collect();
    let mut cells = vec![0.0; 30];
    map.average(&nodal, &mut cells);
    for (value, center) in cells.iter().zip(&frame.centers) {
        assert!((value - field(center.as_slice())).abs() < 1e-13);
    }
}

/// Truth: on a frame whose cells are the faces, each row of the map is the average over its face. The weights are 1/4 on
/// rectangles.
#[test]
fn faces_as_cells() {
    let mesh = brick(false, false);
    let frame = ContactFrame::from_faces(&mesh, "contact", Side::Lower, [0.0, 0.0], 0.0).unwrap();
    assert!((frame.areas.iter().sum::<f64>() - 12.0).abs() < 1e-13);
    let map = map(&mesh, &frame);
    for cell in 0..frame.n_cells() {
        let row: Vec<f64> = map.row(cell).map(|entry| entry.1).collect();
        assert!(row.len() == 4 && row.iter().all(|w| (w - 0.25).abs() < 1e-14), "{row:?}");
    }
    assert!(frame.triads.iter().all(|triad| triad.normal() == nalgebra::Vector3::z()));
    assert_eq!(frame.edge_cells().iter().filter(|rim| !**rim).count(), 6);
}

/// Truth: equilibrium. The nodal forces have the same resultant and the same moment as the cell tractions. The tolerance 1e-12
/// covers rounding.
#[test]
fn forces_and_moments_are_kept() {
    let mesh = brick(true, false);
    let frame = ContactFrame::grid([0.9, 0.8], [6, 5], [0.3, -0.2], 0.5).unwrap();
    let map = map(&mesh, &frame);
    let n = frame.n_cells();
    let tractions: Vec<f64> = (0..3 * n).map(|i| (i as f64 * 1.3).sin()).collect();
    let mut forces = vec![0.0; 3 * map.nodes().len()];
    map.apply_transpose(&tractions, &mut forces);
    let (mut force, mut moment) = (nalgebra::Vector3::zeros(), nalgebra::Vector3::zeros());
    for (f, &node) in forces.chunks_exact(3).zip(map.nodes()) {
        let f = nalgebra::Vector3::from_row_slice(f);
        force += f;
        moment += nalgebra::Vector3::from(mesh.points[node]).cross(&f);
    }
    for cell in 0..n {
        let local = nalgebra::Vector3::new(tractions[cell], tractions[n + cell], tractions[2 * n + cell]);
        let f = frame.triads[cell].to_global(&local) * frame.areas[cell];
        force -= f;
        moment -= frame.centers[cell].cross(&f);
    }
    assert!(force.amax() < 1e-12 && moment.amax() < 1e-12, "{force} {moment}");
}

/// Truth: cells that extend beyond the edge of the faces are refused. Faces that point away from the frame cover 0 % of a cell.
#[test]
fn a_cell_over_the_edge_is_refused() {
    let mesh = brick(false, false);
    let faces = group_faces(&mesh, "contact").unwrap();
    let frame = ContactFrame::grid([1.0, 1.0], [4, 4], [1.2, 0.0], 0.0).unwrap();
    let error = FaceMap::new(&frame, &mesh, &faces, Side::Lower).unwrap_err();
    for word in ["cell 12 (ix = 3, iy = 0)", "60.0000 %", "4 of the 16 cells", "use a smaller frame"] {
        assert!(error.message().contains(word), "{error}");
    }
    let turned_away = FaceMap::new(&frame, &mesh, &faces, Side::Upper).unwrap_err();
    assert!(turned_away.message().contains("0.0000 %"), "{turned_away}");
}
