use serde_json::Value;

use super::console::{print_diagnostics, to_stdout};
use super::options::{CommandResult, SceneArgs, flexibility_cache};
use super::progress::format_duration;
use super::render::with_severity;
use super::run::show_failure;
use super::table::{align_columns, five_digits};
use crate::adaptive::AccuracySearch;
use crate::body::LoadCase;
use crate::error::exit;
use crate::estimate::{RunEstimate, estimate};
use crate::evolution::step::{
    ClosedPath, Correction, Drive, JumpPolicy, Normal, ResolvedCycleSettings, Spin, Step, StepKind,
    Tangential, Tilt,
};
use crate::geometry::format_direction;
use crate::laws::friction::FrictionLaw;
use crate::laws::wear::WearLaw;
use crate::scene::plan::{FramePlan, Plan};
use crate::scene::schema::json_schema;
use crate::scene::spec::frame::FramePoints;
use crate::simulation::plan_bodies;
use crate::simulation::plan_bodies::BODY_KEYS;

pub(super) fn check(arguments: &SceneArgs) -> CommandResult {
    let mut plan = arguments.plan().map_err(|mistakes| print_diagnostics(&mistakes))?;
    plan.flexibility_cache = flexibility_cache(false)?;
    let looked = || Ok((estimate(&plan)?, AccuracySearch::new(&plan)?));
    let (forecast, search) = looked().map_err(|failure| show_failure(&plan, &failure))?;
    to_stdout(&describe(&plan, &forecast, search.as_ref()));
    Ok(exit::DONE)
}

fn describe(plan: &Plan, forecast: &RunEstimate, search: Option<&AccuracySearch>) -> String {
    let mut rows: Vec<Vec<String>> = summary_rows(plan, forecast);
    if let Some((search, wanted)) = search.zip(plan.accuracy.as_ref()) {
        let knobs: Vec<&str> = search.knobs().iter().map(|knob| knob.label()).collect();
        let words = format!(
            "target {:e}: {} are refined until the estimated error is below it; the values above are those of the scene",
            wanted.relative,
            knobs.join(", ")
        );
        rows.push(vec!["accuracy".to_owned(), words]);
    }
    let width = rows.iter().map(|row| row[0].chars().count()).max().unwrap_or(0);
    let mut text = format!("{}\n\n", plan.title);
    for row in &rows {
        text.push_str(&format!("{:width$}   {}\n", row[0], row[1]));
    }
    text.push_str("\nsteps\n");
    text.push_str(&align_columns(&step_rows(plan)));
    let loads = load_rows(plan);
    if !loads.is_empty() {
        text.push_str("\nloads of the bodies at the end of each step\n");
        text.push_str(&align_columns(&loads));
    }
    text.push_str("\nskipped\n");
    if forecast.skipped.is_empty() {
        text.push_str("  nothing\n");
    }
    for skip in &forecast.skipped {
        text.push_str(&format!("  {}: {}\n", skip.what, skip.why));
    }
    text.push_str("\ndefaults\n");
    for (key, value) in defaults(plan) {
        text.push_str(&format!("  {key}: {value}\n"));
    }
    let of_bodies = forecast.bodies.iter().filter_map(|body| body.warning.as_ref());
    for note in plan.notes.iter().chain(of_bodies).chain(&forecast.warnings) {
        text.push_str(&format!("\n{}\n", with_severity(note)));
    }
    text.push_str(&format!("\n{}: no errors found\n", plan.document.file));
    text
}

/// Keys that the main sections of the scene omit, with their default values.
fn defaults(plan: &Plan) -> Vec<(String, String)> {
    let schema = json_schema();
    let mut found = Vec::new();
    for section in ["units", "friction", "wear", "solver", "output"] {
        let property = &schema["properties"][section];
        let mut list = |key: String, property: &Value| {
            if let (Some(default), None) = (property.get("default"), plan.document.get(&key)) {
                found.push((key, default_text(default)));
            }
        };
        if property.get("default").is_some() {
            list(section.to_owned(), property);
            continue;
        }
        let table = property["$ref"].as_str().and_then(|place| schema.pointer(place.trim_start_matches('#')));
        for (name, property) in table.and_then(|table| table["properties"].as_object()).into_iter().flatten()
        {
            list(format!("{section}.{name}"), property);
        }
    }
    if plan.document.get("solver.memory_limit").is_none() && !plan.memory_limit.is_of_command_line() {
        let value = "80 % of the memory available at the start of the run";
        found.push(("solver.memory_limit".to_owned(), value.to_owned()));
    }
    found
}

fn default_text(default: &Value) -> String {
    match default {
        Value::Object(entries) => {
            let parts = entries.iter().map(|(name, value)| format!("{name} {}", default_text(value)));
            parts.collect::<Vec<_>>().join(", ")
        }
        Value::String(word) => word.clone(),
        Value::Array(_) => default.to_string().replace(',', ", "),
        _ => default.to_string(),
    }
}

