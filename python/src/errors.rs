//! Errors of the library as the exceptions of `orthowear.errors`.

use orthowear::cli::{exit, render};
use orthowear::error::{Error, ErrorKind};
use orthowear::scene::{Diagnostics, Plan};
use orthowear::simulation::SceneError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use serde_json::{Value, json};

/// Makes an exception of the given class, with message, exit code, mistakes and the report that the command line prints.
fn raise(py: Python<'_>, class: &str, (text, code): (&str, u8), (mistakes, report): (Value, &str)) -> PyErr {
    let made = (|| {
        let class = py.import("orthowear.errors")?.getattr(class)?;
        let more = PyDict::new(py);
        more.set_item("exit_code", code)?;
        more.set_item("mistakes", py.import("json")?.call_method1("loads", (mistakes.to_string(),))?)?;
        more.set_item("report", report)?;
        class.call((text,), Some(&more))
    })();
    made.map_or_else(|error| error, PyErr::from_value)
}

/// Exception with all mistakes of a scene.
pub fn mistakes(py: Python<'_>, mistakes: &Diagnostics) -> PyErr {
    study_diagnostics(py, std::slice::from_ref(mistakes))
}

/// Exception with all mistakes of a study and its scenes.
pub fn study_diagnostics(py: Python<'_>, files: &[Diagnostics]) -> PyErr {
    let list: Vec<Value> = files.iter().flat_map(listed).collect();
    let text: Vec<String> = files.iter().map(Diagnostics::to_string).collect();
    let report: String = files.iter().map(render).collect();
    raise(py, "InputError", (&text.join("\n"), exit::INPUT), (list.into(), &report))
}

/// Entries of `InputError.mistakes`.
fn listed(mistakes: &Diagnostics) -> Vec<Value> {
    mistakes
        .list
        .iter()
        .map(|mistake| {
            json!({
                "key": mistake.key,
                "message": mistake.message,
                "mend": mistake.help,
                "line": mistakes.line(mistake),
            })
        })
        .collect()
}

/// Exception for an error of the library. If the error has a scene key, the exception names the key.
pub fn scene_error(py: Python<'_>, plan: &Plan, failure: &SceneError) -> PyErr {
    if failure.error.kind() == ErrorKind::Input && !failure.key.is_empty() {
        return mistakes(py, &Diagnostics::from_error(&plan.document, &failure.key, &failure.error));
    }
    error(py, &failure.error)
}

/// Exception for an error of the library.
pub fn error(py: Python<'_>, error: &Error) -> PyErr {
    let class = match error.kind() {
        ErrorKind::Input => "InputError",
        ErrorKind::Resources => "ResourcesError",
        ErrorKind::Numerical => "NumericalError",
        ErrorKind::NotConverged => "NotConvergedError",
        ErrorKind::Interrupted => "InterruptedRunError",
    };
    let text = error.to_string();
    raise(py, class, (&text, error.exit_code()), (json!([]), &format!("error: {text}\n")))
}

/// Exception for a wrong argument.
pub fn input(py: Python<'_>, text: &str) -> PyErr {
    error(py, &Error::input(text))
}

/// Exception for a defect of the program.
pub fn internal(py: Python<'_>, text: &str) -> PyErr {
    error(py, &Error::numerical(format!("internal error, please report it: {text}")))
}
