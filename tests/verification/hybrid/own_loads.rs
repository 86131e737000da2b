//! Displacement under the frame due to the loads, the prescribed displacements and the weight of a body.

use nalgebra::{Matrix3, Vector3, Vector6};
use orthowear::bem::half_space::CrossBlocks::Keep;
use orthowear::bem::half_space::PointForceField;
use orthowear::body::ElasticBody;
use orthowear::element::ElementKind::{self, Hex8, Hex27};
use orthowear::fem::FoundationStiffness;
use orthowear::fem::{FeModel, FeSpec, Foundation, HexFormulation, Support};
use orthowear::frame::{ContactFrame, Side};
use orthowear::geometry::Point;
use orthowear::material::Stiffness;
use orthowear::mesh::{Mesh, PhysicalGroup};

use super::blocks::{body, cfrp, frame, hybrid, mesh};
use crate::common::{assert_order, steel};
use crate::fem_bodies::{ALL, clamp, spec};
use crate::fem_meshes::{boundary_nodes, prescribe};

/// Displacement at the cells of the frame, mm, due to the loads of the body at amplitude 1.
fn surface(spec: FeSpec, frame: &ContactFrame) -> Vec<Point> {
    let body = hybrid(spec, "z1", Side::Lower, frame);
    let gap = &body.loads()[0].gap;
    let n = frame.n_cells();
    (0..n).map(|cell| -Point::new(gap[cell], gap[n + cell], gap[2 * n + cell])).collect()
}

fn off(found: &[Point], frame: &ContactFrame, exact: impl Fn(&Point) -> Point) -> f64 {
    found.iter().zip(&frame.centers).map(|(u, x)| (u - exact(x)).norm()).fold(0.0, f64::max)
}

fn part_of_top(mesh: &mut Mesh, name: &str, inside: impl Fn(&Point) -> bool) {
    let top = mesh.groups.iter().find(|group| group.name == "z1").unwrap();
    let middle = |nodes: &[usize]| -> Point {
        nodes.iter().map(|&node| Point::from(mesh.points[node])).sum::<Point>() / nodes.len() as f64
    };
    let cells = top.cells.iter().filter(|&&cell| inside(&middle(mesh.cell_nodes(cell)))).copied().collect();
    let tag = mesh.groups.len() as i64 + 1;
    mesh.groups.push(PhysicalGroup { name: name.into(), dim: 2, tag, cells });
}

/// Largest error of the displacement under the frame for a block in uniform stress. The error is divided by the half-width 3 mm
/// and by the norm of the displacement gradient. The base moves with the strain of this stress and with a rotation.
fn stressed(kind: ElementKind, cells: usize, stiffness: &Stiffness) -> f64 {
    let frame = frame(12);
    let stress = Vector6::new(120.0, -80.0, -60.0, 25.0, -30.0, 40.0);
    let [e11, e22, e33, g23, g13, g12] = (stiffness.voigt().try_inverse().unwrap() * stress).into();
    let (s12, s13, s23) = (0.5 * g12, 0.5 * g13, 0.5 * g23);
    let turn = Vector3::new(2e-3, -1e-3, 3e-3);
    let gradient = Matrix3::new(e11, s12, s13, s12, e22, s23, s13, s23, e33) + turn.cross_matrix();
    let [xx, yy, zz, yz, xz, xy] = stress.into();
    let tensor = Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz);
    let shift = Vector3::new(0.01, -0.02, 0.03);
    let rows = [0, 1, 2].map(|c| [0, 1, 2].map(|k| gradient[(c, k)]));
    let base = Support { group: "z0".into(), components: ALL, value: shift.into(), gradient: rows };
    let (x, y, z) = (Vector3::x(), Vector3::y(), Vector3::z());
    let faces = [("x0", -x), ("x1", x), ("y0", -y), ("y1", y), ("z1", z)];
    let tractions = faces.map(|(name, n)| (name.to_owned(), (tensor * n).into())).to_vec();
    let spec = FeSpec { supports: vec![base], tractions, ..body(kind, (3.0, cells, 1.0), stiffness) };
    off(&surface(spec, &frame), &frame, |x| shift + gradient * x) / (3.0 * gradient.norm())
}

/// Truth: the displacement of a block in uniform stress, to 2e-4, the accuracy of the quadrature.
#[test]
fn uniform_stress() {
    for stiffness in [steel(), cfrp()] {
        for (kind, cells) in [(Hex8, 4), (Hex27, 4)] {
            let error = stressed(kind, cells, &stiffness);
            assert!(error < 2e-4, "{} {error:.2e}", kind.name());
        }
    }
}

