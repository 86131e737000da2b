//! Compressed flexibility operators on irregular frames, compared with dense operators.

use std::f64::consts::PI;
use std::sync::Arc;

use nalgebra::Matrix3;
use orthowear::bem::half_space::plane::compressed::TOLERANCE_RANGE;
use orthowear::bem::half_space::{CompressedFlexibility, DenseFlexibility, Side, SurfaceGreen};
use orthowear::error::ErrorKind;
use orthowear::evolution::Model;
use orthowear::flexibility::Flexibility;
use orthowear::flexibility::per_cell::PerCell;
use orthowear::frame::ContactFrame;
use orthowear::geometry::{Point, Triad};
use orthowear::laws::friction::FrictionLaw;
use orthowear::laws::wear::WearLaw;

use super::{Random, green, pair, steel};
use crate::common::{indent, press, shift, solve, sphere};

pub(super) struct Cells {
    pub centers: Vec<[f64; 2]>,
    pub corners: Vec<Vec<[f64; 2]>>,
    pub areas: Vec<f64>,
}

impl Cells {
    /// `m` x `m` distorted quadrangles over a square of side 2, finer in the middle. About one in five quadrangles is split into
    /// two triangles.
    pub fn irregular(m: usize) -> Self {
        let graded = |k: usize| {
            let x = 2.0 * k as f64 / m as f64 - 1.0;
            x * (0.5 + 0.5 * x * x)
        };
        let node = |i: usize, j: usize| {
            let (x, y) = (graded(i), graded(j));
            let bump = 0.15 / m as f64 * (3.0 * PI * x).sin() * (2.0 * PI * y).sin();
            [x + bump, y - 0.7 * bump]
        };
        let mut corners = Vec::new();
        for (i, j) in (0..m * m).map(|k| (k / m, k % m)) {
            let [a, b, c, d] = [node(i, j), node(i + 1, j), node(i + 1, j + 1), node(i, j + 1)];
            if (2 * i + j) % 5 == 0 {
                corners.extend([vec![a, b, c], vec![a, c, d]]);
            } else {
                corners.push(vec![a, b, c, d]);
            }
        }
        Self::of(corners)
    }

    pub fn of(corners: Vec<Vec<[f64; 2]>>) -> Self {
        let (mut centers, mut areas) = (Vec::new(), Vec::new());
        for polygon in &corners {
            let (mut area, mut center) = (0.0, [0.0; 2]);
            for (k, p) in polygon.iter().enumerate() {
                let q = polygon[(k + 1) % polygon.len()];
                let cross = p[0] * q[1] - p[1] * q[0];
                area += cross / 2.0;
                (0..2).for_each(|axis| center[axis] += cross * (p[axis] + q[axis]) / 6.0);
            }
            centers.push(center.map(|x| x / area));
            areas.push(area);
        }
        Self { centers, corners, areas }
    }

    pub fn n(&self) -> usize {
        self.areas.len()
    }

    pub fn dense(&self, green: &SurfaceGreen) -> DenseFlexibility {
        DenseFlexibility::new(&self.centers, &self.corners, &self.areas, green).expect("an operator")
    }

    pub fn compressed(&self, green: &SurfaceGreen, tolerance: f64) -> CompressedFlexibility {
        CompressedFlexibility::new(&self.centers, &self.corners, &self.areas, green, tolerance)
            .expect("an operator")
    }

    pub fn frame(&self) -> ContactFrame {
        let n = self.n();
        let up = |p: &[f64; 2]| Point::new(p[0], p[1], 0.0);
        let axes = Triad(Matrix3::identity());
        ContactFrame {
            centers: self.centers.iter().map(up).collect(),
            polygons: Some(self.corners.iter().map(|corners| corners.iter().map(up).collect()).collect()),
            areas: self.areas.clone(),
            triads: PerCell::Same(axes, n),
            origin: Point::zeros(),
            azimuth: 0.0,
            axes,
            grid: None,
            grid_indices: None,
            n_excluded: 0,
            candidates: None,
            symmetry_planes: None,
            symmetry_bounds: [false; 3],
            body_ends: None,
        }
    }