fn summary_rows(plan: &Plan, forecast: &RunEstimate) -> Vec<Vec<String>> {
    let length = &plan.units.length;
    let frame = match plan.frame {
        FramePlan::Grid { half_width, cells, periodic, ref outline, .. } => {
            let all = cells[0] * cells[1];
            let repeated = match periodic {
                [false, false] => "",
                [true, false] => ", periodic along x",
                [false, true] => ", periodic along y",
                [true, true] => ", periodic along x and y",
            };
            let grid = format!(
                "grid of {} x {} = {all} cells, {} x {} {length}{repeated}",
                cells[0],
                cells[1],
                2.0 * half_width[0],
                2.0 * half_width[1]
            );
            let (inside, outside) = (forecast.n_cells, all - forecast.n_cells);
            match outline {
                Some(_) => format!("{grid}; {inside} inside the outline, {outside} outside"),
                None => grid,
            }
        }
        FramePlan::Mesh { body, points, .. } => {
            let what = if points == FramePoints::Faces { "faces" } else { "node cells" };
            format!("{} {what} of the contact group of body {}", forecast.n_cells, body + 1)
        }
    };
    let axes = matches!(plan.frame, FramePlan::Mesh { .. }).then(|| {
        let [x, y, n] = [0, 1, 2].map(|k| format_direction(&forecast.frame_axes.0.column(k).into()));
        ("frame axes", format!("x = {x}, y = {y}, n = {n}; `approach` moves body 2 against n"))
    });
    let allowed = plan.memory_limit.description().map_or_else(String::new, |words| format!(" ({words})"));
    let mib = forecast.memory_bytes / f64::from(1 << 20);
    let mib = if mib < 100.0 { format!("{mib:.1}") } else { format!("{mib:.0}") };
    let first = [
        ("body 1", forecast.bodies[0].description.clone()),
        ("body 2", forecast.bodies[1].description.clone()),
        ("frame", frame),
    ];
    let rest = [
        ("unknowns", format!("{} tractions", 3 * forecast.n_cells)),
        ("friction", describe_friction(&plan.friction)),
        ("wear", describe_wear(plan)),
        ("contact problems", forecast.n_contact_problems.to_string()),
        ("memory", format!("about {mib} MiB{allowed}")),
        ("time", format!("about {} (within a factor of a few)", format_duration(forecast.seconds))),
    ];
    first.into_iter().chain(axes).chain(rest).map(|(name, value)| vec![name.to_owned(), value]).collect()
}

fn describe_friction(law: &FrictionLaw) -> String {
    match law.ellipse() {
        None => "none".to_owned(),
        Some(ellipse) if ellipse.mu[0] == ellipse.mu[1] => {
            format!("coefficient {}", five_digits(ellipse.mu[0]))
        }
        Some(ellipse) => format!(
            "ellipse {} x {}, first axis at {:.1} degrees from the frame's x",
            five_digits(ellipse.mu[0]),
            five_digits(ellipse.mu[1]),
            ellipse.angle.to_degrees()
        ),
    }
}

fn describe_wear(plan: &Plan) -> String {
    let law = wear_law(&plan.wear);
    let Some(share) = plan.mesh_motion_threshold else { return law };
    let bodies = plan_bodies::worn_bodies(plan).map(|(index, ..)| format!("body{}", index + 1));
    let bodies: Vec<String> = bodies.collect();
    format!(
        "{law}; the mesh of {} is moved when the wear depth exceeds {share} of the height of its elements there",
        bodies.join(" and ")
    )
}

fn wear_law(law: &WearLaw) -> String {
    match *law {
        WearLaw::None => "none".to_owned(),
        WearLaw::Archard { i } => format!("Archard, specific wear rate {i:e}"),
        WearLaw::Orthotropic { i, .. } => format!("orthotropic, specific wear rates {:e}, {:e}", i[0], i[1]),
        WearLaw::Frp { .. } => law.specific_rate(None).map_or_else(String::new, |wear| {
            format!("fibre-reinforced plastic, specific wear rates {:.4e}, {:.4e}", wear.i[0], wear.i[1])
        }),
        WearLaw::Energy { k } => format!("energy, wear volume {k:e} per friction energy"),
    }
}

fn step_rows(plan: &Plan) -> Vec<Vec<String>> {
    let first = |step: &&Step| step.history_row.is_none_or(|row| row.index == 0);
    let row = |step: &Step| {
        let wanted = match step.history_row {
            Some(row) => format!("load history of {} points, first: {}", row.count, describe_controls(step)),
            None => describe_controls(step),
        };
        vec![format!("  {}", step.name), wanted, describe_increments(step)]
    };
    plan.steps.iter().filter(first).map(row).collect()
}

