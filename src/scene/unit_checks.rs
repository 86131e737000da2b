//! Warnings about unrealistic magnitudes in a scene, which indicate mixed-up units. Only the check of moduli depends on
//! the names of the units.

use std::f64::consts::PI;

use super::plan::{BodyPlan, FramePlan, MeshedBodyPlan, Plan};
use crate::error::Warning;
use crate::evolution::step::{Normal, Tangential};
use crate::frame::GapShape;
use crate::geometry::{Point, bounds, format_short};
use crate::material::{PlacedMaterial, Stiffness};

/// Range of numbers that are moduli of stiff solids in GPa, but not in MPa.
const GPA_LIKE_MODULI_MPA: [f64; 2] = [2.0, 1000.0];

/// Range of Poisson's ratios of stiff solids. Materials outside this range, such as rubber (0.45 to 0.5) and foam, can
/// have moduli of a few MPa.
const STIFF_POISSON_RATIOS: [f64; 2] = [0.15, 0.42];

/// Upper limit of Young's modulus. Diamond has 1.2e6 MPa.
const MAX_MODULUS_MPA: f64 = 5e6;

/// Upper limit of realistic thermal strains. Rubber with 2e-4 per kelvin reaches 0.1 at a change of 500 K.
const MAX_THERMAL_STRAIN: f64 = 0.1;

/// Ratio of moduli above which the deformation of the stiffer body is negligible.
const MAX_MODULUS_RATIO: f64 = 1e4;

pub(super) fn unit_warnings(plan: &Plan) -> Vec<Warning> {
    let mut notes = Vec::new();
    check_moduli(plan, &mut notes);
    check_modulus_ratio(plan, &mut notes);
    check_contact_size(plan, &mut notes);
    check_mesh_sizes(plan, &mut notes);
    check_thermal_strains(plan, &mut notes);
    notes.iter().map(|note| Warning::unit_error(note)).collect()
}

/// Young's moduli along the material axes.
fn young(stiffness: &Stiffness) -> [f64; 3] {
    let compliance = stiffness.compliance();
    std::array::from_fn(|i| 1.0 / compliance[(i, i)])
}

fn largest(values: [f64; 3]) -> f64 {
    values.into_iter().fold(0.0, f64::max)
}

fn least(values: [f64; 3]) -> f64 {
    values.into_iter().fold(f64::INFINITY, f64::min)
}

fn materials(body: &BodyPlan) -> Vec<(&str, &Stiffness)> {
    let mut found: Vec<(&str, &Stiffness)> = match body {
        BodyPlan::Fe(fe) => {
            let placed = fe.regions.iter().flat_map(|(_, placement)| placement.materials());
            placed.map(|PlacedMaterial { name, stiffness, .. }| (name.as_str(), stiffness)).collect()
        }
        _ => body.material().iter().map(|elastic| (elastic.name.as_str(), &elastic.stiffness)).collect(),
    };
    found.sort_by_key(|(name, _)| *name);
    found.dedup_by_key(|(name, _)| *name);
    found
}

fn check_moduli(plan: &Plan, notes: &mut Vec<String>) {
    // 1 MPa in the unit of stress of the scene.
    let mpa = match (plan.units.force.as_str(), plan.units.length.as_str()) {
        ("N", "mm") => 1.0,
        ("N", "m") => 1e6,
        _ => return,
    };
    let mut all: Vec<(&str, &Stiffness)> = plan.bodies.iter().flat_map(materials).collect();
    all.sort_by_key(|(name, _)| *name);
    all.dedup_by_key(|(name, _)| *name);
    let unit = if mpa == 1.0 { "MPa" } else { "Pa" };
    for (name, stiffness) in all {
        let modulus = largest(young(stiffness));
        let compliance = stiffness.compliance();
        let poisson = -compliance[(0, 1)] / compliance[(0, 0)];
        let stiff = (STIFF_POISSON_RATIOS[0]..=STIFF_POISSON_RATIOS[1]).contains(&poisson);
        let meant = match modulus / mpa {
            x if x > MAX_MODULUS_MPA && mpa == 1.0 => "Pa",
            x if x > MAX_MODULUS_MPA => "a smaller unit",
            _ if stiff && (GPA_LIKE_MODULI_MPA[0]..=GPA_LIKE_MODULI_MPA[1]).contains(&modulus) => "GPa",
            x if stiff && mpa > 1.0 && modulus > GPA_LIKE_MODULI_MPA[1] && x < GPA_LIKE_MODULI_MPA[0] => {
                "MPa"
            }
            _ => continue,
        };
        notes.push(format!(
            "Young's modulus of material `{name}` is {modulus:.4e} {unit}, {} (units of the scene: {}, {}); was it \
             given in {meant}?",
            if modulus > MAX_MODULUS_MPA * mpa { "above that of any solid" } else { "typical of a soft polymer" },
            plan.units.force,
            plan.units.length
        ));
    }
}

