//! Path of a fretting cycle: prescribed positions or forces at its path points.

use serde::{Deserialize, Serialize};

use crate::contact::TangentialControl;
use crate::evolution::controls::PrescribedLoads;
use crate::evolution::step::{ClosedPath, Drive, Tangential};

#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct FrettingPath {
    pub drive: Drive,
    /// Displacement of body 2 (mm) or force on body 1 (N) along x, y at each path point, the + reversal point first.
    path_points: Vec<[f64; 2]>,
    /// Position of each path point along the first semi-axis, divided by the semi-axis; 1 at the + reversal point, -1
    /// at the - reversal point.
    phases: Vec<f64>,
    /// Displacement of body 2 along x, y at the start of the step, mm.
    pub center: [f64; 2],
    /// Tangential force on body 1 along x, y at the start of the step, N.
    center_force: [f64; 2],
}

impl FrettingPath {
    /// Path of `closed` about a centre. The centre is `center` if displacements are prescribed, and `force` if forces
    /// are prescribed.
    pub fn new(closed: &ClosedPath, center: [f64; 2], force: [f64; 2]) -> Self {
        let positions = closed.positions();
        Self::through(closed, &positions, center, force)
    }

    /// Path of `closed` through `positions`, which are relative to the two semi-axes (-1 to 1).
    fn through(
        closed: &ClosedPath,
        positions: &[[f64; 2]],
        center: [f64; 2],
        center_force: [f64; 2],
    ) -> Self {
        let about = if closed.drive == Drive::Shift { center } else { center_force };
        let place = |position: &[f64; 2]| {
            let offset = closed.offset(*position);
            [0, 1].map(|k| about[k] + offset[k])
        };
        Self {
            drive: closed.drive,
            path_points: positions.iter().map(place).collect(),
            phases: positions.iter().map(|position| position[0]).collect(),
            center,
            center_force,
        }
    }

    /// Path about the same centre with the increments of `closed`, at [`ClosedPath::graded_positions`].
    pub fn refined(&self, closed: &ClosedPath, transition: f64) -> Self {
        Self::through(closed, &closed.graded_positions(transition), self.center, self.center_force)
    }

    /// Path about the same centre with the increments of `closed`, all of the same length.
    pub fn with_increments(&self, closed: &ClosedPath) -> Self {
        Self::new(closed, self.center, self.center_force)
    }

    /// Straight path of `closed` from the centre to the + reversal point, in `increments` increments of the same
    /// length.
    pub fn first_stroke(&self, closed: &ClosedPath, increments: usize) -> Self {
        let share = |point: usize| [(point + 1) as f64 / increments as f64, 0.0];
        let positions: Vec<_> = (0..increments).map(share).collect();
        Self::through(closed, &positions, self.center, self.center_force)
    }

    pub fn len(&self) -> usize {
        self.path_points.len()
    }

    pub fn reversal_index(&self) -> usize {
        self.len() / 2
    }

    /// Sets the displacement of body 2 to the displacement of a path point, if displacements are prescribed.
    pub fn set_shift(&self, point: usize, rigid: &mut [f64; 3]) {
        if self.drive == Drive::Shift {
            rigid[..2].copy_from_slice(&self.path_points[point]);
        }
    }

    /// Returns the loads at the centre of the path, and the tangential control for the steps that follow.
    pub fn return_to_center(&self, loads: PrescribedLoads) -> (PrescribedLoads, Tangential) {
        match self.drive {
            Drive::Shift => (
                PrescribedLoads { tangential: TangentialControl::Shift, ..loads },
                Tangential::Shift(self.center),
            ),
            Drive::Force => {
                let on_body2 = self.center_force.map(|force| -force);
                let tangential = TangentialControl::Force(on_body2);
                (PrescribedLoads { tangential, ..loads }, Tangential::Force(self.center_force))
            }
        }
    }

    pub fn loads(&self, point: usize, loads: PrescribedLoads) -> PrescribedLoads {
        let tangential = match self.drive {
            Drive::Shift => TangentialControl::Shift,
            // The path contains the force on body 1. The solver needs the force on body 2.
            Drive::Force => TangentialControl::Force(self.path_points[point].map(|force| -force)),
        };
        PrescribedLoads { tangential, phase: self.phases[point], ..loads }
    }

    /// Whether the prescribed displacement or force stays at the centre of the path, because only loads of the bodies
    /// vary.
    pub fn is_held(&self) -> bool {
        self.path_points.iter().all(|point| *point == self.path_points[0])
    }

    pub fn phase(&self, point: usize) -> f64 {
        self.phases[point]
    }
}
