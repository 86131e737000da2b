//! Settings of wear steps. If a setting mentions no measurement, no recorded measurement supports its value. A coupled
//! cycle is a cycle whose path points are solved together.

pub(super) struct StickZoneSettings {
    /// Largest slip in one increment with which a cell counts as sticking, divided by the amplitude. Strokes do not use
    /// the criterion [`crate::contact::Increment::sticks`], because their tractions are less accurate.
    pub stick_slip_share: f64,
    /// Largest number of iterations of a coupled solution with cells that stick, until a stalled zone has been
    /// recomputed. The last pass has no such limit. With a wrong zone, force cycles of thin plates did not converge in
    /// 20 000 iterations.
    pub max_iterations_before_recomputation: usize,
    /// Largest number of solutions of the coupled cycle per stage of a jump.
    pub max_passes: usize,
    /// Largest number of cycles at constant wear depth that are solved to find a periodic cycle.
    pub max_settling_cycles: usize,
    /// Increments per stroke of the first cycle that finds the stick zone, if cells stick. With one increment per
    /// stroke, forces in random scenes were wrong by up to 3 %.
    pub settling_increments: usize,
    /// Largest change of the responses from one cycle to the next with which the cycle counts as periodic, relative to
    /// the range of the responses.
    pub periodic_tolerance: f64,
    /// Largest relative change of the motion of body 2 from one cycle to the next with which this motion counts as a
    /// steady drift. At 0.986 of the friction limit the motion decreased by 5 % per cycle.
    pub max_drift_change: f64,
    /// Smallest tolerance of the natural residual for strokes that are solved increment by increment.
    pub stroke_tolerance: f64,
}

pub(super) const STICK_ZONE: StickZoneSettings = StickZoneSettings {
    stick_slip_share: 1e-3,
    max_iterations_before_recomputation: 2000,
    max_passes: 8,
    max_settling_cycles: 10,
    settling_increments: 16,
    periodic_tolerance: 1e-3,
    max_drift_change: 0.1,
    stroke_tolerance: 1e-6,
};

pub(super) struct WearStepSettings {
    /// Wear depth at which the first jump with controlled length aims, relative to the approach.
    pub first_jump_depth_share: f64,
    /// Smallest ratio of jump tolerance to solver tolerance without a warning. Below this ratio, errors of the contact solutions
    /// dominate.
    pub min_tolerance_ratio: f64,
    /// Depth, relative to the approach, that is added to the largest wear depth in the allowed error of a jump. Without
    /// this addition, errors of negligible depths would limit the jumps.
    pub negligible_depth_share: f64,
    /// Ratio of the largest pressure to its value at the start of the step. Below this ratio, wear at a fixed approach
    /// ends, because smaller pressures are lost in the rounding of the gap.
    pub worn_out_pressure_ratio: f64,
    /// Largest share of the contact area that the second stage of SDIRK2 may lose. Wear widens contacts, so a jump that
    /// loses a larger share is too long.
    pub max_lost_contact_share: f64,
    /// Ratio of the reported error of the wear volume to the embedded estimate. In the reference scene with a tilt of 90 degrees,
    /// the embedded estimate contains a fifth to a third of the error (docs/theory-wear.md).
    pub volume_error_factor: f64,
    /// Weight of the square root in the error budget of the Euler methods. The square root accounts for cells that come
    /// into contact.
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
    /// Largest number of increments per stroke on a straight path. If four times the increments of the coupled cycle are
    /// more, this multiple is the limit.
    pub max_increments: usize,
    /// [`Self::max_increments`] for elliptic paths. In two of five random scenes with ellipses, the error of the wear was
    /// 1.3e-3 and 2.2e-3 with 64 increments, and at most 4e-4 with 128.
    pub max_increments_on_ellipses: usize,
    /// Smallest number of increments per stroke of a resolved cycle. In 40 random scenes, cycles with 2 and 4
    /// increments agreed by chance.
    pub min_increments: usize,
    /// Share of the wear tolerance that is available for the change by the last refinement. The remaining share is
    /// available for the jumps.
    pub tolerance_share: f64,
    /// Assumed ratio of the error of the cells to the change of the cells by the last refinement (root mean squares).
    pub cell_change_share: f64,
    /// Smallest number of increments of a resolved cycle, as a multiple of the increments of the coupled cycle.
    pub min_refinement: usize,
    /// Ratio of the increments of a second resolved cycle to the increments of the first. If the wear volume of the
    /// first agrees with the coupled cycle, the second must agree, too; otherwise the wear is corrected.
    pub confirming_refinement: usize,
    /// Largest relative change of the tangential force at a reversal point by the last refinement. With 8 increments
    /// the error of the wear was 1e-3, but the force across the stroke was 15 % too small.
    pub max_force_change: f64,
    /// Smallest denominator of relative changes of the tangential force, as a share of the normal force.
    pub min_force_share: f64,
    /// Tolerance of a resolved cycle that measures the error of the coupled cycle without correcting the wear, as a
    /// share of this error.
    pub measurement_tolerance_share: f64,
    /// Lower bound on the share of a stroke in which slip spreads over the contact.
    pub min_slip_spread_share: f64,
    pub min_loop_increments: usize,
    /// Number of cycles solved for a fretting loop. The loop is the last cycle, which no longer depends on the initial
    /// state.
    pub loop_cycles: usize,
}

