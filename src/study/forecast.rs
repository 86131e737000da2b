//! What a run of a plan would compute, skip and need, without doing it.

use super::bodies::{KEYS, SIDES, face_map, frame, half_space_of};
use super::candidates::with_candidates;
use super::controls::refuse_impossible_controls;
use super::expected;
use super::failure::{AtKey, Failure};
use super::flat_faces::largest_bow;
use super::memory::{self, compresses, of_frame, of_half_space};
use super::near_field::{Near, choose};
use super::saved::{self, Spent};
use super::skips::{cached, needs_solves, skips};
use crate::bem::finite::Equations;
use crate::body::hybrid::{Correction, Site};
use crate::body::{BeBody, TruncatedSpec};
use crate::error::Context;
use crate::fem::{Analysis, FeModel, Method, flexibility_bytes};
use crate::frame::ContactFrame;
use crate::linalg::memory::MemoryLimit;
use crate::linalg::two_level::TwoLevelSolver;
use crate::mesh::faces::outer_faces;
use crate::scene::keys::solver::Coupling;
use crate::scene::plan::{BeSpec, BodySpec, MeshedSpec, Plan, Truncated};
use crate::skip::Skipped;

/// Floating-point operations per second that factorisations reach on one core.
pub(super) const FLOPS: f64 = 2.8e10;

/// Seconds per unknown of ordering and analysis.
const PER_UNKNOWN: f64 = 5e-6;

/// Iterations of conjugate gradients, and seconds of each per entry of the matrix.
const ITERATIONS: usize = 40;
const PER_ENTRY: f64 = 1.1e-8;

/// Bytes per second in which kept factors are read and checked.
const READING: f64 = 6e8;

/// Seconds per unknown of assembly.
const ASSEMBLY: f64 = 1e-5;

/// Bytes per second that operators stream from memory, a cautious figure.
const BANDWIDTH: f64 = 6e9;

/// Seconds per point of the zero-padded grid and application of a half-space operator.
const PER_POINT: f64 = 4.0e-8;

/// Seconds per unknown and column of a far field, and of the table of an anisotropic material.
const PER_VALUE: f64 = 1.5e-6;
const TABLE: f64 = 1.0;

/// Seconds per quadrature point in other materials and force, by closed forms and by a table, and per pair of columns.
const PER_FORCE: [f64; 2] = [6e-8, 3e-7];
const PER_PAIR: f64 = 5e-10;

/// Seconds per node and element of their integrals, by closed forms and by a table.
const PER_INFLUENCE: [f64; 2] = [2e-6, 4.5e-6];

/// Of compressed boundary elements: share of the integrals that are computed and entries per row that are kept, at 10 000 unknowns and
/// their powers with more of them, and products for a right side.
const COMPRESSED: [[f64; 2]; 2] = [[0.65, -0.57], [3500.0, 0.2]];
const PRODUCTS: f64 = 15.0;

/// What a cache is expected to have of a body.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Cached {
    /// Not all that is needed.
    Nothing,
    /// The flexibility, and no more is needed.
    Flexibility,
    /// The flexibility and the factor that loads or fields need.
    FactorToo,
}

/// What one body is and needs.
#[derive(Debug, Clone)]
pub struct BodyForecast {
    /// What it is.
    pub what: String,
    /// Memory while it is made ready, bytes.
    pub memory_bytes: f64,
    /// Memory that it keeps, bytes.
    pub held_bytes: usize,
    /// What the user should know of how it is made ready.
    pub note: Option<String>,
    /// Seconds to make it ready.
    pub seconds: f64,
    /// Seconds per application of its flexibility.
    pub application: f64,
    /// What is expected in the cache, so that nothing is factorised.
    pub cached: Cached,
}

/// Expectations of a run.
#[derive(Debug, Clone)]
pub struct Forecast {
    /// Cells of the frame.
    pub n_cells: usize,
    /// The bodies.
    pub bodies: [BodyForecast; 2],
    /// Contact problems to be solved: increments, and strokes of cycle jumps.
    pub n_solves: usize,
    /// Work that the scene does not need.
    pub skipped: Vec<Skipped>,
    /// Peak memory, bytes.
    pub memory_bytes: f64,
    /// Run time, seconds; right within a factor of a few.
    pub seconds: f64,
}

/// The forecast of a plan; builds finite-element bodies and the structure of their factors, but does not factorise.
///
/// # Errors
/// If a mesh, support, material or frame of the plan is wrong.
pub fn forecast(plan: &Plan) -> Result<Forecast, Failure> {
    forecast_on(plan, frame(plan)?)
}

