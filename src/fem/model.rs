//! Assembled finite-element body: the system K u = f of the free dofs.

use std::sync::Arc;

use super::assembly::{ElementContext, assemble, n_stiffness_entries};
use super::dof_map::DofMap;
use super::element_materials::{ElementMaterials, node_graph};
use super::element_rules::RuleSet;
use super::foundation::{self, FoundationFace};
use super::generalised_inverse::GeneralisedInverse;
use super::loads::{AppliedLoads, add_body_force, loads};
use super::rigid_body_modes::{self, RigidBodyModes};
use super::spec::{FeSpec, HexFormulation};
use super::thermal::add_thermal_forces;
use crate::error::{Context, Error, Result};
use crate::geometry::{AXIS_NAMES, format_point};
use crate::linalg::memory::MemoryLimit;
use crate::linalg::ordering::NodeGraph;
use crate::linalg::sparse::SymmetricSparse;
use crate::linalg::two_level::NodalUnknowns;
use crate::mesh::Mesh;

/// Bytes per unknown for the mesh, the elements and the assembly, without the matrix. Small bodies need the most bytes
/// per unknown.
const ASSEMBLY_BYTES_PER_DOF: usize = 1500;

/// Bytes per unknown for the mesh and the elements after assembly.
const RESIDENT_BYTES_PER_DOF: usize = 350;

fn assembly_bytes(n_free: usize, n_stored: usize) -> usize {
    ASSEMBLY_BYTES_PER_DOF * n_free + 16 * n_stored
}

/// Assembled finite-element body.
pub struct FeModel {
    name: String,
    mesh: Arc<Mesh>,
    formulation: HexFormulation,
    regions: ElementMaterials,
    rules: RuleSet,
    dof_map: DofMap,
    graph: NodeGraph,
    stiffness: SymmetricSparse,
    loads: AppliedLoads,
    foundations: Vec<FoundationFace>,
    generalised_inverse: Option<GeneralisedInverse>,
}

impl FeModel {
    /// Assembles the body within the default memory limit.
    ///
    /// # Errors
    /// See [`Self::with_memory_limit`].
    pub fn new(spec: FeSpec) -> Result<Self> {
        Self::with_memory_limit(spec, &MemoryLimit::of_machine())
    }

    /// Assembles the body within a memory limit.
    ///
    /// # Errors
    /// If the body does not fit into memory (kind `Resources`), or the run is cancelled. If an element is inverted or has no
    /// material, or if the stiffness of its enhanced strains is not positive definite. If a group is missing, or a value is not
    /// admissible. If supports contradict one another or fix all nodes. If a body of several unconnected parts has free rigid-body
    /// modes; the message names them.
    pub fn with_memory_limit(spec: FeSpec, memory: &MemoryLimit) -> Result<Self> {
        let name = spec.name.clone();
        let build = || {
            let regions = ElementMaterials::new(&spec)?;
            let dof_map = DofMap::new(&spec, &regions)?;
            let mesh = &spec.mesh;
            let graph = node_graph(mesh, &regions.cells);
            let bytes = assembly_bytes(dof_map.n_free(), n_stiffness_entries(&dof_map, &graph));
            let what = format!("assembling {} unknowns", dof_map.n_free());
            memory.ensure_available(bytes as u128, &what, "use a coarser mesh")?;
            let free = rigid_body_modes::rigid_body_modes_of_dofs(&spec, &dof_map, &graph)?;
            let rules = RuleSet::new();
            let elements =
                ElementContext { mesh, regions: &regions, rules: &rules, formulation: spec.formulation };
            let mut loads = loads(&spec, &regions, &rules)?;
            add_thermal_forces(elements, spec.temperature_change, &mut loads.forces)?;
            let foundations = foundation::foundation_faces(&spec)?;
            let mut stiffness;
            (stiffness, loads.prescribed_dof_forces) = assemble(elements, &foundations, &dof_map, &graph)?;
            loads.prescribed = dof_map.prescribed_displacements().to_vec();
            let mut generalised_inverse = None;
            if let Some(motions) = free {
                let volumes = node_volumes(&spec, &regions, &rules);
                let floating = GeneralisedInverse::new(motions, &mesh.points, &volumes, &dof_map)?;
                floating.add_grounding_springs(&mut stiffness);
                generalised_inverse = Some(floating);
            }
            let FeSpec { name, mesh, formulation, .. } = spec;
            Ok(Self {
                name,
                mesh,
                formulation,
                regions,
                rules,
                dof_map,
                graph,
                stiffness,
                loads,
                foundations,
                generalised_inverse,
            })
        };
        build().context(|| name)
    }