pub(super) const REFINEMENT: RefinementSettings = RefinementSettings {
    max_increments: 64,
    max_increments_on_ellipses: 128,
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

pub(super) struct SettlingSettings {
    /// Share of the wear tolerance that is available for tractions that still change from cycle to cycle.
    pub tolerance_share: f64,
    /// Largest number of cycles with the same number of increments.
    pub max_cycles: usize,
    /// Assumed change over all further cycles, divided by the change by the last cycle, as long as the ratio of
    /// successive changes is unknown.
    pub unknown_remaining_sum: f64,
    /// Largest estimated change over all further cycles, divided by the change by the last cycle.
    pub max_remaining_sum: f64,
    /// Smallest cosine of the angle between the changes of the gap by two successive cycles with which these changes
    /// form a geometric series.
    pub min_cosine: f64,
    /// Smallest ratio of a geometric series. Smaller ratios need no extrapolation.
    pub min_ratio: f64,
    /// Largest extrapolation, divided by the last change.
    pub max_extrapolation: f64,
}

pub(super) const SETTLING: SettlingSettings = SettlingSettings {
    tolerance_share: 0.2,
    max_cycles: 40,
    unknown_remaining_sum: 4.0,
    max_remaining_sum: 50.0,
    min_cosine: 0.9,
    min_ratio: 0.3,
    max_extrapolation: 20.0,
};

pub(super) struct CorrectionSettings {
    /// Smallest wear of a cell, relative to the largest wear, with which the cell has its own factor.
    pub negligible_wear_share: f64,
    pub min_wear_factor: f64,
    pub max_wear_factor: f64,
    /// Largest relative change of a factor by extrapolation to the middle of a jump.
    pub max_factor_extrapolation: f64,
    /// Largest error from factors that change during a jump, divided by the allowed error, with which the jump is not
    /// repeated.
    pub negligible_error_ratio: f64,
    /// Estimated error of a jump that is repeated with the mean factors, divided by the change of the wear by these
    /// factors. The trapezoidal rule gives this value if the factors before were extrapolated from an earlier jump of
    /// the same length.
    pub mean_error_share: f64,
    /// Growth of the ratio of elastic lag to slip after which an uncorrected cycle is resolved again.
    pub recheck_lag_growth: f64,
    /// Factor by which the normal force changes before a cycle is resolved again. With another normal force, the
    /// elastic lag takes another share of the stroke.
    pub recheck_force_ratio: f64,
    /// Smallest relative difference between the tangential forces of the coupled cycle and of the resolved cycle that
    /// causes a warning.
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
    min_reported_force_difference: 0.02,
};
