//! Finite elements: from a mesh, materials, supports and loads to a body's flexibility at its contact nodes.
//!
//! The weak form: find u with u = ū on the supports and ∫ ε(v) : C : ε(u) dV = ∫ v · b dV + ∫ v · t dS for all v that
//! vanish there. [`FeSpec`] says what is given, [`FeModel`] holds K u = f of the free unknowns, [`CondensedBody`] the
//! factor of K and the flexibility of the contact nodes, and recovers displacement, stress, energy and reactions.
//!
//! Unknowns are nodal displacements in global axes. Voigt order 11 22 33 23 13 12, engineering shears.

mod analysis;
mod assembly;
mod cache;
mod condensed;
mod dilatation;
mod dofs;
mod element;
mod enhanced;
mod floating;
mod foundation;
mod integration;
mod kept_factor;
mod loads;
mod method;
mod model;
mod moved;
mod recovery;
mod regions;
mod rigid;
mod solids;
mod spec;
mod superposition;
mod symmetry;

pub use analysis::{Analysis, flexibility_bytes};
pub use cache::{CacheEntry, CacheKey, FlexibilityCache, Lookup};
pub use condensed::{CondensedBody, Keep, Origin, Resources};
pub(crate) use loads::vector_areas;
pub use method::{Method, Shortage};
pub use model::FeModel;
pub(crate) use moved::moved;
pub use recovery::{
    CHANGE, ContactPoint, ErrorEstimate, ExposureField, ROUNDING, RecoveryPoints, StressRecovery, size_ratios,
};
pub(crate) use recovery::{FaceSample, FaceSums, contact_points, exposures};
pub use regions::{Finding, Regions, check_materials};
pub use rigid::{FreeMotions, free_motions};
pub use spec::{Bedding, FeSpec, Foundation, HexFormulation, Support};
pub use superposition::{ColumnSolver, Solved, SupportForces};
pub use symmetry::symmetry_component;
