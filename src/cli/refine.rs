use std::path::{Path, PathBuf};

use clap::Args;

use super::console::{print_diagnostics, print_error, to_stderr, to_stdout};
use super::options::{CommandResult, SceneArgs};
use super::progress::ProgressDisplay;
use super::run::{explain_divergence, reason_label, show_failure};
use super::signal;
use crate::adaptive::size_field::{RefinementTarget, SizeField, size_field};
use crate::body::ErrorEstimation;
use crate::element::ElementKind;
use crate::error::exit;
use crate::error::{Error, ErrorKind, Result};
use crate::evolution::observer::Observer;
use crate::evolution::records::{FrameState, IncrementRecord, Outcome};
use crate::fem::{ErrorEstimate, MIN_RELATIVE_ERROR};
use crate::geometry::{bounds, format_short};
use crate::mesh::gmsh::write_size_field;
use crate::output::atomic_file::write_atomically_with;
use crate::output::body_fields::{BodyOutput, RecoveryLocation};
use crate::output::body_peaks::ErrorRecord;
use crate::scene::Plan;
use crate::simulation::{self, Simulation};

/// Options of `orthowear refine`.
#[derive(Debug, Args)]
pub(super) struct RefineArgs {
    #[command(flatten)]
    pub(super) scene: SceneArgs,
    /// Target relative error of the stress in the energy norm; default: half of the current error.
    #[arg(long, value_name = "SHARE", value_parser = parse_error_fraction)]
    error: Option<f64>,
    /// Size field file (.pos); default: SCENE_body1.pos or SCENE_body2.pos next to the scene.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Body to refine; required with --out if both bodies have meshes.
    #[arg(long, value_name = "1|2", value_parser = clap::value_parser!(u8).range(1..=2))]
    body: Option<u8>,
    /// Last step to run; default: the last step before the first step with `cycles` or `sliding`.
    #[arg(long, value_name = "NAME")]
    step: Option<String>,
    /// Smallest element size; default: a quarter of the current smallest size.
    #[arg(long, value_name = "LENGTH", value_parser = parse_positive)]
    min_size: Option<f64>,
    /// Largest element size; default: twice the current largest size.
    #[arg(long, value_name = "LENGTH", value_parser = parse_positive)]
    max_size: Option<f64>,
    /// Largest gradient of the element size (change of size per distance).
    #[arg(long, value_name = "RATE", value_parser = parse_positive, default_value = "0.4")]
    growth: f64,
    /// Prints errors only.
    #[arg(long)]
    quiet: bool,
}

fn parse_positive(text: &str) -> std::result::Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value.is_finite() && value > 0.0 => Ok(value),
        _ => Err("it must be a positive number".to_owned()),
    }
}

fn parse_error_fraction(text: &str) -> std::result::Result<f64, String> {
    parse_positive(text)
        .ok()
        .filter(|value| *value < 1.0)
        .ok_or_else(|| "it must lie between 0 and 1, e.g. 0.02".to_owned())
}

struct StepEnds<'a> {
    /// Name and last state of each step.
    states: Vec<(String, FrameState)>,
    progress: ProgressDisplay,
    stop: &'a std::sync::atomic::AtomicBool,
}

impl Observer for StepEnds<'_> {
    fn progress(&mut self, stage: &str, fraction: f64, residual: Option<f64>) {
        self.progress.show(stage, fraction, residual);
    }

    fn increment_done(&mut self, record: &IncrementRecord, state: &FrameState) -> Result<()> {
        match self.states.iter_mut().find(|(name, _)| *name == record.name) {
            Some((_, kept)) => kept.clone_from(state),
            None => self.states.push((record.name.clone(), state.clone())),
        }
        Ok(())
    }

    fn cancelled(&self) -> bool {
        self.stop.load(std::sync::atomic::Ordering::Relaxed)
    }
}

