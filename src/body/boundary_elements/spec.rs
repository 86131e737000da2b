//! Definition of a boundary-element body, and its fit to a frame.

use std::collections::HashMap;
use std::sync::Arc;

use nalgebra::Matrix3;
use rayon::prelude::*;

use crate::bem::finite::{
    BodyForceSolution, BoundaryElements, BoundaryValueProblem, BoundaryValues, CompressedEquations,
    Interpolation, Panel, SolutionMethod,
};
use crate::bem::full_space::FullSpaceField;
use crate::body::LoadCase;
use crate::cancel;
use crate::error::{Context, Error, Result};
use crate::fem::{RigidBodyModes, Support};
use crate::frame::{ContactFrame, FaceMap, Side};
use crate::geometry::{AXIS_NAMES, Point, format_point};
use crate::linalg::cache::Cache;
use crate::material::Stiffness;
use crate::mesh::faces::{SurfaceFace, group_faces, outer_faces};
use crate::mesh::self_intersection::find_intersecting_faces;
use crate::mesh::{CellRef, Mesh};

/// Accuracy of the integrals, relative to their largest values. The discretisation error is far larger.
const INTEGRATION_TOLERANCE: f64 = 1e-6;

/// Largest absolute weight of a node in a cell average that counts as a rounding error.
const MIN_SHAPE_WEIGHT: f64 = 1e-9;

const POINTS_PER_CANCEL_CHECK: usize = 1024;

/// Elements in the order of the mesh's outer faces, the element number of each face, the error of the tabulated
/// kernels, and a cache warning.
pub(super) type NumberedElements = (BoundaryElements, HashMap<CellRef, usize>, (f64, Option<String>));

/// Definition of a boundary-element body.
#[derive(Debug, Clone)]
pub struct BeSpec {
    /// Name of the body in messages ("body1").
    pub name: String,
    /// Closed surface mesh without solids, normals outward ([`crate::mesh::closed_surface`]).
    pub mesh: Arc<Mesh>,
    /// Stiffness of the material, global axes.
    pub stiffness: Stiffness,
    /// Interpolation of displacement and traction over an element.
    pub interpolation: Interpolation,
    /// Supports and prescribed displacements, by groups of surfaces.
    pub supports: Vec<Support>,
    /// Pressure on surface groups, MPa, positive into the body.
    pub pressures: Vec<(String, f64)>,
    /// Tractions on surface groups, global axes, MPa.
    pub tractions: Vec<(String, [f64; 3])>,
    /// Force per volume, global axes, N/mm3.
    pub body_force: [f64; 3],
    /// Uniform thermal strain, a symmetric tensor in global axes.
    pub thermal_strain: Matrix3<f64>,
}

/// How a body's mesh fits a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FrameFit {
    /// Number of element nodes under the frame.
    pub n_nodes: usize,
    /// Whether each cell lies within a single element.
    pub cells_within_elements: bool,
    /// Element with the largest ratio of node spacing to the thickness of the body behind it: its index among the outer
    /// faces, and this ratio.
    pub thinnest_element: Option<(usize, f64)>,
}

/// Supports and loads at the nodes of the boundary elements.
pub(super) struct NodalConditions {
    /// Whether the displacement is prescribed, by dof.
    pub(super) held: Vec<bool>,
    /// Displacement (mm) of prescribed dofs and traction (MPa) of the other dofs, minus the contribution of the
    /// particular solution `weight`.
    pub(super) values: Vec<f64>,
    /// Particular solution for the body force and the thermal strain.
    pub(super) weight: Option<BodyForceSolution>,
}

impl NodalConditions {
    fn is_at_rest(&self) -> bool {
        self.weight.is_none() && self.values.iter().all(|value| *value == 0.0)
    }

    /// Boundary values of the equations for a body with the unconstrained modes `free`.
    pub(super) fn boundary_values(
        &self,
        free: Option<&RigidBodyModes>,
        elements: &BoundaryElements,
    ) -> BoundaryValues {
        let mean_displacement = free.map_or_else(Vec::new, |free| self.counter_mean(free, elements));
        BoundaryValues { at_dofs: self.values.clone(), mean_displacement }
    }

