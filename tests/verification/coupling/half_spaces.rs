//! Half-spaces and rigid bodies on one frame.

use super::random;
use crate::common::{im7, steel};
use nalgebra::Vector3;
use orthowear::bem::half_space::CrossBlocks::{self, SkipVanishing};
use orthowear::body::{ElasticBody, HalfSpaceBody, Loading, RigidBody};
use orthowear::coupling::{CoupledBodies, Coupling, couple};
use orthowear::frame::{ContactFrame, Side};
use orthowear::geometry::Triad;
use orthowear::material::Stiffness;

/// IM7/8551-7 with the fibre tilted out of the surface by `tilt` and rotated about the normal by `azimuth`, degrees.
pub fn cfrp(tilt: f64, azimuth: f64) -> Stiffness {
    im7(tilt).rotated(&Triad::horizontal(azimuth.to_radians()).0)
}

fn half_space(stiffness: &Stiffness, side: Side, frame: &ContactFrame) -> HalfSpaceBody {
    HalfSpaceBody::new(stiffness, side, frame).expect("a half-space")
}

fn tied(body1: &mut dyn ElasticBody, body2: &mut dyn ElasticBody, frame: &ContactFrame) -> CoupledBodies {
    couple(body1, body2, frame, Coupling::Schur, SkipVanishing).expect("coupled bodies")
}

pub fn gaps(coupled: &CoupledBodies, tractions: &[f64]) -> Vec<f64> {
    let mut gap = vec![f64::NAN; tractions.len()];
    coupled.flexibility.apply(tractions, &mut gap);
    gap
}

pub fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |m, v| m.max(v.abs()))
}

pub fn difference(a: &[f64], b: &[f64]) -> f64 {
    let apart: Vec<f64> = a.iter().zip(b).map(|(a, b)| a - b).collect();
    largest(&apart) / largest(b)
}

/// Truth: S = S1 + S2 for the flexibility S of a pair and the flexibilities S1 and S2 of its half-spaces
/// (docs/theory-half-space.md). The tolerance 1e-12 covers rounding of the Fourier transforms.
#[test]
fn a_pair_is_the_sum_of_its_halves() {
    let frame = ContactFrame::grid([1.0, 0.8], [8, 6], [0.3, 0.1], 0.4).unwrap();
    let lower = || half_space(&cfrp(30.0, 20.0), Side::Lower, &frame);
    let upper = || half_space(&steel(), Side::Upper, &frame);
    let tractions = random(3 * 48);
    let both = gaps(&tied(&mut lower(), &mut upper(), &frame), &tractions);
    let one = gaps(&tied(&mut lower(), &mut RigidBody, &frame), &tractions);
    let two = gaps(&tied(&mut RigidBody, &mut upper(), &frame), &tractions);
    let sum: Vec<f64> = one.iter().zip(&two).map(|(a, b)| a + b).collect();
    assert!(difference(&both, &sum) < 1e-12, "{:e}", difference(&both, &sum));
}

/// Truth: S = S1 + S2 for the flexibilities of a pair and of its half-spaces. If vanishing blocks are skipped, one operator
/// stands for both half-spaces. If they are kept, two operators are applied. The tolerance 1e-12 covers rounding of the Fourier
/// transforms.
#[test]
fn one_operator_for_two_half_spaces() {
    let frame = ContactFrame::grid([1.0, 0.8], [8, 6], [0.3, 0.1], 0.4).unwrap();
    let tractions = random(3 * 48);
    let answer = |cross: CrossBlocks| {
        let mut lower = half_space(&cfrp(30.0, 20.0), Side::Lower, &frame);
        let mut upper = half_space(&steel(), Side::Upper, &frame);
        let coupled = couple(&mut lower, &mut upper, &frame, Coupling::Schur, cross).unwrap();
        (gaps(&coupled, &tractions), coupled.skipped.len())
    };
    let ((one, listed), (two, not_listed)) = (answer(SkipVanishing), answer(CrossBlocks::Keep));
    assert_eq!((listed, not_listed), (1, 0));
    assert!(difference(&one, &two) < 1e-12);
}

