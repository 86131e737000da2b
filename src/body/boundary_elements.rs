//! Finite bodies of boundary elements, condensed to the nodes under the frame.
//!
//! The displacement u = S_bb t of the nodes b under the frame by tractions there follows from the collocation equations. The frame's
//! tractions reach the nodes as those whose polynomials do the same work, t = M⁻¹ Iᵀ A t_frame with the areas M of the nodes, so that
//! S = I F Iᵀ A as of finite elements, F = S_bb M⁻¹. By Betti's theorem F is symmetric; collocation leaves it so only in the limit. It is made
//! so in a way that keeps the response to uniform tractions (`smooth.rs`).

use std::collections::HashMap;
use std::sync::Arc;

use faer::Par;

use super::condensed::CondensedFlexibility;
use super::floating::{Floating, FloatingMotion};
use super::smooth::Smooth;
use super::{BodyEquations, BodyField, ElasticBody};
use crate::bem::finite::{
    BoundaryElements, Domain, Interpolation, Panel, Problem, Solution, SurfaceState, Weight,
};
use crate::bem::full_space::FullSpaceField;
use crate::bem::half_space::CrossBlocks;
use crate::error::{Context, Error, Result};
use crate::fem::{FreeMotions, Support};
use crate::frame::{ContactFrame, FaceMap, MeshedSurface, Side};
use crate::geometry::{Point, place};
use crate::linalg::cache::Cache;
use crate::linalg::memory::MemoryLimit;
use crate::linalg::operator::Flexibility;
use crate::material::Stiffness;
use crate::mesh::faces::{SurfaceFace, group_faces, outer_faces};
use crate::mesh::surface::crossing;
use crate::mesh::{CellRef, Mesh};

/// Accuracy of the integrals, over the largest values: far below what elements leave.
const ACCURACY: f64 = 1e-6;

/// Share of a function in the mean over a cell that is rounding.
const NO_PART: f64 = 1e-9;

/// Names of the displacement components.
const AXES: [&str; 3] = ["x", "y", "z"];

/// Elements in the order of the mesh's outer faces, the number of each by its face, the error of the kernels, and what the user should know of
/// the cache.
type Numbered = (BoundaryElements, HashMap<CellRef, usize>, (f64, Option<String>));

/// A body of boundary elements.
#[derive(Debug, Clone)]
pub struct BeSpec {
    /// What messages call it ("body1").
    pub name: String,
    /// Its surface: closed, normals outward, without solids ([`crate::mesh::surface`]).
    pub mesh: Arc<Mesh>,
    /// Its material, global axes.
    pub stiffness: Stiffness,
    /// How displacement and traction vary over an element.
    pub interpolation: Interpolation,
    /// Supports and prescribed displacements, groups of surfaces.
    pub supports: Vec<Support>,
    /// Pressure on surface groups, MPa, positive into the body.
    pub pressures: Vec<(String, f64)>,
    /// Tractions on surface groups, global axes, MPa.
    pub tractions: Vec<(String, [f64; 3])>,
    /// Force per volume, global axes, N/mm3.
    pub body_force: [f64; 3],
}

/// How a body lies under a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UnderFrame {
    /// Nodes of elements there.
    pub n_nodes: usize,
    /// Whether no cell lies over two elements.
    pub aligned: bool,
    /// The element whose nodes lie farthest apart beside the thickness of the body behind it: its number among the outer faces, and distance over
    /// thickness.
    pub thin: Option<(usize, f64)>,
}

/// What is known of a body at its nodes.
struct Known {
    /// By dof.
    held: Vec<bool>,
    /// Displacement of what is held, traction of the rest.
    values: Vec<f64>,
    /// Of the force per volume: known everywhere, and taken off the values.
    weight: Option<Weight>,
}

impl Known {
    /// The mean displacement along free motions that takes that of the weight's share off.
    fn counter_mean(&self, free: &FreeMotions, elements: &BoundaryElements) -> Vec<f64> {
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
        (0..free.n()).map(along).collect()
    }
}

