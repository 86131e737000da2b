//! Solid cells of the body, with the material and the material axes of each cell.

use std::collections::HashMap;

use nalgebra::{Matrix3, Matrix6};

use super::spec::FeSpec;
use crate::error::{Error, Result};
use crate::geometry::Point;
use crate::linalg::ordering::NodeGraph;
use crate::material::{PlacedMaterial, RegionMaterial, centroid};
use crate::mesh::{CellRef, Mesh};

/// Largest rotation of the material axes between neighbouring elements of one material that counts as continuous,
/// radians. The value is large enough for the turning fibres of filament windings.
const MAX_SMOOTH_TURN_RAD: f64 = 0.26;

/// Solid cells with their materials and material axes. A stiffness is rotated to global axes on request, because stored matrices
/// would take far more memory.
#[derive(Debug, Clone)]
pub struct ElementMaterials {
    pub(super) cells: Vec<CellRef>,
    materials: Vec<PlacedMaterial>,
    /// Distinct pairs of material index and axes.
    material_states: Vec<(usize, Matrix3<f64>)>,
    /// Index into `material_states` of each cell, `[n_cells]`.
    state_of_cell: Vec<u32>,
}

impl ElementMaterials {
    /// Assigns each solid cell of the mesh its material.
    ///
    /// # Errors
    /// If there is no solid cell, or a group is missing. If a cell has no region or several regions, or no material or axes in its
    /// region.
    pub fn new(spec: &FeSpec) -> Result<Self> {
        let (cells, region) = cells_and_regions(spec)?;
        let (regions, problems) = Self::assign(spec, cells, &region);
        problems.into_iter().flatten().next().map_or(Ok(regions), Err)
    }

    /// Assigns materials as [`Self::new`] does. Also returns the first error of each region, `[n_regions]`.
    fn assign(spec: &FeSpec, cells: Vec<CellRef>, region: &[usize]) -> (Self, Vec<Option<Error>>) {
        let mut first = vec![0; spec.regions.len()];
        let mut materials = Vec::new();
        for ((_, placement), first) in spec.regions.iter().zip(&mut first) {
            *first = materials.len();
            materials.extend(placement.materials().into_iter().cloned());
        }
        let mut problems: Vec<Option<(usize, Error)>> = spec.regions.iter().map(|_| None).collect();
        let mut known: HashMap<(usize, [u64; 9]), u32> = HashMap::new();
        let (mut material_states, mut state_of_cell) = (Vec::new(), Vec::with_capacity(cells.len()));
        for (&cell, &region) in cells.iter().zip(region) {
            match material_and_axes(&spec.mesh, cell, &spec.regions[region].1) {
                Ok((material, axes)) => {
                    let pair = (first[region] + material, axes);
                    let bits: [u64; 9] = std::array::from_fn(|i| axes[i].to_bits());
                    state_of_cell.push(*known.entry((pair.0, bits)).or_insert_with(|| {
                        material_states.push(pair);
                        material_states.len() as u32 - 1
                    }));
                }
                Err(error) => {
                    problems[region].get_or_insert((0, error)).0 += 1;
                    state_of_cell.push(0);
                }
            }
        }
        let problems = problems.into_iter().map(|problem| {
            problem.map(|(n, error)| match n {
                1 => error,
                n => Error::input(format!("{} ({n} elements in all)", error.message())),
            })
        });
        let problems = problems.collect();
        (Self { cells, materials, material_states, state_of_cell }, problems)
    }

    /// Number of elements.
    pub fn n_elements(&self) -> usize {
        self.cells.len()
    }

    /// The solid cells of the mesh, `[n_elements]`.
    pub fn cells(&self) -> &[CellRef] {
        &self.cells
    }

    /// Index of the solid `cell` in [`Self::cells`]; `None` if the mesh has no such solid.
    pub fn element(&self, cell: CellRef) -> Option<usize> {
        // Cells are sorted.
        self.cells.binary_search(&cell).ok()
    }

    /// Stiffness of the element `i` in global axes, MPa.
    pub fn stiffness(&self, i: usize) -> Matrix6<f64> {
        let (material, axes) = &self.material_states[self.state_of_cell[i] as usize];
        *self.materials[*material].stiffness.rotated(axes).voigt()
    }

    /// Coefficients of thermal expansion of the element `i`, a symmetric tensor in global axes, 1/K; `None` if they are unknown.
    pub fn expansion(&self, i: usize) -> Option<Matrix3<f64>> {
        let (material, axes) = &self.material_states[self.state_of_cell[i] as usize];
        let along_axes = self.materials[*material].expansion?;
        Some(axes * Matrix3::from_diagonal(&along_axes.into()) * axes.transpose())
    }

    /// Material axes of the element `i`, columns in global axes.
    pub fn axes(&self, i: usize) -> &Matrix3<f64> {
        &self.material_states[self.state_of_cell[i] as usize].1
    }

