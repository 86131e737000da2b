//! Curved contact faces under a plane frame: the mesh of a steel cap, a sphere of R = 50 mm that touches z = 0.

use super::bricks::{spec, support};
use super::random;
use crate::common::steel;
use nalgebra::Vector3;
use orthowear::body::{ElasticBody, FeBody, RigidBody};
use orthowear::coupling::surface_distance;
use orthowear::frame::{ContactFrame, GapShape, InitialGap, Side};
use orthowear::mesh::gmsh;

fn cap(frame: &ContactFrame) -> FeBody {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("meshes/steel-cap.msh");
    let mut spec = spec(gmsh::read(&path).expect("the committed mesh"), &steel());
    spec.supports = vec![support("top", [true; 3], [0.0; 3])];
    FeBody::new(spec, "contact", Side::Upper, frame).expect("a finite-element body")
}

/// Truth: the gap of a sphere, R - sqrt(R² - r²). Faces with edges of h = 0.19 mm lie inside the sphere, by h² / (6 R) on average
/// and by h² / (4 R) at most. The mean over a cell of width b = 0.2 mm adds b² / (12 R). The nodal forces have the same resultant
/// as the cell tractions, and the same moment about the normal. Other moments differ, because the gap changes the lever arms.
#[test]
fn the_gap_of_a_meshed_sphere() {
    let frame = ContactFrame::grid([1.2; 2], [12; 2], [0.0; 2], 0.2).unwrap();
    let body = cap(&frame);
    let mesh = InitialGap::from(GapShape::Mesh);
    let found = surface_distance(&mesh, &frame, &RigidBody, &body).unwrap();
    let sphere = InitialGap { exact: true, ..GapShape::Sphere { radius: 50.0 }.into() };
    let expected = sphere.evaluate(&frame).unwrap();
    let [h, side] = [0.1875f64, 0.2].map(|length| length * length / 50.0);
    for (f, e) in found.iter().zip(&expected) {
        assert!(f - e > side / 12.0 && f - e < h / 4.0 + side / 12.0, "{f} {e}");
    }
    let mean = found.iter().zip(&expected).map(|(f, e)| f - e).sum::<f64>() / 144.0;
    assert!((mean / (h / 6.0 + side / 12.0) - 1.0).abs() < 0.05, "{mean}");
    let tractions = random(3 * frame.n_cells());
    let n = frame.n_cells();
    let (mut force, mut spin) = (Vector3::zeros(), 0.0);
    for (f, &node) in body.contact_forces(&tractions).chunks_exact(3).zip(body.map().nodes()) {
        let (f, x) =
            (Vector3::from_row_slice(f), Vector3::from(body.condensed().model().mesh().points[node]));
        force += f;
        spin += x.cross(&f).z;
    }
    for cell in 0..n {
        let local = Vector3::new(tractions[cell], tractions[n + cell], tractions[2 * n + cell]);
        let f = frame.triads[cell].to_global(&local) * frame.areas[cell];
        force -= f;
        spin -= frame.centers[cell].cross(&f).z;
    }
    assert!(force.amax() < 1e-12 && spin.abs() < 1e-12, "{force} {spin}");
    assert!(body.surface().is_some());
}

/// Truth: the weights in each row of the map sum to one, because the row is an average over a face. The tilts of the normals
/// agree with the sphere to 1e-3, and so does the gap between the mesh and the plane z = 0.
#[test]
fn a_frame_of_curved_faces() {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("meshes/steel-cap.msh");
    let mesh = gmsh::read(&path).expect("the committed mesh");
    let frame = ContactFrame::from_faces(&mesh, "contact", Side::Upper, [0.0; 2], 0.0).unwrap();
    let body = cap(&frame);
    assert_eq!(frame.n_cells(), 256);
    for cell in 0..256 {
        let row: Vec<f64> = body.map().row(cell).map(|entry| entry.1).collect();
        assert!(row.len() == 4 && (row.iter().sum::<f64>() - 1.0).abs() < 1e-13);
        let tilt = frame.triads[cell].normal().xy().norm();
        let outward = frame.centers[cell].xy().norm() / 50.0;
        assert!((tilt - outward).abs() < 1e-3, "{tilt} {outward}");
    }
    let distance = surface_distance(&InitialGap::from(GapShape::Mesh), &frame, &RigidBody, &body).unwrap();
    for (d, center) in distance.iter().zip(&frame.centers) {
        let r = center.xy().norm();
        assert!((d - r * r / 100.0).abs() < 1e-3, "{d} {r}");
    }
}
