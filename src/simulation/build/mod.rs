//! Simulation of a plan, and the records of its construction.

pub(crate) mod bodies;
mod builder;
pub(crate) mod candidate_cells;
pub(crate) mod contact_frame;
pub(super) mod frame_edges;
pub(crate) mod memory;
pub(crate) mod meshed_gap;
pub(crate) mod near_field;
pub(super) mod settings;

use crate::body::{BodyEquations, BodyLoad, ElasticBody, FeBody};
use crate::error::{Result, Warning};
use crate::evolution::observer::Observer;
use crate::evolution::{self, Model, RunCheckpoint, RunResult};
use crate::flexibility::operator_history::OperatorHistory;
use crate::frame::ContactFrame;
use crate::geometry::Side;
use crate::laws::friction::FrictionLaw;
use crate::omitted::OmittedWork;
use crate::output::body_fields::{BodyOutput, RecoveryLocation};
use crate::output::boundary_elements::BoundaryElementRecord;
use crate::output::condensation::CondensationRecord;
use crate::output::near_field::NearFieldRecord;
use crate::output::summary::Timings;
use crate::output::surface_properties::{SurfaceFibre, SurfaceProperties};
use crate::output::truncation::TruncationRecord;
use crate::scene::plan::{BodyPlan, Plan};
use crate::simulation::build::settings::options;
use crate::simulation::omitted::{needs_factor_after_condensation, omitted_factorisation};
use crate::simulation::plan_bodies::BODY_KEYS;
use crate::simulation::validate::flat_faces;

pub use crate::simulation::build::builder::{build, build_with};

/// Plan with the contact model and the bodies with which its steps are computed.
pub struct Simulation<'p> {
    plan: &'p Plan,
    model: Model,
    bodies: [Box<dyn ElasticBody>; 2],
    contact_nodes: [Vec<usize>; 2],
    /// Records of the construction.
    pub report: BuildReport,
}

/// Records, warnings and times of the construction of a simulation.
#[derive(Default)]
pub struct BuildReport {
    /// Warnings from the checks of the plan and from the construction of the bodies.
    pub warnings: Vec<Warning>,
    /// Work omitted by the construction.
    pub skipped: Vec<OmittedWork>,
    /// Condensation of the meshed bodies.
    pub condensation: Vec<CondensationRecord>,
    /// The boundary-element bodies.
    pub boundary_elements: Vec<BoundaryElementRecord>,
    /// Truncated half-spaces.
    pub truncations: Vec<TruncationRecord>,
    /// Near-field models of the meshed bodies.
    pub near_fields: Vec<NearFieldRecord>,
    /// Elapsed seconds by stage.
    pub timings: Timings,
}

impl BuildReport {
    fn add_body(&mut self, plan: &Plan, frame: &ContactFrame, index: usize, body: &dyn ElasticBody) {
        match body.equations() {
            BodyEquations::BoundaryElements(body) => {
                let record = BoundaryElementRecord::new(index, body);
                self.warnings.extend(record.accuracy_warning());
                self.boundary_elements.push(record);
            }
            BodyEquations::FiniteElements(body) => {
                let condensed = body.condensed();
                let origin = condensed.origin();
                // Loads and fields need the factor even if the flexibility is cached.
                let solves =
                    condensed.model().has_own_loads() || needs_factor_after_condensation(plan, frame);
                let omitted = origin.cached && (!solves || condensed.factor_was_cached());
                self.skipped.extend(omitted.then(|| omitted_factorisation(index, solves)));
                self.warnings.extend(origin.cache_warning.clone().map(Warning::note));
                let record = CondensationRecord::new(index, condensed);
                self.warnings.extend(record.note().map(Warning::note));
                self.condensation.push(record);
            }
            _ => {}
        }
    }
}

