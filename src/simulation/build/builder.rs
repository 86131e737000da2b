//! Builds the simulation of a plan: frame, bodies, flexibility and initial gap.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use crate::body::ElasticBody;
use crate::body::hybrid::indicators::MESH_ERROR_WARNING;
use crate::coupling::{clearance_and_interference, couple, surface_distance};
use crate::error::{Error, Warning};
use crate::evolution::Model;
use crate::frame::ContactFrame;
use crate::linalg::memory::MemoryLimit;
use crate::mesh::Mesh;
use crate::output::near_field::NearFieldRecord;
use crate::output::recorder::ProgressEvent;
use crate::output::summary::Timings;
use crate::scene::plan::Plan;
use crate::scene::spec::body::{Element, NearField};
use crate::simulation::build::bodies::{BuiltBody, HybridRejected, build_body};
use crate::simulation::build::candidate_cells::with_active_cells;
use crate::simulation::build::contact_frame::contact_frame;
use crate::simulation::build::frame_edges::with_body_ends;
use crate::simulation::build::memory;
use crate::simulation::build::near_field::NearFieldModel;
use crate::simulation::build::settings::operators;
use crate::simulation::build::{BuildReport, Simulation};
use crate::simulation::failure::{AtKey, SceneError};
use crate::simulation::omitted::omitted_by_plan;
use crate::simulation::plan_bodies::BODY_KEYS;
use crate::simulation::validate::{ValidScene, fit, flat_faces, validate};
use crate::simulation::worn_meshes::WornMeshes;

const NEAR_FIELD_REMEDIES: &str = "a finer mesh (mainly towards the edges of the supports), elements that represent bending better, or a smaller frame may help";

/// Builds the simulation of `plan`; `progress` receives each stage.
///
/// # Errors
/// * A control, mesh, support, material or frame of the plan is invalid.
/// * A body cannot be solved, or memory does not suffice.
/// * `stop` is set during the construction (kind `Interrupted`).
pub fn build<'p>(
    plan: &'p Plan,
    progress: &mut dyn FnMut(ProgressEvent),
    stop: &AtomicBool,
) -> std::result::Result<Simulation<'p>, SceneError> {
    build_with(plan, None, [None, None], progress, stop)
}

/// As [`build`], but on the frame `given`, if any. Bodies with a mesh in `worn` get the stiffness of this mesh
/// ([`crate::simulation::worn_meshes::worn_meshes`]).
///
/// # Errors
/// As [`build`].
pub fn build_with<'p>(
    plan: &'p Plan,
    given: Option<&ContactFrame>,
    worn: WornMeshes,
    progress: &mut dyn FnMut(ProgressEvent),
    stop: &AtomicBool,
) -> std::result::Result<Simulation<'p>, SceneError> {
    let mut timings = Timings::default();
    progress(ProgressEvent::Stage("frame", 0.0, None));
    let frame = timings.measure("frame", || {
        given.map_or_else(|| contact_frame(plan), |given| with_body_ends(plan, given.clone()))
    })?;
    let ValidScene { frame, near_fields, warnings } = validate(plan, frame)?;
    let frame = timings.measure("frame", || with_active_cells(plan, frame, &near_fields))?;
    let mut builder = Builder {
        plan,
        frame,
        near_fields,
        report: BuildReport { warnings, timings, ..BuildReport::default() },
        progress,
        stop,
    };
    let bodies = builder.build_bodies(worn)?;
    builder.couple(bodies)
}

struct Builder<'p, 's> {
    plan: &'p Plan,
    frame: ContactFrame,
    near_fields: [NearFieldModel; 2],
    report: BuildReport,
    progress: &'s mut dyn FnMut(ProgressEvent),
    stop: &'s AtomicBool,
}

