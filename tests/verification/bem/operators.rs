//! Flexibility operators on contact frames: FFT operators on grids, and dense operators.

use super::{Random, cfrp, green, pair, relative, steel};
use nalgebra::Matrix3;
use orthowear::bem::half_space::integrals::polygon;
use orthowear::bem::half_space::{
    CrossBlocks, DenseFlexibility, FftFlexibility, PatchIntegrator, Side, SurfaceGreen,
};
use orthowear::error::ErrorKind;
use orthowear::flexibility::Flexibility;
use orthowear::material::Stiffness;
use std::f64::consts::PI;

/// Truth: direct summation of the same kernels. The tolerance 1e-13 of the largest entry covers rounding of the Fourier
/// transforms.
#[test]
fn fft_equals_direct_sum() {
    for (cells, spacing) in [([7, 5], [0.1, 0.1]), ([12, 9], [0.2, 0.05]), ([1, 6], [1.0, 1.0])] {
        let green = pair(30.0);
        let integrator = PatchIntegrator::new(&green);
        let operator = FftFlexibility::new(cells, spacing, &green, CrossBlocks::Keep).expect("an operator");
        let n = operator.n_cells();
        let tractions: Vec<f64> = (0..3 * n).map(|k| ((k * 37 % 101) as f64 / 50.0 - 1.0).sin()).collect();
        let mut gap = vec![f64::NAN; 3 * n];
        operator.apply(&tractions, &mut gap);
        let mut direct = vec![0.0; 3 * n];
        for i in 0..n {
            for j in 0..n {
                let at = |k: usize| [(k / cells[1]) as f64 * spacing[0], (k % cells[1]) as f64 * spacing[1]];
                let block = integrator.rectangle(spacing, [at(i)[0] - at(j)[0], at(i)[1] - at(j)[1]]);
                for a in 0..3 {
                    for b in 0..3 {
                        direct[a * n + i] += block[(a, b)] * tractions[b * n + j];
                    }
                }
            }
        }
        let scale = direct.iter().fold(0.0f64, |m, x| m.max(x.abs()));
        for (found, expected) in gap.iter().zip(&direct) {
            assert!((found - expected).abs() < 1e-13 * scale, "{cells:?}: {found} {expected}");
        }
    }
}

/// Truth: Betti's theorem, v·S w = w·S v for the operator S on a uniform grid. S is positive definite. The operator for pressures
/// alone is the normal-normal block of S.
#[test]
fn fft_operator_is_symmetric_and_positive() {
    let operator =
        FftFlexibility::new([9, 6], [0.1, 0.15], &pair(30.0), CrossBlocks::Keep).expect("an operator");
    let n = operator.n_cells();
    let column = |j: usize| {
        let mut unit = vec![0.0; 3 * n];
        unit[j] = 1.0;
        let mut gap = vec![0.0; 3 * n];
        operator.apply(&unit, &mut gap);
        gap
    };
    let columns: Vec<Vec<f64>> = (0..3 * n).map(column).collect();
    let dense = nalgebra::DMatrix::from_fn(3 * n, 3 * n, |i, j| columns[j][i]);
    assert!((&dense - dense.transpose()).amax() < 1e-14 * dense.amax());
    assert!(dense.clone().symmetric_eigen().eigenvalues.min() > 0.0);
    for (i, block) in operator.diagonal_blocks().iter().enumerate() {
        let found = Matrix3::from_fn(|a, b| dense[(a * n + i, b * n + i)]);
        assert!(relative(&found, block) < 1e-13);
    }
    let pressure = Random(5).vector(n);
    let mut normal = vec![0.0; n];
    operator.apply_normal(&pressure, &mut normal);
    for i in 0..n {
        let expected: f64 = (0..n).map(|j| dense[(2 * n + i, 2 * n + j)] * pressure[j]).sum();
        assert!((normal[i] - expected).abs() < 1e-14 * dense.amax() * n as f64);
    }
}

/// Truth: any number of threads gives the same bits.
#[test]
fn operators_give_the_same_bits_for_any_number_of_threads() {
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a thread pool");
        pool.install(|| {
            let green = pair(30.0);
            let (centers, cells, areas) = grid_polygons([9, 7], [0.1, 0.1]);
            let grid =
                FftFlexibility::new([40, 31], [0.1, 0.1], &green, CrossBlocks::Keep).expect("an operator");
            let dense = DenseFlexibility::new(&centers, &cells, &areas, &green).expect("an operator");
            let operators: [&dyn Flexibility; 2] = [&grid, &dense];
            let mut bits = Vec::new();
            for operator in operators {
                let tractions = Random(11).vector(3 * operator.n_cells());
                let mut gap = vec![0.0; tractions.len()];
                operator.apply(&tractions, &mut gap);
                bits.extend(gap.iter().map(|g| g.to_bits()));
                operator.apply_normal(&tractions[..operator.n_cells()], &mut gap[..operator.n_cells()]);
                bits.extend(gap.iter().map(|g| g.to_bits()));
            }
            bits
        })
    };
    let one = run(1);
    assert!(one == run(2) && one == run(3));
}

