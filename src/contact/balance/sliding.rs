//! Sliding along unknown motions: the motion that friction resists least, and the balance of the pressures while the bodies slide.

use nalgebra::{SMatrix, SymmetricEigen};

use super::{
    Balance, LOAD_TOLERANCE, LossOfEquilibrium, MOTION_COMPONENTS, MotionValues, RigidMotion,
    with_unit_maximum,
};

/// Largest number of steps of the minimisation.
const MAX_STEPS: usize = 500;
/// Change of the motion in a step, relative to the motion, at which the minimisation ends.
const STEP_TOLERANCE: f64 = 1e-10;
/// Smallest slip of a cell in the minimisation, relative to the largest slip.
const MIN_SLIP_SHARE: f64 = 1e-9;
/// A combination of motions counts as free of slip if its eigenvalue of the Gram matrix of slips is at most this share of
/// the largest eigenvalue. The weights of the matrix differ by up to the reciprocal of [`MIN_SLIP_SHARE`].
const NULL_SHARE: f64 = 1e-13;
/// A combination of motions counts as changing no normal gap if its eigenvalue of the Gram matrix of normal gaps is at
/// most this share of the largest eigenvalue. The root mean square gap of this combination is at most a millionth of the
/// largest root mean square gap.
const NO_GAP_SHARE: f64 = 1e-12;

type Gram = SMatrix<f64, MOTION_COMPONENTS, MOTION_COMPONENTS>;

/// Motion of body 2 in gross sliding.
pub struct SlidingMotion {
    /// Translation and rotation of body 2, scaled such that the load does the work 1.
    motion: RigidMotion,
    /// Scaled slip of the cells, `[2, N]`.
    pub slip: Vec<f64>,
    /// Work of the friction limits on the motion, divided by the work of the load on the motion.
    pub carried_load_fraction: f64,
    /// Whether the minimisation of the work converged. Otherwise friction may carry a smaller fraction of the load.
    pub is_least: bool,
}

impl Balance {
    /// Motion on which the friction limits do the least work, while the load does the work 1. By the kinematic theorem
    /// of limit analysis, this least work is the fraction of the load that friction with these limits carries.
    ///
    /// The balance must come from [`Self::without_gap`], so that the motions change no normal gap. `limits` are the
    /// scaled friction limits of the cells, `[N]`. Returns `None` if friction does not resist a motion on which the
    /// load does work.
    ///
    /// # Source
    /// Weiszfeld 1937, "Sur le point pour lequel la somme des distances de n points donnés est minimum": each step
    /// minimises a weighted sum of squared slips instead of the sum of slips. The weights are the reciprocal slips of
    /// the previous step.
    pub fn least_resisted_motion(&self, areas: &[f64], limits: &[f64]) -> Option<SlidingMotion> {
        let n = areas.len();
        let mut weights: Vec<f64> = areas.iter().zip(limits).map(|(area, limit)| area * limit).collect();
        let (mut values, mut is_least) = (MotionValues::zeros(), false);
        for _ in 0..MAX_STEPS {
            let next = self.motion_of_least_squares(&weights)?;
            let change = (next - values).norm();
            values = next;
            is_least = change <= STEP_TOLERANCE * values.norm();
            if is_least {
                break;
            }
            let slips: Vec<f64> = (0..n).map(|cell| slip_size(self.gap(cell, &values))).collect();
            let least = MIN_SLIP_SHARE * slips.iter().fold(0.0, |most, slip| f64::max(most, *slip));
            for (cell, weight) in weights.iter_mut().enumerate() {
                *weight = areas[cell] * limits[cell] / slips[cell].max(least);
            }
        }
        let (mut work, mut slip) = (0.0, vec![0.0; 2 * n]);
        for cell in 0..n {
            let gap = self.gap(cell, &values);
            (slip[cell], slip[n + cell]) = (gap[0], gap[1]);
            work += areas[cell] * limits[cell] * slip_size(gap);
        }
        Some(SlidingMotion { motion: self.motion(&values), slip, carried_load_fraction: work, is_least })
    }

