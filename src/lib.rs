//! orthowear: three-dimensional frictional contact and wear of orthotropic bodies, in particular fibre-reinforced plastics.
//!
//! Two bodies touch on a *contact frame*: N cells with areas and local axes (e1, e2, n), where n is the outward normal
//! of body 1. The elasticity of a body enters the contact problem only through its *flexibility* on the frame: the
//! surface displacement due to tractions on the cells. The gap g is the sum of the free gap g_free (initial gap and
//! rigid-body motion), the displacements and the wear depth w along n:
//!
//! ```text
//! g = g_free + S P + w n
//! ```
//!
//! S is the flexibility of both bodies, and P are the tractions on body 2. Signorini's conditions, a Coulomb law with
//! an elliptic friction cone and a wear law for w close the system ([`contact::Increment`]). Tractions inside the
//! library act on body 2; forces in results act on body 1.
//!
//! # Data flow
//!
//! ```text
//! scene -> mesh -> body (finite elements | boundary elements | half-space | rigid)
//!       -> flexibility on the contact frame -> contact problem of an increment
//!       -> evolution of contact and wear over load steps and cycles -> output
//! ```
//!
//! [`scene`] reads a scene file into a [`scene::Plan`]. [`simulation`] builds the bodies and the frame of a plan and runs it. The
//! computing modules do not depend on the format of scenes.
//!
//! # Modules in the order of imports
//!
//! A module uses only modules above it. No files import each other in circles. `tests/architecture.rs` checks these two
//! rules.
//!
//! | module | contents |
//! |---|---|
//! | [`error`] | the error type, its kinds and exit codes |
//! | [`cancel`] | process-wide cancellation flag |
//! | [`omitted`] | work that a scene does not need, and why |
//! | [`npy`] | arrays in NumPy's file format |
//! | `csv` | lines and cells of tables of text |
//! | [`geometry`] | points, local axes, rotations |
//! | [`linalg`] | sparse and dense factorisation, ordering, iterative solvers, hierarchical matrices, cache, memory limit |
//! | [`flexibility`] | the flexibility operator of a frame and its combinations |
//! | [`quadrature`] | quadrature rules |
//! | [`element`] | shape functions, faces and node order of each element |
//! | [`mesh`] | meshes with physical groups, their quality, the .msh reader |
//! | [`material`] | stiffness, orientation, layups, strength |
//! | [`laws`] | friction and wear laws |
//! | [`fem`] | finite elements: assembly, condensation, stress recovery |
//! | [`bem`] | boundary elements: half-space, full space, finite bodies |
//! | [`frame`] | contact frame: cells, areas, axes, initial gap, maps to faces |
//! | [`body`] | elastic bodies: their flexibility on a frame, recovery of fields |
//! | [`coupling`] | two bodies on one frame: Schur complement or block system |
//! | [`contact`] | the contact problem of one increment: equations, solvers, certificate |
//! | [`evolution`] | load steps, fretting cycles, wear |
//! | [`output`] | summary, history, fields, figures, checkpoint files |
//! | [`scene`] | keys, diagnostics, and the plan of a scene |
//! | [`simulation`] | from a plan to its results |
//! | [`estimate`] | time and memory before a run |
//! | [`adaptive`] | refinement until a target accuracy is reached |
//! | [`compare`] | one scene with different models of its bodies |
//! | [`sweep`] | studies: a scene for many values |
//! | [`report`] | results as one HTML page |
//! | [`cli`] | the command line |
#![deny(missing_docs)]
#![warn(clippy::too_many_lines)]

// Fixtures that unit tests share with integration tests use the name `orthowear` for the crate.
#[cfg(test)]
extern crate self as orthowear;

pub mod error;
pub mod cancel;
pub mod omitted;
pub mod npy;
mod csv;
pub mod geometry;
pub mod linalg;
pub mod flexibility;
pub mod quadrature;
pub mod element;
pub mod mesh;
pub mod material;
pub mod laws;
pub mod fem;
pub mod bem;
pub mod frame;
pub mod body;
pub mod coupling;
pub mod contact;
pub mod evolution;
pub mod output;
pub mod scene;
pub mod simulation;
pub mod estimate;
pub mod adaptive;
pub mod compare;
pub mod sweep;
pub mod report;
pub mod cli;
