//! Projection of scaled tractions onto the admissible set: p >= 0, |q̂| <= p and, under force control, the prescribed
//! resultants.
//!
//! p is the pressure, q̂ the scaled tangential traction and A the cell area. The Lagrange multiplier of a prescribed
//! force is the rigid motion for which the projected tractions have the prescribed resultant.

use super::balance::{Balance, LossOfEquilibrium, MAX_RIGID_MODES, ProjectionStart, StepSizes};
use super::friction_scaling::FrictionScaling;
use super::{Increment, NormalControl, PathPoint, Pressures, TangentialControl};

/// Whether the tractions can carry the prescribed forces.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Equilibrium {
    /// The tractions carry the prescribed forces.
    Balanced,
    /// A tangential force reaches the friction limit at the pressures of this iterate. The traction of every cell is at
    /// its limit along the scaled force.
    ///
    /// On a path point with a balance, no rigid motion balances the forces. The bodies slide or separate.
    Sliding(LossOfEquilibrium),
}

/// Rigid motions of all path points.
pub struct RigidMotions<'a> {
    /// Components along x, y, n, per path point.
    pub rigid: &'a mut [[f64; 3]],
    /// Amplitudes of the additional rigid modes, per path point.
    pub floating: &'a mut [[f64; MAX_RIGID_MODES]],
}

/// Computes `out = proj(hatted - step * gradient)` for every path point. Under force control, adds to `motions` the
/// rigid motion that balances the force.
pub fn project(
    problem: &Increment,
    steps: StepSizes,
    hatted: &[f64],
    gradient: &[f64],
    out: &mut [f64],
    motions: RigidMotions,
) -> Equilibrium {
    let RigidMotions { rigid, floating } = motions;
    let mut equilibrium = Equilibrium::Balanced;
    let n = problem.n();
    for (k, end) in problem.path_points.iter().enumerate() {
        let range = k * 3 * n..(k + 1) * 3 * n;
        let (old, g) = (&hatted[range.clone()], &gradient[range.clone()]);
        let new = &mut out[range];
        if let Some(balance) = &end.balance {
            let from = ProjectionStart { hatted: old, gradient: g, steps };
            if let Some(sliding) = balanced(problem, balance, from, new, &mut rigid[k], &mut floating[k]) {
                equilibrium = Equilibrium::Sliding(sliding);
            }
            continue;
        }
        let pressures = 2 * n..3 * n;
        if problem.pressures == Pressures::Given {
            new[pressures.clone()].copy_from_slice(&old[pressures]);
        } else {
            let lift = project_pressures(
                problem,
                end,
                &old[pressures.clone()],
                &g[pressures.clone()],
                steps.normal,
                &mut new[pressures],
            );
            rigid[k][2] -= lift / steps.normal;
        }
        if let Some(hat) = problem.friction_scaling() {
            for j in 0..2 * n {
                new[j] = old[j] - steps.tangential * g[j];
            }
            if let TangentialControl::Force(force) = end.tangential {
                let wanted = hat.scaled_traction(force);
                let (carried, shift) = shift_for_force(new, problem.areas, &hat, wanted, steps.tangential);
                if let Equilibrium::Sliding(_) = carried {
                    equilibrium = carried;
                    saturate_friction(new, n, wanted);
                    continue;
                }
                let hatted_shift = hat.scaled_slip(shift);
                for i in 0..n {
                    new[i] -= steps.tangential * hatted_shift[0];
                    new[n + i] -= steps.tangential * hatted_shift[1];
                }
                rigid[k][0] += shift[0];
                rigid[k][1] += shift[1];
            }
            project_to_friction_disc(new, n);
        } else {
            new[..2 * n].fill(0.0);
        }
    }
    equilibrium
}

/// Takes a step and projects the pressures onto p >= 0. Under a prescribed force, first adds the same shift to all
/// values, so that the projected pressures carry the force. Returns the shift, MPa.
fn project_pressures(
    problem: &Increment,
    end: &PathPoint,
    old: &[f64],
    gap: &[f64],
    step: f64,
    new: &mut [f64],
) -> f64 {
    new.iter_mut().zip(old).zip(gap).for_each(|((new, old), gap)| *new = old - step * gap);
    let lift = match end.normal {
        NormalControl::Force(force) => shift_to_normal_force(new, problem.areas, force),
        NormalControl::Approach => 0.0,
    };
    new.iter_mut().for_each(|p| *p = p.max(0.0));
    lift
}

fn balanced(
    problem: &Increment,
    balance: &Balance,
    from: ProjectionStart,
    new: &mut [f64],
    rigid: &mut [f64; 3],
    floating: &mut [f64; MAX_RIGID_MODES],
) -> Option<LossOfEquilibrium> {
    let (motion, failure) = balance.project(problem.cells(), from, new);
    rigid.iter_mut().zip(&motion).for_each(|(r, m)| *r += m);
    floating.iter_mut().zip(&motion[3..]).for_each(|(f, m)| *f += m);
    failure
}

