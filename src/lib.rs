//! orthowear: three-dimensional frictional contact and wear of orthotropic bodies, above all fibre-reinforced
//! plastics.
//!
//! Two elastic bodies meet on a *contact frame*, a set of N cells with areas and local axes (x, y, n), n being
//! the outward normal of body 1. Each body is known to the contact only by its *flexibility* on the frame: the
//! relative displacement its surface gives to tractions on the cells. With the gap g and the tractions P on
//! body 2, g = g_free + S P + w; Signorini's conditions, an elliptic Coulomb law and a wear law for the worn
//! depth w close the system. Tractions inside the library act on body 2, forces in results act on body 1.
//!
//! The modules in the order of the data flow (a module uses those above it, never those below):
//!
//! scene -> mesh -> body (FE | half-space | rigid) -> flexibility on the contact frame -> contact -> wear -> results
#![deny(missing_docs)]

pub mod error;
pub mod npy;
pub mod geometry;
pub mod linalg;
pub mod quadrature;
pub mod element;
pub mod mesh;
pub mod material;
pub mod fem;
pub mod bem;
pub mod frame;
pub mod body;
pub mod coupling;
pub mod contact;
pub mod scene;
pub mod cli;
pub mod adaptive;
pub mod cancel;
pub mod compare;
pub mod estimate;
pub mod evolution;
pub mod flexibility;
pub mod laws;
pub mod omitted;
pub mod output;
pub mod report;
pub mod simulation;
pub mod sweep;
