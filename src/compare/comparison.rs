//! Results of the variants of a scene and their differences: `compare.json`, `compare.csv`.

use serde::Serialize;

use crate::error::{Error, Result, Warning};
use crate::evolution::records::{Divergence, IncrementRecord};
use crate::output::summary::{Status, Summary, Units};

/// Comparison of the variants of a scene. Its fields are the fields of `compare.json` (docs/results.md).
#[derive(Debug, Clone, Serialize)]
pub struct Comparison {
    /// Name of the program.
    pub program: &'static str,
    /// Version of the program.
    pub version: &'static str,
    /// Title of the scene.
    pub title: String,
    /// SHA-256 of the scene file and its overrides (`--set`).
    pub scene_sha256: String,
    /// Units of all numbers.
    pub units: Units,
    /// Results of the variants. The first variant with a computed step is the reference of all differences.
    pub variants: Vec<VariantResult>,
    /// Warnings and notes for the user.
    pub warnings: Vec<Warning>,
}

/// Result of one variant.
#[derive(Debug, Clone, Serialize)]
pub struct VariantResult {
    /// Discretisations of body 1 and body 2, for example "FE-BE".
    pub name: String,
    /// Status at the end of the run; `None` if the variant was not computed.
    pub status: Option<Status>,
    /// Reason why the variant was not computed, did not converge or failed.
    pub reason: Option<String>,
    /// Reason why the run did not converge. `None` if the run converged or ended with an error.
    #[serde(skip)]
    pub divergence: Option<Divergence>,
    /// Name of the variant's folder of results, next to `compare.json`.
    pub folder: Option<String>,
    /// Total time, s, including the output of results.
    pub seconds: f64,
    /// Peak resident memory during the run, bytes; 0 if unknown.
    pub peak_memory_bytes: u64,
    /// Result of the last increment of each step.
    pub steps: Vec<StepResult>,
}

/// Result of a variant at the end of a step.
#[derive(Debug, Clone, Serialize)]
pub struct StepResult {
    /// Name of the step.
    pub name: String,
    /// Motion of body 2 towards body 1 from the first touch.
    pub approach: f64,
    /// Force on body 1, compression positive.
    pub normal_force: f64,
    /// Tangential force on body 1 along the frame's x, y.
    pub tangential_force: [f64; 2],
    /// Area in contact.
    pub contact_area: f64,
    /// Contact area in stick.
    pub stick_area: f64,
    /// Largest pressure of a cell.
    pub peak_pressure: f64,
    /// Wear volume of both bodies since the start of the run.
    pub worn_volume: f64,
    /// Fretting cycles completed at the end of the step.
    pub cycles_done: u64,
    /// Natural residual of the certificate.
    pub natural_residual: f64,
    /// Computing time of all increments of the step, s.
    pub seconds: f64,
    /// Differences from the reference variant. `None` for the reference itself, and for a step that the reference has
    /// not computed. Also `None` if the numbers of cycles at the end of the step differ.
    pub difference: Option<Difference>,
}

/// Differences from the reference variant, in percent of the magnitude of the reference value. `None` if the reference
/// value is 0.
#[derive(Debug, Clone, Copy, Serialize)]
#[allow(missing_docs)]
pub struct Difference {
    pub approach: Option<f64>,
    pub normal_force: Option<f64>,
    /// Magnitude of the difference of the two force vectors, in percent of the magnitude of the reference force. `None`
    /// also if the reference force is only rounding error.
    pub tangential_force: Option<f64>,
    pub contact_area: Option<f64>,
    pub stick_area: Option<f64>,
    pub peak_pressure: Option<f64>,
    pub worn_volume: Option<f64>,
}

impl VariantResult {
    /// Result of a variant whose computation was not started.
    pub fn not_started(name: &str) -> Self {
        Self {
            name: name.to_owned(),
            status: None,
            reason: Some("not started".to_owned()),
            divergence: None,
            folder: None,
            seconds: 0.0,
            peak_memory_bytes: 0,
            steps: Vec::new(),
        }
    }
}