    /// Whether the material is continuous across the face between the elements `i` and `j`. This is so if their
    /// stiffnesses and their thermal expansions are equal up to rounding. It is also so if both elements have the same
    /// material and its axes turn by at most [`MAX_SMOOTH_TURN_RAD`]. Plies count as different materials.
    pub(super) fn is_continuous(&self, i: usize, j: usize) -> bool {
        if self.state_of_cell[i] == self.state_of_cell[j] {
            return true;
        }
        let (a, b) = (self.stiffness(i), self.stiffness(j));
        let [expansion_i, expansion_j] = [i, j].map(|i| self.expansion(i).unwrap_or_default());
        let equal_expansion = (expansion_i - expansion_j).amax() <= 1e-9 * expansion_i.amax();
        if equal_expansion && (a - b).amax() <= 1e-9 * a.amax() {
            return true;
        }
        let material = |i: usize| self.material_states[self.state_of_cell[i] as usize].0;
        let cosine = 0.5 * ((self.axes(i).transpose() * self.axes(j)).trace() - 1.0);
        material(i) == material(j) && cosine >= MAX_SMOOTH_TURN_RAD.cos()
    }

    /// Materials that at least one element has. A material with several orientations occurs several times.
    pub fn materials_in_use(&self) -> impl Iterator<Item = &PlacedMaterial> {
        self.material_states.iter().map(|(material, _)| &self.materials[*material])
    }

    /// Material of the element `i`, with the stiffness in material axes.
    pub fn material(&self, i: usize) -> &PlacedMaterial {
        &self.materials[self.material_states[self.state_of_cell[i] as usize].0]
    }
}

/// Errors and notes on the materials of a region.
#[derive(Debug, Clone, Default)]
pub struct RegionReport {
    /// Errors of the region.
    pub errors: Vec<String>,
    /// Notes for the user on the region.
    pub notes: Vec<String>,
}

/// Checks the materials of each region, `[n_regions]`: elements without material or axes, plies without elements, and elements that
/// straddle plies.
///
/// # Errors
/// If the solids cannot be divided into regions.
pub fn check_materials(spec: &FeSpec) -> Result<Vec<RegionReport>> {
    let (cells, region) = cells_and_regions(spec)?;
    let (_, problems) = ElementMaterials::assign(spec, cells.clone(), &region);
    let stacked: Vec<bool> = spec.regions.iter().map(|(_, placement)| placement.is_stacked()).collect();
    let mut corners_by_region: Vec<Vec<Vec<Point>>> = vec![Vec::new(); spec.regions.len()];
    for (&cell, &region) in cells.iter().zip(&region) {
        if stacked[region] {
            corners_by_region[region].push(corners(&spec.mesh, cell));
        }
    }
    let mut findings = Vec::with_capacity(problems.len());
    for (((_, placement), problem), corners) in spec.regions.iter().zip(problems).zip(corners_by_region) {
        let mut errors: Vec<String> = problem.iter().map(|error| error.message().to_owned()).collect();
        if errors.is_empty() && !corners.is_empty() {
            errors = placement.empty_ply_errors(&corners);
        }
        findings.push(RegionReport {
            errors,
            notes: placement.straddling_warning(&corners).into_iter().collect(),
        });
    }
    Ok(findings)
}

fn cells_and_regions(spec: &FeSpec) -> Result<(Vec<CellRef>, Vec<usize>)> {
    let mesh = &spec.mesh;
    let cells: Vec<CellRef> = mesh.volume_cells().collect();
    if cells.is_empty() {
        return Err(Error::input(format!(
            "{} has no solid elements; mesh the volume, and put it into a physical group so that gmsh saves it",
            mesh.source
        )));
    }
    let mut by_block: Vec<Vec<Option<usize>>> =
        mesh.blocks.iter().map(|block| vec![None; block.n_cells()]).collect();
    for (index, (group, _)) in spec.regions.iter().enumerate() {
        let Some(group) = group else { continue };
        for &cell in &mesh.group_of_dim(group, 3)?.cells {
            let slot = &mut by_block[cell.block][cell.cell];
            if let Some(other) = slot.replace(index).filter(|&other| other != index) {
                return Err(Error::input(format!(
                    "element {} of {} belongs to two regions, \"{}\" and \"{group}\"; give each element one material",
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
    Ok((cells, region))
}

fn material_and_axes(
    mesh: &Mesh,
    cell: CellRef,
    placement: &RegionMaterial,
) -> Result<(usize, Matrix3<f64>)> {
    let corners = corners(mesh, cell);
    let middle = centroid(&corners);
    let Some(index) = placement.material_at(&middle) else {
        return Err(Error::input(format!(
            "element {} of {} has its centroid at z = {:.6e}, outside all plies",
            mesh.tag(cell),
            mesh.source,
            middle.z
        )));
    };
    let material = placement.materials()[index];
    let tag = mesh.tag(cell);
    let axes = material
        .orientation
        .axes(tag, &corners)
        .map_err(|error| Error::input(format!("element {tag} of {}: {}", mesh.source, error.message())))?;
    Ok((index, axes))
}

pub(super) fn node_graph(mesh: &Mesh, cells: &[CellRef]) -> NodeGraph {
    NodeGraph::from_elements(mesh.n_points(), cells.iter().map(|&cell| mesh.cell_nodes(cell)))
}

fn corners(mesh: &Mesh, cell: CellRef) -> Vec<Point> {
    let nodes = &mesh.cell_nodes(cell)[..mesh.kind(cell).n_corners()];
    nodes.iter().map(|&node| mesh.points[node].into()).collect()
}

fn no_region(mesh: &Mesh, cell: CellRef) -> Error {
    Error::input(format!(
        "element {} of {} belongs to no region with a material; give the body a material, or add the volume group of the element to the regions",
        mesh.tag(cell),
        mesh.source
    ))
}
