//! Bodies in contact on two of their faces.

use orthowear::bem::half_space::CrossBlocks::Keep;
use orthowear::bem::half_space::PointForceField;
use orthowear::body::ElasticBody;
use orthowear::body::hybrid::{ContactPatch, Correction, FaceContact, MultiPatchBody, PatchForces};
use orthowear::contact::SolverOptions;
use orthowear::element::ElementKind::{self, Hex8, Hex27};
use orthowear::evolution::{Model, run};
use orthowear::fem::{ColumnSolver, CondensationResources, FeModel, FeSpec, HexFormulation, Support};
use orthowear::flexibility::Flexibility;
use orthowear::frame::{ContactFrame, GapShape, InitialGap, Side};
use orthowear::geometry::{Point, Triad};
use orthowear::laws::friction::FrictionLaw;
use orthowear::laws::wear::WearLaw;
use orthowear::linalg::memory::MemoryLimit;
use orthowear::material::Stiffness;

use super::blocks::{FRAME, cfrp, frame, hybrid};
use super::hertz::sphere_on;
use crate::common::{Silent, assert_order, indent, steel, usual_or_finest};
use crate::fem_bodies::{clamp, spec};
use crate::fem_meshes::block;

/// Half-width of the bodies.
const WIDTH: f64 = 3.0;

/// A slab from z = -`depth` to 0 of `n` cells across and `layers` along z, held at both ends in x.
fn slab(
    kind: ElementKind,
    (n, layers, depth): (usize, usize, f64),
    stiffness: &Stiffness,
    more: Vec<Support>,
) -> FeSpec {
    let place = |[x, y, z]: [f64; 3]| [WIDTH * (2.0 * x - 1.0), WIDTH * (2.0 * y - 1.0), depth * (z - 1.0)];
    let mesh = block(kind, [n, n, layers], [1.0; 3], place);
    let supports = [clamp("x0"), clamp("x1")].into_iter().chain(more).collect();
    spec(mesh, stiffness.clone(), HexFormulation::Standard, supports)
}

/// Places on a patch, three along each side, and one beside the body.
fn places() -> Vec<[f64; 2]> {
    let line: Vec<f64> = (0..3).map(|k| FRAME * f64::from(k - 1) * 0.8).collect();
    let mut places: Vec<[f64; 2]> = line.iter().flat_map(|&x| line.iter().map(move |&y| [x, y])).collect();
    places.push([1.0, 5.0]);
    places
}

/// Displacement of one patch by a force on the plane of the other beside the body, over that in the half-space alone.
fn beside(kind: ElementKind, n: usize, stiffness: &Stiffness) -> f64 {
    let depth = 3.0;
    let model = FeModel::new(slab(kind, (n, n, depth), stiffness, vec![])).unwrap();
    let solver = ColumnSolver::new(&model, &MemoryLimit::of_machine()).unwrap();
    let level = Triad::horizontal(0.0);
    let sides = [(Side::Lower, 0.0), (Side::Upper, -depth)];
    let patches =
        sides.map(|(side, z)| ContactPatch::on_body(&level, side, Point::new(0.0, 0.0, z), [FRAME; 2]));
    let own = patches.map(|patch| stiffness.rotated(&patch.axes.0.transpose()));
    let fields = own.each_ref().map(|own| PointForceField::new(own).unwrap());
    let forces = [0, 1].map(|k| PatchForces {
        patch: patches[k],
        stiffness: &own[k],
        field: &fields[k],
        points: places(),
        curved_faces: &[],
    });
    let found = Correction::unsymmetric(&model, &solver, &forces, 0.3).unwrap();
    let on_patch = places().len() - 1;
    let (mut off, mut size) = (0.0, 0.0);
    for (to, from) in [(0, 1), (1, 0)] {
        let column = 3 * (from * places().len() + on_patch);
        for (i, place) in places()[..on_patch].iter().enumerate() {
            let x = patches[to].center + patches[to].axes.to_global(&Point::new(place[0], place[1], 0.0));
            let [fx, fy] = places()[on_patch];
            let alone = fields[from].at(&(patches[from].local(&x) - Point::new(fx, fy, 0.0))).value;
            for (a, b) in (0..9).map(|k| (k % 3, k / 3)) {
                off += found.matrix.at(3 * (to * places().len() + i) + a, column + b).powi(2);
                size += alone[(a, b)].powi(2);
            }
        }
    }
    (off / size).sqrt()
}