/// As [`forecast`], on a frame that may have been made for another plan.
pub(super) fn forecast_on(plan: &Plan, frame: ContactFrame) -> Result<Forecast, Failure> {
    refuse_impossible_controls(plan, &frame)?;
    memory::ensure_inside(plan, &frame).at("output.inside")?;
    let near = choose(plan, &frame)?;
    let frame = with_candidates(plan, frame, &near)?;
    let first = body(plan, 0, (&frame, &near[0]), memory::left(plan, &frame, 0))?;
    let left = memory::left(plan, &frame, first.held_bytes);
    let second = body(plan, 1, (&frame, &near[1]), left)?;
    let bodies = [first, second];
    if plan.bodies.iter().all(|body| matches!(body, BodySpec::Rigid)) {
        let error = crate::error::Error::input(
            "both bodies are rigid: make at least one of body1.kind and body2.kind \"fe\" or \"half-space\"",
        );
        return Err(Failure { error, key: "body1.kind".to_owned() });
    }
    let n_solves: usize = plan.steps.iter().map(expected::solves).sum();
    let held = of_frame(plan, &frame) as f64 + bodies[0].held_bytes as f64;
    let memory_bytes =
        (of_frame(plan, &frame) as f64 + bodies[0].memory_bytes).max(held + bodies[1].memory_bytes);
    let mend = "take fewer cells in the frame, or a coarser mesh";
    plan.memory.ensure(memory_bytes as u128, "this scene", mend).at("frame")?;
    let mut skipped = skips(plan, &frame, &near)?;
    let whole = (0..2).filter(|&index| bodies[index].cached != Cached::Nothing);
    skipped.extend(whole.map(|index| cached(index, None, bodies[index].cached == Cached::FactorToo)));
    let making: f64 = bodies.iter().map(|body| body.seconds).sum();
    let steps = expected::steps(plan, &frame, (&near, &bodies), &skipped);
    let solving: f64 = steps.iter().map(|step| step.seconds).sum();
    let seconds = making + solving + expected::inside(plan, n_solves);
    saved::estimate(
        plan,
        &frame,
        &Spent { steps, bodies: making, operators: making, share: None },
        &mut skipped,
    );
    Ok(Forecast { n_cells: frame.n_cells(), bodies, n_solves, skipped, memory_bytes, seconds })
}

fn body(
    plan: &Plan,
    index: usize,
    (frame, near): (&ContactFrame, &Near),
    left: MemoryLimit,
) -> Result<BodyForecast, Failure> {
    let n = frame.n_cells() as f64;
    Ok(match &plan.bodies[index] {
        BodySpec::Rigid => BodyForecast {
            what: "rigid".to_owned(),
            memory_bytes: 0.0,
            held_bytes: 0,
            note: None,
            seconds: 0.0,
            application: 0.0,
            cached: Cached::Nothing,
        },
        BodySpec::HalfSpace(elastic) => {
            let compressed = compresses(plan, frame);
            let mut what = format!("half-space, {}", elastic.name);
            if compressed {
                let tolerance = plan.solver.compression_tolerance;
                what.push_str(&format!("; its operator is compressed to {tolerance:e}"));
            }
            let body = half_space_of(plan, elastic, index, frame)?;
            memory::ensure(plan, frame, &body, &left).at(KEYS[index])?;
            let held_bytes = of_half_space(plan, frame, &body);
            let memory_bytes = held_bytes as f64;
            let (seconds, application) = if frame.grid.is_some() && plan.solver.coupling == Coupling::Schur {
                (0.1 + n * 2e-6, 4.0 * n * PER_POINT)
            } else if compressed {
                (body.building_seconds(), memory_bytes / BANDWIDTH)
            } else {
                (matrix_seconds(frame.n_cells()), 72.0 * n * n / BANDWIDTH)
            };
            BodyForecast {
                what,
                memory_bytes,
                held_bytes,
                note: None,
                seconds,
                application,
                cached: Cached::Nothing,
            }
        }
        BodySpec::Truncated(spec) => truncated(spec, index, (frame, left))?,
        BodySpec::Be(be) => boundary_elements(be, index, (frame, left))?,
        BodySpec::Fe(fe) => match near.site() {
            Some(site) => far_field(plan, (fe, index), (frame, site), &left)?,
            None => finite_elements(plan, fe, index, (frame, left))?,
        },
    })
}

/// Seconds for the matrix of a half-space's operator on `n_cells` polygons.
pub(super) fn matrix_seconds(n_cells: usize) -> f64 {
    9.0 * (n_cells as f64).powi(2) * 2e-7
}

