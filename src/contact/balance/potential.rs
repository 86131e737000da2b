//! Convex potential of a balance. Its minimum is the motion for which the tractions do the prescribed works. The module
//! [`super`] defines the symbols.

use nalgebra::{SMatrix, SymmetricEigen};

use super::{
    Balance, BalanceCells, FrictionBound, LossOfEquilibrium, MOTION_COMPONENTS, MotionValues,
    ProjectionStart, StepSizes, with_unit_maximum,
};

const MAX_NEWTON_STEPS: usize = 80;

/// Largest relative defect of the works in equilibrium. Also the relative eigenvalue of the Gram matrix of normal gaps
/// above which a motion changes these gaps.
const UNBALANCED_SHARE: f64 = 1e-6;

type Matrix = SMatrix<f64, MOTION_COMPONENTS, MOTION_COMPONENTS>;

struct PotentialValue {
    potential: f64,
    gradient: MotionValues,
    hessian: Matrix,
    /// Norm of the prescribed works plus Σ A |R·P|, the scale of the gradient.
    size: f64,
}

impl Balance {
    /// Minimises the potential by Newton's method, starting from `rho`. With saturated friction, `rho` is limited to motions that
    /// change normal gaps and are orthogonal to the sliding motion.
    ///
    /// # Errors
    /// If no motion gives the prescribed works with these radii. Returns a direction of unbounded decrease, or the last Newton
    /// direction.
    pub(super) fn minimise(
        &self,
        cells: BalanceCells,
        from: ProjectionStart,
        friction: FrictionBound,
        rho: &mut MotionValues,
    ) -> Result<(), MotionValues> {
        let fixed = if let FrictionBound::Saturated(_, d) = friction {
            Some((d, self.normal_motion_projector(cells)))
        } else {
            None
        };
        let across = |v: MotionValues| match fixed {
            None => v,
            Some((d, pressing)) => {
                let v = pressing * v;
                v - d * d.dot(&v)
            }
        };
        *rho = across(*rho);
        let stiffness = from.steps.normal * cells.areas.iter().sum::<f64>();
        let mut here = self.point(cells, from, friction, rho);
        let mut last = None;
        for step in 0..MAX_NEWTON_STEPS {
            let gradient = across(here.gradient);
            let error = gradient.norm();
            if error <= 1e-14 * here.size {
                return Ok(());
            }
            // The floor makes the matrix regular if no cell touches or all cells slip in one direction.
            let floor = 0.1 * error / (rho.norm() + here.size / stiffness);
            let mut matrix = here.hessian;
            (0..MOTION_COMPONENTS).for_each(|j| matrix[(j, j)] += if j < self.n { floor } else { 1.0 });
            let Some(factor) = matrix.cholesky() else { break };
            let direction = across(-factor.solve(&gradient));
            last = Some(direction.normalize());
            if fixed.is_none() && step > 4 && self.is_unbounded_along(cells, friction, &direction.normalize())
            {
                return Err(direction.normalize());
            }
            let slope = -direction.dot(&gradient);
            let mut damping = 1.0;
            let accepted = loop {
                let trial = *rho + direction * damping;
                let next = self.point(cells, from, friction, &trial);
                let lower = next.potential <= here.potential - 1e-4 * damping * slope;
                if lower || across(next.gradient).norm() < 0.5 * error {
                    *rho = trial;
                    here = next;
                    break true;
                }
                damping *= 0.5;
                if damping < 1e-9 {
                    break false;
                }
            };
            if !accepted {
                break;
            }
        }
        let undone = across(here.gradient).norm() > UNBALANCED_SHARE * here.size;
        last.filter(|_| undone).map_or(Ok(()), Err)
    }

