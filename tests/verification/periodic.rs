//! Contact on periodic frames: line contacts and wavy surfaces. The catalogue of cases is docs/verification.md.

use std::f64::consts::PI;
use std::sync::Arc;

use orthowear::bem::half_space::{CrossBlocks, PeriodicFlexibility, Side, SurfaceGreen};
use orthowear::contact::SolverOptions;
use orthowear::evolution::records::Outcome;
use orthowear::evolution::step::{Step, Tangential};
use orthowear::evolution::{Model, RunResult};
use orthowear::frame::{ContactFrame, GapShape, InitialGap};
use orthowear::laws::friction::FrictionLaw;
use orthowear::laws::wear::WearLaw;
use orthowear::material::Stiffness;

use crate::common::{half_spaces, im7, press, relative, solve, solve_with, sphere, steel, step};

/// Model of two half-spaces on one period. A body without material is rigid.
pub fn repeated(
    materials: [Option<&Stiffness>; 2],
    (half_width, cells, periodic): ([f64; 2], [usize; 2], [bool; 2]),
    gap: impl Fn(f64, f64) -> f64,
) -> Model {
    let frame =
        ContactFrame::grid(half_width, cells, [0.0; 2], 0.0).expect("a grid").with_periodicity(periodic);
    let grid = frame.grid.expect("a grid frame");
    let greens: Vec<SurfaceGreen> = [Side::Lower, Side::Upper]
        .into_iter()
        .zip(materials)
        .filter_map(|(side, material)| Some(SurfaceGreen::new(material?, side).expect("a Green's function")))
        .collect();
    let green = SurfaceGreen::sum(&greens.iter().collect::<Vec<_>>());
    let cross = CrossBlocks::SkipVanishing;
    let operator = PeriodicFlexibility::new(grid.cells, grid.spacing, periodic, &green, cross);
    let n = frame.n_cells();
    let mut initial_gap = vec![0.0; 3 * n];
    for (cell, center) in frame.centers.iter().enumerate() {
        initial_gap[2 * n + cell] = gap(center.x, center.y);
    }
    Model {
        frame,
        flexibility: Arc::new(operator.expect("an operator")),
        initial_gap,
        loads: Vec::new(),
        floating: Vec::new(),
        friction: FrictionLaw::None,
        wear: WearLaw::None,
        wear_share: 1.0,
    }
}

/// Model of a rigid body on steel. The frame is periodic along y, with one cell of 1 mm. The gap depends on x only.
fn line(half_width: f64, cells: usize, gap: impl Fn(f64) -> f64) -> Model {
    let (steel, frame) = (steel(), ([half_width, 0.5], [cells, 1], [false, true]));
    repeated([Some(&steel), None], frame, |x, _| gap(x))
}

/// Contact modulus E* of a rigid body on steel, MPa.
const E_STAR: f64 = 210e3 / 0.91;

fn pressures(result: &RunResult) -> &[f64] {
    let n = result.state.tractions.len() / 3;
    &result.state.tractions[2 * n..]
}

/// Truth: catalogue case `hertz-line` for a load P' per length. The peak pressure is p0 = 2 P' / (π a), and half the contact
/// width is a = sqrt(4 P' R / (π E*)). The catalogue's tolerance is 1e-2, and cells of about a / 47 give 1e-3. The kernel
/// vanishes at a distance w, half the width of the frame. With ∫ p ln|x| = P' (ln(a / 2) - 1/2) (Johnson 1985, ch. 2), the
/// approach is δ = (2 P' / π E*) (ln(2 w / a) + 1/2).
#[test]
fn hertz_line() {
    let (width, load) = (0.5, 500.0);
    let model = line(width, 200, |x| x * x / 40.0);
    let record = &solve(&model, &[press(load)]).records[0];
    let a = 0.2348908547;
    assert!(relative(record.peak_pressure, 1355.139546) < 1e-3, "{}", record.peak_pressure);
    assert!((record.contact_area - 2.0 * a).abs() < 2.0 * 0.005, "{}", record.contact_area);
    let depth = 2.0 * load / (PI * E_STAR) * ((2.0 * width / a).ln() + 0.5);
    assert!(relative(record.approach, depth) < 1e-3, "{} {depth}", record.approach);
    assert!(!record.contact_touches_edge);
}

