//! Mesh frames with one cell per node (cells of nodes).

use std::collections::HashMap;

use super::bricks::{Brick, straight, wavy};
use orthowear::frame::{ContactFrame, FaceMap, Side};
use orthowear::mesh::Mesh;
use orthowear::mesh::faces::group_faces;

/// Frame with a cell at each node of a group of body 1.
pub fn nodal_frame(mesh: &Mesh, group: &str) -> ContactFrame {
    ContactFrame::from_nodes(mesh, group, Side::Lower, [0.0; 2], 0.0, &HashMap::new()).unwrap()
}

fn mesh(distorted: bool, tetrahedra: bool) -> Mesh {
    let distortion = if distorted { wavy } else { straight };
    Brick {
        width: [2.0, 1.5],
        z: [-1.0, 0.0],
        cells: [6, 5, 1],
        contact_on_top: true,
        distortion,
        tetrahedra,
    }
    .mesh()
}

fn map(mesh: &Mesh, frame: &ContactFrame) -> FaceMap {
    let faces = group_faces(mesh, "contact").expect("a contact group");
    FaceMap::new(frame, mesh, &faces, Side::Lower).expect("a covered frame")
}

/// Truth: the cells of nodes tile the plane contact face of 4 mm x 3 mm. The cells of border nodes are the edge cells of the
/// frame. The tolerance 1e-12 covers rounding.
#[test]
fn cells_tile_the_faces() {
    for (distorted, tetrahedra) in [(false, false), (true, false), (true, true)] {
        let mesh = mesh(distorted, tetrahedra);
        let frame = nodal_frame(&mesh, "contact");
        assert_eq!(frame.n_cells(), 7 * 6);
        assert!((frame.areas.iter().sum::<f64>() / 12.0 - 1.0).abs() < 1e-12);
        assert_eq!(frame.edge_cells().iter().filter(|&&rim| rim).count(), 2 * (6 + 5));
        let moment: f64 = frame.areas.iter().zip(&frame.centers).map(|(area, x)| area * x.x).sum();
        assert!(moment.abs() < 1e-11, "centroid of the cells: {moment:e}");
    }
}

/// Truth: the forces on nodes due to alternating tractions of cells. The shape function of a node decreases linearly to its
/// neighbours. In each direction of a regular mesh, the weights of a cell are 6/8 for its own node and 1/8 for each of the two
/// neighbours.
///
/// With tractions that alternate from node to node, the force on an inner node is (6/8 - 2/8)² = 1/4 of traction times area. With
/// tractions that alternate from face to face, the force is zero. The tolerance 1e-13 covers rounding.
#[test]
fn a_checkerboard_of_nodal_cells_is_felt() {
    let mesh = mesh(false, false);
    let area = (4.0 / 6.0) * (3.0 / 5.0);
    for (frame, share) in [
        (nodal_frame(&mesh, "contact"), 0.25),
        (ContactFrame::from_faces(&mesh, "contact", Side::Lower, [0.0; 2], 0.0).unwrap(), 0.0),
    ] {
        let index = |x: f64, side: f64| (2.0 * x / side).round() as i64;
        // In coordinates divided by half an element side, nodes have even numbers and centres of faces odd numbers.
        let sign = |cell: usize| {
            let x = &frame.centers[cell];
            let [i, j] = [index(x.x + 2.0, 4.0 / 6.0), index(x.y + 1.5, 3.0 / 5.0)];
            if (i.div_euclid(2) + j.div_euclid(2)) % 2 == 0 { 1.0 } else { -1.0 }
        };
        let map = map(&mesh, &frame);
        let mut forces = vec![0.0; map.nodes().len()];
        map.integrate_to_nodes(&(0..frame.n_cells()).map(sign).collect::<Vec<f64>>(), &mut forces);
        let mut inner = 0;
        for (force, &node) in forces.iter().zip(map.nodes()) {
            let [x, y, _] = mesh.points[node];
            // The cells of border nodes are only halves, so nodes next to the border are left out.
            if x.abs() < 1.2 && y.abs() < 0.6 {
                assert!((force.abs() - share * area).abs() < 1e-13, "{force:e} for {share}");
                inner += 1;
            }
        }
        assert!(inner >= 6);
    }
}
