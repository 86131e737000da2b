//! Estimates the resources of a run of a plan, and the work that the run omits, without performing the run.
//!
//! Times are operation counts, divided by typical rates or multiplied by typical costs (the constants of this module).

mod time;

use crate::bem::finite::SolutionMethod;
use crate::body::hybrid::{Correction, HalfSpaceFit};
use crate::body::{BeBody, TruncatedSpec};
use crate::coupling::Coupling;
use crate::error::{Context, Warning};
use crate::fem::{CondensationMethod, FeModel, SymbolicAnalysis, flexibility_bytes};
use crate::frame::ContactFrame;
use crate::geometry::Triad;
use crate::linalg::memory::MemoryLimit;
use crate::linalg::two_level::TwoLevelSolver;
use crate::mesh::faces::outer_faces;
use crate::omitted::OmittedWork;
use crate::scene::plan::{BeBodyPlan, BodyPlan, MeshedBodyPlan, Plan, TruncatedHalfSpacePlan};
use crate::simulation::build::candidate_cells::with_active_cells;
use crate::simulation::build::contact_frame::contact_frame;
use crate::simulation::build::memory::{self, frame_bytes, half_space_bytes, is_compressed};
use crate::simulation::build::near_field::NearFieldModel;
use crate::simulation::failure::{AtKey, SceneError};
use crate::simulation::omitted::{
    expected_omitted_work, needs_factor_after_condensation, omitted_factorisation,
};
use crate::simulation::plan_bodies::{BODY_KEYS, SIDES, configured_half_space, face_map};
use crate::simulation::validate::flat_faces::max_curvature_correction;
use crate::simulation::validate::{ValidScene, validate};

/// Floating-point operations per second that factorisations reach on one core.
const FLOPS_PER_SECOND: f64 = 2.8e10;

/// Seconds per unknown for ordering and symbolic analysis.
const PER_UNKNOWN: f64 = 5e-6;

/// Expected number of conjugate gradient iterations for a batch of right-hand sides. The time of an iteration is
/// `PER_ENTRY` seconds per stored matrix entry.
const EXPECTED_CG_ITERATIONS: usize = 40;
const PER_ENTRY: f64 = 1.1e-8;

/// Bytes per second at which cached factors are read and checked.
const READING: f64 = 6e8;

/// Seconds of assembly per unknown.
const ASSEMBLY: f64 = 1e-5;

/// Bytes per second that operator products read from memory. The value is low on purpose.
const MEMORY_BYTES_PER_SECOND: f64 = 6e9;

/// Seconds per point of the zero-padded grid, for one application of a half-space operator.
const FFT_SECONDS_PER_POINT: f64 = 4.0e-8;

/// Seconds to compute the far field, per unknown and column (right-hand side). Each polynomial has three columns, one
/// per direction of the force. `TABLE` is the time to tabulate the field of an anisotropic material, s.
const PER_VALUE: f64 = 1.5e-6;
const TABLE: f64 = 1.0;

/// Cost of each quadrature point in another material than the half-space. `PER_FORCE` is the time per polynomial for an
/// isotropic and an anisotropic half-space, s. `PER_PAIR` is the time per pair of columns, s.
const PER_FORCE: [f64; 2] = [6e-8, 3e-7];
const PER_PAIR: f64 = 5e-10;

/// Seconds for the influence integrals of a pair of node and element, for an isotropic and an anisotropic material.
const INFLUENCE_SECONDS_PER_PAIR: [f64; 2] = [2e-6, 4.5e-6];

/// Scaling of compressed boundary elements with n unknowns: a row [a, b] stands for a (n / 10 000)^b.
///
/// The first row gives the share of the integrals that are computed. The second row gives the number of entries that
/// are kept per matrix row. `PRODUCTS` is the number of operator products for each right-hand side.
const COMPRESSED_BE_SCALING: [[f64; 2]; 2] = [[0.65, -0.57], [3500.0, 0.2]];
const PRODUCTS: f64 = 15.0;

/// Expected content of the cache for a body.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum CacheContent {
    /// The cache lacks data that the body needs.
    #[default]
    Insufficient,
    /// The cache contains the flexibility, and the body needs nothing else.
    Flexibility,
    /// The cache contains the flexibility, and also the factor for loads or fields.
    FlexibilityAndFactor,
}