/// Truth: catalogue case `wedge-2d` for the slope β and a load P' per length. Half the contact width is a = P' / (E* tan β), to a
/// cell. The pressure is p(a / 2) = (E* tan β / π) acosh 2, to 1e-2.
#[test]
fn wedge_2d() {
    let model = line(0.1, 400, |x| x.abs() * 2.0_f64.to_radians().tan());
    let result = solve(&model, &[press(500.0)]);
    let (a, h) = (0.06204521545, 0.0005);
    assert!((result.records[0].contact_area / 2.0 - a).abs() < h, "{}", result.records[0].contact_area);
    let position = (a / 2.0 + 0.1) / h - 0.5;
    let (cell, share) = (position.floor() as usize, position.fract());
    let p = pressures(&result);
    let found = (1.0 - share) * p[cell] + share * p[cell + 1];
    assert!(relative(found, 3378.187305) < 1e-2, "{found}");
}

/// Model of a rigid body on the half-space `lower`. The gap is a wave of length 1 mm and amplitude 0.002 mm.
fn wave(cells: [usize; 2], lower: &Stiffness) -> Model {
    let frame = ([0.5, 0.3], cells, [true, true]);
    repeated([Some(lower), None], frame, |x, _| 0.002 * (1.0 - (2.0 * PI * x).cos()))
}

/// Truth: catalogue case `wavy-1d-westergaard` in partial contact. Half the contact width agrees to one cell of 256, the peak
/// pressure to 5e-3.
#[test]
fn wavy_1d_westergaard() {
    let expected =
        [(0.1, 0.1024163823, 917.0389168), (0.5, 0.25, 2050.561356), (0.9, 0.3975836177, 2751.116751)];
    let pstar = 1449.96584;
    for (ratio, a, peak) in expected {
        let result = solve(&wave([256, 1], &steel()), &[press(ratio * pstar * 0.6)]);
        let record = &result.records[0];
        assert!(
            (record.contact_area / 0.6 / 2.0 - a).abs() < 1.0 / 256.0,
            "{ratio}: {}",
            record.contact_area
        );
        assert!(relative(record.peak_pressure, peak) < 5e-3, "{ratio}: {}", record.peak_pressure);
        assert!(!record.contact_touches_edge && result.warnings.is_empty(), "{:?}", result.warnings);
        assert_eq!(record.certificate.operator_defect, None);
    }
}

/// Truth: if the mean pressure p̄ exceeds p*, contact is complete. Then p = p̄ + p* cos(2 π x / λ), to 1e-10, and the approach
/// equals the amplitude Δ of the wave. Here p* = 2 π Δ / (λ W_nn), with the length λ = 1 mm of the wave. W_nn is the normal entry
/// of the surface admittance in the direction of the wave. For CFRP, p* is catalogue case `aniso-sinusoidal-load`.
#[test]
fn complete_contact_is_exact() {
    let options = SolverOptions { tolerance: 1e-12, ..SolverOptions::default() };
    for (lower, cells) in [(steel(), [256, 1]), (steel(), [15, 4]), (im7(30.0), [64, 2])] {
        let w = SurfaceGreen::new(&lower, Side::Lower).expect("a Green's function").symbol(0.0)[(2, 2)].re;
        let pstar = 2.0 * PI * 0.002 / w;
        let load = 1.3 * pstar;
        let result = solve_with(&wave(cells, &lower), &[press(load * 0.6)], &options);
        assert_eq!(result.outcome, Outcome::Converged);
        for (i, p) in pressures(&result).iter().enumerate() {
            let x = ((i / cells[1]) as f64 + 0.5) / cells[0] as f64 - 0.5;
            let exact = load + pstar * (2.0 * PI * x).cos();
            assert!((p - exact).abs() < 1e-10 * pstar, "{i}: {p} {exact}");
        }
        assert!(relative(result.records[0].approach, 0.002) < 1e-9, "{}", result.records[0].approach);
    }
}