pub(super) fn refine(arguments: &RefineArgs) -> CommandResult {
    let stop = signal::install();
    let mut plan = arguments.scene.plan().map_err(|mistakes| print_diagnostics(&mistakes))?;
    keep_steps_to_run(&mut plan, arguments).map_err(|error| print_error(&error))?;
    if plan.accuracy.is_some() && !arguments.quiet {
        to_stderr(
            "note: `accuracy` is not used here: the scene runs once, with its own cells and increments\n",
        );
    }
    let bodies = bodies_to_refine(&plan, arguments).map_err(|error| print_error(&error))?;
    let mut progress = ProgressDisplay::new(arguments.quiet);
    let study = match simulation::build(&plan, &mut |event| progress.on_event(event), stop) {
        Ok(study) => study,
        Err(failure) if failure.error.kind() == ErrorKind::Interrupted => return Err(exit::INTERRUPTED),
        Err(failure) => {
            progress.end();
            return Err(show_failure(&plan, &failure));
        }
    };
    let mut ends = StepEnds { states: Vec::new(), progress, stop };
    let outcome = study.run(&mut ends).map(|result| result.outcome);
    ends.progress.end();
    match outcome {
        Ok(Outcome::Converged) => {}
        Ok(Outcome::NotConverged(why)) => {
            to_stderr(&format!("not converged{}: {}\n", reason_label(why), explain_divergence(why)));
            return Err(exit::NOT_CONVERGED);
        }
        Ok(Outcome::Interrupted) => return Err(exit::INTERRUPTED),
        Err(error) => return Err(print_unless_interrupted(&error)),
    }
    let text = write_fields(&plan, &study, arguments, &bodies, &ends.states)
        .map_err(|error| print_unless_interrupted(&error))?;
    if !arguments.quiet {
        to_stdout(&text);
    }
    Ok(exit::DONE)
}

fn print_unless_interrupted(error: &Error) -> u8 {
    if error.kind() == ErrorKind::Interrupted { error.exit_code() } else { print_error(error) }
}

fn keep_steps_to_run(plan: &mut Plan, arguments: &RefineArgs) -> Result<()> {
    let last = match &arguments.step {
        Some(name) => plan.steps.iter().rposition(|step| step.name == *name).ok_or_else(|| {
            let names: Vec<&str> = plan.steps.iter().map(|step| step.name.as_str()).collect();
            Error::input(format!("the scene has no step `{name}`; its steps are {}", names.join(", ")))
        })?,
        None => match plan.steps.iter().position(|step| step.kind.cycles().is_some()) {
            None => plan.steps.len() - 1,
            Some(0) => {
                return Err(Error::input(format!(
                    "the first step, `{0}`, has cycles, so there is no step to run before it. Add a step without cycles, or run all cycles of the first step with --step {0}",
                    plan.steps[0].name
                )));
            }
            Some(first) => first - 1,
        },
    };
    plan.steps.truncate(last + 1);
    Ok(())
}

fn bodies_to_refine(plan: &Plan, arguments: &RefineArgs) -> Result<Vec<(usize, PathBuf)>> {
    let meshed: Vec<usize> = (0..2).filter(|&index| plan.bodies[index].as_fe().is_some()).collect();
    let chosen: Vec<usize> = match arguments.body {
        Some(body) => meshed.iter().copied().filter(|&index| index + 1 == usize::from(body)).collect(),
        None => meshed,
    };
    match (chosen.as_slice(), &arguments.out) {
        ([], _) => Err(Error::input(match arguments.body {
            Some(body) => format!(
                "body {body} is not a finite-element body; only finite-element bodies have an error estimate"
            ),
            None => "the scene has no finite-element body; only finite-element bodies have an error estimate"
                .to_owned(),
        })),
        ([_, _], Some(_)) => {
            Err(Error::input("both bodies have meshes: choose one with --body 1 or --body 2"))
        }
        (_, Some(out)) => Ok(vec![(chosen[0], out.clone())]),
        (_, None) => Ok(chosen
            .iter()
            .map(|&index| (index, default_size_file(&arguments.scene.scene, index)))
            .collect()),
    }
}

fn default_size_file(scene: &Path, index: usize) -> PathBuf {
    let stem = scene.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    scene.with_file_name(format!("{stem}_body{}.pos", index + 1))
}