/// Description, memory and time of one body.
#[derive(Debug, Clone, Default)]
pub struct BodyEstimate {
    /// Type, material and size.
    pub description: String,
    /// Peak memory during construction, bytes.
    pub memory_bytes: f64,
    /// Memory kept after construction, bytes.
    pub resident_bytes: usize,
    /// Warning about the method of construction.
    pub warning: Option<Warning>,
    /// Time of construction, s.
    pub seconds: f64,
    /// Time per application of the body's flexibility, s.
    pub seconds_per_product: f64,
    /// Expected content of the cache.
    pub cached: CacheContent,
}

/// Estimated size, memory and time of a run.
#[derive(Debug, Clone)]
pub struct RunEstimate {
    /// Number of cells of the frame.
    pub n_cells: usize,
    /// Axes of the frame.
    pub frame_axes: Triad,
    /// Estimates of body 1 and body 2.
    pub bodies: [BodyEstimate; 2],
    /// Number of contact problems to solve: increments, and path points of the cycles that are solved.
    pub n_contact_problems: usize,
    /// Work that the run omits because the results do not need it.
    pub skipped: Vec<OmittedWork>,
    /// Peak memory, bytes.
    pub memory_bytes: f64,
    /// Run time, s; accurate within a factor of a few.
    pub seconds: f64,
    /// Warnings about the fit of bodies and frame.
    pub warnings: Vec<Warning>,
}

/// Checks `plan` and estimates its run. Builds finite-element models, but does not factorise.
///
/// # Errors
/// If a mesh, support, material or frame of the plan is wrong, or bodies and frame do not fit together. If both bodies are rigid,
/// or memory does not suffice.
pub fn estimate(plan: &Plan) -> Result<RunEstimate, SceneError> {
    estimate_on_frame(plan, contact_frame(plan)?)
}

/// As [`estimate`], on a frame that may belong to another plan.
pub(super) fn estimate_on_frame(plan: &Plan, frame: ContactFrame) -> Result<RunEstimate, SceneError> {
    let ValidScene { frame, near_fields: near, warnings } = validate(plan, frame)?;
    let frame = with_active_cells(plan, frame, &near)?;
    let first = estimate_body(plan, 0, &frame, &near[0], memory::remaining_limit(plan, &frame, 0))?;
    let left = memory::remaining_limit(plan, &frame, first.resident_bytes);
    let second = estimate_body(plan, 1, &frame, &near[1], left)?;
    let bodies = [first, second];
    if plan.bodies.iter().all(|body| matches!(body, BodyPlan::Rigid)) {
        let error = crate::error::Error::input(
            "both bodies are rigid: give at least one body the kind \"fe\", \"be\" or \"half-space\"",
        );
        return Err(SceneError { error, key: "body1.kind".to_owned() });
    }
    let n_contact_problems: usize = plan.steps.iter().map(time::contact_problems).sum();
    let held = frame_bytes(plan, &frame) as f64 + bodies[0].resident_bytes as f64;
    let memory_bytes =
        (frame_bytes(plan, &frame) as f64 + bodies[0].memory_bytes).max(held + bodies[1].memory_bytes);
    let mend = "use fewer cells in the frame, or a coarser mesh";
    plan.memory_limit.ensure_available(memory_bytes as u128, "this scene", mend).at("frame")?;
    let mut skipped = expected_omitted_work(plan, &frame, &near)?;
    let whole = (0..2).filter(|&index| bodies[index].cached != CacheContent::Insufficient);
    skipped.extend(whole.map(|index| {
        omitted_factorisation(index, bodies[index].cached == CacheContent::FlexibilityAndFactor)
    }));
    let making: f64 = bodies.iter().map(|body| body.seconds).sum();
    let solving =
        time::of_steps(plan, &frame, &near, bodies.each_ref().map(|body| body.seconds_per_product), &skipped);
    let seconds = making + solving + time::inside(plan, n_contact_problems);
    let (n_cells, frame_axes) = (frame.n_cells(), frame.axes);
    Ok(RunEstimate {
        n_cells,
        frame_axes,
        bodies,
        n_contact_problems,
        skipped,
        memory_bytes,
        seconds,
        warnings,
    })
}

