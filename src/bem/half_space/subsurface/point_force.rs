//! Field of a point force on the surface of a half-space: a closed form for isotropic materials, a table for all
//! others.

use std::f64::consts::PI;

use nalgebra::Vector3;

use crate::bem::cube_table::{CubeTable, DirectionSymmetry, GENERAL_LEN};
use crate::bem::green_tensor::GreenTensor;
use crate::bem::half_space::green::SurfaceGreen;
use crate::bem::half_space::subsurface::boussinesq::Boussinesq;
use crate::bem::half_space::subsurface::point_force_integral::PointForceIntegral;
use crate::bem::half_space::subsurface::surface_point_force::SurfacePointForce;
use crate::error::Result;
use crate::geometry::Side;
use crate::linalg::cache::Cache;
use crate::material::Stiffness;

/// Maximum ratio of depth to distance from the force for points that count as surface points.
const SURFACE_TOLERANCE: f64 = 1e-9;

const KIND: &str = "point force";

/// Target error of a table, relative to its largest entry.
const ERROR: f64 = 3e-8;

/// Convergence limit of the integrals behind a table: change of the field when the number of points doubles, relative
/// to the largest entries.
const MAX_INTEGRAL_CHANGE: f64 = 1e-8;

const COMPARED_ON_SURFACE: usize = 1024;

/// Stiffness components up to this multiple of the largest component count as zero, because rotations of the axes leave
/// rounding errors.
const ZERO_STIFFNESS_TOLERANCE: f64 = 1e-14;

/// Field of a unit force at the origin of the surface of the half-space z <= 0, whose outward normal is +z.
#[derive(Debug, Clone)]
pub struct PointForceField(Form);

#[derive(Debug, Clone)]
enum Form {
    Closed(Boussinesq),
    Tabulated(Box<Tabulated>),
}

#[derive(Debug, Clone)]
struct Tabulated {
    inside: CubeTable<GENERAL_LEN>,
    surface: SurfacePointForce,
}

impl PointForceField {
    /// Field for a material in the axes of the surface.
    ///
    /// # Errors
    /// As [`Self::load_or_compute`].
    pub fn new(stiffness: &Stiffness) -> Result<Self> {
        Ok(Self::load_or_compute(stiffness, None)?.0)
    }

    /// Reads the table of the field from `cache`, or computes it if the cache does not hold it. Also returns a warning
    /// for a damaged cache entry or a failed write.
    ///
    /// # Errors
    /// If [`SurfaceGreen::new`] fails, if memory does not suffice, or if the run is cancelled.
    pub fn load_or_compute(stiffness: &Stiffness, cache: Option<&Cache>) -> Result<(Self, Option<String>)> {
        if let Some(closed) = Boussinesq::from_stiffness(stiffness) {
            return Ok((Self(Form::Closed(closed)), None));
        }
        let green = SurfaceGreen::new(stiffness, Side::Lower)?;
        let surface = SurfacePointForce::new(stiffness, &green);
        let symmetry = DirectionSymmetry::Planes([0, 1].map(|axis| is_mirror(stiffness, axis)));
        let (inside, note) = CubeTable::load_or_compute(KIND, stiffness, symmetry, cache, || {
            let integral = PointForceIntegral::new(stiffness, &green);
            let angles = (0..COMPARED_ON_SURFACE).map(|k| 2.0 * PI * k as f64 / COMPARED_ON_SURFACE as f64);
            let on_surface = angles.map(|phi| Vector3::new(phi.cos(), phi.sin(), -SURFACE_TOLERANCE));
            CubeTable::new(symmetry, ERROR, on_surface, |x| {
                Ok(if x.z < -SURFACE_TOLERANCE {
                    integral.integrate(x, MAX_INTEGRAL_CHANGE)
                } else {
                    (surface.at(x.x, x.y), 0.0)
                })
            })
        })?;
        Ok((Self(Form::Tabulated(Box::new(Tabulated { inside, surface }))), note))
    }

    /// Field at the point `x` (mm) with z <= 0, other than the origin. Points whose depth is at most 1e-9 of their
    /// distance from the origin count as surface points. At surface points, the derivatives are one-sided, from within
    /// the body.
    #[inline]
    pub fn at(&self, x: &Vector3<f64>) -> GreenTensor {
        let on_surface = x.z >= -SURFACE_TOLERANCE * x.norm();
        debug_assert!(!on_surface || x.z <= SURFACE_TOLERANCE * x.norm(), "{x} lies above the surface");
        match &self.0 {
            Form::Closed(closed) if on_surface => closed.at(&Vector3::new(x.x, x.y, 0.0)),
            Form::Closed(closed) => closed.at(x),
            Form::Tabulated(tables) if on_surface => tables.surface.at(x.x, x.y),
            Form::Tabulated(tables) => tables.inside.at(x),
        }
    }

    /// Estimated error of the tabulated displacement and gradient, relative to the largest entry; 0 for closed forms.
    pub fn error(&self) -> f64 {
        match &self.0 {
            Form::Closed(_) => 0.0,
            Form::Tabulated(tables) => tables.inside.error(),
        }
    }
}

