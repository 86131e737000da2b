//! Is a mesh of solids fit for analysis: Jacobians, shared faces, unmerged nodes.

mod conformity;
mod jacobian;
mod measure;

use super::Mesh;
use super::faces::face_of_three_solids;
use crate::element::ElementKind;
use crate::error::{Error, Result, warning};
use crate::geometry::{bounds, format_point};
pub use conformity::NonconformingFaces;
use conformity::find_nonconforming_faces;
use jacobian::check_jacobians;
use measure::coincident_points;

/// What [`check`] found out of a mesh that is fit for analysis.
#[derive(Debug, Clone, PartialEq)]
pub struct Quality {
    /// Number of solid cells of each kind.
    pub solids: Vec<(ElementKind, usize)>,
    /// Volume of the solids, cubic length unit.
    pub volume: f64,
    /// Least Jacobian at a node or integration point by the product of the lengths of its columns: 1 for a box; and its
    /// element.
    pub min_scaled_jacobian: (f64, u64),
    /// Number of solids that are folded or flat at a node, though at no integration point.
    pub folded_at_nodes: usize,
    /// Faces of neighbours that do not fit.
    pub nonconforming_faces: NonconformingFaces,
    /// Places of the points that lie where another point lies already, mm.
    pub coincident_points: Vec<[f64; 3]>,
}

impl Quality {
    /// What deserves a warning.
    pub fn warnings(&self) -> Vec<String> {
        self.folded().into_iter().chain(self.nonconforming_warnings()).chain(self.unmerged()).collect()
    }

    /// That solids are folded at nodes.
    fn folded(&self) -> Option<String> {
        let (least, tag) = self.min_scaled_jacobian;
        let all: usize = self.solids.iter().map(|(_, n)| n).sum();
        (self.folded_at_nodes > 0).then(|| {
            format!(
                "{} of {all} solid elements are folded or flat at a node, though their Jacobian is positive at all \
                 integration points; the worst is element {tag}, {least:.1e} of the lengths of its edges. They are computed \
                 as they are, and stresses there are less accurate; better move the node, or straighten the edge",
                self.folded_at_nodes
            )
        })
    }

    /// That displacements have gaps between neighbours.
    fn nonconforming_warnings(&self) -> Vec<String> {
        let NonconformingFaces { split_quadrangles, mixed_orders } = self.nonconforming_faces;
        let told = |(n, tag): (usize, u64), what: &str, mend: &str| {
            let words = format!(
                "{n} {what} (one at element {tag}): their displacements differ between the nodes; {mend}"
            );
            (n > 0).then(|| warning(&words))
        };
        [
            told(
                split_quadrangles,
                "quadrangles of solids lie on triangles of others with the same nodes",
                "put pyramids between hexahedra and tetrahedra",
            ),
            told(
                mixed_orders,
                "faces of neighbouring solids have the same corners but not the same nodes between them",
                "give all solids one order (in gmsh: `Mesh.ElementOrder`)",
            ),
        ]
        .into_iter()
        .flatten()
        .collect()
    }

    /// That nodes lie on one another.
    fn unmerged(&self) -> Option<String> {
        let n = self.coincident_points.len();
        if n == 0 {
            return None;
        }
        let places: Vec<String> = self.coincident_points.iter().take(3).map(format_point).collect();
        let (verb, more) = (if n == 1 { "node lies" } else { "nodes lie" }, if n > 3 { ", .." } else { "" });
        Some(format!(
            "{n} {verb} where another node lies already, at {}{more}: the elements there are not joined; merge the \
             nodes unless a crack is meant (in gmsh: `Coherence Mesh`)",
            places.join(", ")
        ))
    }
}

/// Checks the solids of a mesh and measures them.
///
/// # Errors
/// If there are no solids; if elements are turned inside out, folded or collapsed at an integration point (their numbers
/// and the least Jacobian are named); if three solids share a face. Several parts are not an error here: what holds each is the body's matter.
pub fn check(mesh: &Mesh) -> Result<Quality> {
    if mesh.volume_cells().next().is_none() {
        return Err(no_solids(mesh));
    }
    let jacobians = check_jacobians(mesh)?;
    if let Some([a, b, c]) = face_of_three_solids(mesh) {
        return Err(Error::input(format!(
            "the elements {}, {} and {} of {} share one face; solids may overlap nowhere",
            mesh.tag(a),
            mesh.tag(b),
            mesh.tag(c),
            mesh.source
        )));
    }
    let solids = mesh.blocks.iter().filter(|b| b.kind.dim() == 3).map(|b| (b.kind, b.n_cells())).collect();
    Ok(Quality {
        solids,
        volume: jacobians.volume,
        min_scaled_jacobian: jacobians.least,
        folded_at_nodes: jacobians.folded_at_nodes,
        nonconforming_faces: find_nonconforming_faces(mesh),
        coincident_points: coincident_points(&mesh.points),
    })
}

/// The axis to which all points lie in one perpendicular plane, if there is one.
fn plane_of(points: &[[f64; 3]]) -> Option<usize> {
    let extents = [0, 1, 2].map(|k| {
        let [low, high] = bounds(points.iter().map(|x| x[k]));
        high - low
    });
    let size = extents.iter().copied().fold(0.0, f64::max);
    (0..3).find(|&k| extents[k] <= 1e-9 * size)
}

/// A mesh without solids, and how that comes about.
fn no_solids(mesh: &Mesh) -> Error {
    let faces: usize = mesh.blocks.iter().filter(|b| b.kind.dim() == 2).map(super::CellBlock::n_cells).sum();
    let has = if faces > 0 { format!(" but {faces} surface elements") } else { String::new() };
    let plane = plane_of(&mesh.points).filter(|_| faces > 0).map_or_else(|| ": ".to_owned(), |axis| {
        let normal = ["1, 0, 0", "0, 1, 0", "0, 0, 1"][axis];
        format!(
            ". All of them lie at one {}: a plane model is extruded by one element for plane strain (in the .geo: `Extrude {{{normal}}} \
             {{ Surface{{:}}; Layers{{1}}; Recombine; }}`), with a physical group of its volume, which is held across the plane. Of a model with volumes ",
            ["x", "y", "z"][axis]
        )
    });
    Error::input(format!(
        "{} has no solid elements{has}{plane}gmsh saves only what belongs to a physical group once there is one, so give the \
         volume one too (in the .geo: `Physical Volume(\"body\") = {{1}};` with its number, or \
         `Physical Volume(\"body\") = Volume{{:}};` for all) and mesh it with `gmsh -3`",
        mesh.source
    ))
}