fn estimate_body(
    plan: &Plan,
    index: usize,
    frame: &ContactFrame,
    near: &NearFieldModel,
    left: MemoryLimit,
) -> Result<BodyEstimate, SceneError> {
    let n = frame.n_cells() as f64;
    Ok(match &plan.bodies[index] {
        BodyPlan::Rigid => BodyEstimate { description: "rigid".to_owned(), ..BodyEstimate::default() },
        BodyPlan::HalfSpace(elastic) => {
            let compressed = is_compressed(plan, frame);
            let mut description = format!("half-space, {}", elastic.name);
            if compressed {
                let tolerance = plan.solver.compression_tolerance;
                description
                    .push_str(&format!("; its operator is compressed with the tolerance {tolerance:e}"));
            }
            let body = configured_half_space(plan, elastic, index, frame)?;
            memory::ensure_half_space_fits(plan, frame, &body, &left).at(BODY_KEYS[index])?;
            let resident_bytes = half_space_bytes(plan, frame, &body);
            let memory_bytes = resident_bytes as f64;
            let (seconds, seconds_per_product) =
                if frame.grid.is_some() && plan.solver.coupling == Coupling::Schur {
                    (0.1 + n * 2e-6, 4.0 * n * FFT_SECONDS_PER_POINT)
                } else if compressed {
                    (body.building_seconds(), memory_bytes / MEMORY_BYTES_PER_SECOND)
                } else {
                    (dense_matrix_seconds(frame.n_cells()), 72.0 * n * n / MEMORY_BYTES_PER_SECOND)
                };
            BodyEstimate {
                description,
                memory_bytes,
                resident_bytes,
                seconds,
                seconds_per_product,
                ..BodyEstimate::default()
            }
        }
        BodyPlan::TruncatedHalfSpace(spec) => truncated(spec, index, frame, left)?,
        BodyPlan::Be(be) => boundary_elements(be, index, frame, left)?,
        BodyPlan::Fe(fe) => match near.half_space_fit() {
            Some(site) => estimate_hybrid(plan, fe, index, frame, site, &left)?,
            None => finite_elements(plan, fe, index, frame, left)?,
        },
    })
}

/// Seconds to compute the operator matrix of a half-space for `n_cells` polygonal cells.
fn dense_matrix_seconds(n_cells: usize) -> f64 {
    9.0 * (n_cells as f64).powi(2) * 2e-7
}

fn truncated(
    spec: &TruncatedHalfSpacePlan,
    index: usize,
    frame: &ContactFrame,
    left: MemoryLimit,
) -> Result<BodyEstimate, SceneError> {
    let key = format!("{}.truncated", BODY_KEYS[index]);
    let stiffness = spec.material.stiffness_in_frame(0.0);
    let inputs = TruncatedSpec { stiffness: &stiffness, half_size: spec.half_size };
    let n_elements = inputs.n_elements(frame).at(&key)?;
    let (bytes, n, n_cells) =
        (inputs.bytes(frame).at(&key)?, 3.0 * n_elements as f64, frame.n_cells() as f64);
    let table = if spec.material.isotropic { 0.0 } else { TABLE };
    let integrals =
        INFLUENCE_SECONDS_PER_PAIR[usize::from(!spec.material.isotropic)] * (n_elements as f64).powi(2);
    let flops = 2.0 / 3.0 * n.powi(3) + 6.0 * n * n * n_cells;
    let description = format!(
        "truncated half-space, {}, {n_elements} surface elements, half side {}",
        spec.material.name, spec.half_size
    );
    left.ensure_available(
        bytes,
        &description,
        "use fewer cells in the frame, or a smaller surface (`truncated`)",
    )
    .at(&key)?;
    Ok(BodyEstimate {
        description,
        memory_bytes: bytes as f64,
        resident_bytes: 72 * frame.n_cells().pow(2),
        seconds: table + integrals + flops / FLOPS_PER_SECOND,
        seconds_per_product: 72.0 * n_cells * n_cells / MEMORY_BYTES_PER_SECOND,
        ..BodyEstimate::default()
    })
}