    /// Motion on which the load does the work 1, with the least weighted sum of squared slips. `weights` are the
    /// factors of the squared slips, `[N]`. `None` if the load does work on a motion without weighted slip.
    fn motion_of_least_squares(&self, weights: &[f64]) -> Option<MotionValues> {
        let eigen = SymmetricEigen::new(self.gram(weights, &[0, 1]));
        let least = NULL_SHARE * eigen.eigenvalues.max();
        let (mut values, mut unresisted) = (MotionValues::zeros(), self.target_work);
        for (value, vector) in eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter()) {
            if *value > least {
                let work = vector.dot(&self.target_work);
                values -= vector * (work / value);
                unresisted -= vector * work;
            }
        }
        let driven = -self.target_work.dot(&values);
        let resisted = unresisted.norm() <= LOAD_TOLERANCE * self.target_work.norm();
        (driven > 0.0 && resisted).then(|| values / driven)
    }

    /// Balance of the motions that cause no slip; `None` if there are none.
    pub fn without_slip(&self, areas: &[f64]) -> Option<Self> {
        self.restricted(&self.null_motions(&self.gram(areas, &[0, 1]), NULL_SHARE))
    }

    /// Balance of the motions that change no normal gap. `None` if the load does no work on them.
    pub fn without_gap(&self, areas: &[f64]) -> Option<Self> {
        let sliding = self.restricted(&self.null_motions(&self.gram(areas, &[2]), NO_GAP_SHARE));
        sliding.filter(|sliding| sliding.target_work.norm() > LOAD_TOLERANCE * self.target_work.norm())
    }

    /// Orthonormal eigenvectors of `gram` whose eigenvalues are at most `share` times the largest eigenvalue.
    fn null_motions(&self, gram: &Gram, share: f64) -> Vec<MotionValues> {
        let eigen = SymmetricEigen::new(*gram);
        let least = share * eigen.eigenvalues.max();
        let pairs = eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter());
        let kept = pairs.filter(|(value, vector)| **value <= least && vector.rows(0, self.n).norm() > 0.5);
        kept.map(|(_, vector)| vector.into_owned()).collect()
    }

    /// Gram matrix of the motions: the weighted sum over the cells of products of gaps per unit motion. `components`
    /// selects components of the gaps.
    fn gram(&self, weights: &[f64], components: &[usize]) -> Gram {
        let mut gram = Gram::zeros();
        for (cell, weight) in weights.iter().enumerate() {
            let row = self.row(cell);
            for (j, c) in row.iter().enumerate() {
                for (k, other) in row.iter().enumerate() {
                    gram[(j, k)] += weight * components.iter().map(|&i| c[i] * other[i]).sum::<f64>();
                }
            }
        }
        gram
    }

    /// Balance of the motions `kept`; `None` if there are none.
    fn restricted(&self, kept: &[MotionValues]) -> Option<Self> {
        let mut target_work = MotionValues::zeros();
        for (work, values) in target_work.iter_mut().zip(kept) {
            *work = self.target_work.dot(values);
        }
        let columns = (0..self.columns.len() / self.n)
            .flat_map(|cell| kept.iter().map(move |values| self.gap(cell, values)));
        (!kept.is_empty()).then(|| Self {
            n: kept.len(),
            motions: kept.iter().map(|values| self.motion(values)).collect(),
            columns: columns.collect(),
            target_work,
            unresisted_motions: self.unresisted_motions.clone(),
        })
    }
}

impl SlidingMotion {
    /// Loss of equilibrium by gross sliding along this motion.
    pub(crate) fn loss_of_equilibrium(&self) -> LossOfEquilibrium {
        LossOfEquilibrium {
            motion: with_unit_maximum(self.motion),
            separates_bodies: false,
            carried_load_fraction: self.carried_load_fraction,
        }
    }
}

fn slip_size(gap: [f64; 3]) -> f64 {
    gap[0].hypot(gap[1])
}

#[cfg(test)]
mod tests {
    use super::super::{BalanceCells, BalanceConstraint};
    use super::*;
    use crate::contact::friction_scaling::FrictionScaling;
    use crate::laws::friction::FrictionEllipse;

    /// Height of the axis of the tilt above the frame.
    const HEIGHT: f64 = 5.0;

    /// Balance of a flat frame with cells at `points`. Its motions are translations along x and y, a rotation about n,
    /// and a tilt about an axis along y at [`HEIGHT`]. This tilt also causes slip. `works[3]` is the work on a tilt
    /// about y in the plane of the frame.
    fn balance(points: &[[f64; 2]], areas: &[f64], hat: FrictionScaling, works: [f64; 4]) -> Balance {
        let gap = |component: usize, cell: usize| {
            let [x, y] = points[cell];
            match component {
                0 => [1.0, 0.0, 0.0],
                1 => [0.0, 1.0, 0.0],
                3 => [-y, x, 0.0],
                _ => [HEIGHT, 0.0, x],
            }
        };
        let tilt = works[3] + HEIGHT * works[0];
        let wanted = [(0, works[0]), (1, works[1]), (3, works[2]), (4, tilt)].map(|(component, work)| {
            let mut motion = [0.0; MOTION_COMPONENTS];
            motion[component] = 1.0;
            BalanceConstraint { motion, work }
        });
        Balance::new(BalanceCells { areas, hat: Some(hat) }, gap, &wanted).expect("resisted loads")
    }