    /// Prescribed traction components: dof and value.
    pub(super) fn tractions(&self) -> impl Iterator<Item = (usize, f64)> {
        self.values.iter().copied().enumerate().filter(|(dof, _)| !self.held[*dof])
    }

    /// Mean displacement that the boundary solution must have along each unconstrained mode m. It is minus the mean of
    /// u·m over the surface, where u is the particular solution; the total mean is then zero. Prescribed dofs do not
    /// contribute. Empty without a particular solution.
    fn counter_mean(&self, free: &RigidBodyModes, elements: &BoundaryElements) -> Vec<f64> {
        let Some(weight) = &self.weight else { return Vec::new() };
        let (positions, areas) = (elements.positions(), elements.areas());
        let total: f64 = areas.iter().sum();
        let along = |j: usize| -> f64 {
            let nodes = positions.iter().zip(&areas).enumerate();
            nodes
                .map(|(node, (x, area))| {
                    let (u, motion) = (weight.displacement(x), free.displacement(x, j));
                    let free = (0..3).filter(|c| !self.held[3 * node + c]);
                    -free.map(|c| u[c] * motion[c]).sum::<f64>() * area / total
                })
                .sum()
        };
        (0..free.n_modes()).map(along).collect()
    }
}

impl BeSpec {
    pub(super) fn faces(&self, group: &str) -> Result<Vec<SurfaceFace>> {
        group_faces(&self.mesh, group)
    }

    pub(super) fn elements(&self, cache: Option<&Cache>) -> Result<NumberedElements> {
        let outer = outer_faces(&self.mesh);
        let at = |&node: &usize| Point::from(self.mesh.points[node]);
        let panel =
            |face: &SurfaceFace| Panel { kind: face.kind, nodes: face.nodes.iter().map(at).collect() };
        let (field, note) = FullSpaceField::load_or_compute(&self.stiffness, cache)?;
        let error = field.error();
        let panels = outer.iter().map(panel).collect();
        let elements =
            BoundaryElements::new(panels, self.interpolation, &self.stiffness, field, INTEGRATION_TOLERANCE);
        let number = outer.iter().enumerate().map(|(i, face)| (face.owner, i)).collect();
        Ok((elements, number, (error, note)))
    }

    pub(super) fn nodal_conditions(
        &self,
        elements: &BoundaryElements,
        number: &HashMap<CellRef, usize>,
    ) -> Result<NodalConditions> {
        let (positions, normals) = (elements.positions(), elements.normals());
        let mut held = vec![None; 3 * positions.len()];
        let nodes_of = |faces: Vec<SurfaceFace>| -> Vec<usize> {
            faces.iter().flat_map(|face| elements.nodes_of(number[&face.owner])).collect()
        };
        for support in &self.supports {
            let faces = self.faces(&support.group).map_err(|error| error.at_group(&support.group))?;
            for node in nodes_of(faces) {
                for c in (0..3).filter(|&c| support.components[c]) {
                    let far = Point::from(support.gradient[c]).dot(&positions[node]);
                    let value = support.value[c] + far;
                    let before = held[3 * node + c].replace(value);
                    if before.is_some_and(|before| before != value) {
                        return Err(Error::input(format!(
                            "the group \"{}\" and an earlier group prescribe different displacements along {} at {}: put each face into only one of these groups",
                            support.group,
                            AXIS_NAMES[c],
                            format_point(&positions[node].into())
                        ))
                        .at_group(&support.group));
                    }
                }
            }
        }
        let mut tractions = vec![Point::zeros(); positions.len()];
        for (group, pressure) in &self.pressures {
            let nodes = nodes_of(self.faces(group).context(|| "pressure".to_owned())?);
            nodes.into_iter().for_each(|node| tractions[node] -= normals[node] * *pressure);
        }
        for (group, traction) in &self.tractions {
            let nodes = nodes_of(self.faces(group).context(|| "traction".to_owned())?);
            nodes.into_iter().for_each(|node| tractions[node] += Point::from(*traction));
        }
        let force = Point::from(self.body_force);
        let acts = force != Point::zeros() || self.thermal_strain != Matrix3::zeros();
        let weight = acts.then(|| {
            let middle = positions.iter().sum::<Point>() / positions.len().max(1) as f64;
            BodyForceSolution::new(&self.stiffness, &force, self.thermal_strain, middle)
        });
        let value = |dof: usize, held: &Option<f64>| {
            let (node, c) = (dof / 3, dof % 3);
            let x = &positions[node];
            let of_weight = |weight: &BodyForceSolution| match held {
                Some(_) => weight.displacement(x)[c],
                None => (weight.stress(x) * normals[node])[c],
            };
            held.unwrap_or(tractions[node][c]) - weight.as_ref().map_or(0.0, of_weight)
        };
        let values = held.iter().enumerate().map(|(dof, held)| value(dof, held)).collect();
        Ok(NodalConditions { held: held.iter().map(Option::is_some).collect(), values, weight })
    }