fn boundary_elements(
    be: &BeBodyPlan,
    index: usize,
    frame: &ContactFrame,
    left: MemoryLimit,
) -> Result<BodyEstimate, SceneError> {
    let key = BODY_KEYS[index];
    face_map(&be.meshed, index, frame)?;
    let spec = be.bem_spec(key);
    let nodes = spec.n_nodes();
    let contact = spec.check(&be.meshed.contact, SIDES[index], frame).at(key)?.n_nodes;
    let what = format!("a boundary-element body of {} unknowns", 3 * nodes);
    let bytes = spec.bytes(contact, be.meshed.load_cases().len()).at(key)?;
    left.ensure_available(bytes, &what, BeBody::MEMORY_ADVICE).at(key)?;
    let (n, columns) = (3.0 * nodes as f64, 3.0 * contact as f64);
    let elements = outer_faces(&be.meshed.mesh).len();
    let per_pair = INFLUENCE_SECONDS_PER_PAIR[usize::from(!be.meshed.material.isotropic)];
    let table = if be.meshed.material.isotropic { 0.0 } else { TABLE };
    let (how, share, flops) = match spec.solved_by() {
        SolutionMethod::Dense => ("", 1.0, 2.0 / 3.0 * n.powi(3) + 2.0 * n * n * columns),
        SolutionMethod::Compressed(_) => {
            let [share, entries] = COMPRESSED_BE_SCALING.map(|[least, power]| least * (n / 1e4).powf(power));
            ("; compressed equations", share, 2.0 * entries * n * columns * PRODUCTS)
        }
    };
    Ok(BodyEstimate {
        description: format!(
            "boundary elements, {}: {elements} {} elements, {} unknowns, {contact} contact nodes{how}",
            be.meshed.material.name,
            be.interpolation.name(),
            3 * nodes
        ),
        memory_bytes: bytes as f64,
        resident_bytes: 8 * 3 * nodes * (3 * contact + 1) + 36 * contact * contact,
        seconds: table + share * per_pair * (nodes * elements) as f64 + flops / FLOPS_PER_SECOND,
        seconds_per_product: 4.0 * columns * columns / MEMORY_BYTES_PER_SECOND,
        ..BodyEstimate::default()
    })
}

fn estimate_hybrid(
    plan: &Plan,
    fe: &MeshedBodyPlan,
    index: usize,
    frame: &ContactFrame,
    site: &HalfSpaceFit,
    left: &MemoryLimit,
) -> Result<BodyEstimate, SceneError> {
    let key = BODY_KEYS[index];
    let model = FeModel::with_memory_limit(fe.fem_spec(key), left).at(key)?;
    let analysis = model.analyse(&[]).at(key)?;
    let method = analysis.choose_method(&model, left).context(|| key.to_owned()).at(key)?;
    let (how, solving) = condensation_cost(&model, &analysis, method);
    let nodes = site.first_nodes();
    let columns = 3 * nodes[0] * nodes[1];
    let [peak, _] = analysis.peak_and_resident_bytes(&model, method);
    let n = frame.n_cells() as f64;
    let columns_bytes = Correction::bytes(&model, columns);
    let tables = if site.isotropic { 0 } else { memory::far_field_table_bytes(plan, frame) };
    let resident_bytes =
        model.resident_bytes() + columns_bytes / 4 + memory::grid_operator_bytes(plan, frame) + tables;
    let n_free = model.n_free() as f64;
    let bowed = max_curvature_correction(plan, fe, index, frame)?.map_or_else(String::new, |bow| {
        format!(", flat contact faces corrected for curvature by up to {bow:.2e} {}", plan.units.length)
    });
    let values = n_free * columns as f64;
    let per_point = PER_FORCE[usize::from(!site.isotropic)] * columns as f64 / 3.0;
    let per_point = per_point + PER_PAIR * (columns * columns) as f64;
    let inclusions = Correction::inclusion_points(&model, site) as f64 * per_point;
    Ok(BodyEstimate {
        description: format!(
            "half-space, {}, corrected by finite elements: {} solid cells, {} unknowns, {} x {} polynomials{bowed}; {how}; the run checks whether the correction is accurate enough",
            fe.material.name,
            fe.mesh.volume_cells().count(),
            model.n_free(),
            nodes[0],
            nodes[1]
        ),
        memory_bytes: (peak + columns_bytes).max(resident_bytes) as f64,
        resident_bytes,
        seconds: solving
            + (PER_UNKNOWN + ASSEMBLY) * n_free
            + PER_VALUE * values
            + inclusions
            + if site.isotropic { 0.1 } else { TABLE },
        seconds_per_product: 4.2 * n * FFT_SECONDS_PER_POINT,
        ..BodyEstimate::default()
    })
}