/// Writes the size field of each body. If the estimated error is at rounding level, no field is written. Returns the
/// text for the user.
fn write_fields(
    plan: &Plan,
    study: &Simulation<'_>,
    arguments: &RefineArgs,
    bodies: &[(usize, PathBuf)],
    ends: &[(String, FrameState)],
) -> Result<String> {
    let wanted = RefinementTarget {
        error: arguments.error,
        least: arguments.min_size,
        largest: arguments.max_size,
        growth: arguments.growth,
    };
    let length = &plan.units.length;
    let mut text = String::new();
    for (index, file) in bodies {
        let key = format!("body{}", index + 1);
        let outputs = study.outputs();
        let found = outputs.iter().find_map(|output| match output.location {
            RecoveryLocation::MeshNodes { mesh, .. } if output.side.key() == key => Some((output, mesh)),
            _ => None,
        });
        let Some((output, mesh)) = found else { continue };
        let mut estimates = Vec::new();
        for (step, state) in ends {
            let estimate = estimate(output, state)?;
            text.push_str(&format!("{key}, {step}: {}\n", ErrorRecord::new(&estimate).advice(length)));
            estimates.push(estimate);
        }
        if estimates
            .iter()
            .all(|estimate| estimate.stress_norm > 0.0 && estimate.relative_error() < MIN_RELATIVE_ERROR)
        {
            text.push_str(&format!(
                "{key}: the estimated error is at rounding level; no size field was written\n"
            ));
            continue;
        }
        let field = size_field(mesh, &estimates, &wanted)?;
        let source = plan.bodies[*index].as_fe().map_or("", |fe| fe.mesh_name.as_str());
        let [smallest, largest] = bounds(field.nodal.iter().copied().filter(|size| *size > 0.0));
        let comment = comment(plan, source, &field);
        write_atomically_with(file, |out| write_size_field(out, mesh, &field.nodal, &comment))?;
        let percent = format_short(100.0 * field.error);
        let target = if field.reaches_target {
            format!("an error of {percent} % needs")
        } else {
            format!(
                "the target of {percent} % is not reached in one round, because sizes decrease at most to a quarter. Refine again with the new mesh. This size field gives"
            )
        };
        let (name, kinds) = (file.display(), || mesh.blocks.iter().map(|block| block.kind));
        let remesh = if kinds().any(|kind| matches!(kind, ElementKind::Tet4 | ElementKind::Tet10)) {
            format!("New mesh: gmsh -3 -bgm {name} GEO -o NEW.msh{GMSH_SIZE_OPTIONS} (GEO: your geometry)")
        } else {
            "Extruded and transfinite cells ignore size fields: set these sizes in the geometry, or use tetrahedra".to_owned()
        };
        text.push_str(&format!(
            "{key}: {} elements now; {target} about {:.0} elements of size {:.4} to {:.4} {length}\nwrote {name}. {remesh}\n",
            field.elements, field.next_elements, smallest, largest,
        ));
    }
    Ok(text)
}

/// Options that make gmsh use the sizes of the field only, not the sizes in the .geo file.
const GMSH_SIZE_OPTIONS: &str = " -setnumber Mesh.CharacteristicLengthFromPoints 0 -setnumber Mesh.CharacteristicLengthExtendFromBoundary 0";

fn estimate(output: &BodyOutput<'_>, state: &FrameState) -> Result<ErrorEstimate> {
    let loading = output.loading(state);
    let displacement = output.body.recover(loading)?.displacement;
    let field = output.body.recover_stress(loading, &displacement, ErrorEstimation::Estimate)?;
    field
        .and_then(|field| field.error)
        .ok_or_else(|| Error::numerical("the error of a meshed body could not be estimated"))
}

fn comment(plan: &Plan, source: &str, field: &SizeField) -> Vec<String> {
    vec![
        format!("Element sizes for a mesh to replace {source}, for an estimated error of {:.2} %.", 100.0 * field.error),
        format!("Made by orthowear {} refine from {}.", env!("CARGO_PKG_VERSION"), plan.document.file),
        format!("gmsh -3 -bgm THIS_FILE GEO -o NEW.msh{GMSH_SIZE_OPTIONS}"),
        "Size fields control tetrahedral meshes (and triangle meshes before extrusion); transfinite and extruded cells ignore them."
            .to_owned(),
    ]
}
