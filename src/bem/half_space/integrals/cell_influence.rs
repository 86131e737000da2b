//! Symmetrised influences between the cells of a plane frame: moment expansions for distant cells, exact integrals for
//! near cells.
//!
//! Collocation gives K_IJ, the displacement at the centre of cell I due to a unit traction on cell J. The operator on
//! tractions is S_IJ = (A_I K_IJ + A_J K_JIᵀ) / (2 A_I), with the cell areas A. This module computes F = S A^-1, the
//! operator on forces. F is symmetric. If the cells I and J are expanded about their centres, K_IJ and K_JIᵀ share the
//! derivatives of the Green's function G at d = x_I - x_J:
//!
//! `F_IJ = ½ Σ_k Σ_{a+b=k} ((-1)^k μ_ab(J) + μ_ab(I)) / (a! b!) ∂_z^a ∂_z̄^b G(d)`,
//!
//! where z = x + i y, and μ_ab(I) is a moment of cell I divided by the area of the cell.

use nalgebra::Matrix3;
use rayon::prelude::*;

use crate::bem::half_space::green::kernel_component::KernelComponent;
use crate::bem::half_space::green::{SurfaceGreen, assemble};
use crate::bem::half_space::integrals::patch::PatchIntegrator;
use crate::bem::half_space::integrals::polygon;
use crate::bem::half_space::integrals::polygon_moments::{PolygonMoments, n_moments};
use crate::bem::half_space::integrals::polygon_multipole::{MAX_ORDER, PolygonMultipole};

/// Error of the integrals, divided by the tolerance of the operator.
const INTEGRAL_TOLERANCE_SHARE: f64 = 0.1;

/// Cut-off for trailing harmonics of the Green's function between different cells, divided by the error of the
/// integrals.
const HARMONIC_CUTOFF_SHARE: f64 = 0.05;

/// Smallest relative tolerance of an operator, close to rounding.
const MIN_TOLERANCE: f64 = 1e-12;

/// Cells are small if the square root of their area is below this multiple of the square root of the mean area.
const SMALL_CELL_RATIO: f64 = 0.25;

/// Factor for each cell, at most 1, that multiplies the compression tolerance. An error of the gap changes the pressure
/// of a cell in inverse proportion to the side of the cell. Small cells therefore need a smaller tolerance.
pub(in crate::bem::half_space) fn tolerance_shares(areas: &[f64]) -> Vec<f64> {
    let mean = (areas.iter().sum::<f64>() / areas.len() as f64).sqrt();
    areas.iter().map(|area| (area.sqrt() / (SMALL_CELL_RATIO * mean)).min(1.0)).collect()
}

#[derive(Debug, Clone)]
pub(in crate::bem::half_space) struct Cell {
    center: [f64; 2],
    corners: Vec<[f64; 2]>,
    area: f64,
    /// Largest distance of a corner from the centre.
    radius: f64,
}

impl Cell {
    /// Cell with counter-clockwise `corners`; lengths in mm, area in mm².
    pub fn new(center: [f64; 2], corners: Vec<[f64; 2]>, area: f64) -> Self {
        let radii = corners.iter().map(|p| (p[0] - center[0]).hypot(p[1] - center[1]));
        Self { center, radius: radii.fold(0.0, f64::max), corners, area }
    }
}

pub(in crate::bem::half_space) struct CellInfluence {
    cells: Vec<Cell>,
    /// Moments divided by the area, `[cell][function]`.
    moments: Vec<f64>,
    green: SurfaceGreen,
    /// Integrator for pairs of different cells, with truncated harmonics.
    integrator: PatchIntegrator,
    components: Vec<KernelComponent>,
    far: PolygonMultipole,
    /// Number of additional decades of accuracy that each cell needs because of its size.
    extra_decades: Vec<u8>,
    scale: f64,
}

const SYMMETRIC: [(usize, usize); 6] = [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)];
const ANTISYMMETRIC: [(usize, usize); 3] = [(0, 1), (0, 2), (1, 2)];

pub(in crate::bem::half_space) fn row_and_column(component: KernelComponent) -> (usize, usize) {
    match component {
        KernelComponent::Even(c) => SYMMETRIC[c],
        KernelComponent::Odd(c) => ANTISYMMETRIC[c],
    }
}

/// Whether the terms of the expansion about a source alternate in sign from order to order.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Signs {
    Alternate,
    Same,
}