/// Truth: a rigid motion of the support moves the surface rigidly, to rounding. A soft foundation on a side does not hinder a
/// translation of the support, a stiff foundation does.
#[test]
fn rigid_motions() {
    let frame = frame(8);
    let turn = Vector3::new(2e-3, -1e-3, 3e-3).cross_matrix();
    let rows = [0, 1, 2].map(|c| [0, 1, 2].map(|k| turn[(c, k)]));
    let base = Support { group: "z0".into(), components: ALL, value: [0.1, 0.2, -0.3], gradient: rows };
    let spec = FeSpec { supports: vec![base], ..body(Hex8, (3.0, 4, 1.0), &cfrp()) };
    let found = surface(spec.clone(), &frame);
    let error = off(&found, &frame, |x| Vector3::new(0.1, 0.2, -0.3) + turn * x);
    assert!(error < 1e-12, "{error:.2e}");
    let shifted = |stiffness: f64| {
        let base =
            Support { group: "z0".into(), components: ALL, value: [0.0, 0.0, 0.01], gradient: [[0.0; 3]; 3] };
        let foundation =
            Foundation { group: "x0".into(), stiffness: FoundationStiffness::Components([stiffness; 3]) };
        surface(FeSpec { supports: vec![base], foundations: vec![foundation], ..spec.clone() }, &frame)
    };
    let soft = off(&shifted(1e-6), &frame, |_| Vector3::new(0.0, 0.0, 0.01));
    assert!(soft < 2e-4 * 0.01, "{soft:.2e}");
    let held = shifted(1e5).iter().map(|u| u.z).fold(f64::INFINITY, f64::min);
    assert!(held < 0.009, "{held}");
}

/// Truth: the weight g per volume moves the top of a column of height w by -g w^2 / 2M. The column stands between smooth walls,
/// and M is the modulus of uniaxial strain. On meshes of first-order elements, the error does not exceed the estimated error.
#[test]
fn weight() {
    let frame = frame(8);
    let wall = |group: &str, c: usize| Support { components: [0, 1, 2].map(|k| k == c), ..clamp(group) };
    let supports = vec![wall("x0", 0), wall("x1", 0), wall("y0", 1), wall("y1", 1), wall("z0", 2)];
    let exact = -0.05 * 9.0 / (2.0 * steel().voigt()[(2, 2)]);
    for (kind, cells, ratio, most) in [(Hex27, 4, 1.0, 1e-4), (Hex8, 8, 1.0, 5e-3), (Hex8, 8, 3.0, 2e-2)] {
        let own = body(kind, (3.0, cells, ratio), &steel());
        let spec = FeSpec { supports: supports.clone(), body_force: [0.0, 0.0, -0.05], ..own };
        let estimated = hybrid(spec.clone(), "z1", Side::Lower, &frame).applied_load_error().unwrap().mean;
        let error = off(&surface(spec, &frame), &frame, |_| Vector3::new(0.0, 0.0, exact));
        println!(
            "{} {ratio}: {:.1e}, estimated {:.1e}",
            kind.name(),
            error / exact.abs(),
            estimated / exact.abs()
        );
        assert!(error < most * exact.abs(), "{} {error:.2e} of {exact:.2e}", kind.name());
        assert!(error < estimated.max(1e-4 * exact.abs()), "{} {error:.2e} {estimated:.2e}", kind.name());
    }
}

/// Relative error of the displacement under the frame. The boundary nodes of the body are displaced as in a half-space under a
/// point force beside the body.
fn by_supports(kind: ElementKind, cells: usize, stiffness: &Stiffness, field: &PointForceField) -> f64 {
    let frame = frame(8);
    let mut mesh = mesh(kind, 3.0, cells, 1.0);
    let nodes: Vec<usize> = boundary_nodes(&mesh)
        .into_iter()
        .filter(|&node| {
            let [x, y, z] = mesh.points[node];
            z < -1e-9 || x.abs() > 3.0 - 1e-9 || y.abs() > 3.0 - 1e-9 || x < -1.9
        })
        .collect();
    let force = Vector3::new(1e3, -2e3, 3e3);
    let exact = |x: &Point| field.at(&Vector3::new(x.x - 5.0, x.y - 1.0, x.z.min(0.0))).value * force;
    let supports = prescribe(&mut mesh, &nodes, ALL, |x| exact(&Point::from(x)).into());
    let found = surface(spec(mesh, stiffness.clone(), HexFormulation::Standard, supports), &frame);
    off(&found, &frame, exact) / frame.centers.iter().map(|x| exact(x).norm()).fold(0.0, f64::max)
}

/// Truth: the displacement field of a point force beside the body. On finer meshes, errors decrease with the order of the strain
/// energy, twice the order of the displacement gradient.
#[test]
fn moved_boundaries() {
    let (steel, cfrp) = (steel(), cfrp());
    let field = PointForceField::new(&steel).unwrap();
    let quadratic = by_supports(Hex27, 4, &steel, &field);
    assert!(quadratic < 2e-3, "{quadratic}");
    let field = PointForceField::new(&cfrp).unwrap();
    let cells = [3, 6, 12];
    let errors = cells.map(|n| by_supports(Hex8, n, &cfrp, &field));
    assert_order(&errors, &cells, 1.8, "trilinear elements");
    assert!(errors[2] < 1e-2, "{errors:?}");
}