fn check_thermal_strains(plan: &Plan, notes: &mut Vec<String>) {
    for (index, body) in plan.bodies.iter().enumerate() {
        let temperature = match body.as_meshed() {
            Some(meshed) => &meshed.temperature,
            None => &plan.half_space_loads[index].temperature,
        };
        let Some(temperature) = temperature else { continue };
        for (name, expansion) in body.expansions() {
            let alpha = largest(expansion.unwrap_or_default().map(f64::abs));
            let strain = alpha * temperature.change.abs();
            if strain <= MAX_THERMAL_STRAIN {
                continue;
            }
            notes.push(format!(
                "the thermal strain of body{} is {}: coefficients of thermal expansion are per kelvin, 12e-6 \
                 for steel, but `{name}` has {}, and the temperature changes by {}",
                index + 1,
                format_short(strain),
                format_short(alpha),
                format_short(temperature.change)
            ));
        }
    }
}

fn check_modulus_ratio(plan: &Plan, notes: &mut Vec<String>) {
    let [Some(first), Some(second)] = [0, 1].map(|i| plan.bodies[i].material()) else { return };
    let [a, b] = [first, second].map(|elastic| young(&elastic.stiffness));
    let ratio = (least(a) / largest(b)).max(least(b) / largest(a));
    if ratio > MAX_MODULUS_RATIO {
        notes.push(format!(
            "the moduli of `{}` and `{}` are {:.4e} and {:.4e}, more than a factor of 1e4 apart; if this is intended, \
             use kind = \"rigid\" for the stiffer body, whose deformation is negligible",
            first.name,
            second.name,
            largest(a),
            largest(b)
        ));
    }
}

/// Smallest half-width and cell side of a grid frame over its directions. A periodic direction counts only if both
/// directions are periodic.
fn grid_half_width_and_cell(frame: &FramePlan) -> Option<[f64; 2]> {
    let FramePlan::Grid { half_width, cells, periodic, .. } = frame else { return None };
    let cell = |axis: usize| 2.0 * half_width[axis] / cells[axis] as f64;
    let axes = (0..2).filter(|&axis| !periodic[axis] || *periodic == [true; 2]);
    Some(
        axes.fold([f64::INFINITY; 2], |[half, side], axis| {
            [half.min(half_width[axis]), side.min(cell(axis))]
        }),
    )
}

/// Length of the frame along its periodic direction, if exactly one direction is periodic (line contact).
fn line_contact_length(frame: &FramePlan) -> Option<f64> {
    match frame {
        FramePlan::Grid { half_width, periodic: [true, false], .. } => Some(2.0 * half_width[0]),
        FramePlan::Grid { half_width, periodic: [false, true], .. } => Some(2.0 * half_width[1]),
        _ => None,
    }
}

/// Half-width and cell side of any frame. On a mesh frame, they follow from the two largest extents of the contact
/// group and its number of faces.
fn frame_half_width_and_cell(plan: &Plan) -> Option<[f64; 2]> {
    let FramePlan::Mesh { body, .. } = plan.frame else { return grid_half_width_and_cell(&plan.frame) };
    let fe = plan.bodies[body].as_meshed()?;
    let mut sides = extent(fe, &fe.contact)?;
    sides.sort_by(f64::total_cmp);
    let faces = fe.mesh.group_of_dim(&fe.contact, 2).ok()?.cells.len();
    Some([0.5 * sides[2], (sides[2] * sides[1] / faces.max(1) as f64).sqrt()])
}

/// Radius of curvature of a curved gap. For ellipsoids: geometric mean of the two radii. `None` for other shapes.
fn radius(plan: &Plan) -> Option<f64> {
    match plan.gap.shape {
        GapShape::Sphere { radius } | GapShape::Cylinder { radius, .. } => Some(radius),
        GapShape::Ellipsoid { radii, .. } => Some((radii[0] * radii[1]).sqrt()),
        GapShape::SemiAxes { semi_axes: [a, b, c], .. } => Some(a * b / c),
        _ => None,
    }
}