/// Truth: a force beside the body does not move it at all. The displacement of the other patch, the half-space's with its correction,
/// vanishes with order 2 of trilinear and 4 of triquadratic elements.
#[test]
fn forces_beside_the_body_move_no_other_patch() {
    for stiffness in usual_or_finest(vec![cfrp()], vec![steel(), cfrp()]) {
        for (kind, cells, order, bound) in [(Hex8, [4, 8, 16], 1.8, 0.02), (Hex27, [2, 4, 8], 3.5, 1e-3)] {
            let errors = cells.map(|n| beside(kind, n, &stiffness));
            assert_order(&errors, &cells, order, &format!("{kind:?}"));
            assert!(errors[2] < bound, "{kind:?} {errors:?}");
        }
    }
}

/// The slab of twice the depth, touched from above and below.
fn between(n: usize, stiffness: &Stiffness, frame: &ContactFrame) -> MultiPatchBody {
    let spec = slab(Hex27, (n, n, 2.0 * WIDTH), stiffness, vec![]);
    let contacts = [("z1", Side::Lower), ("z0", Side::Upper)];
    let contacts = contacts.map(|(group, side)| FaceContact { group, side, frame });
    let body = MultiPatchBody::new(spec, &contacts, &CondensationResources::default()).unwrap();
    for indicators in body.indicators() {
        assert_eq!(indicators.rejection_reason(), None, "{indicators:?}");
    }
    body
}

/// Half of it, on its plane of symmetry.
fn half(n: usize, stiffness: &Stiffness) -> FeSpec {
    let symmetry = Support { components: [false, false, true], ..clamp("z0") };
    slab(Hex27, (n, n / 2, WIDTH), stiffness, vec![symmetry])
}

/// Truths: under tractions that are symmetric about its middle plane the body moves like its half on a plane of symmetry; the operator
/// of both frames is symmetric; gaps summed cell by cell are those of the product.
#[test]
#[ignore = "13 s; usual: pressed_between_two_spheres"]
fn symmetric_tractions_on_both_faces() {
    let frame = frame(12);
    let n = frame.n_cells();
    // Fibres in the plane: the slab is symmetric.
    for stiffness in [steel(), crate::common::im7(0.0)] {
        let mut off = Vec::new();
        for cells in [4, 6] {
            let joint = between(cells, &stiffness, &frame).flexibility(Keep).unwrap();
            let single = hybrid(half(cells, &stiffness), "z1", Side::Lower, &frame);
            let single = { single }.take_flexibility(Keep).unwrap().unwrap();
            let above: Vec<f64> = (0..3 * n).map(|k| ((k * k % 97) as f64 / 97.0) + 0.2).collect();
            let mut both = vec![0.0; 6 * n];
            for (plane, sign) in [(0, -1.0), (1, -1.0), (2, 1.0)] {
                let own = &above[plane * n..][..n];
                both[plane * 2 * n..][..n].copy_from_slice(own);
                both[plane * 2 * n + n..][..n].iter_mut().zip(own).for_each(|(to, from)| *to = sign * from);
            }
            let (mut gap, mut wanted) = (vec![f64::NAN; 6 * n], vec![f64::NAN; 3 * n]);
            joint.apply(&both, &mut gap);
            single.apply(&above, &mut wanted);
            let size = wanted.iter().fold(0.0_f64, |size, gap| size.max(gap.abs()));
            let mut most: f64 = 0.0;
            for (plane, sign) in [(0, -1.0), (1, -1.0), (2, 1.0)] {
                for i in 0..n {
                    let wanted = wanted[plane * n + i];
                    let [up, down] = [0, n].map(|first| gap[plane * 2 * n + first + i]);
                    most = most.max((up - wanted).abs()).max((down - sign * wanted).abs());
                }
            }
            off.push(most / size);
            let direct = joint.direct_sum(n + 7, &both).unwrap();
            (0..3).for_each(|c| assert!((direct[c] - gap[c * 2 * n + n + 7]).abs() < 1e-10 * size));
            let other: Vec<f64> = (0..6 * n).map(|k| (k * 7 % 31) as f64 - 15.0).collect();
            let mut by_other = vec![0.0; 6 * n];
            joint.apply(&other, &mut by_other);
            let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
            let (one, two) = (dot(&other, &gap), dot(&both, &by_other));
            assert!((one - two).abs() < 1e-10 * dot(&both, &gap), "{one} {two}");
            let mut normal = vec![0.0; 2 * n];
            joint.apply_normal(&both[4 * n..], &mut normal);
            let pressed: Vec<f64> = (0..6 * n).map(|k| if k < 4 * n { 0.0 } else { both[k] }).collect();
            joint.apply(&pressed, &mut by_other);
            (0..2 * n).for_each(|i| assert!((normal[i] - by_other[4 * n + i]).abs() < 1e-12 * size));
        }
        assert!(off[1] < 1e-4 && off[1] < 0.35 * off[0], "{off:?}");
    }
}

