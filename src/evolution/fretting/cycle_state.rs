//! State of a coupled cycle: its path points, solved together, and its stick zone.

use serde::{Deserialize, Serialize};

use crate::contact::{ContactState, SlipReference, Unknowns};
use crate::evolution::fretting::path::FrettingPath;
use crate::evolution::fretting::settings::STICK_ZONE;
use crate::evolution::model::PreparedModel;

/// Cells that stick through the whole cycle. Drift is a change of the position of body 2 from cycle to cycle.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct StickZone {
    /// Whether each cell sticks, `[N]`.
    pub mask: Vec<bool>,
    /// Stick gap: tangential gap at which the cells of `mask` stick, `[2, N]`, mm.
    pub gap: Vec<f64>,
    /// Displacement of body 2 along x, y at the + reversal point of the last solved strokes, mm. If no cell sticks, a
    /// cycle starts from this displacement. `None` if displacements are prescribed, or on frames with inclined cells.
    pub origin: Option<[f64; 2]>,
    /// Largest tangential change of the gap by loads of the bodies from the centre of the path to a reversal point, mm.
    pub load_motion: f64,
}

impl StickZone {
    /// Whether body 2 may drift under prescribed forces, because no cell sticks through the cycle.
    pub fn may_drift(&self) -> bool {
        self.origin.is_some() && !self.mask.contains(&true)
    }

    pub fn slip_reference(&self) -> SlipReference {
        let origin = self.origin.filter(|_| self.may_drift());
        SlipReference::PreviousPoint { stick_mask: self.mask.clone(), stick_gap: self.gap.clone(), origin }
    }
}

/// Unknowns and stick zone of a coupled cycle, from which the state of the cycle can be evaluated.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct CycleUnknowns {
    pub contact: Unknowns,
    pub stick_zone: StickZone,
}

impl CycleUnknowns {
    /// Largest pressure at any path point, MPa.
    pub fn peak_pressure(&self) -> f64 {
        let n = self.stick_zone.mask.len();
        let pressures = self.contact.scaled.chunks_exact(3 * n).flat_map(|planes| &planes[2 * n..]);
        pressures.copied().fold(0.0, f64::max)
    }
}

pub struct CycleState {
    pub contact: ContactState,
    pub stick_zone: StickZone,
}

impl From<&CycleUnknowns> for CycleState {
    /// Copies the unknowns. The contact state must be evaluated afterwards.
    fn from(cycle: &CycleUnknowns) -> Self {
        Self { contact: (&cycle.contact).into(), stick_zone: cycle.stick_zone.clone() }
    }
}

impl From<CycleState> for CycleUnknowns {
    fn from(cycle: CycleState) -> Self {
        Self { contact: cycle.contact.into(), stick_zone: cycle.stick_zone }
    }
}

impl CycleState {
    /// State with zero tractions at all path points, in which all cells stick. `can_drift` states whether body 2 may
    /// drift if no cell sticks. `load_motion` is explained at [`StickZone::load_motion`].
    pub fn new(n: usize, path: &FrettingPath, rigid: [f64; 3], can_drift: bool, load_motion: f64) -> Self {
        let motions = (0..path.len()).map(|point| {
            let mut rigid = rigid;
            path.set_shift(point, &mut rigid);
            rigid
        });
        let contact = ContactState::new(n, motions.collect());
        Self {
            contact,
            stick_zone: StickZone {
                mask: vec![true; n],
                gap: vec![0.0; 2 * n],
                origin: can_drift.then_some([0.0; 2]),
                load_motion,
            },
        }
    }

    pub fn for_sliding(n: usize, rigid: [f64; 3]) -> Self {
        Self {
            contact: ContactState::new(n, vec![rigid]),
            stick_zone: StickZone {
                mask: vec![false; n],
                gap: vec![0.0; 2 * n],
                origin: None,
                load_motion: 0.0,
            },
        }
    }

    /// Stores the solution `it` of the increment that ends at `point`. The tangential gap of `it` becomes the stick
    /// gap.
    pub(super) fn record_increment(&mut self, it: &ContactState, point: usize) {
        let n = self.stick_zone.mask.len();
        let planes = point * 3 * n..(point + 1) * 3 * n;
        self.contact.scaled[planes.clone()].copy_from_slice(&it.scaled);
        self.contact.tractions[planes].copy_from_slice(&it.tractions);
        self.contact.rigid_motion[point] = it.rigid_motion[0];
        self.contact.mode_amplitudes[point] = it.mode_amplitudes[0];
        if point == 0 {
            self.stick_zone.origin =
                self.stick_zone.origin.map(|_| [it.rigid_motion[0][0], it.rigid_motion[0][1]]);
        }
        self.stick_zone.gap.copy_from_slice(&it.gap[..2 * n]);
    }

    /// Amplitude of the tangential motion, mm: half of the largest distance between the positions of body 2 at two path
    /// points. A larger motion by loads of the bodies replaces this distance.
    pub(super) fn amplitude(&self, prepared: &PreparedModel) -> f64 {
        let points = self.contact.rigid_motion.iter().zip(&self.contact.mode_amplitudes);
        let positions: Vec<[f64; 3]> = points.map(|(rigid, modes)| prepared.motion(rigid, modes)).collect();
        let apart = |a: &[f64; 3], b: &[f64; 3]| (a[0] - b[0]).hypot(a[1] - b[1]);
        let farthest = |a: &[f64; 3]| positions.iter().map(|b| apart(a, b)).fold(0.0, f64::max);
        f64::max(0.5 * positions.iter().map(farthest).fold(0.0, f64::max), self.stick_zone.load_motion)
    }

    /// Largest slip in an increment with which a cell counts as sticking, mm.
    pub(super) fn slip_limit(&self, prepared: &PreparedModel) -> f64 {
        STICK_ZONE.stick_slip_share * self.amplitude(prepared)
    }
}