impl Comparison {
    /// Adds the warnings in `told`, which are pairs of variant and warning. Equal warnings are added once, and only if
    /// the comparison does not contain them. The names of their variants precede the text, unless all computed variants
    /// gave the warning.
    pub fn add_variant_warnings(&mut self, told: Vec<(String, Warning)>) {
        let mut said: Vec<(Warning, Vec<String>)> = Vec::new();
        for (variant, warning) in told.into_iter().filter(|(_, warning)| !self.warnings.contains(warning)) {
            match said.iter_mut().find(|(known, _)| *known == warning) {
                Some((_, variants)) => variants.push(variant),
                None => said.push((warning, vec![variant])),
            }
        }
        let all = self.variants.iter().filter(|variant| variant.status.is_some()).count();
        let named = |(warning, variants): (Warning, Vec<String>)| {
            if variants.len() == all { warning } else { warning.at(&variants.join(", ")) }
        };
        self.warnings.extend(said.into_iter().map(named));
    }

    /// Steps with differences. Each element contains the names of the step, the variant and the reference variant.
    pub fn compared_steps(&self) -> Vec<(String, String, String)> {
        let Some(reference) = self.reference().map(|index| &self.variants[index].name) else {
            return Vec::new();
        };
        let of = |variant: &VariantResult| -> Vec<(String, String, String)> {
            let with = variant.steps.iter().filter(|step| step.difference.is_some());
            with.map(|step| (step.name.clone(), variant.name.clone(), reference.clone())).collect()
        };
        self.variants.iter().flat_map(of).collect()
    }

    /// Index of the reference variant, which is the first variant with a computed step. `None` if no variant has a
    /// computed step.
    pub fn reference(&self) -> Option<usize> {
        self.variants.iter().position(|variant| !variant.steps.is_empty())
    }

    /// Computes the differences of steps that ended after the same number of cycles as in the reference. A step with
    /// another number of cycles causes a warning. A note is added if the reference is not the first variant.
    pub fn compute_differences(&mut self) {
        let Some(first) = self.reference() else { return };
        if first > 0 {
            let [wanted, found] = [0, first].map(|index| &self.variants[index].name);
            let note = format!("{wanted} was not computed; the differences refer to {found}");
            self.warnings.push(Warning::note(note));
        }
        let reference = self.variants[first].clone();
        for variant in &mut self.variants[first + 1..] {
            for step in &mut variant.steps {
                let Some(other) = reference.steps.iter().find(|other| other.name == step.name) else {
                    continue;
                };
                let [own, others] = [step.cycles_done, other.cycles_done];
                if own == others {
                    step.difference = Some(step.difference_from(other));
                } else {
                    self.warnings.push(Warning::uncertain(&format!(
                        "step \"{}\" ended after {own} cycles in {}, but after {others} in {}: the results are not compared",
                        step.name, variant.name, reference.name
                    )));
                }
            }
        }
    }

    /// Serialises the comparison as JSON.
    ///
    /// # Errors
    /// If a number of a step is not finite (kind `Numerical`).
    pub fn to_json(&self) -> Result<String> {
        let numbers = self.variants.iter().flat_map(|variant| &variant.steps).flat_map(StepResult::numbers);
        if numbers.into_iter().any(|number| !number.is_finite()) {
            return Err(Error::numerical("a result of the comparison is not a finite number"));
        }
        let text = serde_json::to_string_pretty(self).expect("strings and numbers always serialise");
        Ok(text + "\n")
    }

    /// Formats the comparison as CSV, with one row per variant and step.
    pub fn to_csv(&self) -> String {
        let mut text = format!("{}\n", COLUMNS.join(","));
        for variant in &self.variants {
            for step in &variant.steps {
                let differences = step.difference.map_or([None; 7], Difference::values);
                let numbers = step.numbers().map(|number| format!("{number:?}"));
                let differences = differences.map(|d| d.map_or(String::new(), |d| format!("{d:?}")));
                let name = step.name.replace('"', "\"\"");
                text +=
                    &format!("{},\"{name}\",{},{}\n", variant.name, numbers.join(","), differences.join(","));
            }
        }
        text
    }
}

