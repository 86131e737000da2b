use super::{FailureMode, PlyStrength, StressExposure};

/// Largest exposure of a single stress component, and its failure mode.
pub fn maximum_stress(strength: &PlyStrength, s: &[f64; 6]) -> StressExposure {
    const TENSION: [FailureMode; 3] = [FailureMode::Tension1, FailureMode::Tension2, FailureMode::Tension3];
    const COMPRESSION: [FailureMode; 3] =
        [FailureMode::Compression1, FailureMode::Compression2, FailureMode::Compression3];
    const SHEAR: [FailureMode; 3] = [FailureMode::Shear23, FailureMode::Shear13, FailureMode::Shear12];
    (0..3).fold(StressExposure::ZERO, |largest, i| {
        largest
            .max(StressExposure { value: s[i] / strength.tension[i], mode: TENSION[i] })
            .max(StressExposure { value: -s[i] / strength.compression[i], mode: COMPRESSION[i] })
            .max(StressExposure { value: s[3 + i].abs() / strength.shear[i], mode: SHEAR[i] })
    })
}

#[cfg(test)]
mod tests {
    use super::super::tests::{single, t300};
    use super::*;

    #[test]
    fn single_stresses_fail_at_their_strengths_in_their_modes() {
        let s = t300();
        for (stress, mode) in [
            (single(0, s.tension[0]), FailureMode::Tension1),
            (single(1, -s.compression[1]), FailureMode::Compression2),
            (single(2, s.tension[2]), FailureMode::Tension3),
            (single(3, -s.shear[0]), FailureMode::Shear23),
            (single(4, s.shear[1]), FailureMode::Shear13),
            (single(5, s.shear[2]), FailureMode::Shear12),
        ] {
            assert_eq!(maximum_stress(&s, &stress), StressExposure { value: 1.0, mode });
        }
    }
}