/// A boundary-element body tied to a frame through the faces of one physical group.
pub struct BeBody {
    side: Side,
    mesh: Arc<Mesh>,
    faces: Vec<SurfaceFace>,
    elements: BoundaryElements,
    /// Of its force per volume.
    weight: Option<Weight>,
    map: FaceMap,
    solution: Solution,
    /// Areas of the nodes of the map.
    areas: Vec<f64>,
    flexibility: Option<CondensedFlexibility>,
    heights: Vec<f64>,
    free_gap: Option<Vec<f64>>,
    floating: Option<Floating>,
    asymmetry: f64,
    kernel_error: f64,
    note: Option<String>,
}

impl BeSpec {
    fn faces(&self, group: &str) -> Result<Vec<SurfaceFace>> {
        group_faces(&self.mesh, group)
    }

    /// Its elements.
    fn elements(&self, cache: Option<&Cache>) -> Result<Numbered> {
        let outer = outer_faces(&self.mesh);
        let at = |&node: &usize| Point::from(self.mesh.points[node]);
        let panel =
            |face: &SurfaceFace| Panel { kind: face.kind, nodes: face.nodes.iter().map(at).collect() };
        let (field, note) = FullSpaceField::cached(&self.stiffness, cache)?;
        let error = field.error();
        let panels = outer.iter().map(panel).collect();
        let material = (&self.stiffness, field);
        let elements = BoundaryElements::new(panels, self.interpolation, material, ACCURACY);
        let number = outer.iter().enumerate().map(|(i, face)| (face.owner, i)).collect();
        Ok((elements, number, (error, note)))
    }

