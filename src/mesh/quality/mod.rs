//! Checks whether a mesh of solids is fit for analysis: Jacobians, shared faces, unmerged nodes.

mod conformity;
mod jacobian;
mod measure;

use super::Mesh;
use super::faces::face_of_three_solids;
use crate::element::ElementKind;
use crate::error::{Error, Result, Warning};
use crate::geometry::{bounds, format_point};
pub use conformity::NonconformingFaces;
use conformity::find_nonconforming_faces;
use jacobian::check_jacobians;
use measure::coincident_points;

/// Result of [`check`] for a mesh that is fit for analysis.
#[derive(Debug, Clone, PartialEq)]
pub struct Quality {
    /// Number of solid cells of each kind.
    pub solids: Vec<(ElementKind, usize)>,
    /// Volume of the solids, cubic length unit.
    pub volume: f64,
    /// Smallest scaled Jacobian at a node or integration point, and the number of its element in the mesh file. A
    /// scaled Jacobian is the Jacobian divided by the product of the lengths of its columns, 1 for a box.
    pub min_scaled_jacobian: (f64, u64),
    /// Number of solids whose Jacobian is positive at all integration points, but negative or almost zero at a node.
    pub folded_at_nodes: usize,
    /// Faces of neighbours that do not match.
    pub nonconforming_faces: NonconformingFaces,
    /// Points that coincide with an earlier point, in the scene's length unit.
    pub coincident_points: Vec<[f64; 3]>,
}

impl Quality {
    /// Warnings about the mesh.
    pub fn warnings(&self) -> Vec<Warning> {
        self.folded().into_iter().chain(self.nonconforming_warnings()).chain(self.unmerged()).collect()
    }

    fn folded(&self) -> Option<Warning> {
        let (least, tag) = self.min_scaled_jacobian;
        let all: usize = self.solids.iter().map(|(_, n)| n).sum();
        (self.folded_at_nodes > 0).then(|| {
            Warning::note(format!(
                "{} of {all} solid elements are folded or flat at a node, but their Jacobian is positive at all integration points (worst: element {tag}, {least:.1e} relative to its edge lengths). They are used as they are, but stresses there are less accurate. Move the node, or straighten the edge",
                self.folded_at_nodes
            ))
        })
    }

    fn nonconforming_warnings(&self) -> Vec<Warning> {
        let NonconformingFaces { split_quadrangles, mixed_orders } = self.nonconforming_faces;
        let told = |(n, tag): (usize, u64), what: &str, mend: &str| {
            let words = format!(
                "{n} {what} (one at element {tag}). Displacements are discontinuous there between the nodes; {mend}"
            );
            (n > 0).then(|| Warning::uncertain(&words))
        };
        [
            told(
                split_quadrangles,
                "quadrilateral faces of solids meet triangles of other solids with the same nodes",
                "insert pyramids between hexahedra and tetrahedra",
            ),
            told(
                mixed_orders,
                "faces of neighbouring solids have the same corners but different mid-side nodes",
                "use the same order for all solids (in gmsh: `Mesh.ElementOrder`)",
            ),
        ]
        .into_iter()
        .flatten()
        .collect()
    }

    fn unmerged(&self) -> Option<Warning> {
        let n = self.coincident_points.len();
        if n == 0 {
            return None;
        }
        let places: Vec<String> = self.coincident_points.iter().take(3).map(format_point).collect();
        let (verb, more) =
            (if n == 1 { "node coincides" } else { "nodes coincide" }, if n > 3 { ", .." } else { "" });
        Some(Warning::note(format!(
            "{n} {verb} with another node, at {}{more}. The elements there are not connected; merge the nodes unless they form a crack (in gmsh: `Coherence Mesh`)",
            places.join(", ")
        )))
    }
}

/// Checks the solids of a mesh and measures them.
///
/// # Errors
/// If there are no solids, or three solids share a face. If elements are inverted, folded or collapsed at an integration point, or
/// have an edge of zero length. Separate parts are not an error.
pub fn check(mesh: &Mesh) -> Result<Quality> {
    if mesh.volume_cells().next().is_none() {
        return Err(no_solids(mesh));
    }
    let jacobians = check_jacobians(mesh)?;
    if let Some([a, b, c]) = face_of_three_solids(mesh) {
        return Err(Error::input(format!(
            "the elements {}, {} and {} of {} share one face; solids must not overlap",
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

/// Axis normal to the plane that contains all points; `None` if the points lie in no plane normal to an axis.
fn plane_of(points: &[[f64; 3]]) -> Option<usize> {
    let extents = [0, 1, 2].map(|k| {
        let [low, high] = bounds(points.iter().map(|x| x[k]));
        high - low
    });
    let size = extents.iter().copied().fold(0.0, f64::max);
    (0..3).find(|&k| extents[k] <= 1e-9 * size)
}

fn no_solids(mesh: &Mesh) -> Error {
    let faces: usize = mesh.blocks.iter().filter(|b| b.kind.dim() == 2).map(super::CellBlock::n_cells).sum();
    let has = if faces > 0 { format!(" but {faces} surface elements") } else { String::new() };
    let plane = plane_of(&mesh.points).filter(|_| faces > 0).map_or_else(|| ": ".to_owned(), |axis| {
        let normal = ["1, 0, 0", "0, 1, 0", "0, 0, 1"][axis];
        format!(
            ". All have the same {}. For plane strain, extrude the plane model by one element (.geo: `Extrude {{{normal}}} {{ Surface{{:}}; Layers{{1}}; Recombine; }}`), and fix the physical group of its volume along that axis. If the model has volumes: ",
            ["x", "y", "z"][axis]
        )
    });
    Error::input(format!(
        "{} has no solid elements{has}{plane}gmsh saves only elements in physical groups once a group exists. Give the volume a group (.geo: `Physical Volume(\"body\") = {{1}};` with its number, or `Physical Volume(\"body\") = Volume{{:}};` for all) and mesh it with `gmsh -3`",
        mesh.source
    ))
}
