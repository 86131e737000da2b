//! A finite-element body ready to be solved: K u = f of its free dofs.

use std::sync::Arc;

use nalgebra::Vector3;

use super::analysis::SymbolicAnalysis;
use super::assembly::{ElementContext, assemble, n_stiffness_entries};
use super::condensation_method::CondensationMethod;
use super::condensed::{CondensationResources, CondensedBody};
use super::dof_map::DofMap;
use super::element_materials::{ElementMaterials, node_graph};
use super::element_rules::RuleSet;
use super::flexibility_cache::{CacheKey, FlexibilityCache};
use super::foundation::{self, FoundationFace};
use super::generalised_inverse::GeneralisedInverse;
use super::loads::{FaceLoad, LoadedFace, NodalForces, add_body_force, loads};
use super::rigid_body_modes::{self, RigidBodyModes};
use super::spec::{FeSpec, HexFormulation};
use crate::error::{Context, Error, Result};
use crate::geometry::{AXIS_NAMES, format_point};
use crate::linalg::memory::MemoryLimit;
use crate::linalg::ordering::{NodeGraph, nested_dissection};
use crate::linalg::sparse::SymmetricSparse;
use crate::linalg::two_level::NodalUnknowns;
use crate::mesh::{CellRef, Mesh};

/// Bytes per unknown of mesh, elements and the assembly of the matrix beside the matrix itself: 290 to 500 were measured on
/// bodies of 50 000 unknowns, up to 1360 on small ones (first order and second, tetrahedra and hexahedra).
const ASSEMBLY_BYTES_PER_DOF: usize = 1500;

/// Bytes per unknown of mesh and elements once the matrix is there.
const RESIDENT_BYTES_PER_DOF: usize = 350;

/// Bytes of an assembled body of `n_free` unknowns and of its making.
fn assembly_bytes(n_free: usize, n_stored: usize) -> usize {
    ASSEMBLY_BYTES_PER_DOF * n_free + 16 * n_stored
}

/// An assembled finite-element body.
pub struct FeModel {
    name: String,
    mesh: Arc<Mesh>,
    formulation: HexFormulation,
    regions: ElementMaterials,
    rules: RuleSet,
    dof_map: DofMap,
    graph: NodeGraph,
    stiffness: SymmetricSparse,
    prescribed_dof_forces: Vec<f64>,
    external_forces: NodalForces,
    body_force: [f64; 3],
    loaded_faces: Vec<LoadedFace>,
    foundations: Vec<FoundationFace>,
    generalised_inverse: Option<GeneralisedInverse>,
}

impl FeModel {
    /// Assembles the body, within the memory that the machine has now.
    ///
    /// # Errors
    /// See [`Self::with_memory_limit`].
    pub fn new(spec: FeSpec) -> Result<Self> {
        Self::with_memory_limit(spec, &MemoryLimit::of_machine())
    }

