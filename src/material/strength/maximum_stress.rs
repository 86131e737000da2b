//! The criterion of the largest stress: each component by itself.

use super::{Exposure, Mode, PlyStrength};

/// Exposure of the component that is nearest to its strength.
pub fn maximum_stress(strength: &PlyStrength, s: &[f64; 6]) -> Exposure {
    const TENSION: [Mode; 3] = [Mode::Tension1, Mode::Tension2, Mode::Tension3];
    const COMPRESSION: [Mode; 3] = [Mode::Compression1, Mode::Compression2, Mode::Compression3];
    const SHEAR: [Mode; 3] = [Mode::Shear23, Mode::Shear13, Mode::Shear12];
    (0..3).fold(Exposure::ZERO, |largest, i| {
        largest
            .max(Exposure { value: s[i] / strength.tension[i], mode: TENSION[i] })
            .max(Exposure { value: -s[i] / strength.compression[i], mode: COMPRESSION[i] })
            .max(Exposure { value: s[3 + i].abs() / strength.shear[i], mode: SHEAR[i] })
    })
}

#[cfg(test)]
mod tests {
    use super::super::tests::{single, t300};
    use super::*;

    /// Truth: each strength is found again, in its mode.
    #[test]
    fn single_stresses_fail_at_their_strengths_in_their_modes() {
        let s = t300();
        for (stress, mode) in [
            (single(0, s.tension[0]), Mode::Tension1),
            (single(1, -s.compression[1]), Mode::Compression2),
            (single(2, s.tension[2]), Mode::Tension3),
            (single(3, -s.shear[0]), Mode::Shear23),
            (single(4, s.shear[1]), Mode::Shear13),
            (single(5, s.shear[2]), Mode::Shear12),
        ] {
            assert_eq!(maximum_stress(&s, &stress), Exposure { value: 1.0, mode });
        }
    }
}
