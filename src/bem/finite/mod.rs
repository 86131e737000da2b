//! Finite boundary-element bodies, isotropic or anisotropic: direct collocation with discontinuous elements.
//!
//! The equation of each node y of each element is c u(y) + ∫ T u dS = ∫ U t dS, with the displacement u and the
//! traction t. The free term is c. The kernels U and T are the displacement and the traction of a unit point force
//! ([`super::full_space`]). The nodes are quadrature points inside the elements. Tractions may jump between elements,
//! so edges and corners need no special treatment.
//!
//! # Source
//! C.A. Brebbia, J.C.F. Telles, L.C. Wrobel, Boundary Element Techniques (1984).

mod body_force;
mod collocation;
mod compressed;
mod elements;
mod influence;
mod interior_solution;
mod interpolation;
mod panel;
mod plane;
mod problem;
mod solution;
mod surface_solution;
mod system;

pub use body_force::BodyForceSolution;
pub use compressed::{CompressedEquations, CompressionReport};
pub use elements::BoundaryElements;
pub use influence::Influence;
pub use interior_solution::{InteriorSolution, NearestPoint};
pub use interpolation::{ElementNodes, Interpolation, MOST_NODES};
pub use panel::Panel;
pub use plane::PlaneResponse;
pub use problem::{BoundaryValueProblem, BoundaryValues, Domain, MAX_DENSE_UNKNOWNS};
pub use solution::{BoundarySolution, SurfaceState};
pub use surface_solution::SurfaceSolution;
pub use system::{DEFAULT_TOLERANCE, SolutionMethod};