/// Amplitudes of the loads of the bodies: one row per step, one column per load. Empty without loads.
fn load_rows(plan: &Plan) -> Vec<Vec<String>> {
    let of_bodies = BODY_KEYS.into_iter().enumerate();
    let mut all: Vec<(&str, LoadCase)> = of_bodies
        .flat_map(|(index, key)| plan.load_cases(index).into_iter().map(move |case| (key, case)))
        .collect();
    all.extend(plan.gap.as_meshed.then(|| ("gap", LoadCase::interference())));
    let mut loads: Vec<(String, LoadCase)> = Vec::new();
    for (key, case) in all {
        let label = case.name.clone().unwrap_or_else(|| format!("loads of {key}"));
        if !loads.iter().any(|(other, _)| *other == label) {
            loads.push((label, case));
        }
    }
    if loads.is_empty() {
        return Vec::new();
    }
    let mut amplitudes: Vec<f64> = loads.iter().map(|(_, case)| f64::from(u8::from(case.preload))).collect();
    let mut row = |(i, step): (usize, &Step)| {
        let mut cells = vec![format!("  {}", step.name)];
        for ((label, case), amplitude) in loads.iter().zip(&mut amplitudes) {
            *amplitude = step.load_amplitude(case.name.as_deref(), *amplitude, i == 0);
            cells.push(format!("{label} {amplitude}"));
        }
        cells
    };
    // A load history has one row, for its last load point.
    let rows = plan.steps.iter().enumerate().map(|(i, step)| (step, row((i, step))));
    let last = |step: &Step| step.history_row.is_none_or(|point| point.index + 1 == point.count);
    rows.filter(|(step, _)| last(step)).map(|(_, row)| row).collect()
}

fn describe_controls(step: &Step) -> String {
    let mut parts = Vec::new();
    match step.normal {
        Some(Normal::Approach(x)) => parts.push(format!("approach {x}")),
        Some(Normal::Force(force)) => parts.push(format!("normal force {force}")),
        None => {}
    }
    match step.tangential {
        Some(Tangential::Shift([x, y])) => {
            parts.push(format!("shift ({}, {})", five_digits(x), five_digits(y)))
        }
        Some(Tangential::Force([x, y])) => parts.push(format!("tangential force ({x}, {y})")),
        None => {}
    }
    match step.tilt {
        Some(Tilt::Rotation([x, y])) => {
            parts.push(format!(
                "rotation ({}, {})",
                five_digits(x.to_degrees()),
                five_digits(y.to_degrees())
            ));
        }
        Some(Tilt::Moment([x, y])) => parts.push(format!("moment ({x}, {y})")),
        None => {}
    }
    match step.spin {
        Some(Spin::Twist(angle)) => parts.push(format!("twist {}", five_digits(angle.to_degrees()))),
        Some(Spin::Moment(moment)) => parts.push(format!("spin moment {moment}")),
        None => {}
    }
    match &step.kind {
        StepKind::Monotone => {}
        StepKind::Rolling(rolling) => parts.push(format!(
            "rolling along {} degrees with creepage ({}, {}), spin {}",
            90 * u32::from(rolling.quarter_turns),
            five_digits(rolling.creepage[0]),
            five_digits(rolling.creepage[1]),
            five_digits(rolling.spin)
        )),
        StepKind::Fretting { path, cycles } => {
            parts.push(describe_cycles(path, cycles.count));
            parts.extend(step.cyclic_loads.iter().map(|(name, by)| format!("{name} +-{by} in phase")));
        }
        StepKind::Sliding { angle, cycles } => {
            parts.push(format!("steady sliding over {} at {:.1} degrees", cycles.count, angle.to_degrees()))
        }
    }
    if parts.is_empty() { "unchanged".to_owned() } else { parts.join(", ") }
}

fn describe_cycles(closed: &ClosedPath, count: f64) -> String {
    let [along, left] = closed.amplitude;
    if closed.amplitude == [0.0; 2] {
        let held = if closed.drive == Drive::Force { "tangential force" } else { "position" };
        return format!("{count} cycles of loads of the bodies, {held} held{}", describe_strokes(closed));
    }
    let path = if left == 0.0 {
        format!("+-{along}")
    } else {
        format!("an ellipse with semi-axes {along} x {left}")
    };
    let of = if closed.drive == Drive::Force { " of the tangential force" } else { "" };
    let angle = closed.angle.to_degrees();
    format!("{count} cycles of {path}{of} at {angle:.1} degrees{}", describe_strokes(closed))
}

fn describe_strokes(closed: &ClosedPath) -> String {
    let as_needed =
        |used: &ResolvedCycleSettings| used.increments.is_none() && used.correction != Correction::Never;
    if closed.resolved_cycles.as_ref().is_some_and(as_needed) {
        return ", increments per stroke as needed".to_owned();
    }
    match closed.given_increments() {
        1 => String::new(),
        increments => format!(", {increments} increments per stroke"),
    }
}

fn describe_increments(step: &Step) -> String {
    let mut text = match step.kind.cycles() {
        Some(cycles) => match cycles.jumps {
            JumpPolicy::Number(jumps) => format!("{jumps} jumps"),
            JumpPolicy::Tolerance(tolerance) => {
                format!(
                    "jumps controlled by the estimated error of the wear depth, relative tolerance {tolerance:e}"
                )
            }
        },
        None if step.increments == 1 => "1 increment".to_owned(),
        None => format!("{} increments", step.increments),
    };
    if step.history_row.is_some() {
        text.push_str(" per point");
    }
    if !step.friction {
        text.push_str(", without friction");
    }
    if !step.wear {
        text.push_str(", without wear");
    }
    text
}
