//! Displacements of the cells of a uniform grid under a unit traction on one cell.

use nalgebra::Matrix3;
use rayon::prelude::*;

use crate::bem::half_space::green::SurfaceGreen;
pub(in crate::bem::half_space) use crate::bem::half_space::green::kernel_component::KernelComponent;
use crate::bem::half_space::integrals::patch::PatchIntegrator;
use crate::bem::half_space::integrals::rectangle_expansion::RectangleExpansion;
use crate::cancel;

const EVEN: [(usize, usize); 6] = [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)];
const ODD: [(usize, usize); 3] = [(0, 1), (0, 2), (1, 2)];

/// Kernel K(d) of a uniform grid for the offsets d = target - source. Near offsets use integrals, far offsets use a
/// series expansion. Half of the offsets suffice, because K(-d) = K(d)^T.
///
/// # Source
/// docs/theory-half-space.md, operators on the frame.
pub(super) struct KernelTable {
    spacing: [f64; 2],
    near_cells: [usize; 2],
    /// Values at the near offsets with x >= 0, `[near_x][2 near_y - 1]`.
    near: Vec<Matrix3<f64>>,
    far: RectangleExpansion,
    integrator: PatchIntegrator,
}

impl KernelTable {
    /// Integrates the kernel for the near offsets. After a cancellation, the table is incomplete.
    pub(super) fn new(cells: [usize; 2], spacing: [f64; 2], green: &SurfaceGreen) -> Self {
        let (integrator, far) = (PatchIntegrator::new(green), RectangleExpansion::new(green, spacing));
        let near_cells: [usize; 2] = std::array::from_fn(|axis| {
            cells[axis].min(((far.min_valid_distance() / spacing[axis]).ceil() as usize).saturating_add(1))
        });
        let width = 2 * near_cells[1] - 1;
        let mut near = vec![Matrix3::zeros(); near_cells[0] * width];
        near.par_chunks_mut(width).enumerate().for_each(|(dx, row)| {
            if cancel::requested() {
                return;
            }
            for (column, block) in row.iter_mut().enumerate() {
                let dy = column as f64 - (near_cells[1] - 1) as f64;
                let offset = [dx as f64 * spacing[0], dy * spacing[1]];
                if offset[0].hypot(offset[1]) < far.min_valid_distance() && (dx > 0 || dy >= 0.0) {
                    *block = integrator.rectangle(spacing, offset);
                }
            }
        });
        // A symmetric K(0) makes the operator symmetric to the last bit.
        near[near_cells[1] - 1] = (near[near_cells[1] - 1] + near[near_cells[1] - 1].transpose()) * 0.5;
        Self { spacing, near_cells, near, far, integrator }
    }

    /// K at an offset of `d` cells, by integration.
    pub(super) fn integral(&self, d: [isize; 2]) -> Matrix3<f64> {
        let offset = [0, 1].map(|axis| d[axis] as f64 * self.spacing[axis]);
        self.integrator.rectangle(self.spacing, offset)
    }

    /// Influence K(0) of a cell on itself.
    pub(super) fn self_influence(&self) -> Matrix3<f64> {
        self.near[self.near_cells[1] - 1]
    }

    /// Tabulated K at a near offset; `None` for far offsets.
    fn near(&self, dx: usize, dy: isize) -> Option<&Matrix3<f64>> {
        let [nx, ny] = self.near_cells;
        let offset = [dx as f64 * self.spacing[0], dy as f64 * self.spacing[1]];
        (dx < nx && dy.unsigned_abs() < ny && offset[0].hypot(offset[1]) < self.far.min_valid_distance())
            .then(|| &self.near[dx * (2 * ny - 1) + (ny as isize - 1 + dy) as usize])
    }

    fn split(near: &Matrix3<f64>, components: &[KernelComponent], values: &mut [f64]) {
        for (value, component) in values.iter_mut().zip(components) {
            *value = match *component {
                KernelComponent::Even(k) => 0.5 * (near[EVEN[k]] + near[(EVEN[k].1, EVEN[k].0)]),
                KernelComponent::Odd(k) => 0.5 * (near[ODD[k]] - near[(ODD[k].1, ODD[k].0)]),
            };
        }
    }