    /// Name of the body in messages.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Mesh of the body.
    pub fn mesh(&self) -> &Arc<Mesh> {
        &self.mesh
    }

    /// Elements of the body with their materials and material axes.
    pub fn regions(&self) -> &ElementMaterials {
        &self.regions
    }

    /// Number of free dofs.
    pub fn n_free(&self) -> usize {
        self.dof_map.n_free()
    }

    /// Row of a displacement component in the system of the free dofs; `None` if the component is prescribed or the node belongs to
    /// no solid.
    pub fn free_dof(&self, node: usize, component: usize) -> Option<usize> {
        self.dof_map.row(3 * node + component)
    }

    /// Prescribed displacement of a component, mm; `None` if the component is free or the node belongs to no solid.
    pub fn prescribed_displacement(&self, node: usize, component: usize) -> Option<f64> {
        self.dof_map.prescribed(3 * node + component)
    }

    /// Rigid-body modes that supports and foundations leave free, with mean square displacement 1 each; `None` if there are none.
    pub fn rigid_body_modes(&self) -> Option<&RigidBodyModes> {
        self.generalised_inverse.as_ref().map(|floating| &floating.modes)
    }

    /// Work of `loads` for unit amplitude of each free rigid-body mode, N mm per mm of amplitude.
    pub fn work_on_rigid_body_modes(&self, loads: &AppliedLoads) -> Vec<f64> {
        let floating = self.generalised_inverse.as_ref();
        floating.map_or(Vec::new(), |floating| floating.work(&self.load_vector(loads)))
    }

    /// Stiffness K of the free dofs, `[n_free, n_free]`, N/mm, including elastic foundations. For m free rigid-body modes, K
    /// includes grounding springs at m dofs. The springs carry no force under loads in equilibrium.
    pub fn stiffness(&self) -> &SymmetricSparse {
        &self.stiffness
    }

    /// All loads and prescribed displacements.
    pub fn loads(&self) -> &AppliedLoads {
        &self.loads
    }

    /// Loads and prescribed displacements of `spec`, which must have the same mesh and the same supports as the body.
    ///
    /// # Errors
    /// If a group is missing, a value is not admissible, or supports contradict one another. If memory does not suffice.
    pub fn loads_of(&self, spec: &FeSpec) -> Result<AppliedLoads> {
        let mut loads = loads(spec, &self.regions, &self.rules)?;
        add_thermal_forces(self.elements(), spec.temperature_change, &mut loads.forces)?;
        loads.prescribed = DofMap::new(spec, &self.regions)?.prescribed_displacements().to_vec();
        let dofs = self.prescribed_dofs();
        let displacement: Vec<f64> = dofs.iter().map(|&dof| loads.prescribed[dof]).collect();
        loads.prescribed_dof_forces = vec![0.0; self.n_free()];
        if displacement.iter().any(|u| *u != 0.0) {
            let forces = self.forces_of_prescribed_displacements(&dofs, &displacement)?.on_free_dofs;
            loads.prescribed_dof_forces = forces.into_iter().map(|force| -force).collect();
        }
        Ok(loads)
    }

    /// Right-hand side of the free dofs due to `loads`, `[n_free]`, N: loads, minus the forces K_fc ū of the prescribed
    /// displacements ū.
    pub fn load_vector(&self, loads: &AppliedLoads) -> Vec<f64> {
        let rows = self.dof_map.dofs_of_rows().iter().zip(&loads.prescribed_dof_forces);
        rows.map(|(&dof, supports)| loads.forces[dof / 3][dof % 3] + supports).collect()
    }

    /// Whether loads other than contact forces act on free dofs, or prescribed displacements are nonzero.
    pub fn has_own_loads(&self) -> bool {
        self.load_vector(&self.loads).iter().any(|&f| f != 0.0)
            || self.prescribed_dofs().iter().any(|&dof| self.loads.prescribed[dof] != 0.0)
    }