fn check_contact_size(plan: &Plan, notes: &mut Vec<String>) {
    let approach = plan.max_prescribed_approach().unwrap_or(0.0);
    let Some([half, cell]) = frame_half_width_and_cell(plan) else { return };
    let unit = &plan.units.length;
    let slides = plan.steps.iter().filter_map(|step| match step.tangential {
        Some(Tangential::Shift([x, y])) => Some(x.hypot(y)),
        _ => step.kind.reach(),
    });
    let slide = slides.fold(0.0, f64::max);
    if slide > 20.0 * half {
        notes.push(format!(
            "the tangential displacement of body 2 is {slide:.4e} {unit}, more than 20 times the half-width of \
             the contact frame ({half:.4e} {unit}): check both"
        ));
    }
    let Some(radius) = radius(plan) else { return };
    if radius > 1e6 * half || radius < 0.05 * half {
        notes.push(format!(
            "the radius of the gap is {radius:.4e} {unit}, but the half-width of the contact frame is {half:.4e} {unit}: check both"
        ));
    }
    if approach > 0.5 * radius {
        notes.push(format!(
            "the approach is {approach:.4e} {unit}, more than half of the gap radius, {radius:.4e} {unit}. Small-deformation \
             theory does not apply: check both"
        ));
        return;
    }
    let estimate = if approach > 0.0 {
        Some((format!("the approach {approach:.4e} {unit}"), (radius * approach).sqrt()))
    } else {
        hertz_half_width(plan, radius)
    };
    let Some((by, width)) = estimate else { return };
    if width > 5.0 * half {
        notes.push(format!(
            "{by} gives a contact half-width of about {width:.1e} {unit} (Hertz), much larger than the half-width of the \
             contact frame, {half:.4e} {unit}: check the units, or enlarge frame.half_width"
        ));
    } else if width < 0.1 * cell {
        notes.push(format!(
            "{by} gives a contact half-width of about {width:.1e} {unit} (Hertz), much smaller than a cell of the frame, \
             {cell:.4e} {unit}. The contact is not resolved: check the units, or use a smaller frame"
        ));
    }
}

/// Contact half-width at the largest prescribed normal force (Hertz), correct within a factor of a few. Also returns
/// the force as text.
fn hertz_half_width(plan: &Plan, radius: f64) -> Option<(String, f64)> {
    let force = (plan.steps.iter())
        .filter_map(|step| if let Some(Normal::Force(force)) = step.normal { Some(force) } else { None })
        .fold(0.0, f64::max);
    let compliance: f64 = (plan.bodies.iter())
        .filter_map(BodyPlan::material)
        .map(|elastic| 0.9 / young(&elastic.stiffness).into_iter().product::<f64>().cbrt())
        .sum();
    let width = match line_contact_length(&plan.frame) {
        None => (0.75 * force * radius * compliance).cbrt(),
        // Line contact of half-width a and length L: a² = 4 F R / (π L E*).
        Some(length) => (4.0 / PI * force / length * radius * compliance).sqrt(),
    };
    (force > 0.0 && width > 0.0).then(|| (format!("the force {force:.4e} {}", plan.units.force), width))
}

fn extent(fe: &MeshedBodyPlan, group: &str) -> Option<[f64; 3]> {
    let nodes = fe.mesh.group(group).map(|group| fe.mesh.nodes_of(group)).ok()?;
    Some([0, 1, 2].map(|k| {
        let [low, high] = bounds(nodes.iter().map(|&node| fe.mesh.points[node][k]));
        high - low
    }))
}

/// Extent of the mesh along the normal of the frame.
fn height(plan: &Plan, fe: &MeshedBodyPlan) -> f64 {
    let normal = match plan.frame {
        FramePlan::Mesh { normal, .. } => Point::from(normal).normalize(),
        FramePlan::Grid { .. } => Point::z(),
    };
    let [low, high] = bounds(fe.mesh.points.iter().map(|&p| Point::from(p).dot(&normal)));
    high - low
}

fn check_mesh_sizes(plan: &Plan, notes: &mut Vec<String>) {
    for (key, body) in ["body1", "body2"].into_iter().zip(&plan.bodies) {
        let Some(fe) = body.as_meshed() else { continue };
        let Some(contact) = extent(fe, &fe.contact) else { continue };
        let (side, height) = (contact[0].max(contact[1]), height(plan, fe));
        let unit = &plan.units.length;
        if let Some([half, _]) = grid_half_width_and_cell(&plan.frame) {
            if side > 1e3 * half {
                notes.push(format!(
                    "the contact surface of {key} is {side:.4e} {unit} wide, more than 1000 times the half-width of the \
                     contact frame, {half:.4e} {unit}: check mesh and frame"
                ));
            } else if side < 0.02 * half {
                notes.push(format!(
                    "the contact surface of {key} is only {side:.4e} {unit} wide, less than 2 % of the half-width of the \
                     contact frame, {half:.4e} {unit}: check mesh and frame"
                ));
            }
        }
        let approach = plan.max_prescribed_approach().unwrap_or(0.0);
        if approach > 0.3 * height {
            notes.push(format!(
                "the approach is {approach:.4e} {unit}, more than 30 % of the height of the mesh of {key} along the normal, {height:.4e} {unit}: check both"
            ));
        }
    }
}
