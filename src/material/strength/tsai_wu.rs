use super::{FailureMode, PlyStrength, StressExposure, quadratic_exposure};

/// Stress exposure by the criterion of Tsai and Wu, F_i σ_i + F_ij σ_i σ_j = 1.
///
/// The coefficients are F_i = 1/X_t - 1/X_c, F_ii = 1/(X_t X_c), F_44 = 1/S23², F_55 = 1/S13², F_66 = 1/S12² and F_ij =
/// F_ij* sqrt(F_ii F_jj). X_t and X_c are the tensile and compressive strengths along axis i.
///
/// # Source
/// Tsai and Wu (1971), J. Composite Materials 5, 58-80, eqs. 4-11.
pub fn tsai_wu(strength: &PlyStrength, s: &[f64; 6]) -> StressExposure {
    let PlyStrength { tension, compression, shear, interaction } = strength;
    // Normal stresses, each divided by the geometric mean of tensile and compressive strength.
    let x: [f64; 3] = std::array::from_fn(|i| s[i] / (tension[i] * compression[i]).sqrt());
    let b: f64 = (0..3).map(|i| s[i] * (1.0 / tension[i] - 1.0 / compression[i])).sum();
    let normal: f64 = x.iter().map(|x| x * x).sum();
    let mixed = interaction[0] * x[1] * x[2] + interaction[1] * x[0] * x[2] + interaction[2] * x[0] * x[1];
    let sheared: f64 = (0..3).map(|i| (s[3 + i] / shear[i]).powi(2)).sum();
    let value = quadratic_exposure(normal + 2.0 * mixed + sheared, b);
    StressExposure::ZERO.max(StressExposure { value, mode: FailureMode::Interaction })
}

#[cfg(test)]
mod tests {
    use super::super::tests::{single, t300};
    use super::*;

    #[test]
    fn single_stresses_fail_at_their_strengths() {
        let strength = t300();
        for i in 0..3 {
            for stress in [
                single(i, strength.tension[i]),
                single(i, -strength.compression[i]),
                single(3 + i, strength.shear[i]),
                single(3 + i, -strength.shear[i]),
            ] {
                assert!((tsai_wu(&strength, &stress).value - 1.0).abs() < 1e-14);
            }
        }
    }

    /// Truth: the stress S at failure in example 2.19 of Kaw, Mechanics of Composite Materials (2nd edition 2006), in plane stress.
    /// A graphite/epoxy lamina has Xt = Xc = 1500, Yt = 40, Yc = 246, S12 = 68 MPa and fibres at 60 degrees from x. Under σx = 2 S,
    /// σy = -3 S, τxy = 4 S, the stresses along the ply axes are σ1 = 1.714 S, σ2 = -2.714 S, τ12 = -4.165 S. With F12 = -1/2
    /// sqrt(F11 F22), the lamina fails at S = 22.39 MPa. Tolerance: rounding of the four digits of S.
    #[test]
    fn worked_example() {
        let strength = PlyStrength {
            tension: [1500.0, 40.0, 40.0],
            compression: [1500.0, 246.0, 246.0],
            shear: [68.0; 3],
            interaction: [-0.5; 3],
        };
        let stress = [1.714, -2.714, 0.0, 0.0, 0.0, -4.165];
        let failure = 1.0 / tsai_wu(&strength, &stress).value;
        assert!((failure - 22.39).abs() < 0.006, "{failure}");
    }

    /// Truth: with equal normal strengths X, shear strengths X / sqrt(3) and interactions -1/2, the exposure is von Mises' stress
    /// divided by X.
    #[test]
    fn isotropic_strengths_give_von_mises() {
        let strength = PlyStrength {
            tension: [250.0; 3],
            compression: [250.0; 3],
            shear: [250.0 / 3f64.sqrt(); 3],
            interaction: [-0.5; 3],
        };
        let stress = [100.0, -40.0, 20.0, 15.0, -60.0, 31.0];
        let wanted = super::super::von_mises(&stress) / 250.0;
        assert!((tsai_wu(&strength, &stress).value / wanted - 1.0).abs() < 1e-14);
    }
}
