//! Curvature correction of flat faces that approximate a curved surface.

use orthowear::body::RigidBody;
use orthowear::coupling::surface_distance;
use orthowear::element::ElementKind::{self, Hex8, Tet4};
use orthowear::frame::{ContactFrame, FaceMap, GapShape, InitialGap, MeshedSurface, Side};
use orthowear::mesh::Mesh;
use orthowear::mesh::faces::group_faces;

use super::blocks::hybrid;
use crate::common::steel;
use crate::fem_bodies::{clamp, spec};
use crate::fem_meshes::block;
use orthowear::fem::HexFormulation;

/// Radius of the surfaces, mm.
const R: f64 = 20.0;

/// Depth below the apex of a surface, as a function of x and y.
type Depth = fn(f64, f64) -> f64;

fn sphere(x: f64, y: f64) -> f64 {
    R - (R * R - x * x - y * y).sqrt()
}

/// A cylinder whose axis is turned by 0.4 rad from x.
fn cylinder(x: f64, y: f64) -> f64 {
    let across = y * 0.4f64.cos() - x * 0.4f64.sin();
    R - (R * R - across * across).sqrt()
}

/// Mesh of a block of half-width 2 mm with cells of unequal size. Its top lies `depth(x, y)` below the apex.
fn curved(kind: ElementKind, n: usize, depth: Depth) -> Mesh {
    block(kind, [n, n, 2], [1.0; 3], |[x, y, z]| {
        let [s, t] = [2.0 * x - 1.0, 2.0 * y - 1.0];
        let [x, y] = [2.0 * s + 0.2 * (1.0 - s * s) * t, 2.0 * t + 0.3 * s * (1.0 - t * t)];
        [x, y, 2.0 * (z - 1.0) - z * depth(x, y)]
    })
}

/// Largest errors of the mean heights over cells of 0.05 mm, for flat faces and for faces with the curvature correction.
fn errors(mesh: &Mesh, depth: Depth) -> [f64; 2] {
    let frame = ContactFrame::grid([0.8; 2], [32; 2], [0.05, -0.1], 0.0).unwrap();
    let faces = group_faces(mesh, "z1").unwrap();
    let map = FaceMap::new(&frame, mesh, &faces, Side::Lower).unwrap();
    let mean_heights = map.mean_heights(&frame, mesh);
    let mesh = std::sync::Arc::new(mesh.clone());
    let surface = MeshedSurface { mesh, faces, side: Side::Lower, mean_heights, curved_gap: false };
    let bowed = surface.curved_heights(&frame);
    let gauss = 0.5 * 0.05 / 3f64.sqrt();
    let largest = |heights: &[f64]| {
        let error = |(height, center): (&f64, &orthowear::geometry::Point)| {
            let corners = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
            let at = |[s, t]: [f64; 2]| -0.25 * depth(center.x + s * gauss, center.y + t * gauss);
            (height + center.z - corners.map(at).iter().sum::<f64>()).abs()
        };
        heights.iter().zip(&frame.centers).map(error).fold(0.0, f64::max)
    };
    [largest(&surface.mean_heights), largest(&bowed)]
}

/// Truth: the exact heights of spheres and cylinders. Flat faces of width h deviate from the surface by h² / 8R along each
/// direction, with order 2. With the curvature correction, heights converge with order 4, or with order 3 on irregular meshes.
/// Their error is less than a tenth of the error of flat faces.
#[test]
fn bowed_faces_follow_the_surface() {
    for (kind, depth) in [(Hex8, sphere as Depth), (Hex8, cylinder), (Tet4, sphere), (Tet4, cylinder)] {
        let found = [8, 16, 32].map(|n| errors(&curved(kind, n, depth), depth));
        println!("{kind:?} {found:?}");
        let order = |k: usize| (found[0][k] / found[2][k]).log2() / 2.0;
        assert!((order(0) - 2.0).abs() < 0.3 && order(1) > 2.7, "{kind:?} {} {}", order(0), order(1));
        assert!(found.iter().all(|[flat, bowed]| *bowed < 0.1 * flat), "{kind:?} {found:?}");
    }
}

/// Truth: a plane and a roof get no curvature correction. The ridge of the roof is a crease and not a curvature.
#[test]
fn what_is_plane_stays_so() {
    let roof = |x: f64, _: f64| 0.5 * x.abs();
    for depth in [(|_, _| 0.0) as Depth, roof] {
        let mesh = block(Hex8, [8, 8, 2], [1.0; 3], |[x, y, z]| {
            let [x, y] = [4.0 * x - 2.0, 4.0 * y - 2.0];
            [x, y, 2.0 * (z - 1.0) - z * depth(x, y)]
        });
        let frame = ContactFrame::grid([0.8; 2], [16; 2], [0.0; 2], 0.0).unwrap();
        let faces = group_faces(&mesh, "z1").unwrap();
        let mean_heights =
            FaceMap::new(&frame, &mesh, &faces, Side::Lower).unwrap().mean_heights(&frame, &mesh);
        let mesh = std::sync::Arc::new(mesh);
        let surface = MeshedSurface { mesh, faces, side: Side::Lower, mean_heights, curved_gap: false };
        let bowed = surface.curved_heights(&frame);
        assert!(bowed.iter().zip(&surface.mean_heights).all(|(a, b)| (a - b).abs() < 1e-12));
    }
}

/// Truth: the gap of the exact sphere. The error is below a twentieth of the largest deviation of the flat faces from the sphere.
#[test]
fn the_gap_of_a_half_space_under_a_mesh() {
    let frame = ContactFrame::grid([0.8; 2], [32; 2], [0.0; 2], 0.0).unwrap();
    let spec = spec(curved(Hex8, 8, sphere), steel(), HexFormulation::Enhanced, vec![clamp("z0")]);
    let body = hybrid(spec, "z1", Side::Lower, &frame);
    let found = surface_distance(&InitialGap::from(GapShape::Mesh), &frame, &body, &RigidBody).unwrap();
    let exact = InitialGap { exact: true, ..GapShape::Sphere { radius: R }.into() };
    let exact = exact.evaluate(&frame).unwrap();
    let largest = found.iter().zip(&exact).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    let cut_off = 0.5 * 0.5 / (4.0 * R);
    println!("{largest:e} {cut_off:e}");
    assert!(largest < 0.05 * cut_off, "{largest:e} {cut_off:e}");
}
