//! Force balance: finds the unknown rigid motions along which a force is prescribed or a body is unconstrained.
//!
//! The motion ρ is the Lagrange multiplier of the projection P = proj(P* - D R ρ). P* are the tractions before the
//! projection. D contains the step sizes and R the gaps per unit motion. The tractions must do the prescribed work F on
//! each motion, Σ A R·P = F with cell areas A (docs/theory-contact.md).
//!
//! For given radii of the friction discs, ρ minimises a convex potential. The radii are the pressures of the previous
//! minimisation.

mod potential;
mod sliding;

use nalgebra::{DMatrix, SVector, SymmetricEigen};

use super::friction_scaling::FrictionScaling;
use crate::laws::friction::FrictionEllipse;

/// Largest number of additional rigid modes of an increment: six modes of unconstrained bodies, or three rotations of
/// body 2.
pub const MAX_RIGID_MODES: usize = 6;

/// Number of components of a relative rigid motion: along the frame's x, y, n, then the additional modes.
pub const MOTION_COMPONENTS: usize = 3 + MAX_RIGID_MODES;

/// Relative rigid motion, by components.
pub type RigidMotion = [f64; MOTION_COMPONENTS];

/// Vector of one value per unknown motion; its remaining entries are zero.
pub(super) type MotionValues = SVector<f64, MOTION_COMPONENTS>;

/// Largest eigenvalue of the Gram matrix of the gaps for which a combination of motions counts as unresisted. The
/// motions are scaled to unit mean square gap.
const RANK_TOLERANCE: f64 = 1e-12;

/// Largest work of the loads on an unresisted motion that counts as rounding error, relative to the largest prescribed
/// work on a motion.
const LOAD_TOLERANCE: f64 = 1e-9;

/// Largest number of updates of the friction radii in one projection. The remaining error appears in the natural residual.
const MAX_RADIUS_UPDATES: usize = 6;

/// How equilibrium under prescribed forces is lost.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LossOfEquilibrium {
    /// Direction of the unresisted motion of body 2. On a path point with a balance its largest component has magnitude 1,
    /// otherwise it is a unit vector.
    pub motion: RigidMotion,
    /// Whether the motion mainly separates the bodies: its largest opening exceeds its largest slip.
    pub separates_bodies: bool,
    /// Work of the friction limits on the motion, divided by the work of the load on the motion.
    pub carried_load_fraction: f64,
}

impl LossOfEquilibrium {
    /// Gross sliding under the scaled tangential force `force` on body 2, which reaches the friction limit `limit`. All cells slip
    /// in the direction whose scaled slip is opposite to `force`.
    pub(super) fn by_sliding(hat: &FrictionScaling, force: [f64; 2], limit: f64) -> Self {
        let slip = hat.physical_slip(force);
        let size = slip[0].hypot(slip[1]);
        let mut motion = [0.0; MOTION_COMPONENTS];
        (motion[0], motion[1]) = (-slip[0] / size, -slip[1] / size);
        Self { motion, separates_bodies: false, carried_load_fraction: limit / force[0].hypot(force[1]) }
    }
}

/// Step sizes of the normal and the tangential block, MPa/mm.
#[derive(Debug, Clone, Copy)]
pub struct StepSizes {
    /// Step size of the pressures.
    pub normal: f64,
    /// Step size of the scaled tangential tractions.
    pub tangential: f64,
}

/// Relation between tangential tractions and their predictors, the tractions before the friction limit.
#[derive(Clone, Copy)]
enum FrictionBound<'a> {
    /// Unlimited friction: the traction equals the predictor.
    Stick,
    /// Radial return to discs of these radii, `[N]`.
    Radius(&'a [f64]),
    /// The tractions of all cells are at these limits, `[N]`, opposite to the given motion.
    Saturated(&'a [f64], MotionValues),
}

/// Unknown motion, and the work that the tractions must do on this motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BalanceConstraint {
    /// Unknown motion.
    pub motion: RigidMotion,
    /// Prescribed work Σ A P·(gap per unit of the motion), with cell areas A and tractions P on body 2.
    pub work: f64,
}

/// Motion that no traction of the frame resists, although a load does work on this motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UnresistedLoad {
    /// Unresisted motion.
    pub motion: RigidMotion,
    /// Work of the load on the motion.
    pub work: f64,
}

#[derive(Clone, Copy)]
pub(super) struct BalanceCells<'a> {
    /// Cell areas, `[N]`.
    pub areas: &'a [f64],
    /// Scaling by the friction law, `None` without friction.
    pub hat: Option<FrictionScaling>,
}

/// Balance of the unknown rigid motions at one path point of an increment.
#[derive(Debug, Clone)]
pub struct Balance {
    /// Number of unknown motions m.
    n: usize,
    motions: Vec<RigidMotion>,
    /// Scaled gap per unit of each motion, by cell: `[N, m]` of components along friction axes 1, 2 and the normal.
    columns: Vec<[f64; 3]>,
    target_work: MotionValues,
    /// Motions without resistance and without load, which keep their values.
    pub unresisted_motions: Vec<RigidMotion>,
}

