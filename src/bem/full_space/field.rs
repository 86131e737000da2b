//! Field of a point force in a full space: a closed form for isotropic materials, a table for all others.

use nalgebra::Vector3;

use super::barnett::BarnettField;
use super::kelvin::Kelvin;
use crate::bem::cube_table::{CubeTable, DirectionSymmetry, SYMMETRIC_LEN};
use crate::bem::green_tensor::GreenTensor;
use crate::error::Result;
use crate::linalg::cache::Cache;
use crate::material::Stiffness;

const KIND: &str = "full space";

/// Target error of a table, relative to its largest entry.
const ERROR: f64 = 1e-9;

/// Field of a unit force at the origin of an infinite body.
#[derive(Debug, Clone)]
pub struct FullSpaceField(Form);

#[derive(Debug, Clone)]
enum Form {
    Closed(Kelvin),
    Tabulated(Box<CubeTable<SYMMETRIC_LEN>>),
}

impl FullSpaceField {
    /// Field for a material.
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
    /// If [`BarnettField::at`] fails, if memory does not suffice, or if the run is cancelled.
    pub fn load_or_compute(stiffness: &Stiffness, cache: Option<&Cache>) -> Result<(Self, Option<String>)> {
        if let Some(closed) = Kelvin::from_stiffness(stiffness) {
            return Ok((Self(Form::Closed(closed)), None));
        }
        let symmetry = DirectionSymmetry::Inversion;
        let (table, note) = CubeTable::load_or_compute(KIND, stiffness, symmetry, cache, || {
            let integrals = BarnettField::new(stiffness);
            CubeTable::new(symmetry, ERROR, std::iter::empty(), |x| Ok((integrals.at(x)?, 0.0)))
        })?;
        Ok((Self(Form::Tabulated(Box::new(table))), note))
    }

    /// Field at the point `x` (mm), which must not be the origin.
    #[inline]
    pub fn at(&self, x: &Vector3<f64>) -> GreenTensor {
        match &self.0 {
            Form::Closed(closed) => closed.at(x),
            Form::Tabulated(table) => table.at(x),
        }
    }

    /// Estimated error of the table, relative to the largest entry; 0 for closed forms.
    pub fn error(&self) -> f64 {
        match &self.0 {
            Form::Closed(_) => 0.0,
            Form::Tabulated(table) => table.error(),
        }
    }
}