    fn normal_motion_projector(&self, cells: BalanceCells) -> Matrix {
        let mut gram = Matrix::zeros();
        for (cell, area) in cells.areas.iter().enumerate() {
            let row = self.row(cell);
            for (j, c) in row.iter().enumerate() {
                row.iter().enumerate().for_each(|(k, other)| gram[(j, k)] += area * c[2] * other[2]);
            }
        }
        let eigen = SymmetricEigen::new(gram);
        let least = UNBALANCED_SHARE * eigen.eigenvalues.max();
        (0..MOTION_COMPONENTS).filter(|&i| eigen.eigenvalues[i] > least).fold(Matrix::zeros(), |sum, i| {
            let v = eigen.eigenvectors.column(i);
            sum + v * v.transpose()
        })
    }

    fn point(
        &self,
        cells: BalanceCells,
        from: ProjectionStart,
        friction: FrictionBound,
        rho: &MotionValues,
    ) -> PotentialValue {
        let n = cells.areas.len();
        let StepSizes { normal, tangential } = from.steps;
        let mut point = PotentialValue {
            potential: self.target_work.dot(rho),
            gradient: self.target_work,
            hessian: Matrix::zeros(),
            size: self.target_work.norm(),
        };
        for (cell, &area) in cells.areas.iter().enumerate() {
            let gap = self.gap(cell, rho);
            let p = from.hatted[2 * n + cell] - normal * (from.gradient[2 * n + cell] + gap[2]);
            let p = p.max(0.0);
            let mut force = [0.0, 0.0, p];
            let mut stiffness = [[0.0; 3]; 3];
            if p > 0.0 {
                point.potential += 0.5 * area * p * p / normal;
                stiffness[2][2] = normal;
            }
            if cells.hat.is_some() {
                let star = [0, 1].map(|k| {
                    let at = k * n + cell;
                    from.hatted[at] - tangential * (from.gradient[at] + gap[k])
                });
                let (potential, q, jacobian) = self.tangential(cell, star, friction);
                point.potential += area * potential / tangential;
                (force[0], force[1]) = (q[0], q[1]);
                for k in 0..2 {
                    (0..2).for_each(|l| stiffness[k][l] = tangential * jacobian[k][l]);
                }
            }
            if force != [0.0; 3] {
                self.add_work(cell, area, force, stiffness, &mut point);
            }
        }
        point
    }

    fn add_work(
        &self,
        cell: usize,
        area: f64,
        force: [f64; 3],
        stiffness: [[f64; 3]; 3],
        point: &mut PotentialValue,
    ) {
        let row = self.row(cell);
        for (j, c) in row.iter().enumerate() {
            let work = area * (c[0] * force[0] + c[1] * force[1] + c[2] * force[2]);
            point.gradient[j] -= work;
            point.size += work.abs();
            let pushed = [0, 1, 2].map(|k| (0..3).map(|l| stiffness[k][l] * c[l]).sum::<f64>());
            for (k, other) in row[..=j].iter().enumerate() {
                let value = area * (pushed[0] * other[0] + pushed[1] * other[1] + pushed[2] * other[2]);
                point.hessian[(j, k)] += value;
                if j != k {
                    point.hessian[(k, j)] += value;
                }
            }
        }
    }

    /// Huber function of the predictor `star` in a cell, its gradient (the traction), and the derivatives of the
    /// traction. With saturated friction, the traction is constant and the function is linear.
    fn tangential(
        &self,
        cell: usize,
        star: [f64; 2],
        friction: FrictionBound,
    ) -> (f64, [f64; 2], [[f64; 2]; 2]) {
        let norm = star[0].hypot(star[1]);
        let radius = match friction {
            FrictionBound::Stick => f64::INFINITY,
            FrictionBound::Radius(radii) => radii[cell],
            FrictionBound::Saturated(radii, direction) => {
                // The traction does not depend on the predictor.
                let q = self.limit(cell, radii[cell], &direction);
                return (q[0] * star[0] + q[1] * star[1], q, [[0.0; 2]; 2]);
            }
        };
        if norm <= radius {
            return (0.5 * norm * norm, star, [[1.0, 0.0], [0.0, 1.0]]);
        }
        let e = star.map(|s| s / norm);
        let (scale, off) = (radius / norm, -radius / norm * e[0] * e[1]);
        (
            radius * (norm - 0.5 * radius),
            e.map(|c| radius * c),
            [[scale * (1.0 - e[0] * e[0]), off], [off, scale * (1.0 - e[1] * e[1])]],
        )
    }