    /// Assembles the body within a memory limit.
    ///
    /// # Errors
    /// If it does not fit (kind `Resources`); if an element is inverted or has no material, a group is missing, supports contradict one another, or leave rigid
    /// motions of one of several parts free (which are
    /// named).
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
            let mut loads = loads(&spec, &regions, &rules)?;
            let elements =
                ElementContext { mesh, regions: &regions, rules: &rules, formulation: spec.formulation };
            let foundations = foundation::foundation_faces(&spec)?;
            loads.faces.extend(foundations.iter().map(|foundation| foundation.face));
            let (mut stiffness, prescribed_dof_forces) =
                assemble(elements, &foundations, (&dof_map, &graph))?;
            let mut generalised_inverse = None;
            if let Some(motions) = free {
                let volumes = node_volumes(&spec, &regions, &rules);
                let floating = GeneralisedInverse::new(motions, &mesh.points, &volumes, &dof_map)?;
                floating.add_grounding_springs(&mut stiffness);
                generalised_inverse = Some(floating);
            }
            let FeSpec { name, mesh, formulation, body_force, .. } = spec;
            Ok(Self {
                name,
                mesh,
                formulation,
                regions,
                rules,
                dof_map,
                graph,
                stiffness,
                prescribed_dof_forces,
                external_forces: loads.forces,
                body_force,
                loaded_faces: loads.faces,
                foundations,
                generalised_inverse,
            })
        };
        build().context(|| name)
    }

    /// What messages call it.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Its mesh.
    pub fn mesh(&self) -> &Arc<Mesh> {
        &self.mesh
    }

    /// Its elements with their materials and material axes.
    pub fn regions(&self) -> &ElementMaterials {
        &self.regions
    }

    /// Number of free dofs.
    pub fn n_free(&self) -> usize {
        self.dof_map.n_free()
    }

    /// Row of a displacement component of a node in the system of the free dofs; `None` if it is prescribed, or the
    /// node belongs to no solid.
    pub fn free_dof(&self, node: usize, component: usize) -> Option<usize> {
        self.dof_map.row(3 * node + component)
    }

    /// Prescribed displacement of a component of a node, mm; `None` if it is free.
    pub fn prescribed_displacement(&self, node: usize, component: usize) -> Option<f64> {
        self.dof_map.prescribed(3 * node + component)
    }

    /// The rigid motions that the supports leave free, mean square displacement 1 each; `None` if the body is held.
    pub fn rigid_body_modes(&self) -> Option<&RigidBodyModes> {
        self.generalised_inverse.as_ref().map(|floating| &floating.modes)
    }

    /// Work of the body's own loads on each of its free motions, N mm / mm.
    pub fn load_work_on_rigid_body_modes(&self) -> Vec<f64> {
        self.generalised_inverse.as_ref().map_or(Vec::new(), |floating| floating.work(&self.load_vector()))
    }

    /// K of the free dofs, `[n_free, n_free]`, N/mm, elastic foundations included; of a body that floats with springs to the ground at as many dofs as
    /// it has free motions, which carry nothing under forces in equilibrium.
    pub fn stiffness(&self) -> &SymmetricSparse {
        &self.stiffness
    }

    /// Right-hand side of the free dofs, `[n_free]`, N: loads, and -K_fc ū of prescribed displacements.
    pub fn load_vector(&self) -> Vec<f64> {
        let rows = self.dof_map.dofs_of_rows().iter().zip(&self.prescribed_dof_forces);
        rows.map(|(&dof, supports)| self.external_forces[dof / 3][dof % 3] + supports).collect()
    }

    /// Whether loads or prescribed displacements act on the body by themselves.
    pub fn has_own_loads(&self) -> bool {
        self.load_vector().iter().any(|&f| f != 0.0)
            || self.prescribed_dofs().iter().any(|&dof| self.dof_map.prescribed(dof) != Some(0.0))
    }

    /// Nodal forces of pressure, tractions and body forces, global axes, N, `[n_points]`.
    pub fn external_forces(&self) -> &[[f64; 3]] {
        &self.external_forces
    }

    /// Its uniform force per volume, global axes, N/mm3.
    pub fn body_force(&self) -> [f64; 3] {
        self.body_force
    }

    /// Loads on its faces: the solid, the index among its faces, pressure (MPa), traction (global axes, MPa); a face with several loads stands
    /// there for each.
    pub fn face_loads(&self) -> impl Iterator<Item = ((CellRef, usize), f64, Vector3<f64>)> + '_ {
        self.loaded_faces.iter().filter_map(|face| {
            let at = (face.owner, face.local_face);
            match face.load {
                FaceLoad::Pressure(pressure) => Some((at, pressure, Vector3::zeros())),
                FaceLoad::Traction(traction) => Some((at, 0.0, traction)),
                FaceLoad::Foundation(_) => None,
            }
        })
    }

    /// Adds a force per volume that varies in space, N/mm3.
    pub fn add_body_force(&mut self, force: impl Fn([f64; 3]) -> [f64; 3]) {
        add_body_force(&self.mesh, &self.regions.cells, &self.rules, force, &mut self.external_forces);
    }

    /// Displacement of all mesh nodes, mm, `[n_points]`, from that of the free dofs, `[n_free]`.
    pub fn expand(&self, free: &[f64]) -> Vec<[f64; 3]> {
        self.dof_map.expand(free)
    }

    /// Orders the unknowns, those of `contact_nodes` last, and finds the structure of the factor: what it will cost.
    ///
    /// # Errors
    /// If a contact node is given twice or is on no solid; if memory does not suffice.
    pub fn analyse(&self, contact_nodes: &[usize]) -> Result<SymbolicAnalysis> {
        self.check_contact_nodes(contact_nodes).context(|| self.name.clone())?;
        let order = nested_dissection(&self.graph, &self.dof_map.solid_nodes, contact_nodes)
            .context(|| self.name.clone())?
            .into_iter()
            .flat_map(|node| (3 * node..3 * node + 3).filter_map(|dof| self.dof_map.row(dof)))
            .collect();
        SymbolicAnalysis::new(self, contact_nodes, order).context(|| self.name.clone())
    }

    /// Factorises K and forms the flexibility of `contact_nodes` (mesh node indices).
    ///
    /// # Errors
    /// See [`Self::analyse`]; further if K is singular, the factorisation fails its check, or does not fit into the
    /// memory that the machine has.
    pub fn condense(self, contact_nodes: &[usize]) -> Result<CondensedBody> {
        self.condense_with(contact_nodes, &CondensationResources::default())
    }

    /// As [`Self::condense`], within a memory limit, and with the flexibility from a cache where it has it; else it is
    /// put there.
    ///
    /// # Errors
    /// See [`Self::condense`]. A cache that cannot be written is no error: [`CondensedBody::origin`] says so.
    pub fn condense_with(
        self,
        contact_nodes: &[usize],
        resources: &CondensationResources,
    ) -> Result<CondensedBody> {
        self.check_contact_nodes(contact_nodes).context(|| self.name.clone())?;
        let CondensationResources { cache, cache_contents, memory } = *resources;
        let name = self.name.clone();
        match cache {
            Some(cache) => CondensedBody::cached(self, contact_nodes, cache, (memory, cache_contents)),
            None => {
                let analysis = self.analyse(contact_nodes)?;
                CondensedBody::new(self, analysis, memory)
            }
        }
        .context(|| name)
    }

    /// Bytes that the body takes while it is assembled: mesh, elements, matrix and its making.
    pub fn assembly_bytes(&self) -> usize {
        assembly_bytes(self.n_free(), self.stiffness.n_stored())
    }

    /// Bytes that the assembled body keeps: mesh, elements, matrix.
    pub fn resident_bytes(&self) -> usize {
        RESIDENT_BYTES_PER_DOF * self.n_free() + 16 * self.stiffness.n_stored()
    }

    /// The key of the flexibility of `contact_nodes` by `method` in a cache.
    pub fn cache_key(&self, contact_nodes: &[usize], method: CondensationMethod) -> CacheKey {
        CacheKey::new(&self.stiffness, &self.contact_rows(contact_nodes), method.name())
    }

    /// The entry that a cache has of the flexibility of `contact_nodes` by `method`, judged by its head and size: the
    /// bytes that a factorisation takes.
    pub fn cached_factorisation_bytes(
        &self,
        contact_nodes: &[usize],
        method: CondensationMethod,
        cache: &FlexibilityCache,
    ) -> Option<usize> {
        cache.peek_factorisation_bytes(
            &self.cache_key(contact_nodes, method),
            self.contact_rows(contact_nodes).len(),
        )
    }

    /// Whether a cache has the factor that fields are recovered with.
    pub fn has_cached_factor(&self, contact_nodes: &[usize], cache: &FlexibilityCache) -> bool {
        cache.has_factor(&self.cache_key(contact_nodes, CondensationMethod::Factorisation))
    }

    /// Number of nodes of its solids.
    pub fn n_nodes(&self) -> usize {
        self.dof_map.solid_nodes.len()
    }

    /// Rows of the free dofs of `contact_nodes`.
    pub fn contact_rows(&self, contact_nodes: &[usize]) -> Vec<usize> {
        let dofs = contact_nodes.iter().flat_map(|&node| 3 * node..3 * node + 3);
        dofs.filter_map(|dof| self.dof_map.row(dof)).collect()
    }

    fn check_contact_nodes(&self, contact_nodes: &[usize]) -> Result<()> {
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

    /// Nodes and components of the rows of the system.
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

    /// What a row of the system is, for messages.
    pub(super) fn describe_row(&self, row: usize) -> String {
        let dof = self.dof_map.dofs_of_rows()[row];
        format!("the node at {}, direction {}", format_point(&self.mesh.points[dof / 3]), AXIS_NAMES[dof % 3])
    }

    /// The faces that loads and foundations act on; one with several stands there for each.
    pub(super) fn loaded_faces(&self) -> &[LoadedFace] {
        &self.loaded_faces
    }

    /// The stiffness of the faces that stand on foundations.
    pub(super) fn foundations(&self) -> &[FoundationFace] {
        &self.foundations
    }

    pub(super) fn generalised_inverse(&self) -> Option<&GeneralisedInverse> {
        self.generalised_inverse.as_ref()
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