/// Truth: the gap due to tractions on a pad, computed by the flexibility of a large frame. For the small frame, the same
/// tractions are loads on a group of faces under and beside the frame.
#[test]
fn pads_beside_the_frame() {
    let large = ContactFrame::grid([1.5, 1.0], [24, 16], [0.25, 0.0], 0.0).unwrap();
    let small = ContactFrame::grid([0.5, 0.5], [8, 8], [-0.5, 0.0], 0.0).unwrap();
    let pad = |x: &Point| x.x > -0.5 && x.x < 1.0 && x.y > -1.0 && x.y < 0.5;
    let traction = Vector3::new(30.0, -20.0, -100.0);
    for stiffness in [steel(), cfrp()] {
        let mut mesh = mesh(Hex8, 3.0, 12, 1.0);
        part_of_top(&mut mesh, "pad", pad);
        let plain = spec(mesh, stiffness.clone(), HexFormulation::Enhanced, vec![clamp("z0")]);
        let loaded = FeSpec { tractions: vec![("pad".into(), traction.into())], ..plain.clone() };
        let found = surface(loaded, &small);
        let mut whole = hybrid(plain, "z1", Side::Lower, &large);
        let operator = whole.take_flexibility(Keep).unwrap().unwrap();
        let n = large.n_cells();
        let mut tractions = vec![0.0; 3 * n];
        for (cell, _) in large.centers.iter().enumerate().filter(|(_, x)| pad(x)) {
            // Tractions of a frame act on body 2, so that loads on body 1 have the opposite sign.
            (0..3).for_each(|c| tractions[c * n + cell] = -traction[c]);
        }
        let mut gap = vec![0.0; 3 * n];
        operator.apply(&tractions, &mut gap);
        let error = off(&found, &small, |x| {
            let cell = large.centers.iter().position(|other| (other - x).norm() < 1e-9).unwrap();
            -Point::new(gap[cell], gap[n + cell], gap[2 * n + cell])
        });
        let size = found.iter().map(|u| u.norm()).fold(0.0, f64::max);
        assert!(error < 3e-3 * size, "{error:.2e} of {size:.2e}");
    }
}

/// Truth: the displacement of the same body with ten elements of order 2 along each edge. The estimated error of a coarse mesh is
/// 1 to 8 times its actual error.
#[test]
fn pressed_from_the_side() {
    let frame = frame(6);
    let pressed =
        |kind, n| FeSpec { pressures: vec![("x1".into(), 100.0)], ..body(kind, (3.0, n, 3.0), &cfrp()) };
    let model = FeModel::new(pressed(Hex27, 10)).unwrap();
    let reference = model.condense(&[]).unwrap();
    let mesh = reference.model().mesh().clone();
    let under: Vec<usize> = (0..mesh.n_points())
        .filter(|&node| {
            let [x, y, z] = mesh.points[node];
            z.abs() < 1e-12 && x.abs().max(y.abs()) < 1.1
        })
        .collect();
    assert!(under.len() > 4);
    let mut errors = Vec::new();
    for (kind, n) in [(Hex8, 4), (Hex8, 8), (Hex27, 4)] {
        let body = hybrid(pressed(kind, n), "z1", Side::Lower, &frame);
        let estimated = body.applied_load_error().unwrap().mean;
        let mut most: f64 = 0.0;
        for &node in &under {
            let x = Point::from(mesh.points[node]);
            let exact = Point::from(reference.contact_free_displacement()[node]);
            let found = interpolated(&body.loads()[0].gap, &frame, &x);
            most = most.max((found - exact).norm());
        }
        assert!(estimated > most && estimated < 8.0 * most, "{estimated} {most}");
        errors.push(most);
    }
    assert!(errors[0] / errors[1] > 3.0, "{errors:?}");
}

/// Displacement of body 1 at `x`: the negative of `gap`, interpolated by parabolas between cell centres.
fn interpolated(gap: &[f64], frame: &ContactFrame, x: &Point) -> Point {
    let grid = frame.grid.unwrap();
    let n = frame.n_cells();
    let [(i, wx), (j, wy)] = [0, 1].map(|axis| {
        let t = (x[axis] + grid.half_width()[axis]) / grid.spacing[axis] - 0.5;
        let first = (t.round() as usize).clamp(1, grid.cells[axis] - 2);
        let s = t - first as f64;
        (first, [0.5 * s * (s - 1.0), 1.0 - s * s, 0.5 * s * (s + 1.0)])
    });
    let mut sum = Point::zeros();
    for (a, wx) in wx.iter().enumerate() {
        for (b, wy) in wy.iter().enumerate() {
            let cell = (i + a - 1) * grid.cells[1] + j + b - 1;
            sum -= Point::new(gap[cell], gap[n + cell], gap[2 * n + cell]) * (wx * wy);
        }
    }
    sum
}