fn condensation_cost(
    model: &FeModel,
    analysis: &SymbolicAnalysis,
    method: CondensationMethod,
) -> (String, f64) {
    match method {
        CondensationMethod::Factorisation => {
            let gflop = analysis.flops() * 1e-9;
            let factor = format!("factor of {} entries, {gflop:.1} GFLOP", analysis.factor_entries());
            (factor, analysis.flops() / FLOPS_PER_SECOND)
        }
        CondensationMethod::ConjugateGradients(_) => {
            let batches = analysis.n_contact_dofs().div_ceil(TwoLevelSolver::rhs_per_batch());
            let steps = (batches * EXPECTED_CG_ITERATIONS) as f64;
            let seconds = steps * PER_ENTRY * model.stiffness().n_stored() as f64;
            ("conjugate gradients".to_owned(), seconds)
        }
    }
}

fn finite_elements(
    plan: &Plan,
    fe: &MeshedBodyPlan,
    index: usize,
    frame: &ContactFrame,
    left: MemoryLimit,
) -> Result<BodyEstimate, SceneError> {
    let key = BODY_KEYS[index];
    let model = FeModel::with_memory_limit(fe.fem_spec(key), &left).at(key)?;
    let map = face_map(fe, index, frame)?;
    let map = frame.candidates.as_ref().map(|cells| map.restrict(cells)).unwrap_or(map);
    let (n_contact, n_free) = (3.0 * map.nodes().len() as f64, model.n_free() as f64);
    let making = model.assembly_bytes();
    let flexibility = model.resident_bytes() + flexibility_bytes(map.nodes().len());
    let expected = |method: CondensationMethod| {
        model.cached_factorisation_bytes(map.nodes(), method, plan.flexibility_cache.as_ref()?)
    };
    let known = expected(CondensationMethod::Factorisation).filter(|&bytes| left.allows(bytes as u128));
    // Fields and loads require a solve, even if the flexibility is in the cache.
    let solves = model.has_own_loads() || needs_factor_after_condensation(plan, frame);
    let has_factor = solves
        && known.is_some()
        && plan.flexibility_cache.as_ref().is_some_and(|cache| model.has_cached_factor(map.nodes(), cache));
    let (mut cached, mut path) = (known.is_some(), "flexibility from the cache".to_owned());
    let ([mut memory_bytes, mut resident_bytes], mut seconds) = ([flexibility; 2], 0.0);
    let mut warning = None;
    if !cached || solves {
        let analysis = model.analyse(map.nodes()).at(key)?;
        let method = analysis.choose_method(&model, &left).context(|| key.to_owned()).at(key)?;
        cached = cached || expected(method).is_some();
        let how = condensation_cost(&model, &analysis, method);
        if !cached || solves {
            [memory_bytes, resident_bytes] = analysis.peak_and_resident_bytes(&model, method);
            let solving = if has_factor { resident_bytes as f64 / READING } else { how.1 };
            seconds = solving + PER_UNKNOWN * n_free;
        }
        path = match (cached, solves) {
            (false, _) => how.0,
            (true, true) if has_factor => format!("{path}, and the factor for fields or loads"),
            (true, true) => format!("{path}, {} for fields or loads", how.0),
            (true, false) => path,
        };
        if let CondensationMethod::ConjugateGradients(shortage) = method {
            warning = Some(Warning::note(format!("{key} is condensed by conjugate gradients: {shortage}")));
        }
    }
    Ok(BodyEstimate {
        description: format!(
            "finite elements, {}: {} solid cells, {} unknowns, {} contact nodes; {path}",
            fe.material.name,
            fe.mesh.volume_cells().count(),
            model.n_free(),
            map.nodes().len()
        ),
        memory_bytes: memory_bytes.max(making) as f64,
        resident_bytes,
        warning,
        seconds: seconds + ASSEMBLY * n_free,
        seconds_per_product: 4.0 * n_contact * n_contact / MEMORY_BYTES_PER_SECOND,
        cached: match (cached, solves) {
            (true, false) => CacheContent::Flexibility,
            (true, true) if has_factor => CacheContent::FlexibilityAndFactor,
            _ => CacheContent::Insufficient,
        },
    })
}