impl Simulation<'_> {
    /// Runs the steps of the plan.
    ///
    /// # Errors
    /// As [`evolution::run`].
    pub fn run(&self, observer: &mut dyn Observer) -> Result<RunResult> {
        self.run_from(None, observer)
    }

    /// Runs the remaining steps after the checkpoint `from`, or all steps if `from` is `None`. Before the run, replays
    /// the history of the checkpoint's operators.
    ///
    /// # Errors
    /// As [`evolution::run`].
    pub fn run_from(
        &self,
        from: Option<(RunCheckpoint, &OperatorHistory)>,
        observer: &mut dyn Observer,
    ) -> Result<RunResult> {
        let snapshot = match from {
            Some((snapshot, course)) => {
                self.model.flexibility.replay(course)?;
                Some(snapshot)
            }
            None => None,
        };
        let mut result =
            evolution::run(&self.model, &self.plan.steps, &options(self.plan), snapshot, observer)?;
        if let Some(approach) = flat_faces::max_reached_approach(self.plan, &result.records) {
            let frame = &self.model.frame;
            let gap = self.model.loaded_gap(&result.state.load_amplitudes);
            let gap = &gap[2 * frame.n_cells()..];
            let as_meshed = self.plan.gap.as_meshed;
            if !as_meshed && !self.model.loads.iter().any(BodyLoad::changes_normal_gap) {
                let preload = flat_faces::reached_preload_warning(self.plan, frame, gap, approach);
                result.warnings.extend(preload.map(String::from));
            }
            if approach > 0.0 && !as_meshed {
                let bowed = [1, 2].map(|body| self.has_half_space_near_field(body));
                let doubts = flat_faces::check(self.plan, frame, gap, approach, bowed);
                let doubts = doubts.map_err(|failure| failure.error)?;
                result.warnings.extend(doubts.into_iter().map(String::from));
            }
            let own = |record: &NearFieldRecord| {
                let error = record.own_error.map(|error| error.shape);
                flat_faces::own_load_warning(self.plan, BODY_KEYS[record.body - 1], error, gap, approach)
            };
            result.warnings.extend(self.report.near_fields.iter().filter_map(own).map(String::from));
        }
        Ok(result)
    }

    /// Whether meshed body 1 or 2 has a half-space near field.
    pub(super) fn has_half_space_near_field(&self, body: usize) -> bool {
        self.report.near_fields.iter().any(|record| record.body == body && record.reason.is_none())
    }

    /// Largest gap due to each load, as magnitude, summed over the loads of all bodies with half-space near fields, mm.
    pub(super) fn max_gap_of_applied_loads(&self) -> f64 {
        let half_spaces =
            self.bodies.iter().enumerate().filter(|(i, _)| self.has_half_space_near_field(i + 1));
        let largest = |load: &BodyLoad| load.gap.iter().fold(0.0, |largest: f64, gap| largest.max(gap.abs()));
        half_spaces.flat_map(|(_, body)| body.loads()).map(largest).sum()
    }

    pub(super) fn fe_body(&self, index: usize) -> Option<&FeBody> {
        match self.bodies[index].equations() {
            BodyEquations::FiniteElements(body) => Some(body),
            _ => None,
        }
    }

    /// Contact model: frame, flexibility, initial gap, friction and wear laws.
    pub fn model(&self) -> &Model {
        &self.model
    }

    /// Extracts the contact model, and drops bodies and plan.
    pub fn into_model(self) -> Model {
        self.model
    }

    /// Axes, fibre directions and wear properties of the surface under the frame. If no body has a uniform fibre
    /// direction, the fibre direction of the friction law is used.
    pub fn surface(&self) -> SurfaceProperties {
        let plan = self.plan;
        let azimuth = self.model.frame.azimuth;
        let of_body = |(side, body): (Side, &BodyPlan)| {
            let elastic = body.material().filter(|elastic| !elastic.isotropic)?;
            let fibre = elastic.fibre?;
            Some(SurfaceFibre { side, tilt: fibre.tilt, azimuth: fibre.azimuth - azimuth })
        };
        let mut fibres: Vec<SurfaceFibre> =
            [Side::Lower, Side::Upper].into_iter().zip(&plan.bodies).filter_map(of_body).collect();
        if let (true, FrictionLaw::Frp { tilt, azimuth, .. }) = (fibres.is_empty(), plan.friction) {
            let side = if plan.bodies[0].has_fibre() { Side::Lower } else { Side::Upper };
            fibres.push(SurfaceFibre { side, tilt, azimuth });
        }
        SurfaceProperties::new(&plan.friction, &plan.wear, plan.wear_share, fibres)
    }

    /// Bodies whose fields can be written; rigid bodies have none.
    pub fn outputs(&self) -> Vec<BodyOutput<'_>> {
        let sides = [Side::Lower, Side::Upper];
        let parts = sides.into_iter().zip(&self.bodies).zip(&self.plan.bodies).zip(&self.contact_nodes);
        parts
            .filter_map(|(((side, body), spec), contact_nodes)| {
                let location = match spec {
                    BodyPlan::Rigid => return None,
                    BodyPlan::HalfSpace(_) | BodyPlan::TruncatedHalfSpace(_) => RecoveryLocation::FrameCells,
                    BodyPlan::Be(be) => RecoveryLocation::MeshNodes { mesh: &be.meshed.mesh, contact_nodes },
                    BodyPlan::Fe(fe) => {
                        let now = self
                            .fe_body(usize::from(side == Side::Upper))
                            .map(|body| body.condensed().model().mesh());
                        RecoveryLocation::MeshNodes { mesh: now.unwrap_or(&fe.mesh), contact_nodes }
                    }
                };
                let first_load = if side == Side::Lower { 0 } else { self.bodies[0].loads().len() };
                Some(BodyOutput { side, body: body.as_ref(), location, first_load })
            })
            .collect()
    }
}