    /// Norm √Σ a x² weighted by the areas a of the cells. The operator is symmetric in the inner product of this norm.
    fn norm(&self, values: &[f64]) -> f64 {
        values
            .chunks(self.n())
            .flat_map(|plane| plane.iter().zip(&self.areas))
            .map(|(x, a)| a * x * x)
            .sum::<f64>()
            .sqrt()
    }
}

fn largest(cells: &Cells, operator: &dyn Flexibility) -> f64 {
    let (mut v, mut image) = (vec![1.0; 3 * cells.n()], vec![0.0; 3 * cells.n()]);
    let mut value = 0.0;
    for _ in 0..6 {
        let norm = cells.norm(&v);
        v.iter_mut().for_each(|x| *x /= norm);
        operator.apply(&v, &mut image);
        value = cells.norm(&image);
        std::mem::swap(&mut v, &mut image);
    }
    value
}

/// Truth: products with the dense operator. The error of a product is below the tolerance, relative to the largest eigenvalue
/// times the norm of the tractions. From the tolerance 1e-4 to 1e-8, the error decreases at least by a factor of 100. Diagonal
/// blocks are integrated separately and agree to 1e-12.
#[test]
fn products_are_those_of_the_dense_operator() {
    let cells = Cells::irregular(27);
    let n = cells.n();
    for green in [green(&steel(), Side::Lower), pair(30.0)] {
        let dense = cells.dense(&green);
        let bound = largest(&cells, &dense);
        let rough = Random(3).vector(3 * n);
        let smooth = vec![1.0; 3 * n];
        let mut errors = Vec::new();
        for tolerance in [1e-4, 1e-8] {
            let compressed = cells.compressed(&green, tolerance);
            let mut worst = 0.0_f64;
            for tractions in [&rough, &smooth] {
                let (mut found, mut expected) = (vec![f64::NAN; 3 * n], vec![0.0; 3 * n]);
                compressed.apply(tractions, &mut found);
                dense.apply(tractions, &mut expected);
                found.iter_mut().zip(&expected).for_each(|(f, e)| *f -= e);
                worst = worst.max(cells.norm(&found) / (bound * cells.norm(tractions)));
                compressed.apply_normal(&tractions[..n], &mut found[..n]);
                dense.apply_normal(&tractions[..n], &mut expected[..n]);
                found[..n].iter_mut().zip(&expected).for_each(|(f, e)| *f -= e);
                worst = worst.max(cells.norm(&found[..n]) / (bound * cells.norm(&tractions[..n])));
            }
            assert!(worst < tolerance, "{tolerance}: {worst}");
            errors.push(worst);
            let blocks =
                compressed.diagonal_blocks().into_vec().into_iter().zip(dense.diagonal_blocks().into_vec());
            let own = blocks.map(|(found, expected)| (found - expected).amax() / expected.amax());
            assert!(own.fold(0.0, f64::max) < 1e-12);
        }
        assert!(errors[1] < 1e-2 * errors[0], "{errors:?}");
        assert!(errors[0] > 1e-8, "{errors:?}");
    }
}

/// Truth: Betti's theorem, v·A S w = w·A S v, for the operator S and the diagonal matrix A of the cell areas. A S is also
/// positive definite. Both properties hold at the coarse tolerance 1e-3. Direct sums over the cells equal the product with the
/// dense operator.
#[test]
fn compressed_operators_are_symmetric_and_sums_direct() {
    let cells = Cells::irregular(25);
    let (n, green) = (cells.n(), pair(30.0));
    let compressed = cells.compressed(&green, 1e-3);
    let mut random = Random(21);
    let product =
        |a: &[f64], b: &[f64]| -> f64 { (0..3 * n).map(|k| cells.areas[k % n] * a[k] * b[k]).sum() };
    for _ in 0..3 {
        let (v, w) = (random.vector(3 * n), random.vector(3 * n));
        let (mut sv, mut sw) = (vec![0.0; 3 * n], vec![0.0; 3 * n]);
        compressed.apply(&v, &mut sv);
        compressed.apply(&w, &mut sw);
        let energy = product(&v, &sv);
        assert!(energy > 0.0 && (product(&v, &sw) - product(&w, &sv)).abs() < 1e-13 * energy);
    }
    let dense = cells.dense(&green);
    let mut tractions = random.vector(3 * n);
    tractions.iter_mut().step_by(3).for_each(|t| *t = 0.0);
    let mut expected = vec![0.0; 3 * n];
    dense.apply(&tractions, &mut expected);
    let scale = expected.iter().fold(0.0f64, |m, x| m.max(x.abs()));
    for (cell, sums) in
        [3, 400, n - 1].iter().zip(compressed.direct_sums(&[3, 400, n - 1], &tractions).expect("sums"))
    {
        for (plane, sum) in sums.into_iter().enumerate() {
            assert!((sum - expected[plane * n + cell]).abs() < 1e-12 * scale);
        }
    }
    assert!(compressed.couples_normal_tangential() && compressed.unformed_cells().is_empty());
}