impl CellInfluence {
    /// Influences for an operator of relative accuracy `tolerance`.
    pub fn new(cells: Vec<Cell>, green: &SurfaceGreen, tolerance: f64) -> Self {
        let components = green.nonzero_components();
        let areas: Vec<f64> = cells.iter().map(|cell| cell.area).collect();
        let most = (tolerance / MIN_TOLERANCE).log10().max(0.0).ceil();
        let decade = |share: f64| (-share.log10()).ceil().clamp(0.0, most) as u8;
        let extra_decades: Vec<u8> = tolerance_shares(&areas).into_iter().map(decade).collect();
        let finer = extra_decades.iter().copied().max().unwrap_or(0);
        let short = green.clone().truncated_at(
            HARMONIC_CUTOFF_SHARE * INTEGRAL_TOLERANCE_SHARE * tolerance * 0.1f64.powi(finer.into()),
        );
        let far =
            PolygonMultipole::new(&short, &components, INTEGRAL_TOLERANCE_SHARE * tolerance, finer.into());
        let integrator = PatchIntegrator::new(&short);
        let rule = PolygonMoments::new(far.order());
        let over_area =
            |cell: &Cell| rule.of(&cell.corners, cell.center).into_iter().map(|m| m / cell.area).collect();
        let of_cells: Vec<Vec<f64>> = cells.par_iter().map(over_area).collect();
        let moments = of_cells.concat();
        let mut pairs = Self {
            cells,
            moments,
            green: green.clone(),
            integrator,
            components,
            far,
            extra_decades,
            scale: 1.0,
        };
        let own = (0..pairs.cells.len()).into_par_iter();
        let own = own.map(|cell| pairs.matrix(cell, cell).amax() / pairs.cells[cell].area);
        let largest = own.reduce(|| 0.0, f64::max);
        pairs.scale = 1.0 / largest;
        pairs
    }

    pub fn components(&self) -> &[KernelComponent] {
        &self.components
    }

    /// Factor by which F is multiplied, so that its entries are at most about 1.
    pub fn scale(&self) -> f64 {
        self.scale
    }

    pub fn bytes(&self) -> usize {
        let corners: usize = self.cells.iter().map(|cell| size_of_val(cell.corners.as_slice())).sum();
        size_of_val(self.cells.as_slice())
            + corners
            + self.extra_decades.len()
            + size_of_val(self.moments.as_slice())
            + self.far.bytes()
    }

    /// Writes the components of `scale` F_IJ to `values` `[components]`.
    pub fn entry(&self, i: usize, j: usize, values: &mut [f64]) {
        let (a, b) = (&self.cells[i], &self.cells[j]);
        let d = [a.center[0] - b.center[0], a.center[1] - b.center[1]];
        // Only the upper half-plane is tabulated. For other directions, F_IJ is computed as the transpose of F_JI.
        if d[1] < 0.0 || (d[1] == 0.0 && d[0] < 0.0) {
            self.entry_in_upper_half_plane(j, i, [-d[0], -d[1]], values);
            for (value, component) in values.iter_mut().zip(&self.components) {
                if matches!(component, KernelComponent::Odd(_)) {
                    *value = -*value;
                }
            }
        } else {
            self.entry_in_upper_half_plane(i, j, d, values);
        }
    }

    /// Same as [`Self::entry`] for `d` = x_I - x_J in the upper half-plane.
    fn entry_in_upper_half_plane(&self, i: usize, j: usize, d: [f64; 2], values: &mut [f64]) {
        let (a, b) = (&self.cells[i], &self.cells[j]);
        let r = (d[0] * d[0] + d[1] * d[1]).sqrt();
        values.fill(0.0);
        let factor = 0.5 * self.scale;
        let Some(order) = self.far.order_at(r / a.radius.max(b.radius), self.decade(i, j)) else {
            // The expansion may hold for one of the two cells only. For example, the distance may be thousands of radii
            // of a small cell, but only one radius of its large neighbour.
            self.add_half((i, j), d, factor, Signs::Alternate, values);
            self.add_half((j, i), d, factor, Signs::Same, values);
            return;
        };
        let mut weights = [0.0; n_moments(MAX_ORDER)];
        let mut factor = factor / r;
        let (mut sign, mut place) = (1.0, 0);
        let (own, other) = (self.moments_of(i, order), self.moments_of(j, order));
        for k in 0..=order {
            for q in place..=place + k {
                weights[q] = factor * (sign * other[q] + own[q]);
            }
            place += k + 1;
            factor /= r;
            sign = -sign;
        }
        self.far.add(d, order, &weights[..n_moments(order)], values);
    }