impl<'p> Builder<'p, '_> {
    fn build_bodies(
        &mut self,
        worn: WornMeshes,
    ) -> std::result::Result<[Box<dyn ElasticBody>; 2], SceneError> {
        let mut held = 0;
        let mut bodies = Vec::with_capacity(2);
        for ((index, key), worn) in BODY_KEYS.into_iter().enumerate().zip(worn) {
            self.start_stage(key)?;
            let left = memory::remaining_limit(self.plan, &self.frame, held);
            let mut made = match self.build_body(index, worn.clone(), left)? {
                Ok(made) => made,
                Err(rejected) => self.fall_back_to_mesh(index, worn, left, rejected)?,
            };
            held += made.resident_bytes;
            if let Some(record) = made.near_field.take() {
                let element = self.plan.bodies[index].as_fe().and_then(|fe| fe.element);
                self.report.warnings.extend(coarse_mesh_warning(key, &record, element));
                self.report.near_fields.push(record);
            }
            if let Some(record) = made.truncation.take() {
                self.report.warnings.extend(record.accuracy_warning());
                self.report.truncations.push(record);
            }
            self.report.warnings.extend(made.warning.take().map(Warning::note));
            bodies.push(made.body);
        }
        Ok(bodies.try_into().unwrap_or_else(|_| unreachable!("the loop makes two bodies")))
    }

    fn start_stage(&mut self, stage: &str) -> std::result::Result<(), SceneError> {
        if self.stop.load(Ordering::Relaxed) {
            return Err(Error::interrupted().into());
        }
        (self.progress)(ProgressEvent::Stage(stage, 0.0, None));
        Ok(())
    }

    /// Builds body `index` within the memory `left`, or returns why its half-space near field is rejected.
    fn build_body(
        &mut self,
        index: usize,
        worn: Option<Arc<Mesh>>,
        left: MemoryLimit,
    ) -> std::result::Result<std::result::Result<BuiltBody, HybridRejected>, SceneError> {
        let (plan, frame, near) = (self.plan, &self.frame, &self.near_fields[index]);
        self.report.timings.measure(BODY_KEYS[index], || build_body(plan, index, worn, frame, near, left))
    }

    /// Builds body `index` with the near field of its mesh, and warns that the half-space was rejected.
    ///
    /// # Errors
    /// If the scene requires the half-space.
    fn fall_back_to_mesh(
        &mut self,
        index: usize,
        worn: Option<Arc<Mesh>>,
        left: MemoryLimit,
        rejected: HybridRejected,
    ) -> std::result::Result<BuiltBody, SceneError> {
        let (plan, key) = (self.plan, BODY_KEYS[index]);
        if plan.bodies[index].as_fe().is_some_and(|fe| fe.near_field == NearField::HalfSpace) {
            return Err(half_space_rejected_error(key, &rejected));
        }
        let why = near_field_fallback_message(key, &rejected);
        let fallback = Warning::uncertain(&why);
        (self.progress)(ProgressEvent::Message(&fallback.text));
        self.near_fields[index] = NearFieldModel::RejectedHalfSpace(rejected.reason.clone());
        // The candidate cells can change only before a meshed body is condensed to these cells.
        if plan.bodies[..index].iter().all(|body| body.as_meshed().is_none()) {
            let (frame, near) = (self.frame.clone(), &self.near_fields);
            self.frame = self.report.timings.measure("frame", || with_active_cells(plan, frame, near))?;
        }
        let fits = fit::check(plan, &self.frame, &self.near_fields)
            .map_err(|failure| SceneError { error: failure.error.context(&why), ..failure })?;
        let warnings = &mut self.report.warnings;
        let new: Vec<Warning> = fits.into_iter().filter(|note| !warnings.contains(note)).collect();
        warnings.extend(new);
        warnings.push(fallback);
        let meshed = self.build_body(index, worn, left)?;
        let mut made = meshed.unwrap_or_else(|_| unreachable!("a near field of the mesh is not rejected"));
        if let Some(record) = &mut made.near_field {
            record.indicators = Some(rejected.indicators);
        }
        Ok(made)
    }

    fn couple(
        mut self,
        [mut body1, mut body2]: [Box<dyn ElasticBody>; 2],
    ) -> std::result::Result<Simulation<'p>, SceneError> {
        self.start_stage("flexibility")?;
        let Self { plan, frame, mut report, .. } = self;
        let coupled = report
            .timings
            .measure("flexibility", || {
                couple(body1.as_mut(), body2.as_mut(), &frame, plan.solver.coupling, operators(plan, &frame))
            })
            .at("frame")?;
        let distance = surface_distance(&plan.gap, &frame, body1.as_ref(), body2.as_ref()).at("gap")?;
        let (clearance, interference) = if plan.gap.as_meshed {
            let (clearance, load) = clearance_and_interference(&distance);
            (clearance, Some(load))
        } else {
            (distance, None)
        };
        let initial_gap = coupled.initial_gap(&clearance);
        report.skipped = coupled.skipped;
        report.skipped.extend(omitted_by_plan(plan, &frame));
        let bodies = [body1, body2];
        for (index, body) in bodies.iter().enumerate() {
            report.add_body(plan, &frame, index, body.as_ref());
        }
        let model = Model {
            frame,
            flexibility: coupled.flexibility,
            initial_gap,
            loads: coupled.loads.into_iter().chain(interference).collect(),
            floating: coupled.floating,
            friction: plan.friction,
            wear: plan.wear,
            wear_share: plan.wear_share,
        };
        if let Some(approach) = plan.max_prescribed_approach() {
            let gap = &model.gap_of_full_loads()[2 * model.frame.n_cells()..];
            let own = |record: &NearFieldRecord| {
                let error = record.own_error.map(|error| error.mean);
                flat_faces::own_load_warning(plan, BODY_KEYS[record.body - 1], error, gap, approach)
            };
            report.warnings.extend(report.near_fields.iter().filter_map(own));
        }
        let contact_nodes = [contact_nodes(plan, 0)?, contact_nodes(plan, 1)?];
        Ok(Simulation { plan, model, bodies, contact_nodes, report })
    }
}