#[derive(Clone, Copy)]
pub(super) struct ProjectionStart<'a> {
    /// Scaled tractions, `[3, N]`.
    pub hatted: &'a [f64],
    /// Scaled slip and normal gap, `[3, N]`.
    pub gradient: &'a [f64],
    pub steps: StepSizes,
}

impl Balance {
    /// Creates the balance of the motions `wanted`. `gap(component, cell)` is the local gap (x, y, n) per unit of a component of
    /// motion. Motions that move no cell against pressure or friction are fixed if no load acts on them.
    ///
    /// # Errors
    /// If a load acts along a motion that no traction resists. Returns the first such motion.
    pub fn for_frame(
        areas: &[f64],
        friction: Option<&FrictionEllipse>,
        gap: impl Fn(usize, usize) -> [f64; 3],
        wanted: &[BalanceConstraint],
    ) -> Result<Self, UnresistedLoad> {
        Self::new(BalanceCells { areas, hat: friction.map(FrictionScaling::new) }, gap, wanted)
    }

    /// Implements [`Self::for_frame`].
    fn new(
        cells: BalanceCells,
        gap: impl Fn(usize, usize) -> [f64; 3],
        wanted: &[BalanceConstraint],
    ) -> Result<Self, UnresistedLoad> {
        let raw = raw_columns(cells, gap, wanted);
        let m = wanted.len();
        let area: f64 = cells.areas.iter().sum();
        let mut gram = DMatrix::<f64>::zeros(m, m);
        let mut size = vec![0.0; m];
        for (cell, &a) in cells.areas.iter().enumerate() {
            let row = &raw[cell * m..(cell + 1) * m];
            for j in 0..m {
                size[j] += a / area * row[j].iter().map(|c| c * c).sum::<f64>();
                for k in 0..m {
                    gram[(j, k)] += a / area * resisted_product(row[j], row[k], cells.hat.is_some());
                }
            }
        }
        let scale: Vec<f64> = size.iter().map(|s| if *s > 0.0 { 1.0 / s.sqrt() } else { 1.0 }).collect();
        let scaled = DMatrix::from_fn(m, m, |j, k| gram[(j, k)] * scale[j] * scale[k]);
        let eigen = SymmetricEigen::new(scaled);
        let largest_work = (0..m).map(|j| (wanted[j].work * scale[j]).abs()).fold(0.0, f64::max);
        let mut balance = Self {
            n: 0,
            motions: Vec::new(),
            columns: Vec::new(),
            target_work: MotionValues::zeros(),
            unresisted_motions: Vec::new(),
        };
        let mut combinations = Vec::new();
        for i in 0..m {
            let vector = eigen.eigenvectors.column(i);
            let resists = eigen.eigenvalues[i] > RANK_TOLERANCE;
            let unit = if resists { eigen.eigenvalues[i].sqrt().recip() } else { 1.0 };
            let combination: Vec<f64> = (0..m).map(|j| unit * vector[j] * scale[j]).collect();
            let work: f64 = combination.iter().zip(wanted).map(|(c, w)| c * w.work).sum();
            let motion = std::array::from_fn(|k| {
                combination.iter().zip(wanted).map(|(c, w)| c * w.motion[k]).sum::<f64>()
            });
            if resists {
                balance.target_work[balance.n] = work;
                balance.n += 1;
                balance.motions.push(motion);
                combinations.push(combination);
            } else if work.abs() > LOAD_TOLERANCE * largest_work {
                return Err(UnresistedLoad { motion: with_unit_maximum(motion), work });
            } else {
                balance.unresisted_motions.push(with_unit_maximum(motion));
            }
        }
        balance.fill_columns(cells, &raw, &combinations);
        Ok(balance)
    }

    fn fill_columns(&mut self, cells: BalanceCells, raw: &[[f64; 3]], combinations: &[Vec<f64>]) {
        let m = raw.len() / cells.areas.len();
        for row in raw.chunks_exact(m.max(1)) {
            for combination in combinations {
                let mut sum = [0.0; 3];
                for (column, c) in row.iter().zip(combination) {
                    (0..3).for_each(|k| sum[k] += c * column[k]);
                }
                let tangential = cells.hat.map_or([0.0; 2], |hat| hat.scaled_slip([sum[0], sum[1]]));
                self.columns.push([tangential[0], tangential[1], sum[2]]);
            }
        }
    }

    fn row(&self, cell: usize) -> &[[f64; 3]] {
        &self.columns[cell * self.n..(cell + 1) * self.n]
    }

    fn gap(&self, cell: usize, rho: &MotionValues) -> [f64; 3] {
        let mut sum = [0.0; 3];
        for (column, r) in self.row(cell).iter().zip(rho.iter()) {
            (0..3).for_each(|k| sum[k] += r * column[k]);
        }
        sum
    }

    fn motion(&self, rho: &MotionValues) -> RigidMotion {
        let mut sum = [0.0; MOTION_COMPONENTS];
        for (motion, r) in self.motions.iter().zip(rho.iter()) {
            sum.iter_mut().zip(motion).for_each(|(s, c)| *s += r * c);
        }
        sum
    }