fn saturate_friction(planes: &mut [f64], n: usize, direction: [f64; 2]) {
    let norm = direction[0].hypot(direction[1]);
    for i in 0..n {
        planes[i] = planes[2 * n + i] * direction[0] / norm;
        planes[n + i] = planes[2 * n + i] * direction[1] / norm;
    }
}

fn project_to_friction_disc(planes: &mut [f64], n: usize) {
    for i in 0..n {
        let (a, b, p) = (planes[i], planes[n + i], planes[2 * n + i]);
        let norm = (a * a + b * b).sqrt();
        if norm > p {
            let scale = p / norm;
            planes[i] *= scale;
            planes[n + i] *= scale;
        }
    }
}

/// Shifts `z` by τ so that Σ A max(z + τ, 0) = force, and returns τ.
///
/// Newton's method starts to the right of the root of this convex function and finds the root in finitely many steps.
/// The largest value is first subtracted from `z`, so that rounding does not affect the smallest forces.
fn shift_to_normal_force(z: &mut [f64], areas: &[f64], force: f64) -> f64 {
    let mut top = 0;
    for i in 0..z.len() {
        if z[i] > z[top] {
            top = i;
        }
    }
    let highest = z[top];
    z.iter_mut().for_each(|value| *value -= highest);
    // With this shift, the cell with the largest value carries the force alone.
    let mut lift = force.max(0.0) / areas[top];
    for _ in 0..200 {
        let (mut sum, mut slope) = (0.0, 0.0);
        for (&value, &area) in z.iter().zip(areas) {
            if value + lift > 0.0 {
                sum += area * (value + lift);
                slope += area;
            }
        }
        if slope == 0.0 {
            break;
        }
        let step = (sum - force) / slope;
        lift -= step;
        if step.abs() <= 1e-15 * lift.abs() {
            break;
        }
    }
    z.iter_mut().for_each(|value| *value += lift);
    lift - highest
}

const POTENTIAL_ROUNDING: f64 = 1e-12;

/// Newton step for the force defect `defect`: (J + floor I)⁻¹ defect. The array contains the components 11, 12, 22 of
/// the symmetric Jacobian J.
fn newton_step([a, b, c]: [f64; 3], floor: f64, defect: [f64; 2]) -> [f64; 2] {
    let (a, c) = (a + floor, c + floor);
    let det = a * c - b * b;
    [(c * defect[0] - b * defect[1]) / det, (a * defect[1] - b * defect[0]) / det]
}

/// Rigid displacement v (x, y) for which the projected tractions carry the prescribed force f: Σ A R M clip(ẑ - a M Rᵀ
/// v; p) = f.
///
/// `planes` contains the predictors ẑ and the pressures p, `step` is the step size a. `wanted` is the scaled force f̂ =
/// M⁻¹ Rᵀ f. clip(·; p) is the radial return to the disc of radius p. R and M are the matrices of [`FrictionScaling`].
///
/// v minimises the convex potential Σ A h(ẑ - a M Rᵀ v; p) + a f·v with Huber's function h. If f reaches the friction
/// limit, the function returns the loss of equilibrium and v = 0.
fn shift_for_force(
    planes: &[f64],
    areas: &[f64],
    hat: &FrictionScaling,
    wanted: [f64; 2],
    step: f64,
) -> (Equilibrium, [f64; 2]) {
    let n = areas.len();
    // In scaled components the equation is Σ A clip(ẑ - y; p) = f̂, with the unknown y = a M Rᵀ v.
    let capacity: f64 = (0..n).map(|i| areas[i] * planes[2 * n + i]).sum();
    let size = wanted[0].hypot(wanted[1]);
    if size >= capacity * (1.0 - 1e-12) {
        let sliding = || Equilibrium::Sliding(LossOfEquilibrium::by_sliding(hat, wanted, capacity));
        return (if size == 0.0 { Equilibrium::Balanced } else { sliding() }, [0.0; 2]);
    }
    let scale = capacity / areas.iter().sum::<f64>();
    let mut y = [0.0; 2];
    let mut current = clipped_sum(planes, areas, y);
    for _ in 0..200 {
        let defect = [current.sum[0] - wanted[0], current.sum[1] - wanted[1]];
        let error = defect[0].hypot(defect[1]);
        if error <= 1e-14 * capacity {
            break;
        }
        // The Jacobian is singular if all cells slip in one direction. The floor then bounds the step.
        let floor = 0.1 * error / (y[0].hypot(y[1]) + scale);
        let direction = newton_step(current.jacobian, floor, defect);
        let slope = direction[0] * defect[0] + direction[1] * defect[1];
        let value = current.potential + wanted[0] * y[0] + wanted[1] * y[1];
        let mut damping = 1.0;
        for _ in 0..40 {
            let trial = [y[0] + damping * direction[0], y[1] + damping * direction[1]];
            let next = clipped_sum(planes, areas, trial);
            let next_value = next.potential + wanted[0] * trial[0] + wanted[1] * trial[1];
            let next_error = (next.sum[0] - wanted[0]).hypot(next.sum[1] - wanted[1]);
            // If rounding hides the change of the potential, the decrease of the force error decides. The force error
            // alone is no criterion: it would accept ever longer steps across the root.
            let level = next_value <= value + POTENTIAL_ROUNDING * value.abs();
            let falls = next_value <= value - 1e-4 * damping * slope;
            let accepted = falls || (level && next_error < 0.5 * error);
            if accepted || damping < 1e-9 {
                y = trial;
                current = next;
                break;
            }
            damping *= 0.5;
        }
    }
    // y = a M Rᵀ v, so v = R M⁻¹ y / a.
    let scaled = [y[0] / hat.mu[0] / step, y[1] / hat.mu[1] / step];
    (
        Equilibrium::Balanced,
        [hat.cos * scaled[0] - hat.sin * scaled[1], hat.sin * scaled[0] + hat.cos * scaled[1]],
    )
}