    /// Values of the `components` of K at the offsets x >= 0 of a grid. This grid must not be larger than the grid of
    /// the table.
    pub(super) fn planes(&self, [nx, ny]: [usize; 2], components: &[KernelComponent]) -> Vec<OffsetPlane> {
        let (width, count, far) = (2 * ny - 1, components.len(), self.far.of(components));
        let mut planes: Vec<OffsetPlane> = components
            .iter()
            .map(|component| OffsetPlane {
                cells_y: ny,
                values: vec![0.0; nx * width],
                parity: if let KernelComponent::Even(_) = component { 1.0 } else { -1.0 },
            })
            .collect();
        // If each component is even or odd in y, only the values at y >= 0 are computed.
        let signs: Option<Vec<f64>> =
            components.iter().map(|component| self.far.y_parity(*component)).collect();
        let mut rows: Vec<Vec<&mut [f64]>> = (0..nx).map(|_| Vec::with_capacity(count)).collect();
        for plane in &mut planes {
            rows.iter_mut().zip(plane.values.chunks_exact_mut(width)).for_each(|(row, part)| row.push(part));
        }
        rows.par_iter_mut().enumerate().for_each(|(dx, row)| {
            let mut values = [0.0; EVEN.len() + ODD.len()];
            let values = &mut values[..count];
            for column in if dx == 0 || signs.is_some() { ny - 1 } else { 0 }..width {
                let dy = column as isize - (ny as isize - 1);
                match self.near(dx, dy) {
                    Some(near) => Self::split(near, components, values),
                    None => {
                        far.evaluate([dx as f64 * self.spacing[0], dy as f64 * self.spacing[1]], values);
                    }
                }
                row.iter_mut().zip(&*values).for_each(|(part, value)| part[column] = *value);
            }
            for (part, sign) in row.iter_mut().zip(signs.iter().flatten()) {
                let (before, from) = part.split_at_mut(ny - 1);
                before.iter_mut().rev().zip(&from[1..]).for_each(|(below, above)| *below = sign * above);
            }
        });
        for plane in &mut planes {
            for dy in 1..ny {
                plane.values[ny - 1 - dy] = plane.parity * plane.values[ny - 1 + dy];
            }
        }
        planes
    }
}

/// One component of the kernel at the offsets x >= 0, `[cells_x][2 cells_y - 1]`. The component is even or odd in the
/// offset.
pub(super) struct OffsetPlane {
    cells_y: usize,
    values: Vec<f64>,
    /// 1 for an even component, -1 for an odd component.
    parity: f64,
}

impl OffsetPlane {
    /// Adds the values at the offset `dx` along x to `row`. Negative offsets along y are at the end of `row`.
    pub(super) fn add_row(&self, dx: isize, row: &mut [f64]) {
        let (ny, period) = (self.cells_y, row.len());
        let start = dx.unsigned_abs() * (2 * ny - 1);
        let values = &self.values[start..start + 2 * ny - 1];
        // `before` has the offsets dy < 0, `from` has dy = 0, 1, .... For dx < 0, the value is `parity` times the value
        // at the offset (-dx, -dy).
        let (before, from) = values.split_at(ny - 1);
        if dx >= 0 {
            row.iter_mut().zip(from).for_each(|(r, value)| *r += value);
            row[period + 1 - ny..].iter_mut().zip(before).for_each(|(r, value)| *r += value);
        } else {
            let mirrored = before.iter().rev();
            row.iter_mut()
                .zip([&from[0]].into_iter().chain(mirrored))
                .for_each(|(r, v)| *r += self.parity * v);
            let behind = from[1..].iter().rev();
            row[period + 1 - ny..].iter_mut().zip(behind).for_each(|(r, v)| *r += self.parity * v);
        }
    }
}
