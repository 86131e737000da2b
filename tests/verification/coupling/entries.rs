//! Entries of flexibility operators for a subset of the cells.

use super::block::{pairs, tied};
use super::half_spaces::largest;
use crate::common::im7;
use orthowear::bem::half_space::{DenseFlexibility, Side, SurfaceGreen};
use orthowear::coupling::Coupling;
use orthowear::flexibility::Flexibility;
use orthowear::flexibility::cell_matrix::CellMatrix;
use orthowear::frame::ContactFrame;

/// Compares the entries for every third cell with products of the operator. The tolerance 1e-13 covers rounding.
fn entries_are_products(name: &str, operator: &dyn Flexibility) {
    let n = operator.n_cells();
    let cells: Vec<usize> = (0..n).step_by(3).collect();
    let m = cells.len();
    let mut matrix = CellMatrix::zeros(m).expect("memory");
    assert!(operator.add_entries(&cells, &mut matrix), "{name}");
    let (mut unit, mut gap, mut column) = (vec![0.0; 3 * n], vec![0.0; 3 * n], vec![0.0; 3 * m]);
    for (k, &cell) in cells.iter().enumerate() {
        for component in 0..3 {
            unit[component * n + cell] = 1.0;
            operator.apply(&unit, &mut gap);
            unit[component * n + cell] = 0.0;
            let mut traction = [0.0; 3];
            traction[component] = 1.0;
            matrix.gap_of(k, traction, &mut column);
            let wanted: Vec<f64> =
                (0..3).flat_map(|a| cells.iter().map(move |i| a * n + i)).map(|row| gap[row]).collect();
            let error = column.iter().zip(&wanted).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(error < 1e-13 * largest(&wanted), "{name}, cell {cell}, component {component}: {error}");
        }
    }
}

/// Truth: products of the operator with unit tractions. They equal the columns of the entries, for meshed bodies, half-spaces and
/// sums of their operators.
#[test]
fn entries_of_operators() {
    let frame = ContactFrame::grid([1.1, 0.9], [8, 7], [0.1, -0.2], 0.3).unwrap();
    for (name, mut pair) in pairs(&frame) {
        let coupled = tied(&mut pair, &frame, Coupling::Schur);
        entries_are_products(name, coupled.flexibility.as_ref());
    }
    let green = SurfaceGreen::new(&im7(30.0), Side::Lower).expect("a Green's function");
    let centers = [[0.0, 0.0], [1.0, 0.2], [0.3, 1.1], [-1.0, 0.4]];
    let square = |(i, [x, y]): (usize, &[f64; 2])| {
        let a = 0.2 + 0.05 * i as f64;
        vec![[x - a, y - a], [x + a, y - a], [x + a, y + a], [x - a, y + a]]
    };
    let cells: Vec<Vec<[f64; 2]>> = centers.iter().enumerate().map(square).collect();
    let areas: Vec<f64> = (0..4).map(|i| (0.4 + 0.1 * f64::from(i)).powi(2)).collect();
    let dense = DenseFlexibility::new(&centers, &cells, &areas, &green).expect("an operator");
    entries_are_products("polygons", &dense);
}