/// Whether the plane normal to `axis` is a plane of material symmetry. Stiffness components C_ijkl with an odd number
/// of indices `axis` then vanish.
fn is_mirror(stiffness: &Stiffness, axis: usize) -> bool {
    let largest = stiffness.voigt().amax();
    let indices = || (0..81).map(|n| [n / 27, n / 9 % 3, n / 3 % 3, n % 3]);
    let odd = indices().filter(|indices| indices.iter().filter(|i| **i == axis).count() % 2 == 1);
    odd.map(|[i, j, k, l]| stiffness.component(i, j, k, l).abs())
        .all(|c| c <= ZERO_STIFFNESS_TOLERANCE * largest)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bem::cube_table::{CACHE_EXTENSION, cache_key};
    use crate::linalg::cache::CacheLookup;

    /// Truth: planes of symmetry contain the fibre or are normal to it. The field equals the direct integral in all quadrants.
    #[test]
    fn mirror_images_are_the_direct_integral() {
        let fibre = Stiffness::transversely_isotropic(14e3, 10e3, 5e3, 0.3, 0.4).unwrap();
        let turned = |axis: Vector3<f64>, angle: f64| {
            fibre.rotated(nalgebra::Rotation3::from_scaled_axis(axis * angle).matrix())
        };
        let [y, z] = [Vector3::y(), Vector3::z()];
        // Fibres along x, tilted in the plane y = 0, tilted in the plane x = 0, and between x and y.
        let upright = turned(y, 0.5).rotated(nalgebra::Rotation3::from_scaled_axis(z * (0.5 * PI)).matrix());
        let cases = [
            (fibre.clone(), [true, true]),
            (turned(y, 0.5), [false, true]),
            (upright, [true, false]),
            (turned(z, 0.5), [false, false]),
        ];
        for (stiffness, mirrors) in cases {
            assert_eq!([0, 1].map(|axis| is_mirror(&stiffness, axis)), mirrors);
            let green = SurfaceGreen::new(&stiffness, Side::Lower).unwrap();
            let integral = PointForceIntegral::new(&stiffness, &green);
            let field = PointForceField::new(&stiffness).unwrap();
            for k in 0..16 {
                let (phi, t) = (0.2 + 2.0 * PI * k as f64 / 16.0, 0.3 + 0.04 * k as f64);
                let (sin, cos) = (2.0 * t / (1.0 + t * t), (1.0 - t * t) / (1.0 + t * t));
                let x = Vector3::new(sin * phi.cos(), sin * phi.sin(), -cos);
                let (found, wanted) = (field.at(&x), integral.at(&x).unwrap());
                let value = (found.value - wanted.value).amax() / wanted.value.amax();
                let gradient = found.max_gradient_difference(&wanted) / wanted.max_gradient();
                assert!(value.max(gradient) < 1e-7, "{mirrors:?}, {k}: {value:e} {gradient:e}");
            }
        }
    }

    #[test]
    fn tables_are_kept() {
        let folder = tempfile::tempdir().unwrap();
        let cache = Cache::new(folder.path(), 1 << 26);
        let stiffness = Stiffness::transversely_isotropic(20_000.0, 9544.0, 5292.0, 0.272, 0.369).unwrap();
        let at = |field: &PointForceField| {
            [[0.3, -0.2, -0.5], [0.0, 0.0, -2.0], [1.0, 4.0, -0.01]].map(|x| field.at(&Vector3::from(x)))
        };
        let (made, note) = PointForceField::load_or_compute(&stiffness, Some(&cache)).unwrap();
        assert_eq!(note, None);
        let path = folder.path().read_dir().unwrap().next().unwrap().unwrap().path();
        let whole = std::fs::read(&path).unwrap();
        let key = cache_key(KIND, &stiffness);
        // The false error value 0.5 in the cache file distinguishes the cached table from a recomputed one.
        let list = |error: f64| {
            let CacheLookup::Hit(mut values) = cache.read_list(&key, CACHE_EXTENSION).unwrap() else {
                panic!("no list")
            };
            values[0] = error;
            cache.write_list(&key, CACHE_EXTENSION, &values).unwrap();
        };
        list(0.5);
        let (read, note) = PointForceField::load_or_compute(&stiffness, Some(&cache)).unwrap();
        assert_eq!((read.error(), note), (0.5, None));
        assert_eq!(at(&read), at(&made));
        let mut bytes = whole.clone();
        bytes[1000] ^= 1;
        std::fs::write(&path, bytes).unwrap();
        let (again, note) = PointForceField::load_or_compute(&stiffness, Some(&cache)).unwrap();
        assert!(note.is_some_and(|note| note.contains("computed again")));
        assert_eq!((again.error(), at(&again)), (made.error(), at(&made)));
        assert_eq!(std::fs::read(&path).unwrap(), whole);
        cache.write_list(&key, CACHE_EXTENSION, &[96.0, 0.0, 1.0]).unwrap();
        let (again, note) = PointForceField::load_or_compute(&stiffness, Some(&cache)).unwrap();
        assert!(note.is_some() && again.error() == made.error());
    }
}
