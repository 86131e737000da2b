//! Makes a plan ready for its history: frame, bodies, flexibility, initial gap.

use std::sync::atomic::{AtomicBool, Ordering};

use super::bodies::{GivenUp, KEYS, body, frame};
use super::candidates::{self, with_candidates};
use super::controls::refuse_impossible_controls;
use super::failure::{AtKey, Failure};
use super::flat_faces;
use super::grow::{self, Outgrown};
use super::memory;
use super::moving::{self, Meshes};
use super::near_field::{Near, choose};
use super::settings::{operators, options, way};
use super::skips::{cached, compression, needs_solves, skipped_fields};
use crate::body::hybrid::indicators::DOUBTFUL_MESH_ERROR;
use crate::body::{BodyEquations, ElasticBody, FeBody};
use crate::coupling::{couple, surface_distance};
use crate::error::{Error, Result, doubtful};
use crate::frame::ContactFrame;
use crate::friction::FrictionLaw;
use crate::geometry::Side;
use crate::history::record::Observer;
use crate::history::{self, Model, RunResult, Snapshot};
use crate::linalg::course::Course;
use crate::results::body_fields::{BodyOutput, BodyShape};
use crate::results::boundary_elements::BoundaryRecord;
use crate::results::condensation::CondensationRecord;
use crate::results::near_field::NearFieldRecord;
use crate::results::summary::Timings;
use crate::results::surface::{Surface, SurfaceFibre};
use crate::results::truncation::TruncationRecord;
use crate::scene::keys::body::NearField;
use crate::scene::plan::{BodySpec, Plan};
use crate::skip::Skipped;

/// What to do about a half-space that is not good enough.
const MAY_MEND: &str = "a finer mesh, above all towards the edges of what is held, elements that bend better, or a smaller frame may mend it";

/// A plan with everything its history needs.
pub struct Study<'p> {
    plan: &'p Plan,
    model: Model,
    bodies: [Box<dyn ElasticBody>; 2],
    contact_nodes: [Vec<usize>; 2],
    /// What the user should know of how bodies and frame fit.
    pub notes: Vec<String>,
    /// Work that was not needed so far.
    pub skipped: Vec<Skipped>,
    /// How the meshed bodies were condensed.
    pub condensation: Vec<CondensationRecord>,
    /// The bodies of boundary elements.
    pub boundary_elements: Vec<BoundaryRecord>,
    /// The half-spaces whose surfaces are meshed.
    pub truncations: Vec<TruncationRecord>,
    /// Where the near fields of the meshed bodies are computed.
    pub near_fields: Vec<NearFieldRecord>,
    /// Seconds by stage so far.
    pub timings: Timings,
}

/// Makes `plan` ready; `progress` hears of each stage (name, fraction done). `None` if `stop` was set meanwhile.
///
/// # Errors
/// If a mesh, support, material or frame of the plan is wrong, or memory does not suffice.
pub fn prepare<'p>(
    plan: &'p Plan,
    progress: &mut dyn FnMut(&str, f64),
    stop: &AtomicBool,
) -> std::result::Result<Option<Study<'p>>, Failure> {
    prepare_on(plan, None, progress, stop)
}

/// As [`prepare`], on a frame that was made for another plan; its own if none is given.
///
/// # Errors
/// As [`prepare`].
pub fn prepare_on<'p>(
    plan: &'p Plan,
    given: Option<&ContactFrame>,
    progress: &mut dyn FnMut(&str, f64),
    stop: &AtomicBool,
) -> std::result::Result<Option<Study<'p>>, Failure> {
    prepare_worn(plan, (given, [None, None]), progress, stop)
}