struct ClippedSum {
    /// Σ A h(ẑ - y), with Huber's function h, whose derivative is clip(x; p).
    potential: f64,
    sum: [f64; 2],
    /// Components 11, 12, 22 of the derivative -∂sum/∂y.
    jacobian: [f64; 3],
}

fn clipped_sum(planes: &[f64], areas: &[f64], y: [f64; 2]) -> ClippedSum {
    let n = areas.len();
    let mut result = ClippedSum { potential: 0.0, sum: [0.0; 2], jacobian: [0.0; 3] };
    for i in 0..n {
        let p = planes[2 * n + i];
        if p <= 0.0 {
            continue;
        }
        let z = [planes[i] - y[0], planes[n + i] - y[1]];
        let norm = (z[0] * z[0] + z[1] * z[1]).sqrt();
        let area = areas[i];
        if norm <= p {
            result.potential += 0.5 * area * norm * norm;
            result.sum[0] += area * z[0];
            result.sum[1] += area * z[1];
            result.jacobian[0] += area;
            result.jacobian[2] += area;
        } else {
            let e = [z[0] / norm, z[1] / norm];
            let scale = p / norm;
            result.potential += area * p * (norm - 0.5 * p);
            result.sum[0] += area * p * e[0];
            result.sum[1] += area * p * e[1];
            result.jacobian[0] += area * scale * (1.0 - e[0] * e[0]);
            result.jacobian[1] -= area * scale * e[0] * e[1];
            result.jacobian[2] += area * scale * (1.0 - e[1] * e[1]);
        }
    }
    result
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::laws::friction::FrictionEllipse;

    struct Numbers(usize);

    impl Numbers {
        fn next(&mut self) -> f64 {
            self.0 += 1;
            ((self.0 as f64) * 0.618_033_988_75).fract() - 0.5
        }
    }

    /// Random tangential predictors and pressures, `[3, n]`. Many predictors exceed the friction limit.
    fn planes(numbers: &mut Numbers, n: usize, size: f64) -> Vec<f64> {
        let pressures: Vec<f64> = (0..n).map(|_| 500.0 * (numbers.next() + 0.5).sqrt()).collect();
        let way = [1.0, -1.0, 0.0][(3.0 * (numbers.next() + 0.5)) as usize];
        let (power, across) = ((3.0 * (numbers.next() + 0.5)) as i32, 10.0f64.powf(6.0 * numbers.next()));
        let first: Vec<f64> = pressures
            .iter()
            .map(|p| 4.0 * numbers.next() * p + size * way * (numbers.next() + 0.5).powi(power))
            .collect();
        let second: Vec<f64> = pressures.iter().map(|p| 4.0 * numbers.next() * p * across).collect();
        [first, second, pressures].concat()
    }

    /// Truth: the cell areas times the shifted and clipped tractions sum to the prescribed force. The tolerance,
    /// relative to the friction limit, is 1e-12 plus ten times the rounding error of the largest predictor.
    #[test]
    fn shifts_carry_their_forces() {
        let hat = FrictionScaling::new(&FrictionEllipse { mu: [0.3, 0.5], angle: 0.7 });
        let mut numbers = Numbers(0);
        for trial in 0..4000 {
            let n = 3 + trial % 57;
            let areas = vec![1e-3; n];
            let size = 10.0f64.powf(14.0 * (numbers.next() + 0.5) - 2.0);
            let planes = planes(&mut numbers, n, size);
            let capacity: f64 = (0..n).map(|i| areas[i] * planes[2 * n + i]).sum();
            let (share, turn) = (1.98 * numbers.next(), 6.0 * numbers.next());
            let force = hat.physical_traction([turn.cos(), turn.sin()]).map(|f| f * share * capacity);
            let (held, shift) = shift_for_force(&planes, &areas, &hat, hat.scaled_traction(force), 2.0);
            assert_eq!(held, Equilibrium::Balanced, "{trial} {force:?}");
            let hatted = hat.scaled_slip(shift).map(|part| 2.0 * part);
            let sum = hat.physical_traction(clipped_sum(&planes, &areas, hatted).sum);
            let rounding = 1e-15 * planes.iter().fold(0.0f64, |most, q| most.max(q.abs())) / 500.0;
            let bound = (1e-12 + 10.0 * rounding) * capacity;
            for defect in [sum[0] - force[0], sum[1] - force[1]] {
                assert!(defect.abs() <= bound, "{trial} {force:?} {size:e}: {}", defect / capacity);
            }
        }
    }
}