    pub(super) fn constraints(&self) -> impl Iterator<Item = (RigidMotion, f64)> {
        self.motions.iter().copied().zip(self.target_work.iter().copied())
    }

    pub(super) fn restricted_to(&self, cells: &[usize]) -> Self {
        let columns = cells.iter().flat_map(|&cell| self.row(cell)).copied().collect();
        Self {
            columns,
            motions: self.motions.clone(),
            unresisted_motions: self.unresisted_motions.clone(),
            ..*self
        }
    }

    /// Works of the scaled tractions `[3, N]` on the unknown motions, minus the prescribed works.
    pub(super) fn work_defects(&self, areas: &[f64], hatted: &[f64]) -> MotionValues {
        let n = areas.len();
        let mut defects = -self.target_work;
        for (cell, area) in areas.iter().enumerate() {
            let p = [hatted[cell], hatted[n + cell], hatted[2 * n + cell]];
            for (defect, c) in defects.iter_mut().zip(self.row(cell)) {
                *defect += area * (c[0] * p[0] + c[1] * p[1] + c[2] * p[2]);
            }
        }
        defects
    }

    /// Adds `works` to the prescribed works.
    pub(super) fn add_works(&mut self, works: MotionValues) {
        self.target_work += works;
    }

    /// Defect of the balance for scaled tractions `[3, N]`, relative to the prescribed works plus the absolute works of all cells.
    pub(super) fn residual(&self, areas: &[f64], hatted: &[f64]) -> f64 {
        let n = areas.len();
        let (mut defect, mut size) = (-self.target_work, self.target_work.norm());
        for (cell, area) in areas.iter().enumerate() {
            let p = [hatted[cell], hatted[n + cell], hatted[2 * n + cell]];
            for (j, c) in self.row(cell).iter().enumerate() {
                let work = area * (c[0] * p[0] + c[1] * p[1] + c[2] * p[2]);
                defect[j] += work;
                size += work.abs();
            }
        }
        let defect = defect.norm();
        if defect == 0.0 { 0.0 } else { defect / size }
    }

    /// Projects a predictor onto the tractions that do the prescribed works, and writes these tractions to `out`.
    /// Returns the motion ρ and, if no motion balances the loads, the loss of equilibrium.
    pub(super) fn project(
        &self,
        cells: BalanceCells,
        from: ProjectionStart,
        out: &mut [f64],
    ) -> (RigidMotion, Option<LossOfEquilibrium>) {
        let n = cells.areas.len();
        let mut rho = MotionValues::zeros();
        let old = &from.hatted[2 * n..];
        out[2 * n..].copy_from_slice(old);
        let mut stick = cells.hat.is_none() || old.iter().all(|p| *p <= 0.0);
        for _ in 0..MAX_RADIUS_UPDATES {
            let radii = &out[2 * n..];
            let friction = if stick { FrictionBound::Stick } else { FrictionBound::Radius(radii) };
            let failure = match self.minimise(cells, from, friction, &mut rho) {
                Ok(()) => None,
                Err(direction) => Some(self.failure(cells, radii, &direction)),
            };
            if let Some((direction, failure)) = failure {
                // Balance the loads on motions orthogonal to the unresisted motion.
                rho = MotionValues::zeros();
                if self.minimise(cells, from, FrictionBound::Saturated(radii, direction), &mut rho).is_err() {
                    rho = MotionValues::zeros();
                }
                self.write(cells, from, &rho, Some(direction), out);
                return (self.motion(&rho), Some(failure));
            }
            let settled = self.write_pressures(from, &rho, &mut out[2 * n..]) && !stick;
            if settled || cells.hat.is_none() {
                break;
            }
            stick = false;
        }
        self.write(cells, from, &rho, None, out);
        (self.motion(&rho), None)
    }
}

fn raw_columns(
    cells: BalanceCells,
    gap: impl Fn(usize, usize) -> [f64; 3],
    wanted: &[BalanceConstraint],
) -> Vec<[f64; 3]> {
    let mut raw = Vec::with_capacity(cells.areas.len() * wanted.len());
    for cell in 0..cells.areas.len() {
        for BalanceConstraint { motion, .. } in wanted {
            let mut sum = [0.0; 3];
            for (component, share) in motion.iter().enumerate().filter(|(_, share)| **share != 0.0) {
                let unit = gap(component, cell);
                (0..3).for_each(|k| sum[k] += share * unit[k]);
            }
            raw.push(sum);
        }
    }
    raw
}

/// Scalar product of two gaps, over the components that tractions can resist.
fn resisted_product(a: [f64; 3], b: [f64; 3], friction: bool) -> f64 {
    let tangential = if friction { a[0] * b[0] + a[1] * b[1] } else { 0.0 };
    tangential + a[2] * b[2]
}

fn with_unit_maximum(motion: RigidMotion) -> RigidMotion {
    let largest = motion.iter().fold(0.0f64, |m, c| m.max(c.abs()));
    if largest > 0.0 { motion.map(|c| c / largest) } else { motion }
}
