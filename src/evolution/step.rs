//! Load steps: controls, cycles, rolling and their laws.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Normal control: value at the end of the step.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Normal {
    /// Motion of body 2 towards body 1, mm, 0 = first touch of the undeformed surfaces.
    Approach(f64),
    /// Normal force on body 1, compression positive, N.
    Force(f64),
}

/// Tangential control: values at the end of the step.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Tangential {
    /// Displacement of body 2 along the frame's x, y, mm.
    Shift([f64; 2]),
    /// Tangential force on body 1 along the frame's x, y, N.
    Force([f64; 2]),
}

/// Control of the rotation of body 2 about the frame's x and y through the frame's centre: values at the end of the step.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Tilt {
    /// Small rotation about x, y, radians.
    Rotation([f64; 2]),
    /// Moment on body 1 about x, y, N mm.
    Moment([f64; 2]),
}

/// Control of the rotation of body 2 about n through the frame's centre: value at the end of the step.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Spin {
    /// Small rotation, radians.
    Twist(f64),
    /// Moment on body 1, N mm.
    Moment(f64),
}

/// Number of fretting cycles or distance of steady sliding, the division into jumps, and the time integration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cycles {
    /// Number of cycles, or distance of steady sliding in mm.
    pub count: f64,
    /// Number or lengths of the jumps.
    pub jumps: JumpPolicy,
    /// Time integration of the wear over a jump.
    pub integrator: Integrator,
}

/// Closed path of the displacement or of the tangential force: a line or an ellipse about the value at the start of the
/// step. The path starts at the + reversal point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ClosedPath {
    /// Quantity that follows the path.
    pub drive: Drive,
    /// Semi-axes of the path, mm or N: along `angle`, and 90 degrees to the left of `angle` (0 for a line). Both
    /// semi-axes are 0 if only loads of the bodies vary.
    pub amplitude: [f64; 2],
    /// Angle from the frame's x to the first semi-axis, radians.
    pub angle: f64,
    /// Number of increments per stroke (half a cycle). Each increment ends at a path point, and all path points are
    /// solved together.
    pub increments: usize,
    /// Settings of resolved cycles; `None` without resolved cycles.
    pub resolved_cycles: Option<ResolvedCycleSettings>,
}

/// Settings of resolved cycles, whose strokes are solved increment by increment. Resolved cycles correct or check the
/// wear computed from the path points.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ResolvedCycleSettings {
    /// Number of increments per stroke. `None`: as many as the tolerance requires.
    pub increments: Option<usize>,
    /// Relative tolerance of the wear of a cycle. Refinement of the increments ends when this tolerance is met.
    pub tolerance: f64,
    /// Use of the resolved cycles.
    pub correction: Correction,
    /// Estimated relative error of the wear that triggers a warning.
    pub error_warning: f64,
}

/// Effect of resolved cycles on the wear.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Correction {
    /// Wear is corrected. With a given number of increments, the cycle is resolved after every jump. Otherwise it is
    /// resolved when the slip has changed by more than the tolerance, or the normal force by a factor of 2.
    Always,
    /// As `Always`, but only with friction. Wear stays uncorrected if the whole contact slides and the wear volumes
    /// without and with resolved cycles agree within the tolerance.
    WhereNeeded,
    /// Wear is not corrected. With friction, one resolved cycle at the start of the step measures the error of the wear.
    Never,
}

/// Prescribed quantity of a closed path.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Drive {
    /// The displacement of body 2.
    Shift,
    /// The tangential force on body 1.
    Force,
}

/// Smallest exponent m of graded increments. At 0.997 of the friction limit, the error of the wear under force cycles was
/// 15 % with m = 1 and 1 % with m = 2.
const MIN_GRADING: f64 = 2.0;

/// Largest exponent of graded increments of force strokes. At 0.999 of the friction limit, the error of the wear was 60 %
/// with m = 1, and below 1 % with m = 3 and 4.
const MAX_FORCE_GRADING: f64 = 4.0;