/// As [`prepare_on`], with the stiffness of worn meshes ([`moving::meshes`]) where there are any.
///
/// # Errors
/// As [`prepare`].
pub fn prepare_worn<'p>(
    plan: &'p Plan,
    (given, worn): (Option<&ContactFrame>, Meshes),
    progress: &mut dyn FnMut(&str, f64),
    stop: &AtomicBool,
) -> std::result::Result<Option<Study<'p>>, Failure> {
    let mut timings = Timings::default();
    progress("frame", 0.0);
    let frame = timings.measure("frame", || given.map_or_else(|| frame(plan), |given| Ok(given.clone())))?;
    refuse_impossible_controls(plan, &frame)?;
    let mut near = choose(plan, &frame)?;
    let mut notes = super::fit::check(plan, &frame, &near)?;
    let frame = timings.measure("frame", || with_candidates(plan, frame, &near))?;
    let (mut bodies, mut near_fields, mut held) = (Vec::with_capacity(2), Vec::new(), 0);
    let mut truncations = Vec::new();
    for ((index, key), worn) in KEYS.into_iter().enumerate().zip(worn) {
        if stop.load(Ordering::Relaxed) {
            return Ok(None);
        }
        progress(key, 0.0);
        let left = memory::left(plan, &frame, held);
        let half_space =
            timings.measure(key, || body(plan, (index, worn.clone()), (&frame, &near[index]), left))?;
        let mut made = match half_space {
            Ok(made) => made,
            Err(given_up) => {
                if plan.bodies[index].fe().is_some_and(|fe| fe.near_field == NearField::HalfSpace) {
                    return Err(not_good_enough(key, &given_up));
                }
                let why = given_up_note(key, &given_up);
                near[index] = Near::GivenUp(given_up.reason.clone());
                let fits = super::fit::check(plan, &frame, &near);
                let fits =
                    fits.map_err(|failure| Failure { error: failure.error.context(&why), ..failure })?;
                notes.extend(fits.into_iter().filter(|note| !notes.contains(note)).collect::<Vec<_>>());
                notes.push(doubtful(&why));
                let meshed =
                    timings.measure(key, || body(plan, (index, worn), (&frame, &near[index]), left))?;
                let mut made = meshed.unwrap_or_else(|_| unreachable!("a mesh is not given up"));
                if let Some(record) = &mut made.near_field {
                    record.indicators = Some(given_up.indicators);
                }
                made
            }
        };
        held += made.held_bytes;
        if let Some(record) = made.near_field.take() {
            notes.extend(too_stiff(key, &record));
            near_fields.push(record);
        }
        if let Some(record) = made.truncation.take() {
            notes.extend(record.doubt());
            truncations.push(record);
        }
        notes.extend(made.note.take());
        bodies.push(made.body);
    }
    let [mut body1, mut body2]: [Box<dyn ElasticBody>; 2] =
        bodies.try_into().unwrap_or_else(|_| unreachable!("the loop makes two bodies"));
    if stop.load(Ordering::Relaxed) {
        return Ok(None);
    }
    progress("flexibility", 0.0);
    let coupled = timings
        .measure("flexibility", || {
            couple(body1.as_mut(), body2.as_mut(), &frame, way(plan), operators(plan, &frame))
        })
        .at("frame")?;
    let distance = surface_distance(&plan.gap, &frame, body1.as_ref(), body2.as_ref()).at("gap")?;
    let initial_gap = coupled.initial_gap(&distance);
    if let Some(approach) = flat_faces::prescribed(plan) {
        let gap = &initial_gap[2 * frame.n_cells()..];
        let own = |record: &NearFieldRecord| {
            let error = record.own_error.map(|error| error.mean);
            flat_faces::own_loads(plan, KEYS[record.body - 1], error, (gap, approach))
        };
        notes.extend(near_fields.iter().filter_map(own));
    }
    let mut skipped = coupled.skipped;
    skipped.extend(candidates::skipped(&frame));
    skipped.extend(compression(plan, &frame));
    skipped.extend(skipped_fields(plan));
    skipped.extend(grow::skipped(plan));
    skipped.extend(moving::skipped(plan));
    let mut condensation = Vec::new();
    let mut boundary_elements = Vec::new();
    for (index, body) in [&body1, &body2].into_iter().enumerate() {
        let body = match body.equations() {
            BodyEquations::FiniteElements(body) => body,
            BodyEquations::BoundaryElements(body) => {
                let record = BoundaryRecord::new(index, body);
                notes.extend(record.doubt());
                boundary_elements.push(record);
                continue;
            }
            _ => continue,
        };
        let origin = body.condensed().origin();
        // Loads and fields need the factor all the same.
        let condensed = body.condensed();
        let solves = condensed.model().is_loaded() || needs_solves(plan, &frame);
        let saved = origin.saved_seconds.filter(|_| !solves || condensed.had_factor());
        skipped.extend(saved.map(|seconds| cached(index, Some(seconds), solves)));
        notes.extend(origin.note.clone());
        let record = CondensationRecord::new(index, body.condensed());
        notes.extend(record.note());
        condensation.push(record);
    }
    let model = Model {
        frame,
        flexibility: coupled.flexibility,
        initial_gap,
        floating: coupled.floating,
        friction: plan.friction,
        wear: plan.wear,
        wear_share: plan.wear_share,
    };
    let contact_nodes = [contact_nodes(plan, 0)?, contact_nodes(plan, 1)?];
    Ok(Some(Study {
        plan,
        model,
        bodies: [body1, body2],
        contact_nodes,
        skipped,
        condensation,
        boundary_elements,
        truncations,
        near_fields,
        notes,
        timings,
    }))
}

