//! Settings of wear steps. Unless a setting names a measurement, no measurement that chose its value is recorded.

pub(super) struct StickZoneSettings {
    /// Largest ratio of the slip in one increment to the amplitude at which a cell counts as sticking. The margin of
    /// [`crate::contact::Increment::sticks`] is not used for strokes, whose tractions are less accurate.
    pub stick_slip_share: f64,
    /// Largest number of coupled solutions per stage.
    pub max_passes: usize,
    /// Largest number of cycles without wear that are solved until a cycle is periodic.
    pub max_settling_cycles: usize,
    /// Increments of the first strokes that find the stick zone, if cells stick. With single increments, forces of random scenes were
    /// off by up to 3 %.
    pub settling_increments: usize,
    /// Largest change of the responses from one cycle to the next for which the cycle counts as periodic, relative to their range.
    pub periodic_tolerance: f64,
    /// Smallest tolerance of the natural residual for strokes that are solved increment by increment.
    pub stroke_tolerance: f64,
}

pub(super) const STICK_ZONE: StickZoneSettings = StickZoneSettings {
    stick_slip_share: 1e-3,
    max_passes: 8,
    max_settling_cycles: 10,
    settling_increments: 16,
    periodic_tolerance: 1e-3,
    stroke_tolerance: 1e-6,
};

pub(super) struct WearStepSettings {
    /// Largest wear depth that the first controlled jump aims at, relative to the approach.
    pub first_jump_depth_share: f64,
    /// Smallest ratio of jump tolerance to solver tolerance without a warning. Below this ratio, errors of the contact solutions
    /// dominate.
    pub min_tolerance_ratio: f64,
    /// Depth, relative to the approach, that is added to the largest wear depth in the reference of the jump error. The addition
    /// keeps errors of negligible depths from limiting the jumps.
    pub negligible_depth_share: f64,
    /// Ratio of the largest pressure to its value at the start of the step, at which wear at a fixed approach ends. Smaller
    /// pressures are lost in the rounding of the gap.
    pub worn_out_pressure_ratio: f64,
    /// Largest share of the contact area that the second stage of SDIRK2 may lose. Wear widens contacts, so a jump that loses more
    /// is too long.
    pub max_lost_contact_share: f64,
    /// Ratio of the reported error of the wear volume to the embedded estimate. In the reference scene with a tilt of 90 degrees,
    /// the embedded estimate contains a fifth to a third of the error (docs/theory-wear.md).
    pub volume_error_factor: f64,
    /// Weight of the square root in the error budget of the Euler methods, for cells that come into contact.
    pub min_error_budget_share: f64,
}

pub(super) const WEAR_STEP: WearStepSettings = WearStepSettings {
    first_jump_depth_share: 0.05,
    min_tolerance_ratio: 10.0,
    negligible_depth_share: 1e-3,
    worn_out_pressure_ratio: 1e-6,
    max_lost_contact_share: 0.05,
    volume_error_factor: 2.0,
    min_error_budget_share: 0.1,
};

pub(super) struct RefinementSettings {
    /// Largest number of increments per stroke, unless four times the coupled increments are more.
    pub max_increments: usize,
    /// Least number of increments of a resolved cycle. With 2 and 4 increments, cycles of 40 random scenes agreed by chance.
    pub min_increments: usize,
    /// Share of the tolerance for the change by the last refinement. The jumps have the rest.
    pub tolerance_share: f64,
    /// Ratio of the root mean square error of the cells to its change by the last refinement.
    pub cell_change_share: f64,
    /// Least number of increments of a resolved cycle, as a multiple of the increments of the coupled cycle.
    pub min_refinement: usize,
    /// Ratio of the increments of a second resolved cycle to the increments of the first. A coupled cycle whose wear volume agrees
    /// with the first resolved cycle stays uncorrected only if the volume of the second agrees, too.
    pub confirming_refinement: usize,
    /// Largest relative change of the tangential force at a reversal point by the last refinement. With 8 increments the wear was
    /// right to 1e-3, but the force across the stroke was 15 % too small.
    pub max_force_change: f64,
    /// Tangential forces below this share of the normal force count as this share in their relative change.
    pub min_force_share: f64,
    /// Relative accuracy with which a resolved cycle measures the error of the coupled cycle if the wear is not corrected.
    pub measurement_tolerance_share: f64,
    /// Lower bound on the share of a stroke in which slip spreads over the contact.
    pub min_slip_spread_share: f64,
    pub min_loop_increments: usize,
    /// Number of cycles until a fretting loop no longer depends on its initial state.
    pub loop_cycles: usize,
}

pub(super) const REFINEMENT: RefinementSettings = RefinementSettings {
    max_increments: 64,
    min_increments: 8,
    tolerance_share: 0.5,
    cell_change_share: 0.5,
    min_refinement: 4,
    confirming_refinement: 4,
    max_force_change: 0.01,
    min_force_share: 1e-3,
    measurement_tolerance_share: 0.1,
    min_slip_spread_share: 0.02,
    min_loop_increments: 16,
    loop_cycles: 2,
};

pub(super) struct CorrectionSettings {
    /// Smallest wear of a cell, relative to the largest, for which the cell has an individual factor.
    pub negligible_wear_share: f64,
    pub min_wear_factor: f64,
    pub max_wear_factor: f64,
    /// Largest relative change of a factor by extrapolation to the middle of a jump.
    pub max_factor_extrapolation: f64,
    /// Largest error from factors that change during a jump, relative to the allowed error, for which the jump is not repeated.
    pub negligible_error_ratio: f64,
    /// Ratio of the estimated error with the mean factors of a jump to the change by the mean factors. The trapezoidal rule has this
    /// ratio if the factors used were extrapolated from an earlier jump of the same length.
    pub mean_error_share: f64,
    /// Growth of the ratio of elastic lag to slip after which a cycle that needed no correction is resolved again.
    pub recheck_lag_growth: f64,
    /// Factor of change of the normal force after which a cycle is resolved again, because the elastic lag then takes another share
    /// of the stroke.
    pub recheck_force_ratio: f64,
    /// Estimated change of the wear volume until the tractions are steady, relative to the change of the wear volume from one cycle
    /// to the next.
    pub drift_error_factor: f64,
    /// Relative difference between the tangential forces of prescribed increments and of the resolved cycle, above which a warning
    /// is given.
    pub min_reported_force_difference: f64,
}

pub(super) const CORRECTION: CorrectionSettings = CorrectionSettings {
    negligible_wear_share: 1e-6,
    min_wear_factor: 1e-3,
    max_wear_factor: 4.0,
    max_factor_extrapolation: 0.1,
    negligible_error_ratio: 0.1,
    mean_error_share: 1.0 / 6.0,
    recheck_lag_growth: 2.0,
    recheck_force_ratio: 2.0,
    drift_error_factor: 4.0,
    min_reported_force_difference: 0.02,
};
