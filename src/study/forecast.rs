//! What a run of a plan would compute, skip and need, without doing it.

use super::bodies::{face_map, frame};
use super::controls::refuse_impossible_controls;
use super::failure::{AtKey, Failure};
use super::skips::skips;
use crate::fem::FeModel;
use crate::frame::ContactFrame;
use crate::history::step::{Integrator, Skipped, Step};
use crate::linalg::memory::ensure;
use crate::scene::plan::{BodySpec, Plan};

/// Floating-point operations per second that factorisations reach, a cautious figure for two cores.
const FLOPS: f64 = 1.5e10;

/// Bytes per second that operators stream from memory, a cautious figure.
const BANDWIDTH: f64 = 6e9;

/// Seconds per point of the zero-padded grid and application of a half-space operator.
const PER_POINT: f64 = 4.0e-8;

/// What one body is and needs.
#[derive(Debug, Clone)]
pub struct BodyForecast {
    /// What it is.
    pub what: String,
    /// Memory, bytes.
    pub memory_bytes: f64,
    /// Seconds to make it ready.
    pub seconds: f64,
    /// Seconds per application of its flexibility.
    pub application: f64,
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
    let bodies = [body(plan, 0, &frame)?, body(plan, 1, &frame)?];
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
    let memory_bytes =
        3.0e7 + 500.0 * frame.n_cells() as f64 + bodies.iter().map(|body| body.memory_bytes).sum::<f64>();
    let seconds =
        bodies.iter().map(|body| body.seconds).sum::<f64>() + n_solves as f64 * iterations * application;
    ensure(memory_bytes as u128, "this scene", "take fewer cells in the frame, or a coarser mesh")
        .at("frame")?;
    let skipped = skips(plan, &frame)?;
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

fn body(plan: &Plan, index: usize, frame: &ContactFrame) -> Result<BodyForecast, Failure> {
    let n = frame.n_cells() as f64;
    Ok(match &plan.bodies[index] {
        BodySpec::Rigid => {
            BodyForecast { what: "rigid".to_owned(), memory_bytes: 0.0, seconds: 0.0, application: 0.0 }
        }
        BodySpec::HalfSpace(elastic) => {
            let what = format!("half-space, {}", elastic.name);
            if frame.grid.is_some() {
                // Nine planes of the symbol and the padded vectors of one application.
                let memory_bytes = 4.0 * n * 8.0 * 16.0;
                BodyForecast { what, memory_bytes, seconds: 0.1 + n * 2e-6, application: 4.0 * n * PER_POINT }
            } else {
                let memory_bytes = 72.0 * n * n;
                let application = memory_bytes / BANDWIDTH;
                BodyForecast { what, memory_bytes, seconds: 9.0 * n * n * 2e-7, application }
            }
        }
        BodySpec::Fe(fe) => {
            let key = if index == 0 { "body1" } else { "body2" };
            let model = FeModel::new(fe.inputs(key)).at(key)?;
            let map = face_map(fe, index, frame)?;
            let analysis = model.analyse(map.nodes()).at(key)?;
            let n_contact = 3.0 * map.nodes().len() as f64;
            let n_free = model.n_free() as f64;
            let entries = analysis.factor_entries() as f64;
            // Cost of a factor from its mean column length, and of the inverse of its trailing block.
            let flops = 1.5 * entries * entries / n_free + n_contact.powi(3);
            BodyForecast {
                what: format!(
                    "finite elements, {}: {} solid cells, {} unknowns, {} contact nodes",
                    fe.elastic.name,
                    fe.mesh.volume_cells().count(),
                    model.n_free(),
                    map.nodes().len()
                ),
                memory_bytes: analysis.memory_bytes() as f64 + 1500.0 * n_free,
                seconds: flops / FLOPS + 5e-5 * n_free,
                application: 4.0 * n_contact * n_contact / BANDWIDTH,
            }
        }
    })
}