/// That the half-space of body `key` was tried for its near field and given up.
fn given_up_note(key: &str, given_up: &GivenUp) -> String {
    format!(
        "the near field of {key} is that of its mesh and not of a half-space: {}; {MAY_MEND}",
        given_up.reason
    )
}

/// That the half-space which body `key` asks for must not be used.
fn not_good_enough(key: &str, given_up: &GivenUp) -> Failure {
    let error = Error::input(format!(
        "{key} asks for the near field of a half-space, whose correction by the mesh is not good enough: {}; {MAY_MEND}, \"auto\" and \
         \"mesh\" take the near field of the mesh",
        given_up.reason
    ));
    Failure { error, key: format!("{key}.near_field") }
}

/// A note if the finite elements that carry a far field are estimated to err by more than they should.
fn too_stiff(key: &str, record: &NearFieldRecord) -> Option<String> {
    let indicators = record.indicators.filter(|_| record.reason.is_none())?;
    let error = indicators.mesh_error;
    // Concentrated loads err by more than uniform ones where the mesh carries most of the displacement.
    (error > DOUBTFUL_MESH_ERROR / indicators.share.max(1.0).sqrt()).then(|| {
        doubtful(&format!(
            "the finite elements of {key} are estimated to be too stiff by {:.1} % of its compliance under uniform tractions: take a finer \
             mesh where `orthowear refine` says, or elements that bend better (of second order, \"hex8-eas\")",
            100.0 * error
        ))
    })
}

/// Nodes of the contact surface of body `index`; none without a mesh.
fn contact_nodes(plan: &Plan, index: usize) -> std::result::Result<Vec<usize>, Failure> {
    let Some(fe) = plan.bodies[index].meshed() else { return Ok(Vec::new()) };
    Ok(fe.mesh.nodes_of(fe.mesh.group_of_dim(&fe.contact, 2).at(KEYS[index])?))
}