const TYPICAL_CONTROLLED_JUMPS: usize = 6;

impl Cycles {
    /// Expected number of contact solutions, including the first strokes.
    pub fn expected_solves(&self, wear: bool) -> usize {
        let jumps = match self.jumps {
            JumpPolicy::Number(jumps) => jumps,
            JumpPolicy::Tolerance(_) if wear => TYPICAL_CONTROLLED_JUMPS,
            JumpPolicy::Tolerance(_) => 1,
        };
        let stages = if self.integrator == Integrator::Sdirk2 { 2 } else { 1 };
        2 + stages * jumps
    }
}

impl ClosedPath {
    /// Number of increments per stroke that is given for resolved cycles. Without a given number, number of increments
    /// between the path points.
    pub fn given_increments(&self) -> usize {
        self.resolved_cycles.and_then(|used| used.increments).unwrap_or(self.increments)
    }

    /// Multiplies the number of increments per stroke by `factor`. If resolved cycles have a given number, or do not
    /// correct the wear, this number is multiplied, and they correct the wear. Otherwise the number of increments
    /// between the path points is multiplied.
    pub fn refine(&mut self, factor: usize) {
        match &mut self.resolved_cycles {
            _ if factor == 1 => {}
            Some(used) if used.increments.is_some() || used.correction == Correction::Never => {
                let increments = factor * used.increments.unwrap_or(self.increments);
                (used.increments, used.correction) = (Some(increments), Correction::Always);
            }
            _ => self.increments *= factor,
        }
    }

    /// Offsets along x, y from the centre of the path at the path points of a cycle. The + reversal point is the first
    /// point, and all increments are equal.
    pub fn offsets(&self) -> Vec<[f64; 2]> {
        self.positions().into_iter().map(|position| self.offset(position)).collect()
    }

    /// Positions of the path points of [`Self::offsets`] along the two semi-axes, divided by the semi-axes: from -1
    /// to 1.
    pub fn positions(&self) -> Vec<[f64; 2]> {
        self.positions_at(|part| part)
    }

    /// As [`Self::positions`], but with graded increments on a line. `transition` (0 to 1) is the share of the stroke
    /// in which slip spreads over the contact.
    ///
    /// With prescribed displacement, increment k of K ends at the fraction (k/K)^m of its stroke,
    /// m = max(log2(1/transition), 2). Increments are short after each reversal, where slip spreads.
    ///
    /// With prescribed force, increment k ends at 1 - (1 - k/K)^m, m = 2 + 2 log2(1/transition), at most
    /// `MAX_FORCE_GRADING`. Increments are short before each reversal, where slip grows fastest. Near gross sliding, most
    /// of the slip of a stroke occurs under the last percent of the force.
    pub fn graded_positions(&self, transition: f64) -> Vec<[f64; 2]> {
        let halvings = transition.recip().log2().max(0.0);
        if self.is_ellipse() {
            return self.positions();
        }
        match self.drive {
            Drive::Shift => self.positions_at(|part| part.powf(halvings.max(MIN_GRADING))),
            Drive::Force => {
                let exponent = (MIN_GRADING + 2.0 * halvings).min(MAX_FORCE_GRADING);
                self.positions_at(|part| 1.0 - (1.0 - part).powf(exponent))
            }
        }
    }

    /// Whether the path is an ellipse, not a line.
    pub fn is_ellipse(&self) -> bool {
        self.amplitude[1] != 0.0
    }

    /// Offset along x, y from the centre of the path. `position` is the position along the two semi-axes, divided by
    /// the semi-axes.
    pub fn offset(&self, position: [f64; 2]) -> [f64; 2] {
        let (s, c) = self.angle.sin_cos();
        let [along, left] = [0, 1].map(|axis| self.amplitude[axis] * position[axis]);
        [along * c - left * s, along * s + left * c]
    }