    /// Adds `factor` K_target,source / A_source: the mean of the Green's function over the source cell, at the centre
    /// of the target cell. With `Signs::Alternate`, `d` points from source to target. With `Signs::Same`, the transpose
    /// is added and `d` points from target to source.
    fn add_half(
        &self,
        (target, source): (usize, usize),
        d: [f64; 2],
        factor: f64,
        signs: Signs,
        values: &mut [f64],
    ) {
        let cell = &self.cells[source];
        let r = (d[0] * d[0] + d[1] * d[1]).sqrt();
        if let Some(order) = self.far.order_at(r / cell.radius, self.decade(target, source)) {
            let mut weights = [0.0; n_moments(MAX_ORDER)];
            let moments = self.moments_of(source, order);
            let (mut factor, mut place) = (factor / r, 0);
            for k in 0..=order {
                (place..=place + k).for_each(|q| weights[q] = factor * moments[q]);
                place += k + 1;
                factor /= if signs == Signs::Alternate { -r } else { r };
            }
            self.far.add(d, order, &weights[..n_moments(order)], values);
            return;
        }
        let center = self.cells[target].center;
        let mut matrix = if target == source {
            polygon::integrate(&self.green, &cell.corners, center)
        } else {
            self.integrator.polygon(&cell.corners, center)
        };
        if signs == Signs::Same {
            matrix.transpose_mut();
        }
        matrix *= factor / cell.area;
        for (value, component) in values.iter_mut().zip(&self.components) {
            let (row, column) = row_and_column(*component);
            let mirrored = matrix[(column, row)];
            *value += match component {
                KernelComponent::Even(_) => 0.5 * (matrix[(row, column)] + mirrored),
                KernelComponent::Odd(_) => 0.5 * (matrix[(row, column)] - mirrored),
            };
        }
    }

    fn decade(&self, i: usize, j: usize) -> usize {
        self.extra_decades[i].max(self.extra_decades[j]).into()
    }

    fn moments_of(&self, cell: usize, order: usize) -> &[f64] {
        let stride = n_moments(self.far.order());
        &self.moments[cell * stride..cell * stride + n_moments(order)]
    }

    /// Block S_IJ from integrals over the cells I and J. `integrator` must belong to the same Green's function.
    pub fn block_by_integration(&self, integrator: &PatchIntegrator, i: usize, j: usize) -> Matrix3<f64> {
        let (a, b) = (&self.cells[i], &self.cells[j]);
        let on = |target: &Cell, source: &Cell| integrator.polygon(&source.corners, target.center);
        0.5 * (on(a, b) + on(b, a).transpose() * (b.area / a.area))
    }