fn near_field_fallback_message(key: &str, given_up: &HybridRejected) -> String {
    format!(
        "the near field of {key} is computed with its mesh instead of a half-space: {}; {NEAR_FIELD_REMEDIES}",
        given_up.reason
    )
}

fn half_space_rejected_error(key: &str, given_up: &HybridRejected) -> SceneError {
    let error = Error::input(format!(
        "{key}.near_field = \"half-space\" is not possible, because the correction by the mesh is not accurate enough: {}; {NEAR_FIELD_REMEDIES}; \"auto\" and \"mesh\" use the near field of the mesh",
        given_up.reason
    ));
    SceneError { error, key: format!("{key}.near_field") }
}

fn coarse_mesh_warning(key: &str, record: &NearFieldRecord, element: Option<Element>) -> Option<Warning> {
    let indicators = record.indicators.filter(|_| record.reason.is_none())?;
    let error = indicators.mesh_error;
    let better = match element {
        Some(Element::Hex8 | Element::Hex8Bbar) => "element = \"hex8-eas\" or elements of second order",
        _ => "elements of second order",
    };
    // If `share` exceeds 1, the mesh error under concentrated loads is larger than under uniform loads. The limit is
    // then smaller.
    (error > MESH_ERROR_WARNING / indicators.share.max(1.0).sqrt()).then(|| {
        Warning::uncertain(&format!(
            "the finite elements of {key} are too stiff: they reduce the compliance under uniform tractions by an estimated {:.1} %. Use a finer mesh where `orthowear refine` suggests it, or {better}",
            100.0 * error
        ))
    })
}

/// Nodes of the contact surface of body `index`. Empty if the body has no mesh.
fn contact_nodes(plan: &Plan, index: usize) -> std::result::Result<Vec<usize>, SceneError> {
    let Some(fe) = plan.bodies[index].as_meshed() else { return Ok(Vec::new()) };
    Ok(fe.mesh.nodes_of(fe.mesh.group_of_dim(&fe.contact, 2).at(BODY_KEYS[index])?))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::hybrid::Indicators;

    /// Truth (docs/theory-hybrid.md): a mesh error above 0.02 / sqrt(max(`share`, 1)) causes a warning. A record with a
    /// `reason` causes no warning, because its near field comes from the mesh.
    #[test]
    fn meshes_that_are_too_stiff() {
        let told = |mesh_error: f64, share: f64, reason: Option<&str>| {
            let indicators = Indicators {
                nodes: [5; 2],
                rise: 0.0,
                field_error: 0.0,
                imbalance: 0.0,
                asymmetry: 0.0,
                direct_difference: 0.0,
                mesh_error,
                tail: 0.0,
                share,
                least_eigenvalue: 1.0,
            };
            let record = NearFieldRecord {
                body: 1,
                near_field: "half-space",
                reason: reason.map(str::to_owned),
                max_face_deviation: None,
                own_error: None,
                indicators: Some(indicators),
            };
            coarse_mesh_warning("body1", &record, None)
        };
        assert!(told(0.019, 0.5, None).is_none());
        let text = told(0.021, 0.5, None).expect("a warning").text;
        assert!(text.contains("body1") && text.contains("2.1 %"));
        assert!(told(0.009, 4.0, None).is_none() && told(0.011, 4.0, None).is_some());
        assert!(told(0.05, 4.0, Some("asked for")).is_none());
    }
}