/// Truth: equal isotropic bodies do not couple normal and tangential components. The operator does not store the zero blocks.
#[test]
fn vanishing_components_are_not_stored() {
    let cells = Cells::irregular(17);
    let n = cells.n();
    let equal = SurfaceGreen::sum(&[&green(&steel(), Side::Lower), &green(&steel(), Side::Upper)]);
    let compressed = cells.compressed(&equal, 1e-6);
    assert!(!compressed.couples_normal_tangential());
    let mut tractions = Random(4).vector(3 * n);
    tractions[2 * n..].fill(0.0);
    let mut gap = vec![f64::NAN; 3 * n];
    compressed.apply(&tractions, &mut gap);
    assert!(gap[2 * n..].iter().all(|g| *g == 0.0) && gap[..2 * n].iter().any(|g| *g != 0.0));
    let unlike = cells.compressed(&green(&steel(), Side::Lower), 1e-6);
    assert!(unlike.couples_normal_tangential() && unlike.bytes() > compressed.bytes());
}

/// Truth: blocks are computed independently, and their contributions are summed in a fixed order. Any number of threads therefore
/// gives the same bits.
#[test]
fn compressed_operators_give_the_same_bits_for_any_number_of_threads() {
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a thread pool");
        pool.install(|| {
            let cells = Cells::irregular(20);
            let operator = cells.compressed(&pair(30.0), 1e-6);
            let tractions = Random(11).vector(3 * cells.n());
            let (mut gap, mut back) = (vec![0.0; tractions.len()], vec![0.0; tractions.len()]);
            operator.apply(&tractions, &mut gap);
            assert!(operator.precondition(&gap, &mut back));
            let mut bits: Vec<u64> = gap.iter().chain(&back).map(|x| x.to_bits()).collect();
            let n = cells.n();
            operator.apply_normal(&tractions[..n], &mut gap[..n]);
            assert!(operator.precondition_normal(&gap[..n], &mut back[..n]));
            bits.extend(gap[..n].iter().chain(&back[..n]).map(|x| x.to_bits()));
            bits
        })
    };
    let one = run(1);
    assert!(one == run(2) && one == run(3));
}

/// Truth: the approximate inverse of the operator S is symmetric and positive definite in the inner product weighted by the
/// areas. The product of the approximate inverse and S has a ratio of largest to smallest eigenvalue below 25. For S alone this
/// ratio is above 100.
#[test]
fn the_approximate_inverse_makes_eigenvalues_alike() {
    let green = pair(30.0);
    for m in [14, 27] {
        let cells = Cells::irregular(m);
        let n = cells.n();
        let operator = cells.compressed(&green, 1e-8);
        let product =
            |a: &[f64], b: &[f64]| -> f64 { (0..3 * n).map(|k| cells.areas[k % n] * a[k] * b[k]).sum() };
        let inverse = |x: &[f64]| {
            let mut y = vec![0.0; 3 * n];
            assert!(operator.precondition(x, &mut y));
            y
        };
        let mut random = Random(7);
        let (v, w) = (random.vector(3 * n), random.vector(3 * n));
        let (mv, mw) = (inverse(&v), inverse(&w));
        assert!((product(&v, &mw) - product(&w, &mv)).abs() < 1e-11 * product(&v, &mv));
        // Rayleigh quotient of the approximate inverse times S, in the energy product of S.
        let step = |x: &[f64]| {
            let mut image = vec![0.0; 3 * n];
            operator.apply(x, &mut image);
            inverse(&image)
        };
        let energy = |x: &[f64], y: &[f64]| {
            let mut image = vec![0.0; 3 * n];
            operator.apply(y, &mut image);
            product(x, &image)
        };
        let quotient = |shift: f64| {
            let mut x = v.clone();
            let mut value = 0.0;
            for _ in 0..60 {
                let y = step(&x);
                value = energy(&x, &y) / energy(&x, &x);
                let next: Vec<f64> = x.iter().zip(&y).map(|(x, y)| shift * x - y).collect();
                let size = next.iter().fold(0.0f64, |m, x| m.max(x.abs()));
                x = next.into_iter().map(|x| x / size).collect();
            }
            value
        };
        let most = quotient(0.0);
        let least = quotient(most);
        assert!(least > 0.0 && most / least < 25.0, "{m}: {least} to {most}");
    }
}