    /// Traction of magnitude `radius` in a cell, opposite to the slip in the motion `direction`.
    fn limit(&self, cell: usize, radius: f64, direction: &MotionValues) -> [f64; 2] {
        let gap = self.gap(cell, direction);
        let norm = gap[0].hypot(gap[1]);
        if norm > 0.0 { [-radius * gap[0] / norm, -radius * gap[1] / norm] } else { [0.0; 2] }
    }

    /// Returns whether the potential decreases without bound along `direction`: no cell closes, and friction does not
    /// balance the load.
    fn is_unbounded_along(
        &self,
        cells: BalanceCells,
        friction: FrictionBound,
        direction: &MotionValues,
    ) -> bool {
        let driven = -self.target_work.dot(direction);
        let (mut resisted, mut closing, mut largest) = (0.0, 0.0f64, 0.0f64);
        for (cell, area) in cells.areas.iter().enumerate() {
            let gap = self.gap(cell, direction);
            let size = gap[0].hypot(gap[1]);
            resisted += match friction {
                FrictionBound::Radius(radii) => area * radii[cell] * size,
                FrictionBound::Stick | FrictionBound::Saturated(..) if cells.hat.is_some() && size > 0.0 => {
                    return false;
                }
                FrictionBound::Stick | FrictionBound::Saturated(..) => 0.0,
            };
            closing = closing.min(gap[2]);
            largest = largest.max(size).max(gap[2].abs());
        }
        closing >= -1e-9 * largest && driven > resisted * (1.0 + 1e-12)
    }

    pub(super) fn failure(
        &self,
        cells: BalanceCells,
        radii: &[f64],
        direction: &MotionValues,
    ) -> (MotionValues, LossOfEquilibrium) {
        let (mut resisted, mut opening, mut sliding) = (0.0, 0.0f64, 0.0f64);
        for (cell, area) in cells.areas.iter().enumerate() {
            let gap = self.gap(cell, direction);
            resisted += area * radii[cell] * gap[0].hypot(gap[1]);
            opening = opening.max(gap[2]);
            let slip = cells.hat.map_or([0.0; 2], |hat| hat.physical_slip([gap[0], gap[1]]));
            sliding = sliding.max(slip[0].hypot(slip[1]));
        }
        let failure = LossOfEquilibrium {
            motion: with_unit_maximum(self.motion(direction)),
            separates_bodies: opening > sliding,
            carried_load_fraction: resisted / -self.target_work.dot(direction),
        };
        (*direction, failure)
    }

    /// Computes the pressures for the motion `rho`. Returns whether they equal the previous pressures to rounding.
    pub(super) fn write_pressures(
        &self,
        from: ProjectionStart,
        rho: &MotionValues,
        pressures: &mut [f64],
    ) -> bool {
        let n = pressures.len();
        let (mut change, mut largest) = (0.0f64, 0.0f64);
        for (cell, pressure) in pressures.iter_mut().enumerate() {
            let gap = from.gradient[2 * n + cell] + self.gap(cell, rho)[2];
            let p = (from.hatted[2 * n + cell] - from.steps.normal * gap).max(0.0);
            change = change.max((p - *pressure).abs());
            largest = largest.max(p);
            *pressure = p;
        }
        change <= 1e-14 * largest
    }