    /// Block S_IJ.
    pub fn matrix(&self, i: usize, j: usize) -> Matrix3<f64> {
        let mut values = [0.0; 9];
        self.entry(i, j, &mut values[..self.components.len()]);
        let (mut even, mut odd) = ([0.0; 6], [0.0; 3]);
        for (value, component) in values.iter().zip(&self.components) {
            match *component {
                KernelComponent::Even(c) => even[c] = *value,
                KernelComponent::Odd(c) => odd[c] = *value,
            }
        }
        assemble(&even, &odd) * (self.cells[j].area / self.scale)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Side;
    use crate::material::{Orthotropic, Stiffness};

    fn isotropic() -> SurfaceGreen {
        let steel = Stiffness::isotropic(210e3, 0.3).expect("admissible");
        SurfaceGreen::new(&steel, Side::Lower).expect("converges")
    }

    /// Green's function without vanishing components.
    fn anisotropic() -> SurfaceGreen {
        let constants = Orthotropic {
            e1: 120e3,
            e2: 20e3,
            e3: 10e3,
            g12: 8e3,
            g13: 6e3,
            g23: 4e3,
            nu12: 0.3,
            nu13: 0.25,
            nu23: 0.35,
        };
        let turn = nalgebra::Rotation3::from_euler_angles(0.4, -0.7, 0.3).into_inner();
        let stiffness = Stiffness::orthotropic(&constants).expect("admissible").rotated(&turn);
        SurfaceGreen::new(&stiffness, Side::Lower).expect("converges")
    }

    fn triangle() -> Cell {
        let corners = vec![[0.0, 0.0], [0.3, 0.05], [0.1, 0.25]];
        Cell::new([0.4 / 3.0, 0.1], corners, 0.5 * (0.3 * 0.25 - 0.1 * 0.05))
    }

    fn square([x, y]: [f64; 2]) -> Cell {
        let corners = [[-0.1, -0.1], [0.1, -0.1], [0.1, 0.1], [-0.1, 0.1]].map(|[a, b]| [x + a, y + b]);
        Cell::new([x, y], corners.to_vec(), 0.04)
    }

    /// Truth: the symmetrised exact integrals over the two cells. At the smallest distance of the expansion, the error
    /// must not be negligible. Otherwise this distance would be larger than necessary.
    #[test]
    fn moments_give_the_integrals() {
        for green in [isotropic(), anisotropic()] {
            for tolerance in [1e-4, 1e-6, 1e-8] {
                let integrator = PatchIntegrator::new(&green);
                let mut pairs = CellInfluence::new(vec![triangle(), square([0.0, 0.0])], &green, tolerance);
                let begin = *pairs.far.from().last().expect("one");
                let mut nearest = 0.0_f64;
                for distance in [1.001, 1.3, 2.0, 5.0] {
                    for k in 0..12 {
                        let (r, angle) = (distance * begin * 0.2, 0.1 + 0.52 * f64::from(k));
                        // The moments about the centre do not change when the cell moves.
                        pairs.cells[1] = square([0.4 / 3.0 + r * f64::cos(angle), 0.1 + r * f64::sin(angle)]);
                        let (a, b) = (&pairs.cells[0], &pairs.cells[1]);
                        assert!(pairs.far.order_at(r / a.radius.max(b.radius), 0).is_some());
                        let expected = pairs.block_by_integration(&integrator, 0, 1);
                        let error = (pairs.matrix(0, 1) - expected).amax() / expected.amax();
                        assert!(
                            error < INTEGRAL_TOLERANCE_SHARE * tolerance,
                            "{tolerance} {r} {angle}: {error}"
                        );
                        if distance < 1.1 {
                            nearest = nearest.max(error);
                        }
                    }
                }
                assert!(nearest > 1e-3 * INTEGRAL_TOLERANCE_SHARE * tolerance, "{tolerance}: {nearest}");
            }
        }
    }

    /// Truth: the symmetrised integrals over the two cells, which stay accurate at any distance. The small cell is
    /// distant relative to its own size, but too near for the moments of the large cell.
    #[test]
    fn cells_of_unlike_size_give_the_integrals() {
        for green in [isotropic(), anisotropic()] {
            let integrator = PatchIntegrator::new(&green);
            for tolerance in [1e-4, 1e-8, 1e-10] {
                for size in [1e-2, 1e-3, 1e-5] {
                    let corners = [[-0.2, -0.1], [0.2, -0.1], [0.1, 0.1]].map(|p| p.map(|x| x * size));
                    let (shift, area) = ([0.1 / 3.0 * size, -0.1 / 3.0 * size], 0.04 * size * size);
                    for (x, y) in [(0.12, 0.03), (-0.4, 0.1), (0.05, -0.7), (0.0, 0.05)] {
                        let corners = corners.map(|p| [p[0] + x, p[1] + y]).to_vec();
                        let small = Cell::new([x + shift[0], y + shift[1]], corners, area);
                        let pairs = CellInfluence::new(vec![square([0.0, 0.0]), small], &green, tolerance);
                        for (i, j) in [(0, 1), (1, 0)] {
                            let expected = pairs.block_by_integration(&integrator, i, j);
                            let error = (pairs.matrix(i, j) - expected).amax() / expected.amax();
                            assert!(
                                error < INTEGRAL_TOLERANCE_SHARE * tolerance,
                                "{tolerance} {size} {x} {y}: {error}"
                            );
                        }
                    }
                }
            }
        }
    }

    /// Truth: a term of order k falls as (radius / distance)^k. The error of an expansion up to order p falls as the power p + 1,
    /// or as the power p + 2 if the term of order p + 1 is small.
    #[test]
    fn error_falls_with_the_power_of_the_order() {
        let green = anisotropic();
        let far = PolygonMultipole::new(&green, &green.nonzero_components(), 1e-9, 0);
        let Cell { center, corners, .. } = triangle();
        let moments = PolygonMoments::new(far.order()).of(&corners, center);
        for order in 2..=5 {
            let error = |r: f64| {
                let d = [r * 0.6, r * 0.8];
                let mut weights = moments.clone();
                let mut place = 0;
                for k in 0..=far.order() {
                    let sign = if k % 2 == 0 { 1.0 } else { -1.0 };
                    weights[place..=place + k].iter_mut().for_each(|w| *w *= sign / r.powi(k as i32 + 1));
                    place += k + 1;
                }
                let mut values = vec![0.0; 9];
                far.add(d, order, &weights[..n_moments(order)], &mut values);
                let found =
                    assemble(&std::array::from_fn(|c| values[c]), &std::array::from_fn(|c| values[6 + c]));
                let target = [center[0] + d[0], center[1] + d[1]];
                let expected = polygon::integrate(&green, &corners, target);
                (found - expected).amax() / expected.amax()
            };
            let observed = (error(1.5) / error(3.0)).log2();
            let wanted = (order + 1) as f64;
            assert!((wanted - 0.6..wanted + 1.6).contains(&observed), "order {order}: {observed}");
        }
    }
}
