//! Values whose accuracy is requested.

use crate::evolution::records::IncrementRecord;
use crate::evolution::step::{Drive, Normal, Step, Tangential};
use crate::laws::wear::WearLaw;
use crate::scene::plan::Plan;
use crate::scene::spec::accuracy::AccuracyQuantity;

/// Smallest reference value, as a fraction of the largest reference value with the same name over all steps.
const LEAST: f64 = 0.01;

#[derive(Debug, Clone, PartialEq)]
pub(super) struct TargetValue {
    pub step: String,
    /// Name in `summary.steps`.
    pub name: &'static str,
    pub quantity: AccuracyQuantity,
    pub value: f64,
    /// Reference value of the relative error; 0 without a reference value.
    pub scale: f64,
    /// Exponent k of a value that is proportional to the k-th power of the area of a punch; 0 if unknown.
    pub area_power: f64,
    /// Whether the contact fills the outline, so the error of the outline area affects the value.
    pub fills_outline: bool,
}

impl TargetValue {
    /// Value for the exact area of the outline; `cut` is (area of the cells) / (area of the outline) - 1.
    pub fn corrected_for_outline(&self, cut: Option<f64>) -> f64 {
        self.value / (1.0 + cut.unwrap_or(0.0)).powf(self.area_power)
    }
}

/// Exponent of the area A of a flat punch. The load of the punch at a given displacement is proportional to A^0.5. The
/// displacement under a given load is proportional to A^-0.5.
///
/// # Source
/// King 1987, "Elastic analysis of some punch problems for a layered medium": load / depth is 1.13 to 1.17 E* √A for circles,
/// squares, triangles.
const PUNCH_LOAD_AREA_POWER: f64 = 0.5;

/// Whether a step prescribes the normal force, and whether it prescribes the tangential force.
#[derive(Clone, Copy)]
struct ForceControls {
    normal_force: bool,
    tangential_force: bool,
}

impl ForceControls {
    const NOTHING: Self = Self { normal_force: false, tangential_force: false };

    fn after(self, step: &Step) -> Self {
        let normal_force = step.normal.map_or(self.normal_force, |normal| matches!(normal, Normal::Force(_)));
        let held = step.tangential.map_or(self.tangential_force, |held| matches!(held, Tangential::Force(_)));
        let driven = step.kind.closed_path().map(|path| path.drive == Drive::Force);
        Self { normal_force, tangential_force: driven.unwrap_or(held) }
    }
}

/// Smallest number of cells in contact at the ends of the steps, for cells of the area `cell`. [`usize::MAX`] if no
/// step counts.
///
/// A step without contact counts as 0 cells if its approach is positive and its normal force is not prescribed.
/// Otherwise a step without contact does not count.
pub(super) fn min_contact_cells(plan: &Plan, records: &[IncrementRecord], cell: f64) -> usize {
    let mut held = ForceControls::NOTHING;
    let mut fewest = usize::MAX;
    for step in &plan.steps {
        held = held.after(step);
        let Some(record) = records.iter().rev().find(|record| record.name == step.name) else { continue };
        if record.contact_area > 0.0 || (!held.normal_force && record.approach > 0.0) {
            fewest = fewest.min((record.contact_area / cell).round() as usize);
        }
    }
    fewest
}

/// Values at the ends of the steps. `punch` is the area of the cells within the outline of a punch.
pub(super) fn values(plan: &Plan, records: &[IncrementRecord], punch: Option<f64>) -> Vec<TargetValue> {
    let wanted = plan.accuracy.as_ref().map_or(&AccuracyQuantity::ALL[..], |spec| &spec.quantities);
    let mut held = ForceControls::NOTHING;
    let mut found: Vec<TargetValue> = Vec::new();
    for step in &plan.steps {
        held = held.after(step);
        // Of several steps or records with the same name, the last one counts.
        found.retain(|value| value.step != step.name);
        let Some(record) = records.iter().rev().find(|record| record.name == step.name) else { continue };
        // If the whole punch is in contact, its outline is the edge of the contact.
        let flat = punch.is_some_and(|area| record.contact_area > (1.0 - 1e-9) * area);
        let mut push = |quantity: AccuracyQuantity,
                        name: &'static str,
                        power: f64,
                        value: f64,
                        scale: f64| {
            let (step, area_power) = (step.name.clone(), if flat { power } else { 0.0 });
            let scale = if scale.is_finite() { scale } else { 0.0 };
            found.push(TargetValue { step, name, quantity, value, scale, area_power, fills_outline: flat });
        };
        if wanted.contains(&AccuracyQuantity::Load) {
            let load = AccuracyQuantity::Load;
            let [qx, qy] = record.tangential_force;
            let [sx, sy] = record.shift;
            let force = record.normal_force.hypot(qx).hypot(qy);
            // Without contact the motion is arbitrary, so it is no reference value.
            let touches = record.contact_area > 0.0;
            let motion = if touches { record.approach.hypot(sx).hypot(sy) } else { 0.0 };
            match held.normal_force {
                true => push(
                    load,
                    "approach",
                    -PUNCH_LOAD_AREA_POWER,
                    record.approach,
                    if touches { record.approach.abs() } else { 0.0 },
                ),
                false => push(load, "normal_force", PUNCH_LOAD_AREA_POWER, record.normal_force, force),
            }
            match held.tangential_force {
                true => [("shift x", sx), ("shift y", sy)]
                    .map(|(name, value)| push(load, name, -PUNCH_LOAD_AREA_POWER, value, motion)),
                false => [("tangential_force x", qx), ("tangential_force y", qy)]
                    .map(|(name, value)| push(load, name, PUNCH_LOAD_AREA_POWER, value, force)),
            };
        }
        if wanted.contains(&AccuracyQuantity::PeakPressure) {
            let peak = record.peak_pressure;
            push(AccuracyQuantity::PeakPressure, "peak_pressure", 0.0, peak, peak);
        }
        if wanted.contains(&AccuracyQuantity::WornVolume) && plan.wear != WearLaw::None {
            let worn = record.worn_volume;
            push(AccuracyQuantity::WornVolume, "worn_volume", 0.0, worn, worn);
        }
    }
    for (name, quantity) in found.iter().map(|value| (value.name, value.quantity)).collect::<Vec<_>>() {
        let largest = found
            .iter()
            .filter(|value| value.name == name)
            .fold(0.0, |most: f64, value| most.max(value.scale));
        // The error of the wear volume is relative to the largest wear volume of all steps.
        let least = if quantity == AccuracyQuantity::WornVolume { 1.0 } else { LEAST };
        let of_name = found.iter_mut().filter(|value| value.name == name && value.scale > 0.0);
        of_name.for_each(|value| value.scale = value.scale.max(least * largest));
    }
    found
}