    /// Writes the tractions for the motion `rho` to `out`. If `sliding` is given, all tangential tractions are at their
    /// limits, opposite to `sliding`.
    pub(super) fn write(
        &self,
        cells: BalanceCells,
        from: ProjectionStart,
        rho: &MotionValues,
        sliding: Option<MotionValues>,
        out: &mut [f64],
    ) {
        let n = cells.areas.len();
        self.write_pressures(from, rho, &mut out[2 * n..]);
        for cell in 0..n {
            let p = out[2 * n + cell];
            let q = match (cells.hat.is_some(), sliding) {
                (false, _) => [0.0; 2],
                (true, Some(direction)) => self.limit(cell, p, &direction),
                (true, None) => {
                    let gap = self.gap(cell, rho);
                    let star = [0, 1].map(|k| {
                        let at = k * n + cell;
                        from.hatted[at] - from.steps.tangential * (from.gradient[at] + gap[k])
                    });
                    let norm = star[0].hypot(star[1]);
                    if norm > p { star.map(|s| s * (p / norm)) } else { star }
                }
            };
            (out[cell], out[n + cell]) = (q[0], q[1]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::BalanceConstraint;
    use super::*;
    use crate::contact::friction_scaling::FrictionScaling;
    use crate::laws::friction::FrictionEllipse;

    const N: usize = 12;

    fn number(k: usize) -> f64 {
        ((k as f64) * 0.618_033_988_75).fract() - 0.5
    }

    fn bowl(areas: &[f64], hat: FrictionScaling) -> Balance {
        let gap = |component: usize, cell: usize| match component {
            0 => [1.0, 0.2 * number(cell), number(3 * cell)],
            2 => [number(5 * cell), number(7 * cell + 1), 1.0],
            _ => [0.3 * number(cell + 4), number(2 * cell), 2.0 * number(11 * cell)],
        };
        let wanted = [(0, 0.4), (2, 3.0), (3, 0.2)].map(|(component, work)| {
            let mut motion = [0.0; MOTION_COMPONENTS];
            motion[component] = 1.0;
            BalanceConstraint { motion, work }
        });
        Balance::new(BalanceCells { areas, hat: Some(hat) }, gap, &wanted).unwrap()
    }

    /// Truth: the gradient is the derivative of the potential, and the Hessian the derivative of the gradient, for every friction
    /// bound. Central differences of step h = 1e-5 have errors of about h^2 = 1e-10 and rounding / h = 1e-11; the tolerances are
    /// larger.
    #[test]
    fn the_gradient_is_the_derivative_of_the_potential() {
        let ellipse = FrictionEllipse { mu: [0.4, 0.6], angle: 0.3 };
        let areas: Vec<f64> = (0..N).map(|i| 1.0 + number(i)).collect();
        let hat = FrictionScaling::new(&ellipse);
        let balance = bowl(&areas, hat);
        let cells = BalanceCells { areas: &areas, hat: Some(hat) };
        let hatted: Vec<f64> =
            (0..3 * N).map(|k| number(13 * k) + if k < 2 * N { 0.0 } else { 0.4 }).collect();
        let gradient: Vec<f64> = (0..3 * N).map(|k| 0.1 * number(17 * k)).collect();
        let steps = StepSizes { normal: 2.0, tangential: 1.5 };
        let from = ProjectionStart { hatted: &hatted, gradient: &gradient, steps };
        let radii: Vec<f64> = (0..N).map(|i| 0.3 + 0.4 * number(19 * i).abs()).collect();
        let mut direction = MotionValues::zeros();
        (0..3).for_each(|j| direction[j] = number(j + 2));
        let mut rho = MotionValues::zeros();
        (0..3).for_each(|j| rho[j] = 0.1 * number(23 * j + 1));
        for friction in
            [FrictionBound::Stick, FrictionBound::Radius(&radii), FrictionBound::Saturated(&radii, direction)]
        {
            let here = balance.point(cells, from, friction, &rho);
            for j in 0..3 {
                let h = 1e-5;
                let mut step = MotionValues::zeros();
                step[j] = h;
                let [up, down] =
                    [rho + step, rho - step].map(|rho| balance.point(cells, from, friction, &rho));
                let slope = (up.potential - down.potential) / (2.0 * h);
                assert!(
                    (slope - here.gradient[j]).abs() < 1e-7 * here.size,
                    "{j} {slope} {}",
                    here.gradient[j]
                );
                let bend = (up.gradient - down.gradient) / (2.0 * h);
                assert!((bend - here.hessian.column(j)).norm() < 1e-6 * here.hessian.norm(), "{j}");
            }
        }
    }
}
