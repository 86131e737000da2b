use super::{FailureMode, PlyStrength, StressExposure, quadratic_exposure};

/// Largest stress exposure over Hashin's criteria. The sign of σ11 selects tension or compression of the fibre, the sign of σ22 +
/// σ33 tension or compression of the matrix.
///
/// ```text
/// fibre tension        (σ11/Xt)² + (σ12/S12)² + (σ13/S13)² = 1
/// fibre compression    -σ11/Xc = 1
/// matrix tension       ((σ22+σ33)/Yt)² + (σ23²-σ22σ33)/S23² + (σ12/S12)² + (σ13/S13)² = 1
/// matrix compression   ((Yc/2S23)²-1) (σ22+σ33)/Yc + ((σ22+σ33)/2S23)² + (σ23²-σ22σ33)/S23² + (σ12/S12)² + (σ13/S13)² = 1
/// ```
///
/// The criteria assume a transversely isotropic ply: Yt and Yc also apply along 3, and Zt and Zc are not used. S12 and S13 may
/// differ.
///
/// # Source
/// Hashin (1980), J. Applied Mechanics 47, 329-334, eqs. 17-20.
pub fn hashin(strength: &PlyStrength, s: &[f64; 6]) -> StressExposure {
    let [s23, s13, s12] = strength.shear;
    let axial = (s[5] / s12).powi(2) + (s[4] / s13).powi(2);
    let fibre = if s[0] > 0.0 {
        let value = ((s[0] / strength.tension[0]).powi(2) + axial).sqrt();
        StressExposure { value, mode: FailureMode::FibreTension }
    } else {
        StressExposure { value: -s[0] / strength.compression[0], mode: FailureMode::FibreCompression }
    };
    let sum = s[1] + s[2];
    let matrix = if sum >= 0.0 {
        let across = (sum / strength.tension[1]).powi(2) + (s[3] * s[3] - s[1] * s[2]) / (s23 * s23);
        StressExposure { value: (across + axial).max(0.0).sqrt(), mode: FailureMode::MatrixTension }
    } else {
        // Equals (((σ22 + σ33)/2)² - σ22 σ33 + σ23²) / S23², without cancellation.
        let across = (0.25 * (s[1] - s[2]).powi(2) + s[3] * s[3]) / (s23 * s23);
        let yc = strength.compression[1];
        let linear = ((0.5 * yc / s23).powi(2) - 1.0) * sum / yc;
        StressExposure {
            value: quadratic_exposure(across + axial, linear),
            mode: FailureMode::MatrixCompression,
        }
    };
    StressExposure::ZERO.max(fibre).max(matrix)
}

#[cfg(test)]
mod tests {
    use super::super::tests::{single, t300};
    use super::*;

    /// Truth: exposure 1 at each strength. Single shear stresses have the mode matrix tension, because σ22 + σ33 is not negative.
    #[test]
    fn single_stresses_fail_at_their_strengths_in_their_modes() {
        let s = t300();
        for (stress, mode) in [
            (single(0, s.tension[0]), FailureMode::FibreTension),
            (single(0, -s.compression[0]), FailureMode::FibreCompression),
            (single(1, s.tension[1]), FailureMode::MatrixTension),
            (single(2, s.tension[1]), FailureMode::MatrixTension),
            (single(1, -s.compression[1]), FailureMode::MatrixCompression),
            (single(2, -s.compression[1]), FailureMode::MatrixCompression),
            (single(3, s.shear[0]), FailureMode::MatrixTension),
            (single(4, s.shear[1]), FailureMode::MatrixTension),
            (single(5, -s.shear[2]), FailureMode::MatrixTension),
        ] {
            let found = hashin(&s, &stress);
            assert!((found.value - 1.0).abs() < 1e-14 && found.mode == mode, "{stress:?}: {found:?}");
        }
    }

    /// Truth: a rotation about the fibre changes nothing, because Hashin's criteria use invariants of transverse isotropy. Where
    /// fibre compression governs, the exposure is -σ11/Xc.
    #[test]
    fn invariant_about_the_fibre() {
        let strength = t300();
        for stress in [[300.0, -40.0, 12.0, 9.0, -20.0, 31.0], [-100.0, 15.0, 9.0, -9.0, 2.0, -30.0]] {
            for angle in [0.3f64, 1.2, 2.5] {
                let (s, c) = angle.sin_cos();
                let axes = nalgebra::Matrix3::new(1.0, 0.0, 0.0, 0.0, c, -s, 0.0, s, c);
                let turned = hashin(&strength, &super::super::stress_in_axes(&axes, &stress));
                let found = hashin(&strength, &stress);
                assert!((turned.value / found.value - 1.0).abs() < 1e-13 && turned.mode == found.mode);
            }
        }
        let pressed = hashin(&strength, &[-450.0, 1.0, 0.0, 0.0, 0.0, 1.0]);
        assert_eq!(pressed, StressExposure { value: 0.5, mode: FailureMode::FibreCompression });
    }
}
