//! Flexibilities formed for the candidate cells only, which may come into contact. They are extended when contact reaches other
//! cells.

use super::block::{pairs, tied};
use super::half_spaces::{difference, gaps};
use super::random;
use super::states::history;
use orthowear::body::BodyLoad;
use orthowear::coupling::Coupling;
use orthowear::frame::ContactFrame;

fn frame() -> ContactFrame {
    ContactFrame::grid([1.1, 0.9], [8, 7], [0.1, -0.2], 0.3).unwrap()
}

fn within(radius: f64) -> ContactFrame {
    let mut frame = frame();
    let near = |cell| frame.plane_coordinates(cell).iter().map(|x| x * x).sum::<f64>() <= radius * radius;
    frame.candidates = Some((0..frame.n_cells()).map(near).collect());
    frame
}

/// Truth: a solution of the whole body. The condensed flexibility must give the same gap, because condensation is exact
/// elimination. For half-spaces the truth is the direct sum over the cells. The tolerance 1e-11 covers rounding of solves with
/// the factorised stiffness.
#[test]
fn operators_agree_with_bodies_solved_afresh() {
    let frame = frame();
    let n = frame.n_cells();
    let tractions = random(3 * n);
    let cells: Vec<usize> = (0..n).step_by(3).collect();
    for (name, mut pair) in pairs(&frame) {
        let coupled = tied(&mut pair, &frame, Coupling::Schur);
        let gap = gaps(&coupled, &tractions);
        let afresh =
            coupled.flexibility.direct_sums(&cells, &tractions).expect("a factor at hand, or a grid");
        let some = |plane: usize| cells.iter().map(move |cell| plane * n + cell);
        let expected: Vec<f64> = (0..3).flat_map(some).map(|i| gap[i]).collect();
        let found: Vec<f64> = (0..3).flat_map(|plane| afresh.iter().map(move |gap| gap[plane])).collect();
        assert!(difference(&found, &expected) < 1e-11, "{name}: {:e}", difference(&found, &expected));
    }
}

/// Truth: the operator of all cells. The first comparison has tractions on candidates only and completes the gap of the other
/// cells. Then the other cells are formed in two portions. The tolerance 1e-11 covers rounding of solves with the factorised
/// stiffness.
#[test]
fn what_is_not_formed_is_completed_or_grown() {
    let (whole, part) = (frame(), within(0.5));
    let n = whole.n_cells();
    let candidates = part.candidates.clone().unwrap();
    for ((name, mut all), (_, mut some)) in pairs(&whole).into_iter().zip(pairs(&part)) {
        let all = tied(&mut all, &whole, Coupling::Schur);
        let some = tied(&mut some, &part, Coupling::Schur);
        assert_eq!(all.loads.len(), some.loads.len());
        let load_gaps =
            |loads: &[BodyLoad]| loads.iter().flat_map(|load| load.gap.clone()).collect::<Vec<_>>();
        let by_loads = load_gaps(&all.loads).into_iter().zip(load_gaps(&some.loads));
        assert!(by_loads.fold(0.0, |most: f64, (a, b)| most.max((a - b).abs())) < 1e-14, "{name}");
        let others: Vec<usize> = (0..n).filter(|&cell| !candidates[cell]).collect();
        // Half-spaces form all cells at once.
        let unformed = some.flexibility.unformed_cells();
        assert_eq!(unformed, if name.contains("FE") { others.clone() } else { Vec::new() }, "{name}");
        if unformed.is_empty() {
            continue;
        }
        let mut tractions = random(3 * n);
        for plane in 0..3 {
            others.iter().for_each(|&cell| tractions[plane * n + cell] = 0.0);
        }
        let mut completed = gaps(&some, &tractions);
        assert!(difference(&completed, &gaps(&all, &tractions)) > 1e-3, "{name}: nothing to complete");
        some.flexibility.complete_gap(&tractions, &mut completed).unwrap();
        assert!(difference(&completed, &gaps(&all, &tractions)) < 1e-11, "{name}");
        some.flexibility.form_rows(&others[..5]).unwrap();
        assert_eq!(some.flexibility.unformed_cells(), others[5..], "{name}");
        some.flexibility.form_rows(&others[3..]).unwrap();
        assert!(some.flexibility.unformed_cells().is_empty(), "{name}");
        let tractions = random(3 * n);
        assert!(difference(&gaps(&some, &tractions), &gaps(&all, &tractions)) < 1e-11, "{name}");
        let (mut normal, mut expected) = (vec![0.0; n], vec![0.0; n]);
        some.flexibility.apply_normal(&tractions[2 * n..], &mut normal);
        all.flexibility.apply_normal(&tractions[2 * n..], &mut expected);
        assert!(difference(&normal, &expected) < 1e-11, "{name}");
    }
}

/// Truth: the same steps with all cells formed. The tolerance 1e-8 follows from certificates of 1e-12 and a condition number of
/// the flexibility below 1e4.
#[test]
fn contact_grows_beyond_its_candidates() {
    let (whole, part) = (frame(), within(0.15));
    assert!((1..5).contains(&part.candidates.iter().flatten().filter(|&&is| is).count()));
    for ((name, mut all), (_, mut some)) in pairs(&whole).into_iter().zip(pairs(&part)) {
        let all = history(&mut all, &whole, Coupling::Schur);
        let some = history(&mut some, &part, Coupling::Schur);
        for (a, b) in all.records.iter().zip(&some.records) {
            assert!(a.converged && b.converged, "{name} {}: {:?}", a.name, b.certificate);
            assert!(b.certificate.energy_balance < 1e-10, "{name} {}: {:?}", a.name, b.certificate);
            let values = |r: &orthowear::evolution::records::IncrementRecord| {
                [r.normal_force, r.tangential_force[0], r.tangential_force[1], r.peak_pressure]
            };
            assert!(difference(&values(a), &values(b)) < 1e-8, "{name} {}", a.name);
            assert!((a.worn_volume - b.worn_volume).abs() <= 1e-8 * a.worn_volume, "{name} {}", a.name);
        }
        assert!(difference(&all.state.tractions, &some.state.tractions) < 1e-8, "{name}");
        assert!(difference(&all.state.gap, &some.state.gap) < 1e-8, "{name}");
    }
}
