//! Field of a point force on the surface of a half-space, fast enough for millions of points.

use nalgebra::Vector3;

use crate::bem::green_tensor::GreenTensor;
use crate::bem::half_space::green::SurfaceGreen;
use crate::bem::half_space::subsurface::boussinesq::Boussinesq;
use crate::bem::half_space::subsurface::point_force_integral::PointForceIntegral;
use crate::bem::half_space::subsurface::point_force_table::PointForceTable;
use crate::bem::half_space::subsurface::surface_point_force::SurfacePointForce;
use crate::error::Result;
use crate::geometry::Side;
use crate::linalg::cache::{Cache, CacheKey, CacheKeyBuilder, CacheLookup};
use crate::material::Stiffness;

/// Points nearer to the surface, over their distance from the force, count as on it.
const SURFACE_TOLERANCE: f64 = 1e-9;

/// Raised whenever what a table holds, or its arithmetic, changes.
const FORMAT: u64 = 2;

/// Names of kept tables end so.
const CACHE_EXTENSION: &str = "field";

/// Field of a unit force at the origin of the surface of the half-space z <= 0, whose outward normal is +z.
///
/// Isotropic materials have closed forms; others a table, made of integrals over directions, and on the surface the series of
/// its Green's function.
#[derive(Debug, Clone)]
pub struct PointForceField(Form);

#[derive(Debug, Clone)]
enum Form {
    Closed(Boussinesq),
    Tabulated(Box<Tabulated>),
}

#[derive(Debug, Clone)]
struct Tabulated {
    inside: PointForceTable,
    surface: SurfacePointForce,
}

impl Tabulated {
    fn form(inside: PointForceTable, surface: SurfacePointForce) -> Form {
        Form::Tabulated(Box::new(Self { inside, surface }))
    }
}

impl PointForceField {
    /// The field in a material, in the axes of the surface.
    ///
    /// # Errors
    /// As [`Self::load_or_compute`].
    pub fn new(stiffness: &Stiffness) -> Result<Self> {
        Ok(Self::load_or_compute(stiffness, None)?.0)
    }

    /// The same with the table from a cache, or computed and put there, and what the user should know of the cache: a damaged
    /// entry, or one that could not be written.
    ///
    /// # Errors
    /// As [`SurfaceGreen::new`], if memory does not suffice, and if a stop is wished.
    pub fn load_or_compute(stiffness: &Stiffness, cache: Option<&Cache>) -> Result<(Self, Option<String>)> {
        if let Some(closed) = Boussinesq::from_stiffness(stiffness) {
            return Ok((Self(Form::Closed(closed)), None));
        }
        let green = SurfaceGreen::new(stiffness, Side::Lower)?;
        let surface = SurfacePointForce::new(stiffness, &green);
        let key = key(stiffness);
        let mut note = None;
        if let Some(cache) = cache {
            match cache.read_list(&key, CACHE_EXTENSION)? {
                CacheLookup::Hit(values) => match PointForceTable::from_values(values) {
                    Some(inside) => return Ok((Self(Tabulated::form(inside, surface)), None)),
                    None => note = Some(damage("its shape is wrong")),
                },
                CacheLookup::Miss => {}
                CacheLookup::Damaged(how) => note = Some(damage(&how)),
            }
        }
        let table = PointForceTable::new(&PointForceIntegral::new(stiffness, &green), &surface)?;
        let written = cache.map_or(Ok(()), |cache| cache.write_list(&key, CACHE_EXTENSION, &table.values()));
        let note = note.or(written.err().map(|error| error.to_string()));
        Ok((Self(Tabulated::form(table, surface)), note))
    }

    /// The field at `x` (mm) with z <= 0, not the origin. A point within 1e-9 of its distance from the surface, below or above, counts as on it:
    /// its derivatives are those from within the body.
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

    /// Largest difference of the gradient from the direct integral that was found when the table was made, over its largest
    /// entry at that distance; 0 for closed forms.
    pub fn error(&self) -> f64 {
        match &self.0 {
            Form::Closed(_) => 0.0,
            Form::Tabulated(tables) => tables.inside.error(),
        }
    }
}

/// The key of the table of a material.
fn key(stiffness: &Stiffness) -> CacheKey {
    let mut hash = CacheKeyBuilder::new(&format!("point force {FORMAT}"));
    hash.update(stiffness.voigt().as_slice(), |value| value.to_le_bytes());
    hash.finish()
}

fn damage(how: &str) -> String {
    format!("the field of a point force in the cache was damaged ({how}); it was computed anew")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Truth: a table that is kept is read, to the last bit; a damaged one is made anew, and told.
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
        // A mark in the file tells what is read from what is made anew.
        let list = |error: f64| {
            let CacheLookup::Hit(mut values) = cache.read_list(&key(&stiffness), CACHE_EXTENSION).unwrap()
            else {
                panic!("no list")
            };
            values[1] = error;
            cache.write_list(&key(&stiffness), CACHE_EXTENSION, &values).unwrap();
        };
        list(0.5);
        let (read, note) = PointForceField::load_or_compute(&stiffness, Some(&cache)).unwrap();
        assert_eq!((read.error(), note), (0.5, None));
        assert_eq!(at(&read), at(&made));
        let mut bytes = whole.clone();
        bytes[1000] ^= 1;
        std::fs::write(&path, bytes).unwrap();
        let (again, note) = PointForceField::load_or_compute(&stiffness, Some(&cache)).unwrap();
        assert!(note.is_some_and(|note| note.contains("computed anew")));
        assert_eq!((again.error(), at(&again)), (made.error(), at(&made)));
        assert_eq!(std::fs::read(&path).unwrap(), whole);
        cache.write_list(&key(&stiffness), CACHE_EXTENSION, &[96.0, 0.0, 1.0]).unwrap();
        let (again, note) = PointForceField::load_or_compute(&stiffness, Some(&cache)).unwrap();
        assert!(note.is_some() && again.error() == made.error());
    }
}