    /// Adds the body force `force`, a force per volume that depends on the position, N/mm3.
    pub fn add_body_force(&mut self, force: impl Fn([f64; 3]) -> [f64; 3]) {
        add_body_force(&self.mesh, &self.regions.cells, &self.rules, force, &mut self.loads.forces);
    }

    /// Displacement of all mesh nodes, mm, `[n_points]`, from the displacement of the free dofs, `[n_free]`, and the prescribed
    /// displacements of `loads`.
    pub fn expand(&self, free: &[f64], loads: &AppliedLoads) -> Vec<[f64; 3]> {
        let value = |dof: usize| self.dof_map.row(dof).map_or(loads.prescribed[dof], |row| free[row]);
        let at = |node: usize| [value(3 * node), value(3 * node + 1), value(3 * node + 2)];
        (0..self.mesh.n_points()).map(at).collect()
    }

    /// Peak memory of the assembly, bytes.
    pub fn assembly_bytes(&self) -> usize {
        assembly_bytes(self.n_free(), self.stiffness.n_stored())
    }

    /// Memory of the assembled body, bytes.
    pub fn resident_bytes(&self) -> usize {
        RESIDENT_BYTES_PER_DOF * self.n_free() + 16 * self.stiffness.n_stored()
    }

    /// Number of nodes of the solids.
    pub fn n_nodes(&self) -> usize {
        self.dof_map.solid_nodes.len()
    }

    /// Rows of the free dofs of `contact_nodes`.
    pub fn contact_rows(&self, contact_nodes: &[usize]) -> Vec<usize> {
        let dofs = contact_nodes.iter().flat_map(|&node| 3 * node..3 * node + 3);
        dofs.filter_map(|dof| self.dof_map.row(dof)).collect()
    }

    pub(super) fn check_contact_nodes(&self, contact_nodes: &[usize]) -> Result<()> {
        let mut seen = vec![false; self.mesh.n_points()];
        for &node in contact_nodes {
            if !self.dof_map.is_solid_node.get(node).copied().unwrap_or(false) {
                return Err(Error::input(format!("the contact node {node} belongs to no solid element")));
            }
            if std::mem::replace(&mut seen[node], true) {
                return Err(Error::input(format!("the contact node {node} is given twice")));
            }
        }
        Ok(())
    }

    /// Node and component of each row of the system; nodes are indices into the returned `points`.
    pub fn unknowns(&self) -> NodalUnknowns {
        let mut place = vec![usize::MAX; self.mesh.n_points()];
        let mut points = Vec::new();
        let of_row = self.dof_map.dofs_of_rows().iter().map(|&dof| {
            let node = &mut place[dof / 3];
            if *node == usize::MAX {
                *node = points.len();
                points.push(self.mesh.points[dof / 3]);
            }
            (*node, dof % 3)
        });
        let of_row = of_row.collect();
        NodalUnknowns { of_row, points }
    }

    pub(super) fn describe_row(&self, row: usize) -> String {
        let dof = self.dof_map.dofs_of_rows()[row];
        format!("the node at {}, direction {}", format_point(&self.mesh.points[dof / 3]), AXIS_NAMES[dof % 3])
    }

    pub(super) fn foundations(&self) -> &[FoundationFace] {
        &self.foundations
    }

    pub(super) fn generalised_inverse(&self) -> Option<&GeneralisedInverse> {
        self.generalised_inverse.as_ref()
    }

    pub(super) fn graph(&self) -> &NodeGraph {
        &self.graph
    }

    pub(super) fn dof_map(&self) -> &DofMap {
        &self.dof_map
    }

    pub(super) fn elements(&self) -> ElementContext<'_> {
        ElementContext {
            mesh: &self.mesh,
            regions: &self.regions,
            rules: &self.rules,
            formulation: self.formulation,
        }
    }
}

/// Volume of each node, ∫ N_a dV, mm3, `[n_points]`.
fn node_volumes(spec: &FeSpec, regions: &ElementMaterials, rules: &RuleSet) -> Vec<f64> {
    let mut volumes = vec![[0.0; 3]; spec.mesh.n_points()];
    add_body_force(&spec.mesh, &regions.cells, rules, |_| [1.0, 0.0, 0.0], &mut volumes);
    volumes.iter().map(|volume| volume[0]).collect()
}