    /// Positions for K increments per stroke. On a line, increment k ends at the fraction `of(k/K)` of its stroke. On
    /// an ellipse, the increments cover equal angles.
    fn positions_at(&self, of: impl Fn(f64) -> f64) -> Vec<[f64; 2]> {
        let k = self.increments as f64;
        let position = |end: usize| {
            let at = end as f64;
            if !self.is_ellipse() {
                let back = end > self.increments;
                let along = 1.0 - 2.0 * of(if back { at - k } else { at } / k);
                return [if back { -along } else { along }, 0.0];
            }
            let (sin, cos) = (std::f64::consts::PI * at / k).sin_cos();
            [cos, sin]
        };
        (0..2 * self.increments).map(position).collect()
    }
}

/// Division of the cycles or of the sliding distance into jumps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum JumpPolicy {
    /// Number of jumps of equal length. Jumps of fretting cycles are rounded to whole cycles.
    Number(usize),
    /// Lengths chosen by the step controller. The value is the allowed error of the wear depth as a share of the
    /// largest depth.
    Tolerance(f64),
}

/// Steady rolling of the contact over both bodies.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rolling {
    /// Direction in which the contact moves over the bodies, in quarter turns from the frame's x towards its y.
    pub quarter_turns: u8,
    /// Rigid slip of body 2 relative to body 1 per rolled distance, along the direction of rolling and to the left of
    /// this direction.
    pub creepage: [f64; 2],
    /// Rotation of body 2 relative to body 1 about the normal per rolled distance, 1/mm.
    pub spin: f64,
    /// Rolled distance, for wear and dissipation, mm.
    pub distance: f64,
}

/// Time integration of wear over a jump of many cycles.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Integrator {
    /// Implicit, second order, L-stable (stable for jumps of any length).
    #[default]
    Sdirk2,
    /// Implicit, first order.
    BackwardEuler,
    /// Explicit, first order; stable for small jumps only.
    Explicit,
}

/// Kind of a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum StepKind {
    /// Load increments from the loads before the step to the loads of the step.
    Monotone,
    /// Steady rolling, in load increments.
    Rolling(Rolling),
    /// Fretting cycles on a closed path, computed in jumps.
    Fretting {
        /// Path of each cycle.
        path: ClosedPath,
        /// Number of cycles, jumps and time integration.
        cycles: Cycles,
    },
    /// Steady sliding in one direction, computed in jumps.
    Sliding {
        /// Angle from the frame's x to the direction of sliding, radians.
        angle: f64,
        /// Sliding distance, jumps and time integration.
        cycles: Cycles,
    },
}

impl StepKind {
    /// Cycles of fretting or steady sliding.
    pub fn cycles(&self) -> Option<&Cycles> {
        match self {
            Self::Fretting { cycles, .. } | Self::Sliding { cycles, .. } => Some(cycles),
            Self::Monotone | Self::Rolling(_) => None,
        }
    }

    /// Cycles of fretting or steady sliding, as a mutable reference.
    pub fn cycles_mut(&mut self) -> Option<&mut Cycles> {
        match self {
            Self::Fretting { cycles, .. } | Self::Sliding { cycles, .. } => Some(cycles),
            Self::Monotone | Self::Rolling(_) => None,
        }
    }

    /// Rolling of a rolling step.
    pub fn rolling(&self) -> Option<&Rolling> {
        if let Self::Rolling(rolling) = self { Some(rolling) } else { None }
    }

    /// Closed path of fretting cycles.
    pub fn closed_path(&self) -> Option<&ClosedPath> {
        if let Self::Fretting { path, .. } = self { Some(path) } else { None }
    }

    /// Largest displacement of body 2 from the centre of its closed path, mm. 0 for other kinds of steps, and `None` if
    /// forces are prescribed.
    pub fn reach(&self) -> Option<f64> {
        match self.closed_path() {
            Some(path) if path.drive == Drive::Force => None,
            Some(path) => Some(path.amplitude[0].max(path.amplitude[1])),
            None => Some(0.0),
        }
    }

