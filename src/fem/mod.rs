//! Finite elements: from mesh, materials, supports and loads to the flexibility of a body at its contact nodes.
//!
//! Weak form: find u with u = ū on the supports and ∫ ε(v) : C : ε(u) dV = ∫ v · b dV + ∫ v · t dS for all v that vanish on the
//! supports. The tractions t include the tractions of elastic foundations.
//!
//! [`FeSpec`] is the specification, and [`FeModel`] the assembled system K u = f of the free dofs. [`CondensedBody`] gives the
//! flexibility of the contact nodes and displacements, [`StressRecovery`] the stress.
//!
//! Unknowns are nodal displacements in global axes. The Voigt order is 11 22 33 23 13 12, with engineering shear strains.

mod analysis;
mod assembly;
mod column_solver;
mod condensation_method;
mod condensed;
mod dof_map;
mod element_kernels;
mod element_materials;
mod element_rules;
mod enhanced_strain;
mod factor_cache;
mod flexibility_cache;
mod foundation;
mod generalised_inverse;
mod integration_points;
mod loads;
mod mean_dilatation;
mod mesh_motion;
mod model;
mod prescribed_motion;
mod recovery;
mod rigid_body_modes;
mod spec;
mod symmetry;
mod thermal;

pub use analysis::{SymbolicAnalysis, flexibility_bytes};
pub use column_solver::{ColumnSolver, PrescribedDisplacementForces};
pub use condensation_method::{CondensationMethod, MemoryShortfall};
pub use condensed::{CacheContents, CondensationResources, CondensedBody, FlexibilityOrigin};
pub use element_materials::{ElementMaterials, RegionReport, check_materials};
pub use flexibility_cache::{CacheKey, CacheLookup, FlexibilityCache, FlexibilityEntry};
pub use loads::AppliedLoads;
pub(crate) use loads::nodal_area_vectors;
pub(crate) use mesh_motion::move_mesh;
pub use model::FeModel;
pub(crate) use prescribed_motion::PrescribedMotion;
pub use recovery::{
    ErrorEstimate, ExposureField, MIN_RELATIVE_ERROR, RecoveryPoints, SIZE_RATIO_BOUNDS, StressRecovery,
    SurfaceStressPoint, size_ratios,
};
pub(crate) use recovery::{FaceAverages, FaceContribution, exposures, surface_stress_points};
pub use rigid_body_modes::{RigidBodyModes, find_rigid_body_modes};
pub(crate) use rigid_body_modes::{SUBSPACE_TOLERANCE, translations_in};
pub use spec::{FeSpec, Foundation, FoundationStiffness, HexFormulation, Support};
pub use symmetry::symmetry_component;
pub use thermal::ThermoelasticState;
