//! Resolves the document into the [`Plan`]. Checks the values against each other and collects all errors.

mod accuracy;
mod be_body;
mod bodies;
mod compare;
mod cycles;
mod frame;
mod friction_loads;
mod interior_points;
mod laws;
mod load_points;
mod loads;
mod materials;
mod orientations;
mod placements;
mod resolver;
mod rolling;
mod steps;
mod support_conflicts;

use materials::Materials;
use resolver::Resolver;

use super::diagnostic::Diagnostic;
use super::document::Document;
use super::plan::{BodyPlan, Plan, TruncatedHalfSpacePlan};
use super::spec::body::Body;
use super::spec::laws::{Friction, Wear};
use super::spec::solver::{Output, Solver};
use crate::error::Warning;
use crate::laws::friction::FrictionLaw;
use crate::linalg::memory::MemoryLimit;
use crate::output::summary::Units;
use crate::scene::mesh_cache::MeshCache;

/// Returns the plan of a document, its errors and its notes. The plan is `None` if there are errors, or if
/// `schema_valid` is false.
pub(super) fn resolve(
    document: &Document,
    meshes: &MeshCache,
    unknown_keys: &[String],
    schema_valid: bool,
) -> (Option<Plan>, Vec<Diagnostic>, Vec<Warning>) {
    let mut r = Resolver {
        document,
        meshes,
        diagnostics: Vec::new(),
        notes: Vec::new(),
        files: Vec::new(),
        unknown_keys,
        schema_valid,
    };
    let plan = build_plan(&mut r);
    let whole = schema_valid && r.diagnostics.is_empty();
    (plan.filter(|_| whole), r.diagnostics, r.notes)
}

/// Name of the scene file without extension.
fn file_stem(document: &Document) -> String {
    let stem = std::path::Path::new(&document.file).file_stem();
    stem.map_or_else(String::new, |stem| stem.to_string_lossy().into_owned())
}

fn build_plan(r: &mut Resolver) -> Option<Plan> {
    let title: Option<String> = r.section_or_default("title");
    let units: Option<Units> = r.section_or_default("units");
    let materials = materials::resolve(r);
    let bodies = [resolve_body(r, "body1", &materials), resolve_body(r, "body2", &materials)];
    let frame = frame::resolve_frame(r, &bodies);
    let gap = frame::resolve_gap(r, frame.as_ref(), &bodies);
    let friction: Option<Friction> = r.section_or_default("friction");
    let wear: Option<Wear> = r.section_or_default("wear");
    let ground = laws::LawContext { bodies: &bodies, frame: frame.as_ref() };
    let laws = laws::resolve(r, ground, friction, wear);
    let half_space_loads = loads::half_space_loads(r);
    let as_meshed = gap.as_ref().is_some_and(|gap| gap.as_meshed);
    let load_names = loads::load_names(&half_space_loads, &bodies, as_meshed);
    let steps = steps::resolve(r, laws.as_ref(), frame.as_ref(), load_names.as_deref());
    let friction = laws.as_ref().is_none_or(|laws| laws.friction != FrictionLaw::None)
        && steps.as_ref().is_none_or(|steps| steps.iter().any(|step| step.friction));
    loads::check(r, &half_space_loads, (&bodies, as_meshed), friction);
    rolling::check_model(r, frame.as_ref(), &bodies);
    let solver: Option<Solver> = r.section_or_default("solver");
    let memory = memory_limit(r, solver.as_ref());
    let output: Option<Output> = r.section_or_default("output");
    let compare = compare::resolve(r, &bodies);
    let interior_requests = interior_points::resolve(r, output.as_ref(), &bodies, frame.as_ref());
    let accuracy = accuracy::resolve(r);
    let [body1, body2] = bodies;
    let [loads1, loads2] = half_space_loads;
    let laws = laws?;
    Some(Plan {
        title: title.map(|title| if title.is_empty() { file_stem(r.document) } else { title })?,
        units: units?,
        bodies: [body1?, body2?],
        half_space_loads: [loads1?, loads2?],
        strength_limits: (materials.into_iter())
            .filter_map(|(name, material)| Some((name, material?.strength?)))
            .collect(),
        frame: frame?,
        gap: gap?,
        friction: laws.friction,
        wear: laws.wear,
        fibre_bodies: laws.fibre_bodies,
        wear_share: laws.integration.share,
        mesh_motion_threshold: laws.integration.move_mesh.map(|threshold| threshold.0),
        integrator: laws.integration.integrator,
        steps: steps?,
        solver: solver?,
        memory_limit: memory?,
        output: output?,
        compare: compare?,
        interior_requests,
        accuracy: accuracy?,
        fields_every: 1,
        flexibility_cache: None,
        notes: r.notes.clone(),
        files: std::mem::take(&mut r.files),
        document: r.document.clone(),
    })
}

fn resolve_body(r: &mut Resolver, key: &str, materials: &Materials) -> Option<BodyPlan> {
    let body: Body = r.section(key)?;
    match body {
        Body::Rigid {} => Some(BodyPlan::Rigid),
        Body::HalfSpace { material, fibre, truncated, .. } => {
            let elastic = materials::find_material(r, key, &material, fibre, materials)?;
            Some(match truncated {
                None => BodyPlan::HalfSpace(Box::new(elastic)),
                Some(half_size) => BodyPlan::TruncatedHalfSpace(Box::new(TruncatedHalfSpacePlan {
                    material: elastic,
                    half_size: half_size.0,
                })),
            })
        }
        Body::Fe(fe) => bodies::resolve_fe(r, key, &fe, materials),
        Body::Be(be) => be_body::resolve(r, key, *be, materials),
    }
}

/// Memory limit of the scene, or the default limit of the machine.
fn memory_limit(r: &mut Resolver, solver: Option<&Solver>) -> Option<MemoryLimit> {
    let Some(size) = &solver?.memory_limit else { return Some(MemoryLimit::of_machine()) };
    let bytes = size.bytes();
    if bytes.is_none() {
        r.report(
            "solver.memory_limit",
            "`memory_limit` is not a valid amount of memory",
            "not an amount of memory",
            "give a number of bytes, or a text like \"4 GiB\" or \"500 MB\"",
        );
    }
    bytes.map(MemoryLimit::of_scene)
}