/// Truth: the contact on an open frame. Periodic images hardly affect a contact that is much smaller than the frame. With two
/// periodic directions, the four nearest images lie at the distance L. They change the coefficient 1 / (2 R) of the gap by P / (π
/// E* L³), a fraction of about 2e-3. Tractions are constant over the cells along open directions, and smooth along periodic
/// directions. With about 35 cells along the contact, this difference changes the peak pressure by less than 5e-3.
#[test]
fn large_frames_agree_with_open_ones() {
    let (load, gap) = (60.0, sphere(50.0));
    let lower = im7(30.0);
    let (half_width, cells) = (2.0, 128);
    let open = solve(&half_spaces(&lower, None, (half_width, cells), &gap), &[press(load)]);
    for periodic in [[true, true], [false, true], [true, false]] {
        let model = repeated([Some(&lower), None], ([half_width; 2], [cells; 2], periodic), &gap);
        let result = solve(&model, &[press(load)]);
        let (found, expected) = (&result.records[0], &open.records[0]);
        assert!(relative(found.peak_pressure, expected.peak_pressure) < 5e-3, "{periodic:?} {found:?}");
        assert!(relative(found.contact_area, expected.contact_area) < 3e-2, "{periodic:?} {found:?}");
    }
}

/// Truth: Cattaneo's and Mindlin's solution in plane strain, for equal bodies (K.L. Johnson 1985, 7.2). Let P be the normal and Q
/// the tangential force, c the half-width of the stick area and a the half-width of the contact. Then c / a = sqrt(1 - Q / μP),
/// to one cell.
#[test]
fn partial_slip_of_a_line_contact() {
    let steel = steel();
    for across in [1, 3] {
        let frame = ([0.5, 0.5], [100, across], [false, true]);
        let mut model = repeated([Some(&steel), Some(&steel)], frame, |x, _| x * x / 40.0);
        model.friction = FrictionLaw::Coulomb { mu: 0.3 };
        let shear = Step { tangential: Some(Tangential::Force([75.0, 0.0])), ..step("shear") };
        let result = solve(&model, &[press(500.0), shear]);
        let record = &result.records[1];
        assert_eq!(result.outcome, Outcome::Converged);
        let a = (4.0 * 500.0 * 20.0 / (PI * 0.5 * E_STAR)).sqrt();
        let c = a * (0.5_f64).sqrt();
        assert!((record.stick_area / 2.0 - c).abs() < 0.01, "{} {c}", record.stick_area / 2.0);
        assert!(relative(record.tangential_force[0], 75.0) < 1e-7);
    }
}

/// Truth: an offset moves the gap. Each cell has the gap of the nearest periodic image of the shape.
#[test]
fn shapes_stand_at_their_nearest_image() {
    let frame =
        ContactFrame::grid([1.5; 2], [6; 2], [0.0; 2], 0.0).expect("a grid").with_periodicity([true, true]);
    let at = |offset| {
        let gap = InitialGap { offset, ..InitialGap::from(GapShape::Sphere { radius: 10.0 }) };
        gap.evaluate(&frame).expect("a gap")
    };
    let (middle, moved) = (at([0.0; 2]), at([1.0, -1.0]));
    for ix in 0..6 {
        for iy in 0..6 {
            let (to, from) = (((ix + 2) % 6) * 6 + (iy + 4) % 6, ix * 6 + iy);
            assert!((moved[to] - middle[from]).abs() < 1e-14, "{ix} {iy}");
        }
    }
}