/// Truth: equal isotropic bodies do not couple normal and tangential components, because the antisymmetric parts cancel. Unlike
/// bodies couple these components. Equal bodies with tilted fibres also couple them, by the even part of G_xn
/// (docs/theory-half-space.md).
#[test]
fn vanishing_cross_blocks_may_be_skipped() {
    let equal = SurfaceGreen::sum(&[&green(&steel(), Side::Lower), &green(&steel(), Side::Upper)]);
    let make =
        |green: &SurfaceGreen, cross| FftFlexibility::new([16, 12], [0.1, 0.1], green, cross).expect("made");
    let (kept, skipped) = (make(&equal, CrossBlocks::Keep), make(&equal, CrossBlocks::SkipVanishing));
    assert!(kept.couples_normal_tangential() && !skipped.couples_normal_tangential());
    let tractions = Random(2).vector(3 * kept.n_cells());
    let (mut a, mut b) = (vec![0.0; tractions.len()], vec![0.0; tractions.len()]);
    kept.apply(&tractions, &mut a);
    skipped.apply(&tractions, &mut b);
    let scale = a.iter().fold(0.0f64, |m, x| m.max(x.abs()));
    assert!(a.iter().zip(&b).all(|(x, y)| (x - y).abs() < 1e-14 * scale));
    let tilted = SurfaceGreen::sum(&[&green(&cfrp(30.0), Side::Lower), &green(&cfrp(30.0), Side::Upper)]);
    let flat = SurfaceGreen::sum(&[&green(&cfrp(0.0), Side::Lower), &green(&cfrp(0.0), Side::Upper)]);
    assert!(tilted.couples_normal_tangential() && !flat.couples_normal_tangential());
    assert!(make(&pair(30.0), CrossBlocks::SkipVanishing).couples_normal_tangential());
}

/// Truth: the flexibility is proportional to length / modulus, in any units. The tolerance is 1e-12.
#[test]
fn units_do_not_matter() {
    let scaled = |modulus: f64, length: f64| {
        let stiffness = Stiffness::from_voigt(cfrp(30.0).voigt() * modulus).expect("an admissible stiffness");
        let green = green(&stiffness, Side::Lower);
        let operator = FftFlexibility::new([6, 5], [0.1 * length, 0.2 * length], &green, CrossBlocks::Keep)
            .expect("made");
        let mut gap = vec![0.0; 90];
        operator.apply(&Random(4).vector(90), &mut gap);
        gap.iter().map(|g| g * modulus / length).collect::<Vec<_>>()
    };
    let reference = scaled(1.0, 1.0);
    let scale = reference.iter().fold(0.0f64, |m, x| m.max(x.abs()));
    for (modulus, length) in [(1e6, 1e-3), (1e-3, 1e6), (1e9, 1e-9)] {
        let found = scaled(modulus, length);
        assert!(found.iter().zip(&reference).all(|(x, y)| (x - y).abs() < 1e-12 * scale));
    }
}

type Polygons = (Vec<[f64; 2]>, Vec<Vec<[f64; 2]>>, Vec<f64>);

fn grid_polygons(cells: [usize; 2], spacing: [f64; 2]) -> Polygons {
    let [a, b] = spacing.map(|h| h / 2.0);
    let centers: Vec<[f64; 2]> = (0..cells[0] * cells[1])
        .map(|k| [(k / cells[1]) as f64 * spacing[0], (k % cells[1]) as f64 * spacing[1]])
        .collect();
    let corners = |[x, y]: [f64; 2]| vec![[x - a, y - b], [x + a, y - b], [x + a, y + b], [x - a, y + b]];
    let polygons = centers.iter().map(|&c| corners(c)).collect();
    let areas = vec![spacing[0] * spacing[1]; centers.len()];
    (centers, polygons, areas)
}

/// Truth: the FFT operator on the same grid. The tolerance is 1e-12 of the largest entry.
#[test]
fn dense_operator_on_a_grid_is_the_fft_operator() {
    let green = pair(30.0);
    let (centers, cells, areas) = grid_polygons([14, 11], [0.1, 0.07]);
    let dense = DenseFlexibility::new(&centers, &cells, &areas, &green).expect("an operator");
    let fft = FftFlexibility::new([14, 11], [0.1, 0.07], &green, CrossBlocks::Keep).expect("an operator");
    let n = dense.n_cells();
    let tractions = Random(9).vector(3 * n);
    let (mut a, mut b) = (vec![0.0; 3 * n], vec![0.0; 3 * n]);
    dense.apply(&tractions, &mut a);
    fft.apply(&tractions, &mut b);
    let scale = b.iter().fold(0.0f64, |m, x| m.max(x.abs()));
    assert!(a.iter().zip(&b).all(|(x, y)| (x - y).abs() < 1e-12 * scale));
    dense.apply_normal(&tractions[..n], &mut a[..n]);
    fft.apply_normal(&tractions[..n], &mut b[..n]);
    assert!(a[..n].iter().zip(&b[..n]).all(|(x, y)| (x - y).abs() < 1e-12 * scale));
    assert!(relative(&dense.diagonal_blocks()[5], &fft.diagonal_blocks()[5]) < 1e-12);
}