const COLUMNS: [&str; 20] = [
    "variant",
    "step",
    "normal_force",
    "tangential_force_x",
    "tangential_force_y",
    "contact_area",
    "stick_area",
    "peak_pressure",
    "worn_volume",
    "cycles_done",
    "natural_residual",
    "seconds",
    "approach",
    "normal_force_percent",
    "tangential_force_percent",
    "contact_area_percent",
    "stick_area_percent",
    "peak_pressure_percent",
    "worn_volume_percent",
    "approach_percent",
];

impl StepResult {
    /// Result of the last increment of each step of a run. `seconds` is the sum over all increments of the step.
    pub fn last_entries(summary: &Summary) -> Vec<Self> {
        let mut steps: Vec<Self> = Vec::new();
        for record in &summary.steps {
            match steps.iter_mut().find(|step| step.name == record.name) {
                Some(step) => *step = Self { seconds: step.seconds + record.seconds, ..Self::new(record) },
                None => steps.push(Self::new(record)),
            }
        }
        steps
    }

    fn new(record: &IncrementRecord) -> Self {
        Self {
            name: record.name.clone(),
            approach: record.approach,
            normal_force: record.normal_force,
            tangential_force: record.tangential_force,
            contact_area: record.contact_area,
            stick_area: record.stick_area,
            peak_pressure: record.peak_pressure,
            worn_volume: record.worn_volume,
            cycles_done: record.cycles_done,
            natural_residual: record.certificate.natural_residual,
            seconds: record.seconds,
            difference: None,
        }
    }

    fn numbers(&self) -> [f64; 11] {
        let [qx, qy] = self.tangential_force;
        [
            self.normal_force,
            qx,
            qy,
            self.contact_area,
            self.stick_area,
            self.peak_pressure,
            self.worn_volume,
            self.cycles_done as f64,
            self.natural_residual,
            self.seconds,
            self.approach,
        ]
    }

    fn difference_from(&self, first: &Self) -> Difference {
        let percent = |a: f64, b: f64| (b != 0.0).then(|| 100.0 * (a - b) / b.abs());
        let [[qx, qy], [rx, ry]] = [self.tangential_force, first.tangential_force];
        // A tangential force of at most 1e-7 of the normal force is rounding error.
        let sideways = rx.hypot(ry);
        let sideways = if sideways > 1e-7 * first.normal_force { sideways } else { 0.0 };
        Difference {
            approach: percent(self.approach, first.approach),
            normal_force: percent(self.normal_force, first.normal_force),
            tangential_force: percent(sideways + (qx - rx).hypot(qy - ry), sideways),
            contact_area: percent(self.contact_area, first.contact_area),
            stick_area: percent(self.stick_area, first.stick_area),
            peak_pressure: percent(self.peak_pressure, first.peak_pressure),
            worn_volume: percent(self.worn_volume, first.worn_volume),
        }
    }
}

impl Difference {
    fn values(self) -> [Option<f64>; 7] {
        [
            self.normal_force,
            self.tangential_force,
            self.contact_area,
            self.stick_area,
            self.peak_pressure,
            self.worn_volume,
            self.approach,
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn step(normal_force: f64, tangential_force: [f64; 2]) -> StepResult {
        let record =
            IncrementRecord { name: "a".into(), normal_force, tangential_force, ..Default::default() };
        StepResult::new(&record)
    }

    /// Truth: differences in percent, computed by hand.
    #[test]
    fn differences_are_percent_of_the_first() {
        let difference = step(110.0, [3.0, 0.0]).difference_from(&step(100.0, [0.0, 4.0]));
        assert!((difference.normal_force.unwrap() - 10.0).abs() < 1e-12);
        assert!((difference.tangential_force.unwrap() - 125.0).abs() < 1e-12);
        assert_eq!(difference.worn_volume, None);
        let at = |approach: f64| StepResult { approach, ..step(100.0, [0.0; 2]) };
        assert!((at(0.03).difference_from(&at(0.02)).approach.unwrap() - 50.0).abs() < 1e-12);
    }
}
