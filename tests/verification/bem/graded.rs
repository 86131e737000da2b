//! Compressed operators on cells of very different size.

use std::sync::Arc;

use orthowear::bem::half_space::{CompressedFlexibility, CrossBlocks, Side};
use orthowear::body::{ElasticBody, HalfSpaceBody, Loading};
use orthowear::error::ErrorKind;
use orthowear::flexibility::Flexibility;
use orthowear::laws::friction::FrictionLaw;
use orthowear::linalg::memory::MemoryLimit;

use super::compressed::{Cells, model};
use super::{Random, green, pair, steel};
use crate::common::{indent, press, relative, solve, usual_or_finest};

/// `2 m` x `2 m` rectangles over a square of side 2. Their sides grow from the middle to the edge of the square, by the factor
/// `ratio` in total.
fn graded(m: usize, ratio: f64) -> Cells {
    let growth = ratio.powf(1.0 / (m - 1) as f64);
    let mut ends = vec![0.0];
    (0..m).for_each(|k| ends.push(ends[k] + growth.powi(k as i32)));
    let at = |k: usize| ends[k.abs_diff(m)] / ends[m] * if k < m { -1.0 } else { 1.0 };
    let cell = |k: usize| {
        let (i, j) = (k / (2 * m), k % (2 * m));
        vec![[at(i), at(j)], [at(i + 1), at(j)], [at(i + 1), at(j + 1)], [at(i), at(j + 1)]]
    };
    Cells::of((0..4 * m * m).map(cell).collect())
}

/// Truth: products with the dense operator. They differ from products with the compressed operator by less than 3 × tolerance ×
/// the largest gap.
#[test]
fn cells_of_unlike_size_keep_the_tolerance() {
    for ratio in [1e3, 1e5] {
        let cells = graded(usual_or_finest(11, 18), ratio);
        let n = cells.n();
        for green in [green(&steel(), Side::Lower), pair(30.0)] {
            let dense = cells.dense(&green);
            let rough = Random(5).vector(3 * n);
            let mut expected = vec![0.0; 3 * n];
            dense.apply(&rough, &mut expected);
            let scale = expected.iter().fold(0.0f64, |most, x| most.max(x.abs()));
            for tolerance in [1e-5, 1e-8] {
                let compressed = cells.compressed(&green, tolerance);
                let mut found = vec![f64::NAN; 3 * n];
                compressed.apply(&rough, &mut found);
                let apart = found.iter().zip(&expected).fold(0.0f64, |most, (f, e)| most.max((f - e).abs()));
                assert!(apart < 3.0 * tolerance * scale, "{ratio} {tolerance}: {}", apart / scale);
            }
        }
    }
}

/// Truth: the operator that `take_flexibility` returns. A body recovers its displacements with the same operator, bit by bit.
/// With [`CrossBlocks::Keep`] the operator is dense, with [`CrossBlocks::SkipVanishing`] it is compressed to 1e-3.
#[test]
fn fields_are_those_of_the_operator_that_was_taken() {
    let cells = Cells::irregular(30);
    let (n, frame) = (cells.n(), cells.frame());
    assert!(n > 1000);
    let tractions = Random(8).vector(3 * n);
    let body = || HalfSpaceBody::new(&steel(), Side::Upper, &frame).expect("a body").with_tolerance(1e-3);
    let field =
        |body: &HalfSpaceBody| body.recover(Loading::of_contact(&tractions)).expect("a field").displacement;
    let mut exact = vec![0.0; 3 * n];
    cells.dense(&green(&steel(), Side::Upper)).apply(&tractions, &mut exact);
    let is = |field: &[[f64; 3]], gap: &[f64]| {
        let pairs = field.iter().enumerate().flat_map(|(i, u)| (0..3).map(move |k| (i, k, u[k])));
        pairs.fold(true, |same, (i, k, u)| same && u.abs() == gap[k * n + i].abs())
    };
    for cross in [CrossBlocks::Keep, CrossBlocks::SkipVanishing] {
        let mut taken = body();
        let operator = taken.take_flexibility(cross).expect("an operator").expect("not rigid");
        let mut gap = vec![0.0; 3 * n];
        operator.apply(&tractions, &mut gap);
        assert!(is(&field(&taken), &gap));
        assert_eq!(is(&field(&taken), &exact), cross == CrossBlocks::Keep);
        assert_eq!(is(&field(&body().with_blocks(cross)), &exact), cross == CrossBlocks::Keep);
    }
}