    /// Load cases of the body, and the boundary conditions of each case at amplitude 1. Without `cases`, all loads of
    /// the body form one case.
    pub(super) fn load_conditions(
        &self,
        cases: &[(LoadCase, Self)],
        elements: &BoundaryElements,
        number: &HashMap<CellRef, usize>,
    ) -> Result<Vec<(LoadCase, NodalConditions)>> {
        let conditions = |spec: &Self| spec.nodal_conditions(elements, number);
        if !cases.is_empty() {
            return cases.iter().map(|(case, spec)| Ok((case.clone(), conditions(spec)?))).collect();
        }
        let all = conditions(self)?;
        Ok(if all.is_at_rest() { Vec::new() } else { vec![(LoadCase::default(), all)] })
    }

    /// Unconstrained rigid-body modes; `None` if the supports fix the body.
    ///
    /// # Errors
    /// If a group is missing, or supports contradict one another.
    pub fn free_motions(&self) -> Result<Option<RigidBodyModes>> {
        // Rigid-body modes do not depend on the material.
        let plain = self.with_unit_material()?;
        let (elements, number, _) = plain.elements(None)?;
        elements.free_motions(&plain.nodal_conditions(&elements, &number)?.held)
    }

    /// Number of nodes of all elements.
    pub fn n_nodes(&self) -> usize {
        let of_face = |face: &SurfaceFace| self.interpolation.n_nodes(face.kind.n_corners() == 3);
        outer_faces(&self.mesh).iter().map(of_face).sum()
    }

    /// Checks the body against a frame without solving its equations. Returns how the mesh fits the frame.
    ///
    /// # Errors
    /// As [`BeBody::new`](super::BeBody::new), except that the flexibility and the memory are not checked.
    pub fn check(&self, contact: &str, side: Side, frame: &ContactFrame) -> Result<FrameFit> {
        let faces = self.faces(contact)?;
        refuse_crossing(&self.mesh, &faces, contact)?;
        let plain = self.with_unit_material()?;
        let (elements, number, _) = plain.elements(None)?;
        let map = build_face_map(&plain, &elements, &number, frame, side, &faces)?;
        refuse_held(&map, &plain.nodal_conditions(&elements, &number)?, &elements)?;
        let element: Vec<usize> =
            (0..elements.n_elements()).flat_map(|i| elements.nodes_of(i).map(move |_| i)).collect();
        let of_cell = |cell: usize| {
            let mut own = map
                .row(cell)
                .filter(|(_, weight)| weight.abs() > MIN_SHAPE_WEIGHT)
                .map(|(node, _)| element[map.nodes()[node]]);
            let first = own.next();
            own.all(|other| Some(other) == first)
        };
        let cells_within_elements = (0..map.n_cells()).all(of_cell);
        Ok(FrameFit {
            n_nodes: map.nodes().len(),
            cells_within_elements,
            thinnest_element: elements.max_spacing_to_thickness(),
        })
    }