impl Study<'_> {
    /// Runs the steps of the plan.
    ///
    /// # Errors
    /// As [`history::run`].
    pub fn run(&self, observer: &mut dyn Observer) -> Result<RunResult> {
        self.run_from(None, observer)
    }

    /// The same, or what is left of them: goes on from a state, with what the operators held there.
    ///
    /// # Errors
    /// As [`history::run_from`].
    pub fn run_from(
        &self,
        from: Option<(Snapshot, &Course)>,
        observer: &mut dyn Observer,
    ) -> Result<RunResult> {
        let snapshot = match from {
            Some((snapshot, course)) => {
                self.model.flexibility.repeat(course)?;
                Some(snapshot)
            }
            None => None,
        };
        let mut result =
            history::run_from(&self.model, &self.plan.steps, &options(self.plan), snapshot, observer)?;
        if let Some(approach) = flat_faces::reached(self.plan, &result.records) {
            let frame = &self.model.frame;
            let gap = &self.model.initial_gap[2 * frame.n_cells()..];
            if approach > 0.0 {
                let bowed = [1, 2].map(|body| self.is_half_space(body));
                let doubts = flat_faces::check(self.plan, frame, (gap, approach), bowed);
                result.warnings.extend(doubts.map_err(|failure| failure.error)?);
            }
            let own = |record: &NearFieldRecord| {
                let error = record.own_error.map(|error| error.shape);
                flat_faces::own_loads(self.plan, KEYS[record.body - 1], error, (gap, approach))
            };
            result.warnings.extend(self.near_fields.iter().filter_map(own));
        }
        Ok(result)
    }

    /// Whether the near field of meshed body 1 or 2 is that of a half-space.
    pub(super) fn is_half_space(&self, body: usize) -> bool {
        self.near_fields.iter().any(|record| record.body == body && record.near_field == "half-space")
    }

    /// The most that loads of bodies with half-spaces change the gap by, mm.
    pub(super) fn largest_own_gap(&self) -> f64 {
        let half_spaces = self.bodies.iter().enumerate().filter(|(i, _)| self.is_half_space(i + 1));
        let gaps = half_spaces.filter_map(|(_, body)| body.free_gap()).flatten();
        gaps.fold(0.0, |largest, gap| largest.max(gap.abs()))
    }

    /// What is left of it for a study on a larger frame, which goes on from `snapshot`; the bodies and operators are dropped.
    pub fn outgrown(self, snapshot: Snapshot) -> Outgrown {
        let half_spaces = [1, 2].map(|body| self.is_half_space(body));
        Outgrown { frame: self.model.frame, gap: self.model.initial_gap, half_spaces, snapshot }
    }

    /// Body `index`, if it is meshed.
    pub(super) fn meshed(&self, index: usize) -> Option<&FeBody> {
        match self.bodies[index].equations() {
            BodyEquations::FiniteElements(body) => Some(body),
            _ => None,
        }
    }

    /// Frame, flexibility, gap and laws.
    pub fn model(&self) -> &Model {
        &self.model
    }

    /// The same, without the bodies and the plan.
    pub fn into_model(self) -> Model {
        self.model
    }

    /// Axes, fibres and wear of the surface under the frame; a body whose fibres vary has those that the friction law takes.
    pub fn surface(&self) -> Surface {
        let plan = self.plan;
        let azimuth = self.model.frame.azimuth;
        let of_body = |(side, body): (Side, &BodySpec)| {
            let elastic = body.elastic().filter(|elastic| !elastic.isotropic)?;
            let fibre = elastic.fibre?;
            Some(SurfaceFibre { side, tilt: fibre.tilt, azimuth: fibre.azimuth - azimuth })
        };
        let mut fibres: Vec<SurfaceFibre> =
            [Side::Lower, Side::Upper].into_iter().zip(&plan.bodies).filter_map(of_body).collect();
        if let (true, FrictionLaw::Frp { tilt, azimuth, .. }) = (fibres.is_empty(), plan.friction) {
            let side = if plan.bodies[0].has_fibre() { Side::Lower } else { Side::Upper };
            fibres.push(SurfaceFibre { side, tilt, azimuth });
        }
        Surface::new(&plan.friction, &plan.wear, plan.wear_share, fibres)
    }

    /// The bodies whose fields can be written; a rigid one has none.
    pub fn outputs(&self) -> Vec<BodyOutput<'_>> {
        let sides = [Side::Lower, Side::Upper];
        let parts = sides.into_iter().zip(&self.bodies).zip(&self.plan.bodies).zip(&self.contact_nodes);
        parts
            .filter_map(|(((side, body), spec), contact_nodes)| {
                let shape = match spec {
                    BodySpec::Rigid => return None,
                    BodySpec::HalfSpace(_) | BodySpec::Truncated(_) => BodyShape::Frame,
                    BodySpec::Be(be) => BodyShape::Mesh { mesh: &be.meshed.mesh, contact_nodes },
                    BodySpec::Fe(fe) => {
                        // It may have moved with wear.
                        let now = self
                            .meshed(usize::from(side == Side::Upper))
                            .map(|body| body.condensed().model().mesh());
                        BodyShape::Mesh { mesh: now.unwrap_or(&fe.mesh), contact_nodes }
                    }
                };
                Some(BodyOutput { side, body: body.as_ref(), shape })
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::hybrid::Indicators;

    /// Truth: docs/theory-hybrid.md: a warning from 0.02 on, over the root of `share` where that exceeds 1, and none of a body whose mesh is
    /// condensed for another reason.
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
                bow: None,
                own_error: None,
                indicators: Some(indicators),
            };
            too_stiff("body1", &record)
        };
        assert!(told(0.019, 0.5, None).is_none());
        assert!(told(0.021, 0.5, None).is_some_and(|text| text.contains("body1") && text.contains("2.1 %")));
        assert!(told(0.009, 4.0, None).is_none() && told(0.011, 4.0, None).is_some());
        assert!(told(0.05, 4.0, Some("asked for")).is_none());
    }
}