/// Truth: two equal spheres that press on both sides of a body carry what one carries on its half.
#[test]
fn pressed_between_two_spheres() {
    let grid = frame(32);
    let stiffness = steel();
    let body = between(6, &stiffness, &grid);
    let frame = ContactFrame::concatenated(&[(&grid, 0.0), (&grid, -2.0 * WIDTH)]);
    let n = grid.n_cells();
    let distance = InitialGap::from(GapShape::Sphere { radius: 50.0 }).evaluate(&grid).unwrap();
    let mut initial_gap = vec![0.0; 6 * n];
    [4 * n, 5 * n].into_iter().for_each(|first| initial_gap[first..first + n].copy_from_slice(&distance));
    let model = Model {
        frame,
        flexibility: Box::new(body.flexibility(Keep).unwrap()),
        initial_gap,
        floating: Vec::new(),
        friction: FrictionLaw::None,
        wear: WearLaw::None,
        wear_share: 1.0,
    };
    let load = |model: &Model| {
        let result = run(model, &[indent(0.02)], &SolverOptions::default(), &mut Silent).unwrap();
        assert!(result.records[0].converged);
        result.records[0].normal_force
    };
    let mut single = hybrid(half(6, &stiffness), "z1", Side::Lower, &grid);
    let wanted = load(&sphere_on(&mut single, Side::Lower, &grid));
    let found = load(&model);
    assert!((found / (2.0 * wanted) - 1.0).abs() < 2e-4, "{found} {wanted}");
}

/// Two square frames beside each other on one face, `apart` from middle to middle.
fn two_frames(apart: f64) -> [ContactFrame; 2] {
    [-0.5, 0.5].map(|side| ContactFrame::grid([0.6; 2], [8; 2], [side * apart, 0.0], 0.0).unwrap())
}

