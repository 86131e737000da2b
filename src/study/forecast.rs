//! What a run of a plan would compute, skip and need, without doing it.

use super::bodies::{KEYS, face_map, frame};
use super::controls::refuse_impossible_controls;
use super::failure::{AtKey, Failure};
use super::memory::{self, of_frame, of_half_space};
use super::skips::{cached, recovers, skips};
use crate::error::Context;
use crate::fem::{FeModel, FlexibilityCache, flexibility_bytes};
use crate::frame::ContactFrame;
use crate::history::step::{Integrator, Skipped, Step};
use crate::linalg::memory::MemoryLimit;
use crate::scene::plan::{BodySpec, FeSpec, Plan};

/// Floating-point operations per second that factorisations reach on one core.
const FLOPS: f64 = 2.8e10;

/// Seconds per unknown of ordering and analysis.
const PER_UNKNOWN: f64 = 5e-6;

/// Seconds per unknown of assembly.
const ASSEMBLY: f64 = 1e-5;

/// Bytes per second that operators stream from memory, a cautious figure.
const BANDWIDTH: f64 = 6e9;

/// Seconds per point of the zero-padded grid and application of a half-space operator.
const PER_POINT: f64 = 4.0e-8;

/// What one body is and needs.
#[derive(Debug, Clone)]
pub struct BodyForecast {
    /// What it is.
    pub what: String,
    /// Memory while it is made ready, bytes.
    pub memory_bytes: f64,
    /// Memory that it keeps, bytes.
    pub held_bytes: usize,
    /// Seconds to make it ready.
    pub seconds: f64,
    /// Seconds per application of its flexibility.
    pub application: f64,
    /// Whether its flexibility is expected in the cache.
    pub cached: bool,
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
    let frame = frame(plan)?;
    refuse_impossible_controls(plan, &frame)?;
    let first = body(plan, 0, &frame, memory::left(plan, &frame, 0))?;
    let second = body(plan, 1, &frame, memory::left(plan, &frame, first.held_bytes))?;
    let bodies = [first, second];
    if plan.bodies.iter().all(|body| matches!(body, BodySpec::Rigid)) {
        let error = crate::error::Error::input(
            "both bodies are rigid: make at least one of body1.kind and body2.kind \"fe\" or \"half-space\"",
        );
        return Err(Failure { error, key: "body1.kind".to_owned() });
    }
    let n_solves: usize = plan.steps.iter().map(solves).sum();
    let application: f64 = bodies.iter().map(|body| body.application).sum();
    // First-order iterations grow with the number of cells across the contact (formulation 6.1).
    let iterations = 8.0 * (frame.n_cells() as f64).sqrt();
    let held = of_frame(&frame) as f64 + bodies[0].held_bytes as f64;
    let memory_bytes = (of_frame(&frame) as f64 + bodies[0].memory_bytes).max(held + bodies[1].memory_bytes);
    let seconds =
        bodies.iter().map(|body| body.seconds).sum::<f64>() + n_solves as f64 * iterations * application;
    let mend = "take fewer cells in the frame, or a coarser mesh";
    plan.memory.ensure(memory_bytes as u128, "this scene", mend).at("frame")?;
    let mut skipped = skips(plan, &frame)?;
    skipped.extend((0..2).filter(|&index| bodies[index].cached).map(|index| cached(index, None)));
    Ok(Forecast { n_cells: frame.n_cells(), bodies, n_solves, skipped, memory_bytes, seconds })
}

/// Contact problems of a step.
fn solves(step: &Step) -> usize {
    match &step.cycles {
        None => step.increments,
        // Both ends of a stroke are solved together; the first stroke comes before the jumps.
        Some(cycles) if step.wear => {
            let stages = if cycles.integrator == Integrator::Sdirk2 { 2 } else { 1 };
            1 + 2 * stages * cycles.jumps
        }
        Some(cycles) => 1 + 2 * cycles.jumps,
    }
}

fn body(plan: &Plan, index: usize, frame: &ContactFrame, left: MemoryLimit) -> Result<BodyForecast, Failure> {
    let n = frame.n_cells() as f64;
    memory::ensure(plan, index, frame, &left).at(KEYS[index])?;
    Ok(match &plan.bodies[index] {
        BodySpec::Rigid => BodyForecast {
            what: "rigid".to_owned(),
            memory_bytes: 0.0,
            held_bytes: 0,
            seconds: 0.0,
            application: 0.0,
            cached: false,
        },
        BodySpec::HalfSpace(elastic) => {
            let what = format!("half-space, {}", elastic.name);
            let held_bytes = of_half_space(frame);
            let memory_bytes = held_bytes as f64;
            let (seconds, application) = if frame.grid.is_some() {
                (0.1 + n * 2e-6, 4.0 * n * PER_POINT)
            } else {
                (9.0 * n * n * 2e-7, 72.0 * n * n / BANDWIDTH)
            };
            BodyForecast { what, memory_bytes, held_bytes, seconds, application, cached: false }
        }
        BodySpec::Fe(fe) => finite_elements(plan, fe, index, (frame, left))?,
    })
}

/// A meshed body: the structure of its factor is found, and whether its flexibility is in the cache.
fn finite_elements(
    plan: &Plan,
    fe: &FeSpec,
    index: usize,
    (frame, left): (&ContactFrame, MemoryLimit),
) -> Result<BodyForecast, Failure> {
    let key = KEYS[index];
    let model = FeModel::new(fe.inputs(key)).at(key)?;
    let map = face_map(fe, index, frame)?;
    let n_contact = 3.0 * map.nodes().len() as f64;
    let n_free = model.n_free() as f64;
    let rows = model.contact_rows(map.nodes()).len();
    let in_cache = |cache: &FlexibilityCache| cache.expects(&model.cache_key(map.nodes()), rows);
    let cached = plan.cache.as_ref().is_some_and(in_cache);
    // Fields and loads need the factor all the same.
    let needs_factor = !cached || model.is_loaded() || recovers(plan);
    let mut held_bytes = model.memory_bytes() + flexibility_bytes(map.nodes().len());
    let (mut memory_bytes, mut seconds) = (held_bytes as f64, 0.0);
    let mut path = "flexibility from the cache".to_owned();
    if needs_factor {
        let analysis = model.analyse(map.nodes()).at(key)?;
        analysis.ensure(&left).context(|| key.to_owned()).at(key)?;
        memory_bytes = analysis.memory_bytes() as f64;
        held_bytes = analysis.held_bytes();
        seconds = analysis.flops() / FLOPS + PER_UNKNOWN * n_free;
        let gflop = analysis.flops() * 1e-9;
        let factor = format!("factor of {} entries, {gflop:.1} GFLOP", analysis.factor_entries());
        path = if cached { format!("{path}, {factor} for fields or loads") } else { factor };
    }
    Ok(BodyForecast {
        what: format!(
            "finite elements, {}: {} solid cells, {} unknowns, {} contact nodes; {path}",
            fe.elastic.name,
            fe.mesh.volume_cells().count(),
            model.n_free(),
            map.nodes().len()
        ),
        memory_bytes,
        held_bytes,
        seconds: seconds + ASSEMBLY * n_free,
        application: 4.0 * n_contact * n_contact / BANDWIDTH,
        cached: !needs_factor,
    })
}