/// A half-space whose surface is meshed.
fn truncated(
    spec: &Truncated,
    index: usize,
    (frame, left): (&ContactFrame, MemoryLimit),
) -> Result<BodyForecast, Failure> {
    let key = format!("{}.truncated", KEYS[index]);
    let stiffness = spec.elastic.in_axes(0.0);
    let inputs = TruncatedSpec { stiffness: &stiffness, half_size: spec.half_size };
    let n_elements = inputs.n_elements(frame).at(&key)?;
    let (bytes, n, n_cells) =
        (inputs.bytes(frame).at(&key)?, 3.0 * n_elements as f64, frame.n_cells() as f64);
    let table = if spec.elastic.isotropic { 0.0 } else { TABLE };
    let integrals = PER_INFLUENCE[usize::from(!spec.elastic.isotropic)] * (n_elements as f64).powi(2);
    let flops = 2.0 / 3.0 * n.powi(3) + 6.0 * n * n * n_cells;
    let what = format!(
        "half-space, {}, {n_elements} elements on its surface as far as {}",
        spec.elastic.name, spec.half_size
    );
    left.ensure(bytes, &what, "take fewer cells in the frame, or a smaller surface").at(&key)?;
    Ok(BodyForecast {
        what,
        memory_bytes: bytes as f64,
        held_bytes: 72 * frame.n_cells().pow(2),
        note: None,
        seconds: table + integrals + flops / FLOPS,
        application: 72.0 * n_cells * n_cells / BANDWIDTH,
        cached: Cached::Nothing,
    })
}

/// A body of boundary elements.
fn boundary_elements(
    be: &BeSpec,
    index: usize,
    (frame, left): (&ContactFrame, MemoryLimit),
) -> Result<BodyForecast, Failure> {
    let key = KEYS[index];
    face_map(&be.meshed, index, frame)?;
    let spec = be.inputs(key);
    let nodes = spec.n_nodes();
    let contact = spec.check(&be.meshed.contact, SIDES[index], frame).at(key)?.n_nodes;
    let what = format!("a boundary-element body of {} unknowns", 3 * nodes);
    let bytes = spec.bytes(contact).at(key)?;
    left.ensure(bytes, &what, BeBody::MEND).at(key)?;
    let (n, columns) = (3.0 * nodes as f64, 3.0 * contact as f64);
    let elements = outer_faces(&be.meshed.mesh).len();
    let per_pair = PER_INFLUENCE[usize::from(!be.meshed.elastic.isotropic)];
    let table = if be.meshed.elastic.isotropic { 0.0 } else { TABLE };
    let (how, share, flops) = match spec.solved_by() {
        Equations::Dense => ("", 1.0, 2.0 / 3.0 * n.powi(3) + 2.0 * n * n * columns),
        Equations::Compressed(_) => {
            let [share, entries] = COMPRESSED.map(|[least, power]| least * (n / 1e4).powf(power));
            ("; its equations are compressed", share, 2.0 * entries * n * columns * PRODUCTS)
        }
    };
    Ok(BodyForecast {
        what: format!(
            "boundary elements, {}: {elements} {} elements, {} unknowns, {contact} contact nodes{how}",
            be.meshed.elastic.name,
            be.interpolation.name(),
            3 * nodes
        ),
        memory_bytes: bytes as f64,
        held_bytes: 8 * 3 * nodes * (3 * contact + 1) + 36 * contact * contact,
        note: None,
        seconds: table + share * per_pair * (nodes * elements) as f64 + flops / FLOPS,
        application: 4.0 * columns * columns / BANDWIDTH,
        cached: Cached::Nothing,
    })
}

/// A meshed body that carries what the half-space of `site` lacks.
fn far_field(
    plan: &Plan,
    (fe, index): (&MeshedSpec, usize),
    (frame, site): (&ContactFrame, &Site),
    left: &MemoryLimit,
) -> Result<BodyForecast, Failure> {
    let key = KEYS[index];
    let model = FeModel::within(fe.inputs(key), left).at(key)?;
    let analysis = model.analyse(&[]).at(key)?;
    let method = analysis.method(&model, left).context(|| key.to_owned()).at(key)?;
    let (how, solving) = how(&model, &analysis, method);
    let nodes = site.first_nodes();
    let columns = 3 * nodes[0] * nodes[1];
    let [peak, _] = analysis.bytes_by(&model, method);
    let n = frame.n_cells() as f64;
    let columns_bytes = Correction::bytes(&model, columns);
    let tables = if site.isotropic { 0 } else { memory::of_far_field(plan, frame) };
    let held_bytes = model.held_bytes() + columns_bytes / 4 + memory::of_grid(plan, frame) + tables;
    let n_free = model.n_free() as f64;
    let bowed = largest_bow(plan, fe, index, frame)?.map_or_else(String::new, |bow| {
        format!(", flat contact faces bowed by up to {bow:.2e} {}", plan.units.length)
    });
    let values = n_free * columns as f64;
    let per_point = PER_FORCE[usize::from(!site.isotropic)] * columns as f64 / 3.0;
    let per_point = per_point + PER_PAIR * (columns * columns) as f64;
    let inclusions = Correction::inclusion_points(&model, site) as f64 * per_point;
    Ok(BodyForecast {
        what: format!(
            "half-space, {}, with the far field of finite elements: {} solid cells, {} unknowns, {} x {} polynomials{bowed}; {how}; \
             whether its far field is good enough shows when it runs",
            fe.elastic.name,
            fe.mesh.volume_cells().count(),
            model.n_free(),
            nodes[0],
            nodes[1]
        ),
        memory_bytes: (peak + columns_bytes).max(held_bytes) as f64,
        held_bytes,
        note: None,
        seconds: solving
            + (PER_UNKNOWN + ASSEMBLY) * n_free
            + PER_VALUE * values
            + inclusions
            + if site.isotropic { 0.1 } else { TABLE },
        application: 4.2 * n * PER_POINT,
        cached: Cached::Nothing,
    })
}