    /// Index of the first of `points` that lies outside the body.
    ///
    /// # Errors
    /// If the run is cancelled.
    pub fn first_point_outside(&self, points: &[Point]) -> Result<Option<usize>> {
        let (elements, ..) = self.with_unit_material()?.elements(None)?;
        for (batch, points) in points.chunks(POINTS_PER_CANCEL_CHECK).enumerate() {
            cancel::check()?;
            let found = points.par_iter().position_first(|x| !elements.contains(x));
            if let Some(first) = found {
                return Ok(Some(batch * POINTS_PER_CANCEL_CHECK + first));
            }
        }
        Ok(None)
    }

    /// This body with an isotropic material. The kernels of isotropic materials need no table.
    fn with_unit_material(&self) -> Result<Self> {
        Ok(Self { stiffness: Stiffness::isotropic(1.0, 0.0)?, ..self.clone() })
    }

    /// Solution method of the equations.
    pub fn solved_by(&self) -> SolutionMethod {
        SolutionMethod::of(3 * self.n_nodes())
    }

    /// Peak memory to build a body with `n_loaded` nodes under the frame and `n_loads` loads, bytes.
    ///
    /// # Errors
    /// If the surface is invalid.
    pub fn bytes(&self, n_loaded: usize, n_loads: usize) -> Result<u128> {
        let columns = n_loads + 3 * n_loaded;
        let equations = match self.solved_by() {
            SolutionMethod::Dense => BoundaryValueProblem::dense_bytes(self.n_nodes(), columns),
            SolutionMethod::Compressed(tolerance) => CompressedEquations::expected_bytes(
                &self.with_unit_material()?.elements(None)?.0,
                columns,
                tolerance,
            ),
        };
        Ok(equations + 9 * 8 * (n_loaded as u128).pow(2))
    }
}

pub(super) fn build_face_map(
    spec: &BeSpec,
    elements: &BoundaryElements,
    number: &HashMap<CellRef, usize>,
    frame: &ContactFrame,
    side: Side,
    faces: &[SurfaceFace],
) -> Result<FaceMap> {
    // Elements of higher order than their faces need additional mesh points.
    let mut mesh = Mesh { points: spec.mesh.points.clone(), ..Mesh::default() };
    let raised = |face: &SurfaceFace| {
        let panel = elements.panel(number[&face.owner]);
        let n_corners = face.kind.n_corners();
        let mut nodes = face.nodes.clone();
        if panel.kind != face.kind {
            nodes.truncate(n_corners);
            for point in &panel.nodes[n_corners..] {
                nodes.push(mesh.points.len());
                mesh.points.push((*point).into());
            }
        }
        SurfaceFace { kind: panel.kind, nodes, ..face.clone() }
    };
    let faces: Vec<SurfaceFace> = faces.iter().map(raised).collect();
    let values = |face: usize, local: usize| {
        let element = number[&faces[face].owner];
        let values =
            elements.reference_nodes_of(element).values(faces[face].kind.face_reference_nodes()[local]);
        elements.nodes_of(element).zip(values).collect()
    };
    FaceMap::with_basis(frame, &mesh, &faces, side, values)
}

pub(super) fn refuse_crossing(mesh: &Mesh, faces: &[SurfaceFace], contact: &str) -> Result<()> {
    let Some(pair) = find_intersecting_faces(mesh, faces) else { return Ok(()) };
    let [a, b] = pair.map(|k| faces[k].tag);
    Err(Error::input(format!(
        "the elements {a} and {b} of the group \"{contact}\" of {} intersect, but a contact surface must not cross itself; fix the mesh there",
        mesh.source
    )))
}

pub(super) fn refuse_held(map: &FaceMap, known: &NodalConditions, elements: &BoundaryElements) -> Result<()> {
    let held = |&&node: &&usize| known.held[3 * node..3 * node + 3].contains(&true);
    let Some(&node) = map.nodes().iter().find(held) else { return Ok(()) };
    let count = map.nodes().iter().filter(held).count();
    let smaller = if count < map.nodes().len() { ", or use a smaller frame" } else { "" };
    Err(Error::input(format!(
        "a support fixes faces under the contact frame ({count} nodes, one at {}), but fixed faces cannot come into contact; fix other faces{smaller}",
        format_point(&elements.positions()[node].into())
    )))
}
