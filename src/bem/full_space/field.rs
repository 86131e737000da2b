//! Field of a point force in a full space, fast enough for millions of points.

use nalgebra::Vector3;

use super::barnett::BarnettField;
use super::kelvin::Kelvin;
use crate::bem::cube_table::{CubeTable, DirectionSymmetry, SYMMETRIC_LEN};
use crate::bem::green_tensor::GreenTensor;
use crate::error::Result;
use crate::linalg::cache::Cache;
use crate::material::Stiffness;

/// Names the tables in the cache.
const KIND: &str = "full space";

/// Wanted error of a table, over its largest entry.
const ERROR: f64 = 1e-9;

/// Field of a unit force at the origin of a body without surfaces.
#[derive(Debug, Clone)]
pub struct FullSpaceField(Form);

#[derive(Debug, Clone)]
enum Form {
    Closed(Kelvin),
    Tabulated(Box<CubeTable<SYMMETRIC_LEN>>),
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
        let symmetry = DirectionSymmetry::Inversion;
        let (table, note) = CubeTable::load_or_compute((KIND, stiffness), symmetry, cache, || {
            let integrals = BarnettField::new(stiffness);
            CubeTable::new(symmetry, ERROR, std::iter::empty(), |x| Ok((integrals.at(x)?, 0.0)))
        })?;
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