fn fan(n: usize) -> Cells {
    let at = |k: usize| (std::f64::consts::TAU * k as f64 / n as f64).sin_cos();
    let corner = |k: usize| [at(k).1, at(k).0];
    Cells::of((0..n).map(|k| vec![[0.0; 2], corner(k), corner(k + 1)]).collect())
}

/// Truth: pressures under a sphere with the dense operator. A gap error of the tolerance changes the pressure of a cell by
/// tolerance × contact size / cell size. The frame has 28 cells across, so the contact is at most 28 mean cell sizes wide. The
/// bound of 112 times the tolerance allows four times this value. The lower bound shows that the compressed operator is not
/// exact.
#[test]
#[ignore = "11 s; usual: bem::compressed::contacts_are_those_of_the_dense_operator"]
fn pressures_follow_the_tolerance() {
    for ratio in [1.5, 1e3, 1e5] {
        let cells = graded(14, ratio);
        let green = pair(30.0);
        let pressures = |operator: Arc<dyn Flexibility>| {
            let mut model = model(&cells, operator);
            model.friction = FrictionLaw::None;
            solve(&model, &[press(100.0)]).state.tractions
        };
        let exact = pressures(Arc::new(cells.dense(&green)));
        for tolerance in [1e-4, 1e-8] {
            let found = pressures(Arc::new(cells.compressed(&green, tolerance)));
            let n = cells.n();
            let most = exact[2 * n..].iter().fold(0.0f64, |most, p| most.max(*p));
            let apart = found[2 * n..]
                .iter()
                .zip(&exact[2 * n..])
                .fold(0.0f64, |most, (a, b)| most.max((a - b).abs()));
            let apart = apart / most;
            assert!(apart < 112.0 * tolerance && apart > 1e-3 * tolerance, "{ratio} {tolerance}: {apart}");
        }
    }
}

/// Truth: the memory of the operator in bytes. For cells of similar size, the estimate from the cells alone is 0.75 to 1.33 times
/// the true size. For cells of different size it is 0.75 to 2 times the true size. With a memory limit of half the estimate, the
/// operator is refused.
#[test]
fn memory_is_told_by_the_cells() {
    let (one, two) = (green(&steel(), Side::Lower), pair(30.0));
    let [squares, sides, triangles] = usual_or_finest([24, 13, 800], [30, 18, 1100]);
    let cases = [
        (Cells::irregular(squares), false, 1.33),
        (graded(sides, 1e3), false, 2.0),
        (fan(triangles), true, 1.33),
    ];
    for (cells, whole, most) in cases {
        for (green, components) in [(&one, 6), (&two, 9)] {
            for tolerance in [1e-3, 1e-8] {
                let Cells { centers, corners, areas } = &cells;
                let told = CompressedFlexibility::typical_bytes(centers, corners, areas, green, tolerance);
                let operator = cells.compressed(green, tolerance);
                let (n, mut out) = (cells.n(), vec![0.0; 3 * cells.n()]);
                let ones = vec![1.0; 3 * n];
                assert!(operator.precondition(&ones, &mut out));
                let ratio = told as f64 / operator.bytes() as f64;
                assert!(ratio > 0.75 && ratio < most, "{n} {tolerance}: {ratio}");
                assert!(!whole || told > 4 * components * n * n);
                let limit = MemoryLimit::of_scene(told as u64 / 2);
                let refused =
                    CompressedFlexibility::within_memory(centers, corners, areas, green, tolerance, &limit);
                let error = refused.err().expect("a refusal");
                assert_eq!(error.kind(), ErrorKind::Resources);
                assert!(error.message().contains("solver.compression_tolerance"), "{error}");
            }
        }
    }
}

