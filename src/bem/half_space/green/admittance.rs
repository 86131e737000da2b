//! Surface admittance W(m) / κ of half-spaces, interpolated in a table of the directions m.
//!
//! A traction t exp(i κ m·x) has the wavenumber κ and the direction m, a unit vector. This traction displaces the
//! surface by W(m) t exp(i κ m·x) / κ.

use crate::bem::half_space::green::SurfaceGreen;
use crate::bem::half_space::green::angular_table::AngularTable;

/// Hermitian 3 x 3 matrix: real entries xx, yy, nn, then real and imaginary parts of the entries xy, xn, yn.
pub(in crate::bem::half_space) type Hermitian = [f64; 9];

/// Real matrix Re W + Im W for one direction, row by row. Re W is symmetric and Im W is antisymmetric.
pub(in crate::bem::half_space) type Rows = [f64; 9];

pub(in crate::bem::half_space) struct Admittance {
    table: AngularTable,
}

impl Admittance {
    pub(in crate::bem::half_space) fn new(green: &SurfaceGreen) -> Self {
        Self { table: AngularTable::from_green(&green.admittance_series()) }
    }

    /// Adds `factor` W(m) / κ at the nonzero wavevector κ m = (`kx`, `ky`) to `sum`.
    pub(in crate::bem::half_space) fn add(&self, [kx, ky]: [f64; 2], factor: f64, sum: &mut Rows) {
        self.table.add(kx, ky, factor / kx.hypot(ky), sum);
    }

    /// W(m) / κ at the wavevector κ m = `k`; zero for κ = 0.
    pub(in crate::bem::half_space) fn at(&self, k: [f64; 2]) -> Rows {
        let mut sum = [0.0; 9];
        if k != [0.0; 2] {
            self.add(k, 1.0, &mut sum);
        }
        sum
    }
}

pub(in crate::bem::half_space) fn hermitian(rows: &Rows) -> Hermitian {
    let [xx, xy, xn, yx, yy, yn, nx, ny, nn] = *rows;
    let (half_sum, half_difference) = (|a: f64, b: f64| 0.5 * (a + b), |a: f64, b: f64| 0.5 * (a - b));
    [
        xx,
        yy,
        nn,
        half_sum(xy, yx),
        half_difference(xy, yx),
        half_sum(xn, nx),
        half_difference(xn, nx),
        half_sum(yn, ny),
        half_difference(yn, ny),
    ]
}