    /// Number of path points that a stage solves together; 1 without a closed path.
    pub fn n_path_points(&self) -> usize {
        self.closed_path().map_or(1, |path| 2 * path.increments)
    }
}

/// Position of a step among the load points of a history.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct HistoryRow {
    /// Number of the load point, from 0.
    pub index: usize,
    /// Number of load points.
    pub count: usize,
}

impl Step {
    /// Amplitude of the load `name` of a body at the end of this step. A load that the step does not name keeps the
    /// amplitude `before`. In the first step (`is_first`), this load reaches 1 instead.
    pub fn load_amplitude(&self, name: Option<&str>, before: f64, is_first: bool) -> f64 {
        let named = self.loads.iter().find(|(load, _)| Some(load.as_str()) == name);
        named.map_or(if is_first { 1.0 } else { before }, |(_, amplitude)| *amplitude)
    }
}

/// One load step. A control that is `None` keeps its previous value.
#[derive(Debug, Clone, PartialEq)]
pub struct Step {
    /// Name of the step in results.
    pub name: String,
    /// Normal control.
    pub normal: Option<Normal>,
    /// Tangential control.
    pub tangential: Option<Tangential>,
    /// Rotation about x, y or its moment.
    pub tilt: Option<Tilt>,
    /// Rotation about n or its moment.
    pub spin: Option<Spin>,
    /// Names of loads of the bodies, with their amplitudes at the end of the step. Loads that are not named keep their
    /// amplitudes; in the first step they reach 1.
    pub loads: Vec<(String, f64)>,
    /// Names of loads that vary in phase with the strokes, with their amplitudes about the values at the start of the
    /// step.
    pub cyclic_loads: Vec<(String, f64)>,
    /// Number of load increments.
    pub increments: usize,
    /// Whether friction acts in this step.
    pub friction: bool,
    /// Whether wear acts in this step.
    pub wear: bool,
    /// Kind of the step.
    pub kind: StepKind,
    /// Load point of a history; `None` for other steps. Numbers of increments continue from the previous load point.
    pub history_row: Option<HistoryRow>,
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Truth: increment 1 of 2 ends at the share (1/2)^m = min(1/4, transition) of a displacement, and at the share 1 - (1/2)^m =
    /// 1 - transition^2 / 4 of a force, at most 15/16. With 8 increments, positions decrease from one reversal point to the other,
    /// and the second stroke mirrors the first.
    #[test]
    fn graded_increments() {
        let path = |drive: Drive, increments: usize| ClosedPath {
            drive,
            amplitude: [2.0, 0.0],
            angle: 0.0,
            increments,
            resolved_cycles: None,
        };
        let offsets_of = |path: &ClosedPath, transition: f64| -> Vec<[f64; 2]> {
            path.graded_positions(transition).into_iter().map(|position| path.offset(position)).collect()
        };
        let by_displacement = [(1.0, 0.25), (0.25, 0.25), (0.05, 0.05)].map(|case| (Drive::Shift, case));
        let by_force = [(1.0, 0.75), (0.8, 0.84), (0.05, 0.9375)].map(|case| (Drive::Force, case));
        for (drive, (transition, first)) in by_displacement.into_iter().chain(by_force) {
            let offsets = offsets_of(&path(drive, 2), transition);
            assert!((offsets[1][0] - (2.0 - 4.0 * first)).abs() < 1e-14, "{offsets:?}");
            let offsets = offsets_of(&path(drive, 8), transition);
            assert_eq!((offsets.len(), offsets[0][0], offsets[8][0]), (16, 2.0, -2.0));
            assert!(offsets[..9].windows(2).all(|pair| pair[1][0] < pair[0][0]), "{offsets:?}");
            assert!((0..8).all(|k| offsets[k + 8][0] == -offsets[k][0]), "{offsets:?}");
        }
    }
}
