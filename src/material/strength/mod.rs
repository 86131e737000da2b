//! Strengths of materials and failure criteria. Stresses are in material axes, Voigt order 11 22 33 23 13 12.
//!
//! Every criterion gives the *stress exposure* f = 1/R: if all stresses are multiplied by R, the criterion is just met. The
//! exposure is 0 if no positive multiple of the stress fails. The exposure of a quadratic criterion a R² + b R = 1 is f = (b +
//! sqrt(b² + 4 a)) / 2.

mod hashin;
mod maximum_stress;
mod tsai_wu;

use nalgebra::Matrix3;

use super::{tensor_to_voigt, voigt_to_tensor};
use crate::error::{Error, Result};

pub use hashin::hashin;
pub use maximum_stress::maximum_stress;
pub use tsai_wu::tsai_wu;

/// Strengths of a unidirectional ply (MPa, positive) and its Tsai-Wu interactions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlyStrength {
    /// Tension along 1, 2, 3: Xt, Yt, Zt.
    pub tension: [f64; 3],
    /// Compression along 1, 2, 3: Xc, Yc, Zc.
    pub compression: [f64; 3],
    /// Shear 23, 13, 12: S23, S13, S12.
    pub shear: [f64; 3],
    /// Tsai and Wu's normalised interactions F23*, F13*, F12*.
    pub interaction: [f64; 3],
}

/// Strength of a material.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum MaterialStrength {
    /// Yield stress of von Mises' criterion, MPa.
    Yield(f64),
    /// Strengths along the material axes.
    Ply(PlyStrength),
}

/// Failure mode of a material.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[allow(missing_docs)]
pub enum FailureMode {
    None,
    Yield,
    Interaction,
    FibreTension,
    FibreCompression,
    MatrixTension,
    MatrixCompression,
    Tension1,
    Tension2,
    Tension3,
    Compression1,
    Compression2,
    Compression3,
    Shear23,
    Shear13,
    Shear12,
}

impl FailureMode {
    /// Name in results.
    pub const fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Yield => "yield",
            Self::Interaction => "interaction",
            Self::FibreTension => "fibre tension",
            Self::FibreCompression => "fibre compression",
            Self::MatrixTension => "matrix tension",
            Self::MatrixCompression => "matrix compression",
            Self::Tension1 => "tension 1",
            Self::Tension2 => "tension 2",
            Self::Tension3 => "tension 3",
            Self::Compression1 => "compression 1",
            Self::Compression2 => "compression 2",
            Self::Compression3 => "compression 3",
            Self::Shear23 => "shear 23",
            Self::Shear13 => "shear 13",
            Self::Shear12 => "shear 12",
        }
    }

    /// Number in field files.
    pub const fn code(self) -> u8 {
        self as u8
    }
}

/// Failure criterion of an exposure.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum FailureCriterion {
    /// Von Mises' equivalent stress divided by the yield stress.
    Yield,
    /// Criterion of Tsai and Wu.
    TsaiWu,
    /// Criterion of Hashin.
    Hashin,
    /// Largest ratio of a stress component to its strength.
    MaximumStress,
}

impl FailureCriterion {
    /// Criteria of plies.
    pub const PLY: [Self; 3] = [Self::TsaiWu, Self::Hashin, Self::MaximumStress];

    /// Name in results.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Yield => "yield",
            Self::TsaiWu => "tsai_wu",
            Self::Hashin => "hashin",
            Self::MaximumStress => "max_stress",
        }
    }
}

/// Stress exposure and the governing failure mode.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StressExposure {
    /// Exposure, proportional to the load; 1 at failure.
    pub value: f64,
    /// Failure mode at this exposure.
    pub mode: FailureMode,
}

impl StressExposure {
    /// Exposure of an unloaded material.
    pub const ZERO: Self = Self { value: 0.0, mode: FailureMode::None };

    /// Returns the larger of two exposures.
    pub fn max(self, other: Self) -> Self {
        if other.value > self.value { other } else { self }
    }
}

impl MaterialStrength {
    /// Criteria that apply to this material.
    pub fn criteria(&self) -> &'static [FailureCriterion] {
        match self {
            Self::Yield(_) => &[FailureCriterion::Yield],
            Self::Ply(_) => &FailureCriterion::PLY,
        }
    }

    /// Exposure to a stress in material axes, MPa; zero for criteria that do not apply to this material.
    pub fn exposure(&self, criterion: FailureCriterion, stress: &[f64; 6]) -> StressExposure {
        match (self, criterion) {
            (Self::Yield(limit), FailureCriterion::Yield) => StressExposure::ZERO
                .max(StressExposure { value: von_mises(stress) / limit, mode: FailureMode::Yield }),
            (Self::Ply(strength), FailureCriterion::TsaiWu) => tsai_wu(strength, stress),
            (Self::Ply(strength), FailureCriterion::Hashin) => hashin(strength, stress),
            (Self::Ply(strength), FailureCriterion::MaximumStress) => maximum_stress(strength, stress),
            _ => StressExposure::ZERO,
        }
    }

    /// Checks that all strengths are positive and finite, and that the interactions give a closed failure surface.
    ///
    /// # Errors
    /// If a value is not admissible (kind `Input`).
    pub fn check(&self) -> Result<()> {
        match self {
            Self::Yield(limit) => positive("yield", *limit),
            Self::Ply(strength) => strength.check(),
        }
    }
}