    /// What is known at the nodes.
    fn known(&self, elements: &BoundaryElements, number: &HashMap<CellRef, usize>) -> Result<Known> {
        let (positions, normals) = (elements.positions(), elements.normals());
        let mut held = vec![None; 3 * positions.len()];
        let nodes_of = |faces: Vec<SurfaceFace>| -> Vec<usize> {
            faces.iter().flat_map(|face| elements.nodes_of(number[&face.owner])).collect()
        };
        for support in &self.supports {
            for node in nodes_of(self.faces(&support.group)?) {
                for c in (0..3).filter(|&c| support.components[c]) {
                    let far = Point::from(support.gradient[c]).dot(&positions[node]);
                    let value = support.value[c] + far;
                    let before = held[3 * node + c].replace(value);
                    if before.is_some_and(|before| before != value) {
                        return Err(Error::input(format!(
                            "the group \"{}\" prescribes another displacement along {} than a group before it, at {}: name \
                             each face in one of them",
                            support.group,
                            AXES[c],
                            place(&positions[node].into())
                        )));
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
        let weight = (force != Point::zeros()).then(|| {
            let middle = positions.iter().sum::<Point>() / positions.len().max(1) as f64;
            Weight::new(&self.stiffness, &force, middle)
        });
        let value = |dof: usize, held: &Option<f64>| {
            let (node, c) = (dof / 3, dof % 3);
            let x = &positions[node];
            let of_weight = |weight: &Weight| match held {
                Some(_) => weight.displacement(x)[c],
                None => (weight.stress(x) * normals[node])[c],
            };
            held.unwrap_or(tractions[node][c]) - weight.as_ref().map_or(0.0, of_weight)
        };
        let values = held.iter().enumerate().map(|(dof, held)| value(dof, held)).collect();
        Ok(Known { held: held.iter().map(Option::is_some).collect(), values, weight })
    }

    /// The rigid motions that the supports leave free; `None` if the body is held.
    ///
    /// # Errors
    /// If a group is missing, or supports contradict one another.
    pub fn free_motions(&self) -> Result<Option<FreeMotions>> {
        // Motions do not depend on the material.
        let plain = self.plain()?;
        let (elements, number, _) = plain.elements(None)?;
        elements.free_motions(&plain.known(&elements, &number)?.held)
    }

    /// Number of nodes of all elements.
    pub fn n_nodes(&self) -> usize {
        let of_face = |face: &SurfaceFace| self.interpolation.n_nodes(face.kind.n_corners() == 3);
        outer_faces(&self.mesh).iter().map(of_face).sum()
    }

    /// How it lies under a frame, after all that [`BeBody::new`] checks before it integrates anything.
    ///
    /// # Errors
    /// As [`BeBody::new`], memory excepted.
    pub fn check(&self, contact: &str, side: Side, frame: &ContactFrame) -> Result<UnderFrame> {
        let faces = self.faces(contact)?;
        refuse_crossing(&self.mesh, &faces, contact)?;
        let plain = self.plain()?;
        let (elements, number, _) = plain.elements(None)?;
        let map = map(&plain, (&elements, &number), (frame, side), &faces)?;
        refuse_held(&map, &plain.known(&elements, &number)?, &elements)?;
        let element: Vec<usize> =
            (0..elements.n_elements()).flat_map(|i| elements.nodes_of(i).map(move |_| i)).collect();
        let of_cell = |cell: usize| {
            let mut own = map
                .row(cell)
                .filter(|(_, weight)| weight.abs() > NO_PART)
                .map(|(node, _)| element[map.nodes()[node]]);
            let first = own.next();
            own.all(|other| Some(other) == first)
        };
        let aligned = (0..map.n_cells()).all(of_cell);
        Ok(UnderFrame { n_nodes: map.nodes().len(), aligned, thin: elements.thinnest() })
    }

    /// The same of a material that needs no table.
    fn plain(&self) -> Result<Self> {
        Ok(Self { stiffness: Stiffness::isotropic(1.0, 0.0)?, ..self.clone() })
    }

    /// Bytes that a body with so many nodes under the frame takes while it is made.
    pub fn bytes(&self, n_loaded: usize) -> u128 {
        Problem::bytes(self.n_nodes(), n_loaded) + 9 * 8 * (n_loaded as u128).pow(2)
    }
}

/// The map from the nodes of the contact faces to the cells.
fn map(
    spec: &BeSpec,
    (elements, number): (&BoundaryElements, &HashMap<CellRef, usize>),
    (frame, side): (&ContactFrame, Side),
    faces: &[SurfaceFace],
) -> Result<FaceMap> {
    // Elements of higher order than their faces have points of their own.
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
        let values = elements.places_of(element).values(faces[face].kind.face_places()[local]);
        elements.nodes_of(element).zip(values).collect()
    };
    FaceMap::of_functions(frame, &mesh, (side, &faces), values)
}

impl BeBody {
    /// What makes it smaller.
    pub const MEND: &'static str =
        "take larger elements away from the contact, or elements of lower order (`element`)";

    /// Solves the body for unit tractions at all nodes under the frame, within the memory that is left for it.
    ///
    /// # Errors
    /// If a group or the frame do not fit, faces of the contact group cross, supports contradict one another or hold faces under the
    /// frame, or memory does not suffice.
    pub fn new(
        spec: &BeSpec,
        (contact, side): (&str, Side),
        frame: &ContactFrame,
        (cache, memory): (Option<&Cache>, &MemoryLimit),
    ) -> Result<Self> {
        Self::build(spec, (contact, side), frame, (cache, memory)).context(|| spec.name.clone())
    }

    fn build(
        spec: &BeSpec,
        (contact, side): (&str, Side),
        frame: &ContactFrame,
        (cache, memory): (Option<&Cache>, &MemoryLimit),
    ) -> Result<Self> {
        let faces = spec.faces(contact)?;
        refuse_crossing(&spec.mesh, &faces, contact)?;
        let (elements, number, (kernel_error, note)) = spec.elements(cache)?;
        let map = map(spec, (&elements, &number), (frame, side), &faces)?;
        let known = spec.known(&elements, &number)?;
        refuse_held(&map, &known, &elements)?;
        let what = format!("a boundary-element body of {} unknowns", 3 * elements.n_nodes());
        memory.ensure(spec.bytes(map.nodes().len()), &what, Self::MEND)?;
        let free = elements.free_motions(&known.held)?;
        let mean = free.as_ref().map_or_else(Vec::new, |free| known.counter_mean(free, &elements));
        let problem = Problem {
            elements: &elements,
            domain: Domain::Inside,
            held: &known.held,
            known: &known.values,
            loaded: map.nodes(),
            free: free.as_ref(),
            mean: &mean,
        };
        let solution = problem.solve(Par::rayon(0))?;
        let all = elements.areas();
        let areas: Vec<f64> = map.nodes().iter().map(|&node| all[node]).collect();
        let nodal = |i: usize, j: usize| solution.response(3 * map.nodes()[i / 3] + i % 3, j) / areas[j / 3];
        let smooth = Smooth::new(&map, frame, &areas, nodal);
        let asymmetry = smooth.asymmetry();
        refuse_negative(3 * areas.len(), &nodal)?;
        let symmetric = |i: usize, j: usize| 0.5 * (nodal(i, j) + nodal(j, i)) + smooth.correction(i, j);
        let flexibility = CondensedFlexibility::new(map.clone(), symmetric)?;
        let heights = FaceMap::new(frame, &spec.mesh, &faces, side)?.heights(frame, &spec.mesh);
        let mut body = Self {
            side,
            mesh: spec.mesh.clone(),
            faces,
            weight: known.weight.clone(),
            map,
            solution,
            areas,
            flexibility: Some(flexibility),
            heights,
            free_gap: None,
            floating: None,
            asymmetry,
            kernel_error,
            note,
            elements,
        };
        let at_rest = known.values.iter().all(|value| *value == 0.0) && known.weight.is_none();
        body.free_gap = (!at_rest).then(|| body.own_gap());
        body.floating = free.map(|free| body.floating_by(&free, &known, frame));
        Ok(body)
    }

    /// Gap change of displacements of the nodes.
    fn gap(&self, displacement: impl Fn(usize) -> Point) -> Vec<f64> {
        let nodal: Vec<f64> =
            self.map.nodes().iter().flat_map(|&node| <[f64; 3]>::from(displacement(node))).collect();
        let mut gap = vec![0.0; 3 * self.map.n_cells()];
        self.map.apply(&nodal, &mut gap);
        gap.iter_mut().for_each(|g| *g *= self.side.gap_sign());
        gap
    }

    /// Share of the body's own deformation in the gap.
    fn own_gap(&self) -> Vec<f64> {
        let state = self.solution.state(1.0, &vec![0.0; 3 * self.areas.len()]);
        let positions = self.elements.positions();
        let of_weight =
            |node: usize| self.weight.as_ref().map_or(Point::zeros(), |w| w.displacement(&positions[node]));
        self.gap(|node| Point::from(state.displacement[node]) + of_weight(node))
    }

    /// The free motions as the frame sees them.
    fn floating_by(&self, free: &FreeMotions, known: &Known, frame: &ContactFrame) -> Floating {
        let sign = self.side.gap_sign();
        let (positions, areas) = (self.elements.positions(), self.elements.areas());
        let motion = |j: usize| {
            let [shift, turn] =
                free.about(&frame.origin, j).map(|global| frame.axes.to_local(&global) * sign);
            let work = |(dof, value): (usize, &f64)| {
                value * free.displacement(&positions[dof / 3], j)[dof % 3] * areas[dof / 3]
            };
            let loads = known.values.iter().enumerate().filter(|(dof, _)| !known.held[*dof]);
            FloatingMotion {
                relative: [shift.x, shift.y, shift.z, turn.x, turn.y, turn.z],
                gap: self.gap(|node| free.displacement(&positions[node], j)),
                load: loads.map(work).sum(),
            }
        };
        let motions = (0..free.n()).map(motion).collect();
        Floating { side: self.side, motions, names: free.names.clone() }
    }

    /// Number of elements.
    pub fn n_elements(&self) -> usize {
        self.elements.n_elements()
    }

    /// Number of unknowns.
    pub fn n_unknowns(&self) -> usize {
        3 * self.elements.n_nodes()
    }

    /// How displacement and traction vary over an element.
    pub fn interpolation(&self) -> Interpolation {
        self.elements.interpolation()
    }

    /// Norm of the antisymmetric part over that of the whole of the works that constant and linear tractions over the frame do on the
    /// displacements by one another: 0 but for the error of the elements.
    pub fn asymmetry(&self) -> f64 {
        self.asymmetry
    }

    /// Residual of equations computed afresh over the size of their terms.
    pub fn residual(&self) -> f64 {
        self.solution.residual()
    }

    /// Error of the tabulated kernels, over their largest values; 0 for closed forms.
    pub fn kernel_error(&self) -> f64 {
        self.kernel_error
    }

    /// What the user should know of the cache.
    pub fn note(&self) -> Option<&str> {
        self.note.as_deref()
    }

    /// Bytes that it keeps.
    pub fn held_bytes(&self) -> usize {
        self.solution.bytes() + 9 * 4 * self.areas.len().pow(2)
    }

    /// Displacement of the points of the mesh by a state without the weight's share: means over the elements around.
    fn at_points(&self, state: &SurfaceState) -> Vec<[f64; 3]> {
        let mut sums = vec![(Point::zeros(), 0.0); self.mesh.n_points()];
        for (i, face) in outer_faces(&self.mesh).iter().enumerate() {
            let nodes = self.elements.places_of(i);
            for (&point, xi) in face.nodes.iter().zip(face.kind.face_places()) {
                let values = nodes.values(*xi);
                let u: Point = self
                    .elements
                    .nodes_of(i)
                    .zip(values)
                    .map(|(node, n)| Point::from(state.displacement[node]) * n)
                    .sum();
                let weight = self.elements.panel(i).area(*xi).norm();
                sums[point].0 += u * weight;
                sums[point].1 += weight;
            }
        }
        let of_weight =
            |x: &[f64; 3]| self.weight.as_ref().map_or(Point::zeros(), |w| w.displacement(&Point::from(*x)));
        let means = sums.into_iter().zip(&self.mesh.points);
        means.map(|((sum, weight), x)| (sum / weight.max(f64::MIN_POSITIVE) + of_weight(x)).into()).collect()
    }
}

/// Refuses flexibilities that elements far too large have made nonsense of.
fn refuse_negative(n: usize, entry: &impl Fn(usize, usize) -> f64) -> Result<()> {
    if (0..n).all(|i| entry(i, i) > 0.0) {
        return Ok(());
    }
    Err(Error::input(
        "forces on nodes under the frame move them backwards: the elements are far too large beside the thickness of the body, or their \
         surface is damaged; take smaller elements, or quadratic ones (`element`)",
    ))
}

fn refuse_crossing(mesh: &Mesh, faces: &[SurfaceFace], contact: &str) -> Result<()> {
    let Some(pair) = crossing(mesh, faces) else { return Ok(()) };
    let [a, b] = pair.map(|k| faces[k].tag);
    Err(Error::input(format!(
        "the elements {a} and {b} of the group \"{contact}\" of {} cut one another: a contact surface must not cross itself; mend the mesh there",
        mesh.source
    )))
}

fn refuse_held(map: &FaceMap, known: &Known, elements: &BoundaryElements) -> Result<()> {
    let held = |&&node: &&usize| known.held[3 * node..3 * node + 3].contains(&true);
    let Some(&node) = map.nodes().iter().find(held) else { return Ok(()) };
    let count = map.nodes().iter().filter(held).count();
    Err(Error::input(format!(
        "a support holds faces under the contact frame ({count} nodes of them, one at {}): what is held cannot come into contact; hold other faces, or \
         make the frame smaller",
        place(&elements.positions()[node].into())
    )))
}

impl ElasticBody for BeBody {
    fn describe(&self) -> String {
        format!(
            "boundary elements, {} {} ones, {} unknowns, {} contact nodes",
            self.n_elements(),
            self.interpolation().name(),
            self.n_unknowns(),
            self.areas.len()
        )
    }

    fn equations(&self) -> BodyEquations<'_> {
        BodyEquations::BoundaryElements(self)
    }

    fn take_flexibility(&mut self, _cross: CrossBlocks) -> Result<Option<Box<dyn Flexibility>>> {
        match self.flexibility.take() {
            Some(flexibility) => Ok(Some(Box::new(flexibility))),
            None => Err(Error::numerical("the flexibility of a boundary-element body was taken twice")),
        }
    }

    fn free_gap(&self) -> Option<&[f64]> {
        self.free_gap.as_deref()
    }

    fn floating(&self) -> Option<&Floating> {
        self.floating.as_ref()
    }

    fn surface(&self) -> Option<MeshedSurface<'_>> {
        Some(MeshedSurface {
            mesh: &self.mesh,
            faces: &self.faces,
            side: self.side,
            heights: self.heights.clone(),
        })
    }

    /// Displacement at the points of the surface mesh.
    fn recover(&self, tractions: &[f64]) -> Result<BodyField> {
        let mut forces = vec![0.0; 3 * self.areas.len()];
        self.map.apply_transpose(tractions, &mut forces);
        for (dof, force) in forces.iter_mut().enumerate() {
            *force *= self.side.gap_sign() / self.areas[dof / 3];
        }
        let state = self.solution.state(1.0, &forces);
        Ok(BodyField { displacement: self.at_points(&state), stress: None })
    }
}