/// Truth: the operator S times the areas A of the cells, A S, is symmetric and positive definite on an irregular frame. A uniform
/// pressure gives Love's displacement of a loaded square. The collocation matrix is changed slightly to make A S symmetric. The
/// tolerance 5e-3 covers this change.
#[test]
fn dense_operator_on_triangles() {
    let green = green(&steel(), Side::Lower);
    let m = 8;
    let node = |i: usize, j: usize| {
        let (x, y) = (i as f64 / m as f64, j as f64 / m as f64);
        let bump = 0.04 * (PI * x).sin() * (PI * y).sin();
        [x + bump, y - bump]
    };
    let mut cells = Vec::new();
    for i in 0..m {
        for j in 0..m {
            let [a, b, c, d] = [node(i, j), node(i + 1, j), node(i + 1, j + 1), node(i, j + 1)];
            cells.extend([vec![a, b, c], vec![a, c, d]]);
        }
    }
    let centers: Vec<[f64; 2]> =
        cells.iter().map(|t| [0, 1].map(|c| (t[0][c] + t[1][c] + t[2][c]) / 3.0)).collect();
    let area = |t: &Vec<[f64; 2]>| {
        0.5 * ((t[1][0] - t[0][0]) * (t[2][1] - t[0][1]) - (t[1][1] - t[0][1]) * (t[2][0] - t[0][0]))
    };
    let areas: Vec<f64> = cells.iter().map(area).collect();
    let operator = DenseFlexibility::new(&centers, &cells, &areas, &green).expect("an operator");
    let n = operator.n_cells();
    let mut random = Random(21);
    let weighted = |a: &[f64], b: &[f64]| -> f64 { (0..3 * n).map(|k| areas[k % n] * a[k] * b[k]).sum() };
    for _ in 0..5 {
        let (v, w) = (random.vector(3 * n), random.vector(3 * n));
        let (mut sv, mut sw) = (vec![0.0; 3 * n], vec![0.0; 3 * n]);
        operator.apply(&v, &mut sv);
        operator.apply(&w, &mut sw);
        let energy = weighted(&v, &sv);
        assert!(energy > 0.0 && (weighted(&v, &sw) - weighted(&w, &sv)).abs() < 1e-13 * energy);
    }
    let mut gap = vec![0.0; n];
    operator.apply_normal(&vec![1.0; n], &mut gap);
    let square = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    let worst = (0..n)
        .map(|i| (gap[i] / polygon::integrate(&green, &square, centers[i])[(2, 2)] - 1.0).abs())
        .fold(0.0, f64::max);
    assert!(worst < 5e-3, "{worst}");
}

/// Truth: frames that are invalid, or too large for the memory, are refused with the right kind of error.
#[test]
fn unusable_frames_are_refused() {
    let green = green(&steel(), Side::Lower);
    let grid = |cells, spacing| {
        let error = FftFlexibility::new(cells, spacing, &green, CrossBlocks::Keep).err().expect("a refusal");
        (error.kind(), error.to_string())
    };
    assert_eq!(grid([0, 4], [0.1, 0.1]).0, ErrorKind::Input);
    assert_eq!(grid([4, 4], [0.1, f64::NAN]).0, ErrorKind::Input);
    assert_eq!(grid([4, 4], [-0.1, 0.1]).0, ErrorKind::Input);
    for size in [1e30, 1e-30] {
        let (kind, message) = grid([4, 4], [size, size]);
        assert!(kind == ErrorKind::Input && message.contains("units"), "{message}");
    }
    let (kind, message) = grid([1_000_000, 1_000_000], [0.1, 0.1]);
    assert!(kind == ErrorKind::Resources && message.contains("bytes") && message.contains("fewer cells"));
    let (centers, cells, areas) = grid_polygons([2, 2], [1.0, 1.0]);
    let dense = |centers: &[[f64; 2]], cells: &[Vec<[f64; 2]>], areas: &[f64]| {
        DenseFlexibility::new(centers, cells, areas, &green).err().expect("a refusal").kind()
    };
    assert_eq!(dense(&centers, &cells, &areas[1..]), ErrorKind::Input);
    assert_eq!(dense(&[], &[], &[]), ErrorKind::Input);
    assert_eq!(dense(&centers, &cells, &[1.0, 0.0, 1.0, 1.0]), ErrorKind::Input);
    let line = vec![vec![[0.0, 0.0], [1.0, 0.0]]; 4];
    assert_eq!(dense(&centers, &line, &areas), ErrorKind::Input);
    let clockwise: Vec<Vec<[f64; 2]>> = cells.iter().map(|c| c.iter().rev().copied().collect()).collect();
    assert_eq!(dense(&centers, &clockwise, &areas), ErrorKind::Input);
    let many = 300_000;
    let huge = dense(&vec![[0.0, 0.0]; many], &vec![cells[0].clone(); many], &vec![1.0; many]);
    assert_eq!(huge, ErrorKind::Resources);
}