    fn coulomb(mu: f64) -> FrictionScaling {
        FrictionScaling::new(&FrictionEllipse { mu: [mu; 2], angle: 0.0 })
    }

    /// Truth: the body turns about the point that is farther from the force. Two points at x = -a and x = a have the
    /// friction limit L each. They carry a force along y at x = e up to 2 L a / (a + e). The tolerance is 1e-6, because
    /// the farther point slips by [`MIN_SLIP_SHARE`] of the slip of the nearer point.
    #[test]
    fn an_eccentric_force_turns_the_body_about_the_farther_point() {
        let (a, limit, force) = (2.0, 0.7, 3.0);
        for e in [0.1, 0.5, 1.9] {
            let works = [0.0, force, force * e, 0.0];
            let balance = balance(&[[-a, 0.0], [a, 0.0]], &[1.0; 2], coulomb(1.0), works);
            let along = balance.without_gap(&[1.0; 2]).expect("a load");
            let sliding = along.least_resisted_motion(&[1.0; 2], &[limit; 2]).expect("a motion");
            let wanted = 2.0 * limit * a / (a + e) / force;
            let found = sliding.carried_load_fraction;
            assert!((found / wanted - 1.0).abs() < 1e-6, "{e} {found} {wanted}");
        }
    }

    /// Truth: points on a circle of radius r, with friction limits L and areas A, carry the moment Σ A L r by friction.
    /// In a translation, all points slip along the normal of the friction ellipse at the point in the direction of the
    /// force. A tilt about y in the plane of the frame causes no slip, and the balance without slip keeps its work.
    #[test]
    fn moments_turn_and_forces_translate() {
        let (n, r) = (12, 1.5);
        let points: Vec<[f64; 2]> = (0..n)
            .map(|i| {
                let (sin, cos) = (std::f64::consts::TAU * i as f64 / n as f64).sin_cos();
                [r * cos, r * sin]
            })
            .collect();
        let (areas, limits) = (vec![0.5; n], vec![0.8; n]);
        let turned = balance(&points, &areas, coulomb(1.0), [0.0, 0.0, 2.0, 0.3]);
        let along = turned.without_gap(&areas).expect("a load");
        let sliding = along.least_resisted_motion(&areas, &limits).expect("a motion");
        let wanted = n as f64 * 0.5 * 0.8 * r / 2.0;
        assert!((sliding.carried_load_fraction / wanted - 1.0).abs() < 1e-9);

        let (mu, angle) = ([0.4, 0.1], 0.3);
        let hat = FrictionScaling::new(&FrictionEllipse { mu, angle });
        let force = [1.1, 0.6];
        let pulled = balance(&points, &areas, hat, [force[0], force[1], 0.0, 0.3]);
        let along = pulled.without_gap(&areas).expect("a load");
        let sliding = along.least_resisted_motion(&areas, &limits).expect("a motion");
        let motion = sliding.motion;
        let (sin, cos) = angle.sin_cos();
        let along = [force[0] * cos + force[1] * sin, force[1] * cos - force[0] * sin];
        let normal = [along[0] / mu[0].powi(2), along[1] / mu[1].powi(2)];
        let wanted = [normal[0] * cos - normal[1] * sin, normal[0] * sin + normal[1] * cos];
        let across = (motion[0] * wanted[1] - motion[1] * wanted[0]) / wanted[0].hypot(wanted[1]);
        assert!(across.abs() < 1e-9 * motion[0].hypot(motion[1]) && motion[3].abs() < 1e-9, "{motion:?}");

        let pressing = pulled.without_slip(&areas).expect("a tilt");
        let [(motion, work)] = pressing.constraints().collect::<Vec<_>>()[..] else { panic!("one motion") };
        assert!((work - 0.3 * motion[4]).abs() < 1e-12 && (motion[0] + HEIGHT * motion[4]).abs() < 1e-12);
        assert!(motion[1..4].iter().all(|part| part.abs() < 1e-12), "{motion:?}");
    }
}