/// Truth: invariance. A common rotation of frame, material and tractions changes nothing. The tolerance is 1e-11, because the
/// series of the Green's function is truncated at 1e-13 of its largest term.
#[test]
fn a_turned_frame_sees_the_turned_material() {
    let tractions = random(3 * 48);
    let answer = |azimuth: f64| {
        let frame = ContactFrame::grid([1.0, 0.8], [8, 6], [0.0, 0.0], f64::to_radians(azimuth)).unwrap();
        let mut lower = half_space(&cfrp(40.0, 10.0 + azimuth), Side::Lower, &frame);
        gaps(&tied(&mut lower, &mut RigidBody, &frame), &tractions)
    };
    let (straight, turned) = (answer(0.0), answer(35.0));
    assert!(difference(&turned, &straight) < 1e-11, "{:e}", difference(&turned, &straight));
}

/// Truth: the FFT operator on a grid. The tolerance 1e-11 covers the errors of the influence coefficients in the dense and FFT
/// operators.
#[test]
fn dense_and_fft_agree() {
    let grid = ContactFrame::grid([1.0, 0.8], [7, 5], [0.3, 0.1], 0.4).unwrap();
    let loose = grid.clone().retain_cells(&vec![true; grid.n_cells()]);
    let tractions = random(3 * 35);
    let answer = |frame: &ContactFrame| {
        let mut lower = half_space(&cfrp(30.0, 20.0), Side::Lower, frame);
        gaps(&tied(&mut lower, &mut half_space(&steel(), Side::Upper, frame), frame), &tractions)
    };
    let apart = difference(&answer(&loose), &answer(&grid));
    assert!(apart < 1e-11, "{apart:e}");
}

/// Truth: the definition of the gap. The displacements u1 and u2 of the bodies under the tractions P satisfy u2 - u1 = S P, with
/// the flexibility S. The tolerance 1e-12 covers rounding.
#[test]
fn recovered_displacements_make_the_gap() {
    let frame = ContactFrame::grid([1.0, 0.8], [8, 6], [0.3, 0.1], 0.4).unwrap();
    let mut lower = half_space(&cfrp(30.0, 20.0), Side::Lower, &frame);
    let mut upper = half_space(&steel(), Side::Upper, &frame);
    let tractions = random(3 * 48);
    let gap = gaps(&tied(&mut lower, &mut upper, &frame), &tractions);
    let (u1, u2) = (
        lower.recover(Loading::of_contact(&tractions)).unwrap(),
        upper.recover(Loading::of_contact(&tractions)).unwrap(),
    );
    let mut found = vec![0.0; 3 * 48];
    for cell in 0..48 {
        let apart = Vector3::from(u2.displacement[cell]) - Vector3::from(u1.displacement[cell]);
        let local = frame.triads[cell].to_local(&apart);
        (0..3).for_each(|k| found[k * 48 + cell] = local[k]);
    }
    assert!(difference(&found, &gap) < 1e-12);
}

/// Truth: for equal isotropic bodies the normal-tangential blocks cancel up to rounding (docs/theory-half-space.md). Gaps with
/// and without these blocks agree to 1e-14.
#[test]
fn vanishing_blocks_are_skipped() {
    let frame = ContactFrame::grid([1.0, 1.0], [6, 6], [0.0, 0.0], 0.0).unwrap();
    let tractions = random(3 * 36);
    let answer = |cross: CrossBlocks| {
        let mut bodies = [Side::Lower, Side::Upper].map(|side| half_space(&steel(), side, &frame));
        let [lower, upper] = &mut bodies;
        let coupled = couple(lower, upper, &frame, Coupling::Schur, cross).unwrap();
        let ledger = coupled.skipped.iter().any(|s| s.what.contains("normal and tangential"));
        (gaps(&coupled, &tractions), ledger)
    };
    let ((skipped, listed), (kept, not_listed)) = (answer(SkipVanishing), answer(CrossBlocks::Keep));
    assert!(listed && !not_listed);
    assert!(difference(&skipped, &kept) < 1e-14);
}

/// Truth: a pair of two rigid bodies is refused. A half-space on a frame that is not plane is also refused.
#[test]
fn impossible_pairs_are_refused() {
    let frame = ContactFrame::grid([1.0, 1.0], [4, 4], [0.0, 0.0], 0.0).unwrap();
    let refused =
        couple(&mut RigidBody, &mut RigidBody, &frame, Coupling::Schur, SkipVanishing).err().unwrap();
    assert!(refused.message().contains("both bodies are rigid"), "{refused}");
    let all = vec![true; frame.n_cells()];
    let mut bent = frame.retain_cells(&all);
    bent.centers[5].z = 0.1;
    let refused = HalfSpaceBody::new(&steel(), Side::Lower, &bent).err().unwrap();
    assert!(refused.message().contains("cell 5") && refused.message().contains("grid"), "{refused}");
}