pub(super) fn model(cells: &Cells, operator: Arc<dyn Flexibility>) -> Model {
    let n = cells.n();
    let mut initial_gap = vec![0.0; 3 * n];
    let gap = sphere(20.0);
    cells.centers.iter().enumerate().for_each(|(cell, p)| initial_gap[2 * n + cell] = gap(p[0], p[1]));
    Model {
        frame: cells.frame(),
        flexibility: operator,
        initial_gap,
        loads: Vec::new(),
        floating: Vec::new(),
        friction: FrictionLaw::Coulomb { mu: 0.3 },
        wear: WearLaw::None,
        wear_share: 1.0,
    }
}

/// Truth: the solution with the dense operator. Forces agree to ten times the tolerance, relative to the normal force. Under a
/// prescribed normal force without friction, the approach agrees to 1e-7. In this case the solver applies the compressed operator
/// at most as often as the dense operator.
#[test]
fn contacts_are_those_of_the_dense_operator() {
    let cells = Cells::irregular(24);
    let green = pair(30.0);
    let tolerance = 1e-6;
    let steps = [indent(0.02), shift(0.004, 30.0)];
    let wanted = solve(&model(&cells, Arc::new(cells.dense(&green))), &steps);
    let found = solve(&model(&cells, Arc::new(cells.compressed(&green, tolerance))), &steps);
    assert_eq!(wanted.records.len(), 2);
    for (found, wanted) in found.records.iter().zip(&wanted.records) {
        let close = |a: f64, b: f64| (a - b).abs() < 10.0 * tolerance * wanted.normal_force.abs();
        assert!(found.certificate.natural_residual < 1e-8);
        assert!(close(found.normal_force, wanted.normal_force));
        assert!((0..2).all(|k| close(found.tangential_force[k], wanted.tangential_force[k])));
        let defect = found.certificate.operator_defect.expect("direct sums");
        assert!(defect < tolerance && defect > 1e-12, "{defect}");
    }
    let force = [press(wanted.records[0].normal_force)];
    let mut smooth = model(&cells, Arc::new(cells.compressed(&green, 1e-8)));
    smooth.friction = FrictionLaw::None;
    let mut exact = model(&cells, Arc::new(cells.dense(&green)));
    exact.friction = FrictionLaw::None;
    let (found, wanted) = (solve(&smooth, &force), solve(&exact, &force));
    let (found, wanted) = (&found.records[0], &wanted.records[0]);
    assert!((found.approach / wanted.approach - 1.0).abs() < 1e-7);
    assert!(found.operator_applications <= wanted.operator_applications);
}

/// Truth: invalid tolerances and cells are refused as input errors.
#[test]
fn unusable_tolerances_and_cells_are_refused() {
    let cells = Cells::irregular(3);
    let green = green(&steel(), Side::Lower);
    let refused = |areas: &[f64], tolerance: f64| {
        let made = CompressedFlexibility::new(&cells.centers, &cells.corners, areas, &green, tolerance);
        made.err().expect("a refusal").kind()
    };
    for tolerance in [0.0, 0.5 * TOLERANCE_RANGE[0], 2.0 * TOLERANCE_RANGE[1], f64::NAN, -1e-8] {
        assert_eq!(refused(&cells.areas, tolerance), ErrorKind::Input);
    }
    assert_eq!(refused(&cells.areas[1..], 1e-6), ErrorKind::Input);
}