/// Sectors of concentric rings, which fill a regular polygon with the area of the unit circle. The widths of the rings decrease
/// geometrically to a thousandth at the edge.
fn rings(n_rings: usize, n_sectors: usize) -> Cells {
    let fall = 1e-3f64.powf(1.0 / (n_rings - 1) as f64);
    let widths: Vec<f64> = (0..n_rings).map(|k| fall.powi(k as i32)).collect();
    let step = std::f64::consts::TAU / n_sectors as f64;
    // A regular polygon of radius R has the area n R^2 sin(step) / 2.
    let outer = (2.0 * std::f64::consts::PI / (n_sectors as f64 * step.sin())).sqrt();
    let scale = outer / widths.iter().sum::<f64>();
    let mut radii = vec![0.0];
    widths.iter().for_each(|width| radii.push(radii[radii.len() - 1] + scale * width));
    let at = |ring: usize, sector: usize| {
        let (sin, cos) = (step * (sector % n_sectors) as f64).sin_cos();
        [radii[ring] * cos, radii[ring] * sin]
    };
    let mut cells = Vec::new();
    for (ring, sector) in (0..n_rings).flat_map(|ring| (0..n_sectors).map(move |sector| (ring, sector))) {
        let outside = [at(ring + 1, sector), at(ring + 1, sector + 1)];
        cells.push(if ring == 0 {
            vec![[0.0; 2], outside[0], outside[1]]
        } else {
            vec![at(ring, sector), outside[0], outside[1], at(ring, sector + 1)]
        });
    }
    Cells::of(cells)
}

/// Truth: F = 2 E* a delta under a rigid flat punch of radius a at the approach delta (case `str-graded-mesh` of
/// docs/verification.md; Boussinesq). The tolerance 1e-4 holds for extrapolated forces. Errors are of second order in the angle
/// of a sector and in the growth per ring. All pressures are positive and grow from ring to ring.
#[test]
fn flat_punch_on_graded_rings() {
    let modulus = 210e3 / 0.91;
    let force = |n_rings: usize, sectors: usize| {
        let cells = rings(n_rings, sectors);
        let n = cells.n();
        let operator = cells.dense(&green(&steel(), Side::Lower));
        let (mut pressure, mut gap) = (vec![0.0; 3 * n], vec![0.0; 3 * n]);
        for cell in (0..n).step_by(5) {
            pressure[2 * n + cell] = 1.0;
            operator.apply(&pressure, &mut gap);
            pressure[2 * n + cell] = 0.0;
            assert!(gap[2 * n..].iter().all(|gap| *gap > 0.0));
        }
        let mut model = model(&cells, Arc::new(operator));
        model.friction = FrictionLaw::None;
        model.initial_gap.iter_mut().for_each(|gap| *gap = 0.0);
        let result = solve(&model, &[indent(1e-3)]);
        assert!(result.records[0].converged);
        let pressure = &result.state.tractions[2 * n..];
        assert!(pressure.iter().all(|p| *p > 0.0));
        let of_rings: Vec<f64> = pressure.iter().step_by(sectors).copied().collect();
        assert!(of_rings.windows(2).all(|pair| pair[0] < pair[1]), "{of_rings:?}");
        let force = result.records[0].normal_force / (2.0 * modulus * 1e-3);
        println!("{n_rings} rings of {sectors}: {force}, {} iterations", result.records[0].iterations);
        force
    };
    let [[a, b], [c, d]] = [12, 23].map(|n_rings| [36, 48].map(|sectors| force(n_rings, sectors)));
    // The error is proportional to 1 / sectors². The error with 48 sectors is 36² / (48² - 36²) = 9 / 7 of the change from 36 to
    // 48 sectors.
    let [coarse, fine] = [b + (b - a) * 9.0 / 7.0, d + (d - c) * 9.0 / 7.0];
    // The error is proportional to the squared logarithm of the growth per ring. This logarithm is halved from 12 to 23 rings,
    // with 11 and 22 steps to a thousandth. The error with 23 rings is therefore a third of the change.
    let limit = fine + (fine - coarse) / 3.0;
    assert!(relative(limit, 1.0) < 1e-4, "{coarse} {fine} {limit}");
}