/// Truth: two patches on one plane are two windows of one frame that holds both.
#[test]
fn two_patches_on_one_face() {
    let stiffness = cfrp();
    let spec = || slab(Hex27, (6, 6, WIDTH), &stiffness, vec![]);
    let frames = two_frames(3.0);
    let contacts = frames.each_ref().map(|frame| FaceContact { group: "z1", side: Side::Lower, frame });
    let body = MultiPatchBody::new(spec(), &contacts, &CondensationResources::default()).unwrap();
    let whole = ContactFrame::grid([2.1, 0.6], [28, 8], [0.0; 2], 0.0).unwrap();
    let mut single = hybrid(spec(), "z1", Side::Lower, &whole);
    let (joint, single) = (body.flexibility(Keep).unwrap(), single.take_flexibility(Keep).unwrap().unwrap());
    let (n, all) = (64, 28 * 8);
    // The second begins at the column of cells 20 of the whole.
    let first = [0, 20 * 8];
    let mut tractions = vec![0.0; 6 * n];
    let mut wanted = vec![0.0; 3 * all];
    for (k, traction) in tractions.iter_mut().enumerate() {
        let (plane, frame, cell) = (k / (2 * n), k / n % 2, k % n);
        *traction = ((k * k % 89) as f64 / 89.0) - 0.3;
        wanted[plane * all + first[frame] + cell] = *traction;
    }
    let (mut gap, mut by_all) = (vec![0.0; 6 * n], vec![0.0; 3 * all]);
    joint.apply(&tractions, &mut gap);
    single.apply(&wanted, &mut by_all);
    let size = gap.iter().fold(0.0_f64, |size, gap| size.max(gap.abs()));
    let off = (0..6 * n).map(|k| {
        let (plane, frame, cell) = (k / (2 * n), k / n % 2, k % n);
        (gap[k] - by_all[plane * all + first[frame] + cell]).abs() / size
    });
    let off = off.fold(0.0, f64::max);
    assert!(off < 5e-4, "{off}");
}

/// Truth: patches without a place of their own, or of different materials, are refused with the reason.
#[test]
fn patches_that_do_not_suit() {
    let refused = |spec: FeSpec, contacts: &[FaceContact]| {
        let found = MultiPatchBody::new(spec, contacts, &CondensationResources::default());
        found.err().expect("a refusal").to_string()
    };
    let stiffness = steel();
    let spec = || slab(Hex8, (6, 6, WIDTH), &stiffness, vec![]);
    let near = two_frames(1.3);
    let contacts = near.each_ref().map(|frame| FaceContact { group: "z1", side: Side::Lower, frame });
    let told = refused(spec(), &contacts);
    assert!(told.contains("two patches are 0.1 apart") && told.contains("one frame"), "{told}");
    let frame = frame(8);
    let above = FaceContact { group: "z1", side: Side::Lower, frame: &frame };
    let below = FaceContact { group: "z0", side: Side::Upper, frame: &frame };
    let held = FeSpec { supports: vec![clamp("z0")], ..spec() };
    let told = refused(held, &[above, below]);
    assert!(told.contains("`z0` has no place for a half-space"), "{told}");
    let thin = slab(Hex8, (6, 2, 0.2), &stiffness, vec![]);
    let told = refused(thin, &[above, below]);
    assert!(told.contains("`z1` has no place for a half-space"), "{told}");
    let loaded = FeSpec { body_force: [0.0, 0.0, -1e-4], ..spec() };
    let told = refused(loaded, &[above, below]);
    assert!(told.contains("loads and prescribed displacements"), "{told}");
    // Two elements along each edge that lock.
    let told = refused(
        slab(Hex8, (2, 1, 2.0), &Stiffness::isotropic(210e3, 0.49).unwrap(), vec![]),
        &[above, below],
    );
    assert!(told.contains("the half-space under `z1` is not good enough: the estimated error"), "{told}");
    // Long frames that cross each other, the corners and middles of each far from the other.
    let crossing = [([2.0, 0.1], [-0.1, 0.0]), ([0.1, 1.5], [1.3, 0.9])]
        .map(|(half, middle)| ContactFrame::grid(half, [8, 8], middle, 0.0).unwrap());
    let contacts = crossing.each_ref().map(|frame| FaceContact { group: "z1", side: Side::Lower, frame });
    let told = refused(slab(Hex8, (6, 6, 6.0), &stiffness, vec![]), &contacts);
    assert!(told.contains("two patches are 0 apart"), "{told}");
}
