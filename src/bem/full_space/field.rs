//! Field of a point force in a full space, fast enough for millions of points.

use nalgebra::Vector3;

use super::barnett::BarnettField;
use super::cube_table::CubeTable;
use super::kelvin::Kelvin;
use crate::bem::green_tensor::GreenTensor;
use crate::error::Result;
use crate::linalg::cache::{Cache, CacheKey, CacheKeyBuilder, CacheLookup};
use crate::material::Stiffness;

/// Raised whenever what a table holds, or its arithmetic, changes.
const FORMAT: u64 = 2;

/// Names of kept tables end so.
const CACHE_EXTENSION: &str = "directions";

/// Field of a unit force at the origin of a body without surfaces.
#[derive(Debug, Clone)]
pub struct FullSpaceField(Form);

#[derive(Debug, Clone)]
enum Form {
    Closed(Kelvin),
    Tabulated(Box<CubeTable>),
}

impl FullSpaceField {
    /// The field in a material.
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
    /// As [`BarnettField::at`], if memory does not suffice, and if a stop is wished.
    pub fn load_or_compute(stiffness: &Stiffness, cache: Option<&Cache>) -> Result<(Self, Option<String>)> {
        if let Some(closed) = Kelvin::from_stiffness(stiffness) {
            return Ok((Self(Form::Closed(closed)), None));
        }
        let key = key(stiffness);
        let mut note = None;
        if let Some(cache) = cache {
            match cache.read_list(&key, CACHE_EXTENSION)? {
                CacheLookup::Hit(values) => match CubeTable::from_values(&values) {
                    Some(table) => return Ok((Self(Form::Tabulated(Box::new(table))), None)),
                    None => note = Some(damage("its shape is wrong")),
                },
                CacheLookup::Miss => {}
                CacheLookup::Damaged(how) => note = Some(damage(&how)),
            }
        }
        let table = CubeTable::new(&BarnettField::new(stiffness))?;
        let written = cache.map_or(Ok(()), |cache| cache.write_list(&key, CACHE_EXTENSION, &table.values()));
        let note = note.or(written.err().map(|error| error.to_string()));
        Ok((Self(Form::Tabulated(Box::new(table))), note))
    }

    /// The field at `x` (mm), not the origin.
    #[inline]
    pub fn at(&self, x: &Vector3<f64>) -> GreenTensor {
        match &self.0 {
            Form::Closed(closed) => closed.at(x),
            Form::Tabulated(table) => table.at(x),
        }
    }

    /// Largest difference from the integrals over directions that was found when the table was made, over the largest entry at that
    /// distance; 0 for closed forms.
    pub fn error(&self) -> f64 {
        match &self.0 {
            Form::Closed(_) => 0.0,
            Form::Tabulated(table) => table.error(),
        }
    }
}

/// The key of the table of a material.
fn key(stiffness: &Stiffness) -> CacheKey {
    let mut hash = CacheKeyBuilder::new(&format!("full space {FORMAT}"));
    hash.update(stiffness.voigt().as_slice(), |value| value.to_le_bytes());
    hash.finish()
}

fn damage(how: &str) -> String {
    format!("the field of a point force in the cache was damaged ({how}); it was computed anew")
}
