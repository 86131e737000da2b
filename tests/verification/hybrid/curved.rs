//! Bodies with a curved contact surface and the near field of a half-space.

use std::sync::Arc;

use orthowear::body::hybrid::HalfSpaceFit;
use orthowear::body::{ElasticBody, FeBody};
use orthowear::contact::SolverOptions;
use orthowear::element::ElementKind::{self, Hex8};
use orthowear::evolution::run;
use orthowear::fem::{FeSpec, HexFormulation};
use orthowear::frame::{ContactFrame, Side};
use orthowear::mesh::faces::group_faces;

use super::blocks::{frame, hybrid, mesh};
use super::hertz::sphere_on;
use crate::common::{Silent, indent, steel};
use crate::fem_bodies::{clamp, spec};
use crate::fem_meshes::add_cells;

/// A block of half-width and depth 6, whose top has the given curvatures along x and y (1/mm).
fn capped(cells: usize, [along_x, along_y]: [f64; 2]) -> FeSpec {
    let w = 6.0;
    let mut mesh = mesh(Hex8, w, cells, 1.0);
    for x in &mut mesh.points {
        let share = 1.0 + x[2] / w;
        x[2] -= share * 0.5 * (along_x * x[0] * x[0] + along_y * x[1] * x[1]);
    }
    spec(mesh, steel(), HexFormulation::Enhanced, vec![clamp("z0")])
}

fn load(body: &mut dyn ElasticBody, frame: &ContactFrame) -> f64 {
    let model = sphere_on(body, Side::Lower, frame);
    let result = run(&model, &[indent(0.02)], &SolverOptions::default(), None, &mut Silent).unwrap();
    assert!(result.records[0].converged);
    result.records[0].normal_force
}

/// Relative changes of the load due to the curvatures of the top, under the same gap. The first value is computed with the near
/// field of a half-space, the second with condensed meshes.
fn changes(curvatures: [f64; 2]) -> [f64; 2] {
    let frame = frame(24);
    let finite = |curvatures: [f64; 2]| {
        let mut body = hybrid(capped(12, curvatures), "z1", Side::Lower, &frame);
        assert_eq!(body.indicators().rejection_reason(), None);
        assert_eq!(body.indicators().rise > 0.0, curvatures != [0.0; 2]);
        load(&mut body, &frame)
    };
    let coarse = ContactFrame::grid([1.2; 2], [8; 2], [0.0; 2], 0.0).unwrap();
    let meshed = |curvatures| {
        let mut body = FeBody::new(capped(24, curvatures), "z1", Side::Lower, &coarse).unwrap();
        load(&mut body, &coarse)
    };
    [finite(curvatures) / finite([0.0; 2]) - 1.0, meshed(curvatures) / meshed([0.0; 2]) - 1.0]
}

/// Truth: the relative change of the load on condensed meshes, -1.9e-3 on a cap of radius 50 mm. The relative change with the
/// near field of a half-space differs by less than 1.5e-3. The correction includes the curved surface beyond the contact, but
/// takes the contact itself as plane.
#[test]
fn cap_of_a_sphere() {
    let [finite, meshed] = changes([1.0 / 50.0; 2]);
    assert!(finite < 0.0 && (finite - meshed).abs() < 1.5e-3, "{finite:e} {meshed:e}");
}

/// Truth: the relative change of the load on condensed meshes, as in [`cap_of_a_sphere`]. The bound is about half as large,
/// because the surface is curved along x only.
#[test]
fn back_of_a_cylinder() {
    let [finite, meshed] = changes([1.0 / 50.0, 0.0]);
    assert!(finite < 0.0 && (finite - meshed).abs() < 0.8e-3, "{finite:e} {meshed:e}");
}

/// Truth: the surface of a body continues beyond the contact group. A smaller group therefore gives the same fit of the
/// half-space. A step of the surface beside the group counts as an edge.
#[test]
fn surfaces_go_on_beyond_the_group() {
    let frame = ContactFrame::grid([1.9; 2], [8; 2], [0.0; 2], 0.0).unwrap();
    let with_middle = |change: &dyn Fn(&mut [f64; 3])| {
        let mut body = capped(12, [1.0 / 50.0; 2]);
        let mut mesh = (*body.mesh).clone();
        let faces = group_faces(&mesh, "z1").unwrap();
        let inside = |node: &usize| mesh.points[*node][..2].iter().all(|x| x.abs() < 2.1);
        let middle: Vec<usize> = faces
            .iter()
            .filter(|face| face.nodes.iter().all(inside))
            .flat_map(|face| face.nodes.clone())
            .collect();
        add_cells(&mut mesh, ElementKind::Quad4, "middle", middle);
        mesh.points.iter_mut().for_each(change);
        body.mesh = Arc::new(mesh);
        body
    };
    let whole = HalfSpaceFit::find(&with_middle(&|_| {}), "z1", Side::Lower, &frame).unwrap().unwrap();
    let middle = HalfSpaceFit::find(&with_middle(&|_| {}), "middle", Side::Lower, &frame).unwrap().unwrap();
    assert_eq!(whole, middle);
    let step = |x: &mut [f64; 3]| x[2] -= if x[0] > 2.5 && x[2] > -1.5 { 0.5 } else { 0.0 };
    let why = HalfSpaceFit::find(&with_middle(&step), "middle", Side::Lower, &frame).unwrap().unwrap_err();
    assert!(why.0.contains("an edge or a support of the body"), "{}", why.0);
}

/// Truth: a plane face under the frame has no height difference, so its `rise` is zero. On a mesh of a sphere of radius R, the
/// nodes lie (x² + y²) / 2R below the apex. The flat faces between these nodes determine the height difference.
#[test]
fn small_frames_on_large_faces() {
    let site = |curvature: f64, half: f64, middle: [f64; 2]| {
        let frame = ContactFrame::grid([half; 2], [4; 2], middle, 0.0).unwrap();
        HalfSpaceFit::find(&capped(4, [curvature; 2]), "z1", Side::Lower, &frame).unwrap()
    };
    for middle in [[0.9, 0.9], [-1.1, 0.4], [0.0, 0.0]] {
        assert_eq!(site(0.0, 0.05, middle).unwrap().rise, 0.0);
    }
    // Within 3 mm of the origin, the four flat faces lie (|x| + |y|) 1.5 mm / R below the apex.
    let rise = site(1.0 / 500.0, 0.1, [0.0; 2]).unwrap().rise;
    assert!((rise * 0.1 / (0.2 * 1.5 / 500.0) - 1.0).abs() < 1e-6, "{rise}");
}
