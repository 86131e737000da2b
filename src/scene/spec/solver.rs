//! `[solver]` and `[output]`.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::bem::half_space::plane::compressed::DEFAULT_TOLERANCE;
use crate::contact::Method;
use crate::coupling::Coupling;
use crate::omitted::{AllowedOmissions, OmittableWork};
use crate::output::checkpoint_writer::CheckpointInterval;
use crate::output::field_writer::FieldKind;

/// Solver settings: method, tolerances, memory.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Solver {
    /// Convergence tolerance: natural residual of the contact conditions, relative to the peak pressure.
    #[schemars(extend("exclusiveMinimum" = 0, "exclusiveMaximum" = 1))]
    pub tolerance: f64,
    /// Solution method of the contact problem.
    pub method: Method,
    /// Largest number of iterations per increment.
    #[schemars(range(min = 1))]
    pub max_iterations: usize,
    /// Method that couples finite-element bodies to the contact frame.
    pub coupling: Coupling,
    /// Kinds of work to omit if the scene does not need them: true (all kinds), false (none) or a list of names.
    ///
    /// The results stay the same within the tolerances of the solution.
    pub skip: SkipSetting,
    /// Memory limit of the run: bytes, or a size like "4 GiB" or "500 MB"; default 80 % of the available memory.
    #[schemars(schema_with = "memory_size")]
    pub memory_limit: Option<MemorySize>,
    /// Relative tolerance of compressed half-space operators, on mesh frames of more than 1000 cells.
    #[schemars(range(min = 1e-12, max = 1e-2))]
    pub compression_tolerance: f64,
}

/// Kinds of work to omit if the scene does not need them.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(untagged)]
#[schemars(inline)]
pub enum SkipSetting {
    /// All kinds, or none.
    All(bool),
    /// Only the named kinds.
    Named(Vec<OmittableWork>),
}

impl SkipSetting {
    /// The work that may be omitted.
    pub fn allowed_skips(&self) -> AllowedOmissions {
        match self {
            Self::All(true) => AllowedOmissions::ALL,
            Self::All(false) => AllowedOmissions::NONE,
            Self::Named(named) => named.iter().copied().collect(),
        }
    }
}

/// An amount of memory.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(untagged)]
pub enum MemorySize {
    /// Bytes.
    Bytes(u64),
    /// Number of bytes as a floating-point number, such as 1e9.
    Number(f64),
    /// A number with its unit.
    Text(String),
}

fn memory_size(_: &mut schemars::SchemaGenerator) -> schemars::Schema {
    schemars::json_schema!({ "type": ["string", "number"], "minimum": 1 })
}

impl MemorySize {
    /// Number of bytes. `None` if the value is neither a positive integer nor a positive number with a unit of memory.
    pub fn bytes(&self) -> Option<u64> {
        let text = match self {
            Self::Bytes(bytes) => return Some(*bytes).filter(|&bytes| bytes > 0),
            Self::Number(bytes) => return positive_integer(*bytes),
            Self::Text(text) => text.trim(),
        };
        let number = text.trim_end_matches(char::is_alphabetic);
        let factor = match text[number.len()..].to_ascii_lowercase().as_str() {
            "" => return positive_integer(number.parse().ok()?),
            "b" | "bytes" => 1.0,
            "kb" => 1e3,
            "mb" => 1e6,
            "gb" => 1e9,
            "tb" => 1e12,
            "kib" => 1024.0,
            "mib" => 1024f64.powi(2),
            "gib" => 1024f64.powi(3),
            "tib" => 1024f64.powi(4),
            _ => return None,
        };
        let bytes = number.trim().parse::<f64>().ok()? * factor;
        (bytes.is_finite() && bytes >= 1.0).then_some(bytes as u64)
    }
}

/// Returns `number` as an integer; `None` if it is not an integer above 0.
fn positive_integer(number: f64) -> Option<u64> {
    (number >= 1.0 && number.is_finite() && number.fract() == 0.0).then_some(number as u64)
}

impl Default for Solver {
    fn default() -> Self {
        Self {
            tolerance: 1e-8,
            method: Method::Auto,
            max_iterations: 20_000,
            coupling: Coupling::Schur,
            skip: SkipSetting::All(true),
            memory_limit: None,
            compression_tolerance: DEFAULT_TOLERANCE,
        }
    }
}

/// Files to write in addition to summary.json and history.csv.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Output {
    /// Field files to write; `[]` writes none.
    pub fields: Vec<FieldKind>,
    /// Lines and rectangles of points inside half-spaces and boundary-element bodies, for displacement and stress.
    pub inside: Vec<InteriorPoints>,
    /// Interval between checkpoints; --resume continues from the last checkpoint.
    pub checkpoint: CheckpointInterval,
}

/// Points inside a body, evenly spaced on a line or over a rectangle.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct InteriorPoints {
    /// Name, also used in file names: letters, digits, "-", "_"; each name once.
    pub name: String,
    /// Number of the body, 1 or 2: a half-space or a body with `kind = "be"`.
    #[schemars(range(min = 1, max = 2))]
    pub body: usize,
    /// Start of the line, or first corner of the rectangle, global x, y, z.
    pub from: [f64; 3],
    /// End of the line, or of the first side of the rectangle, global x, y, z.
    pub to: [f64; 3],
    /// End of the second side of the rectangle, global x, y, z; this side starts at `from`. Default: a line.
    pub across: Option<[f64; 3]>,
    /// Number of points on the line, including both ends; for a rectangle two numbers.
    ///
    /// The first number counts the points along the side towards `to`, the second along the side towards `across`.
    pub points: PointCounts,
}

/// Numbers of points.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(untagged)]
#[schemars(inline)]
pub enum PointCounts {
    /// Number of points on a line, including both ends.
    Line(#[schemars(range(min = 2))] usize),
    /// Numbers of points along the two sides of a rectangle: towards `to`, towards `across`.
    Rectangle(#[schemars(inner(range(min = 2)))] [usize; 2]),
}

impl Default for Output {
    fn default() -> Self {
        Self {
            fields: vec![FieldKind::Vtu, FieldKind::Svg],
            inside: Vec::new(),
            checkpoint: CheckpointInterval::default(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::MemorySize;

    /// Truth: the prefixes of IEC 80000-13, where kibi is 1024 and kilo 1000.
    #[test]
    fn sizes_of_memory() {
        let bytes = |text: &str| MemorySize::Text(text.to_owned()).bytes();
        assert_eq!(bytes("4 GiB"), Some(4 << 30));
        assert_eq!(bytes("1.5kB"), Some(1500));
        assert_eq!(bytes(" 20 mib "), Some(20 << 20));
        assert_eq!(MemorySize::Bytes(7).bytes(), Some(7));
        assert_eq!(
            (bytes("1e9"), bytes("1.5e9"), bytes("1.5e3 MB")),
            (Some(1_000_000_000), Some(1_500_000_000), Some(1_500_000_000))
        );
        assert_eq!(MemorySize::Number(1.5e9).bytes(), Some(1_500_000_000));
        for wrong in [
            "", "2.5", "1e-3", "1e400", "e9", "nan", "inf", "GiB", "4 G", "-1 GB", "nan GB", "inf MB", "0 B",
            "1e400 B", "4 GiB/s",
        ] {
            assert_eq!(bytes(wrong), None, "{wrong}");
        }
        let none = [0.0, -1.0, 2.5, f64::NAN, f64::INFINITY].map(|number| MemorySize::Number(number).bytes());
        assert_eq!((MemorySize::Bytes(0).bytes(), none), (None, [None; 5]));
    }
}
