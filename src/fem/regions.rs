//! Which solid cells the body has, and the stiffness of each.

use std::collections::BTreeSet;

use nalgebra::Matrix6;

use super::spec::FeSpec;
use crate::element::ElementKind;
use crate::error::{Error, Result};
use crate::mesh::{CellRef, Mesh};

/// The kinds that are finite elements here.
const SUPPORTED: [ElementKind; 2] = [ElementKind::Hex8, ElementKind::Tet4];

/// The solid cells with their stiffness.
#[derive(Debug, Clone)]
pub(super) struct Regions {
    /// Solid cells of the mesh, `[n_cells]`.
    pub cells: Vec<CellRef>,
    /// Index into `stiffness` of each, `[n_cells]`.
    pub region: Vec<usize>,
    /// Stiffness of the regions, global axes, MPa.
    pub stiffness: Vec<Matrix6<f64>>,
}

impl Regions {
    /// Gives each solid cell of the mesh its stiffness.
    ///
    /// # Errors
    /// If there is no solid cell, one is no finite element here, has no region or several; if a group is missing.
    pub fn new(spec: &FeSpec) -> Result<Self> {
        let mesh = &spec.mesh;
        let cells: Vec<CellRef> = mesh.volume_cells().collect();
        if cells.is_empty() {
            return Err(Error::input(format!(
                "{} has no solid elements; mesh the volume, and put it into a physical group so that gmsh saves it",
                mesh.source
            )));
        }
        refuse_unsupported(mesh)?;
        let mut by_block: Vec<Vec<Option<usize>>> =
            mesh.blocks.iter().map(|block| vec![None; block.n_cells()]).collect();
        for (index, (group, _)) in spec.regions.iter().enumerate() {
            let Some(group) = group else { continue };
            for &cell in &mesh.group_of_dim(group, 3)?.cells {
                let slot = &mut by_block[cell.block][cell.cell];
                if let Some(other) = slot.replace(index).filter(|&other| other != index) {
                    return Err(Error::input(format!(
                        "element {} of {} is in two regions, \"{}\" and \"{group}\"; give each element one material",
                        mesh.tag(cell),
                        mesh.source,
                        spec.regions[other].0.as_deref().unwrap_or("all"),
                    )));
                }
            }
        }
        let rest = spec.regions.iter().position(|(group, _)| group.is_none());
        let region = cells
            .iter()
            .map(|&cell| by_block[cell.block][cell.cell].or(rest).ok_or_else(|| no_region(mesh, cell)))
            .collect::<Result<_>>()?;
        let stiffness = spec.regions.iter().map(|(_, stiffness)| *stiffness.voigt()).collect();
        Ok(Self { cells, region, stiffness })
    }
}

fn no_region(mesh: &Mesh, cell: CellRef) -> Error {
    Error::input(format!(
        "element {} of {} is in no region that has a material; give the body a material, or name its volume group \
         in the regions",
        mesh.tag(cell),
        mesh.source
    ))
}

fn refuse_unsupported(mesh: &Mesh) -> Result<()> {
    let kinds: BTreeSet<&str> = mesh
        .blocks
        .iter()
        .filter(|block| block.kind.dim() == 3 && block.n_cells() > 0 && !SUPPORTED.contains(&block.kind))
        .map(|block| block.kind.name())
        .collect();
    if kinds.is_empty() {
        return Ok(());
    }
    let list = |names: Vec<&str>| names.join(", ");
    Err(Error::input(format!(
        "{} has solid elements of kind {}, which can be read but not computed with; finite elements are {}: mesh \
         with first order, in hexahedra (transfinite, extruded and recombined) or tetrahedra",
        mesh.source,
        list(kinds.into_iter().collect()),
        list(SUPPORTED.map(ElementKind::name).to_vec()),
    )))
}
