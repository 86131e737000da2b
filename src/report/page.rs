//! Content of a report page and its HTML template.

use minijinja::{AutoEscape, Environment};
use serde::Serialize;
use serde_json::Value;

use crate::error::{Error, Result, Severity, Warning};
use crate::report::encode::base64;
use crate::report::result_directory::ResultDirectory;
use crate::report::value_text::{unit_of_key, units_of};

const TEMPLATE: &str = include_str!("assets/page.html");
const STYLE: &str = include_str!("assets/page.css");
const SCRIPT: &str = include_str!("assets/page.js");
const VIEWER: &str = include_str!("assets/viewer.js");
const THREE: &str = include_str!("assets/three.min.js");

#[derive(Debug, Clone, Default, Serialize)]
pub(super) struct Table {
    pub title: String,
    pub note: String,
    pub heads: Vec<[String; 2]>,
    pub rows: Vec<Vec<String>>,
}

#[derive(Debug, Clone, Serialize)]
pub(super) struct EmbeddedImage {
    pub title: String,
    pub address: String,
}

impl EmbeddedImage {
    pub(super) fn of_svg(title: &str, svg: &str) -> Self {
        let address = format!("data:image/svg+xml;base64,{}", base64(svg.as_bytes()));
        Self { title: title.to_owned(), address }
    }
}

#[derive(Debug, Clone, Default, Serialize)]
pub(super) struct Page {
    /// "run", "compare" or "study".
    pub kind: &'static str,
    pub title: String,
    /// "good", "bad" or "doubtful".
    pub severity: &'static str,
    pub status: String,
    pub reason: String,
    pub facts: Vec<[String; 2]>,
    pub warnings: Vec<Warning>,
    pub problems: Vec<String>,
    pub key_table: Option<Table>,
    pub drawing: Option<EmbeddedImage>,
    pub steps: Vec<[String; 2]>,
    /// Tables of the scene: heading, and rows of key and value.
    pub scene: Vec<(String, Vec<[String; 2]>)>,
    pub scene_missing: bool,
    pub plan: Vec<Table>,
    pub certificate: Option<Table>,
    pub convergence: Vec<EmbeddedImage>,
    pub tables: Vec<Table>,
    pub plots: Vec<EmbeddedImage>,
    pub folders: Vec<[String; 2]>,
    pub has_maps: bool,
    pub has_view: bool,
    pub n_frames: usize,
    pub names: [String; 3],
    pub program: String,
}

impl Page {
    pub(super) fn new(source: &ResultDirectory) -> Self {
        let said = &source.summary;
        let text = |key: &str| said[key].as_str().unwrap_or("").to_owned();
        let units = units_of(said);
        let title = match text("title") {
            title if title.trim().is_empty() => "Results without a title".to_owned(),
            title => title,
        };
        let program = match (text("program"), text("version")) {
            (name, version) if !name.is_empty() => format!("Computed by {name} {version}"),
            _ => "Computed by an unknown version".to_owned(),
        };
        let warnings = said["warnings"].as_array().into_iter().flatten().filter_map(Value::as_str);
        Self {
            kind: source.kind.name(),
            title,
            warnings: warnings.map(|text| Warning::from(text.to_owned())).collect(),
            names: [units.length.clone(), units.force.clone(), unit_of_key(&units, "peak_pressure")],
            program: format!("{program}; this page by orthowear {}", env!("CARGO_PKG_VERSION")),
            ..Self::default()
        }
    }

    pub(super) fn is_uncertain(&self) -> bool {
        self.warnings.iter().any(|warning| warning.severity == Severity::Uncertain)
    }

    /// Renders the page as HTML; `data` is the JSON for its script.
    ///
    /// # Errors
    /// If the template cannot be filled (kind `Numerical`).
    pub(super) fn render(&self, data: &Value) -> Result<String> {
        let failed =
            |error: minijinja::Error| Error::numerical(format!("the page cannot be created: {error}"));
        let mut environment = Environment::new();
        environment.set_auto_escape_callback(|_| AutoEscape::Html);
        environment.add_template("page.html", TEMPLATE).map_err(failed)?;
        let viewer = if self.has_view { [THREE, VIEWER] } else { [""; 2] };
        // Inside a script, no text may look like the end tag of the script or like a comment.
        let data = data.to_string().replace('<', "\\u003c");
        let context = minijinja::context! {
            page => minijinja::value::Serde(self), style => STYLE, script => SCRIPT, viewer => viewer, data => data,
        };
        environment.get_template("page.html").and_then(|page| page.render(context)).map_err(failed)
    }
}