/// How a body is condensed in words, and seconds.
fn how(model: &FeModel, analysis: &Analysis, method: Method) -> (String, f64) {
    match method {
        Method::Factorisation => {
            let gflop = analysis.flops() * 1e-9;
            let factor = format!("factor of {} entries, {gflop:.1} GFLOP", analysis.factor_entries());
            (factor, analysis.flops() / FLOPS)
        }
        Method::ConjugateGradients(_) => {
            let batches = analysis.n_trailing().div_ceil(TwoLevelSolver::batch());
            let steps = (batches * ITERATIONS) as f64;
            let seconds = steps * PER_ENTRY * model.stiffness().n_stored() as f64;
            ("conjugate gradients".to_owned(), seconds)
        }
    }
}

/// A meshed body: the structure of its factor is found, and whether its flexibility is in the cache.
fn finite_elements(
    plan: &Plan,
    fe: &MeshedSpec,
    index: usize,
    (frame, left): (&ContactFrame, MemoryLimit),
) -> Result<BodyForecast, Failure> {
    let key = KEYS[index];
    let model = FeModel::within(fe.inputs(key), &left).at(key)?;
    let map = face_map(fe, index, frame)?;
    let map = frame.candidates.as_ref().map(|cells| map.restrict(cells)).unwrap_or(map);
    let (n_contact, n_free) = (3.0 * map.nodes().len() as f64, model.n_free() as f64);
    let making = model.memory_bytes();
    let flexibility = model.held_bytes() + flexibility_bytes(map.nodes().len());
    let expected = |method: Method| model.expects(map.nodes(), method, plan.cache.as_ref()?);
    let known = expected(Method::Factorisation).filter(|&bytes| left.allows(bytes as u128));
    // Fields and loads need to solve all the same.
    let solves = model.is_loaded() || needs_solves(plan, frame);
    let has_factor = solves
        && known.is_some()
        && plan.cache.as_ref().is_some_and(|cache| model.expects_factor(map.nodes(), cache));
    let (mut cached, mut path) = (known.is_some(), "flexibility from the cache".to_owned());
    let ([mut memory_bytes, mut held_bytes], mut seconds) = ([flexibility; 2], 0.0);
    let mut note = None;
    if !cached || solves {
        let analysis = model.analyse(map.nodes()).at(key)?;
        let method = analysis.method(&model, &left).context(|| key.to_owned()).at(key)?;
        cached = cached || expected(method).is_some();
        let how = how(&model, &analysis, method);
        if !cached || solves {
            [memory_bytes, held_bytes] = analysis.bytes_by(&model, method);
            let solving = if has_factor { held_bytes as f64 / READING } else { how.1 };
            seconds = solving + PER_UNKNOWN * n_free;
        }
        path = match (cached, solves) {
            (false, _) => how.0,
            (true, true) if has_factor => format!("{path}, and the factor for fields or loads"),
            (true, true) => format!("{path}, {} for fields or loads", how.0),
            (true, false) => path,
        };
        if let Method::ConjugateGradients(shortage) = method {
            note = Some(format!("{key} is condensed by conjugate gradients: {shortage}"));
        }
    }
    Ok(BodyForecast {
        what: format!(
            "finite elements, {}: {} solid cells, {} unknowns, {} contact nodes; {path}",
            fe.elastic.name,
            fe.mesh.volume_cells().count(),
            model.n_free(),
            map.nodes().len()
        ),
        memory_bytes: memory_bytes.max(making) as f64,
        held_bytes,
        note,
        seconds: seconds + ASSEMBLY * n_free,
        application: 4.0 * n_contact * n_contact / BANDWIDTH,
        cached: match (cached, solves) {
            (true, false) => Cached::Flexibility,
            (true, true) if has_factor => Cached::FactorToo,
            _ => Cached::Nothing,
        },
    })
}