impl PlyStrength {
    fn check(&self) -> Result<()> {
        let named = ["Xt", "Yt", "Zt"].into_iter().zip(self.tension);
        let named = named.chain(["Xc", "Yc", "Zc"].into_iter().zip(self.compression));
        for (name, value) in named.chain(["S23", "S13", "S12"].into_iter().zip(self.shear)) {
            positive(name, value)?;
        }
        let [f23, f13, f12] = self.interaction;
        let least = Matrix3::new(1.0, f12, f13, f12, 1.0, f23, f13, f23, 1.0).symmetric_eigenvalues().min();
        if least.is_finite() && least > -1e-9 {
            return Ok(());
        }
        Err(Error::input(format!(
            "the interactions F12 = {f12}, F13 = {f13}, F23 = {f23} leave the failure surface open. The matrix with ones on the diagonal and these values off the diagonal has the negative eigenvalue {least:.3}; the usual value of all three is -0.5"
        )))
    }
}

fn positive(name: &str, value: f64) -> Result<()> {
    if value.is_finite() && value > 0.0 {
        return Ok(());
    }
    Err(Error::input(format!(
        "the strength {name} = {value} is not admissible: it must be positive and finite, also in compression"
    )))
}

/// Von Mises' equivalent stress.
pub fn von_mises(s: &[f64; 6]) -> f64 {
    let normal = (s[0] - s[1]).powi(2) + (s[1] - s[2]).powi(2) + (s[2] - s[0]).powi(2);
    (0.5 * normal + 3.0 * (s[3] * s[3] + s[4] * s[4] + s[5] * s[5])).sqrt()
}

/// Transforms a stress from global axes to the axes in the columns of Q = `axes`: σ'_ab = Q_ia σ_ij Q_jb.
pub fn stress_in_axes(axes: &Matrix3<f64>, s: &[f64; 6]) -> [f64; 6] {
    tensor_to_voigt(&(axes.transpose() * voigt_to_tensor(s) * axes))
}

/// Exposure of the quadratic criterion a R² + b R = 1, with a >= 0 up to rounding.
fn quadratic_exposure(a: f64, b: f64) -> f64 {
    0.5 * (b + (b * b + 4.0 * a.max(0.0)).sqrt())
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// T300/BSL914C epoxy (Soden, Hinton and Kaddour 1998), transversely isotropic.
    pub fn t300() -> PlyStrength {
        PlyStrength {
            tension: [1500.0, 27.0, 27.0],
            compression: [900.0, 200.0, 200.0],
            shear: [60.0, 80.0, 80.0],
            interaction: [-0.5; 3],
        }
    }

    pub fn single(component: usize, value: f64) -> [f64; 6] {
        let mut stress = [0.0; 6];
        stress[component] = value;
        stress
    }

    /// Truth: the exposure f is proportional to the load.
    #[test]
    fn exposures_are_proportional_to_the_load() {
        let stress = [300.0, -40.0, 12.0, 9.0, -20.0, 31.0];
        let limit = MaterialStrength::Ply(t300());
        for criterion in FailureCriterion::PLY {
            let f = limit.exposure(criterion, &stress);
            for factor in [0.1, 1.0 / f.value, 7.0] {
                let scaled = limit.exposure(criterion, &stress.map(|s| s * factor));
                assert!((scaled.value / (factor * f.value) - 1.0).abs() < 1e-14, "{criterion:?}");
                assert_eq!(scaled.mode, f.mode);
            }
        }
        assert_eq!(limit.exposure(FailureCriterion::Yield, &stress), StressExposure::ZERO);
        assert_eq!(limit.exposure(FailureCriterion::TsaiWu, &[0.0; 6]), StressExposure::ZERO);
    }

    /// Truth: von Mises' stress is abs(s) in uniaxial stress and sqrt(3) abs(s) in pure shear, in any axes.
    #[test]
    fn von_mises_and_axes() {
        assert!((von_mises(&single(2, -250.0)) - 250.0).abs() < 1e-12);
        assert!((von_mises(&single(4, 100.0)) - 100.0 * 3f64.sqrt()).abs() < 1e-12);
        let stress = [300.0, -40.0, 12.0, 9.0, -20.0, 31.0];
        let axes = crate::geometry::fibre_axes(0.4, 1.3);
        assert!((von_mises(&stress_in_axes(&axes, &stress)) / von_mises(&stress) - 1.0).abs() < 1e-14);
        let back = stress_in_axes(&axes.transpose(), &stress_in_axes(&axes, &stress));
        assert!(back.iter().zip(&stress).all(|(a, b)| (a - b).abs() < 1e-12));
        let quarter = Matrix3::new(0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0);
        assert_eq!(stress_in_axes(&quarter, &stress), [-40.0, 300.0, 12.0, 20.0, 9.0, -31.0]);
    }

    #[test]
    fn strengths_that_mean_nothing_are_refused() {
        let message = |limit: MaterialStrength| limit.check().expect_err("a refusal").to_string();
        assert!(message(MaterialStrength::Yield(0.0)).contains("yield = 0"));
        let wrong = PlyStrength { compression: [900.0, -200.0, 200.0], ..t300() };
        assert!(message(MaterialStrength::Ply(wrong)).contains("Yc = -200"));
        let open = PlyStrength { interaction: [-0.9, -0.5, -0.5], ..t300() };
        assert!(message(MaterialStrength::Ply(open)).contains("F23 = -0.9"));
        MaterialStrength::Ply(t300()).check().expect("sound");
    }
}
