//! Conversion of Python values to TOML, and of JSON to Python values.

use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyFloat, PyInt, PyList, PyString, PyTuple};
use serde::Serialize;
use toml::Value;

use crate::errors;

/// Largest nesting depth of tables and lists. Scenes have fewer than ten levels.
const DEEPEST: usize = 50;

/// A value of a scene as TOML; `None` for Python's None, which stands for an absent key. `key` names the value in messages.
pub fn to_toml(value: &Bound<'_, PyAny>, key: &str) -> PyResult<Option<Value>> {
    if value.is_none() {
        return Ok(None);
    }
    if key.matches('.').count() > DEEPEST {
        let short: String = key.chars().take(60).collect();
        return Err(wrong(value, &format!("{short}.."), "tables and lists are nested too deeply"));
    }
    if let Ok(flag) = value.cast::<PyBool>() {
        return Ok(Some(Value::Boolean(flag.is_true())));
    }
    if value.is_instance_of::<PyInt>() {
        let number =
            value.extract::<i64>().map_err(|_| wrong(value, key, "a whole number of more than 64 bits"))?;
        return Ok(Some(Value::Integer(number)));
    }
    if value.is_instance_of::<PyFloat>() {
        return Ok(Some(Value::Float(value.extract::<f64>()?)));
    }
    if let Ok(text) = value.cast::<PyString>() {
        return Ok(Some(Value::String(text.to_str()?.to_owned())));
    }
    if let Ok(table) = value.cast::<PyDict>() {
        return to_table(table, key).map(|table| Some(Value::Table(table)));
    }
    if value.is_instance_of::<PyList>() || value.is_instance_of::<PyTuple>() {
        return to_array(value, key).map(|list| Some(Value::Array(list)));
    }
    // NumPy numbers and arrays have this method.
    if value.hasattr("tolist")? {
        return to_toml(&value.call_method0("tolist")?, key);
    }
    if value.hasattr("__fspath__")? {
        return to_toml(&value.call_method0("__fspath__")?, key);
    }
    Err(wrong(value, key, "this is not a value of a scene"))
}

fn to_table(table: &Bound<'_, PyDict>, key: &str) -> PyResult<toml::Table> {
    let mut found = toml::Table::new();
    for (name, value) in table {
        let name = name
            .cast::<PyString>()
            .map_err(|_| wrong(&name, key, "this is not the name of a key"))?
            .to_str()?
            .to_owned();
        let dot = if key.is_empty() { "" } else { "." };
        if let Some(value) = to_toml(&value, &format!("{key}{dot}{name}"))? {
            found.insert(name, value);
        }
    }
    Ok(found)
}

fn to_array(list: &Bound<'_, PyAny>, key: &str) -> PyResult<Vec<Value>> {
    let mut found = Vec::new();
    for (i, value) in list.try_iter()?.enumerate() {
        let key = format!("{key}.{i}");
        let value = value?;
        found
            .push(to_toml(&value, &key)?.ok_or_else(|| wrong(&value, &key, "a list must not contain None"))?);
    }
    Ok(found)
}

fn wrong(value: &Bound<'_, PyAny>, key: &str, what: &str) -> PyErr {
    let kind = value.get_type().name().map_or_else(|_| "object".to_owned(), |name| name.to_string());
    let text = format!(
        "{key}: {what} (Python type {kind}). A scene contains numbers, texts, booleans, paths, NumPy arrays, and lists and dicts of these"
    );
    errors::input(value.py(), &text)
}

/// A scene as TOML text.
pub fn scene_text(scene: &Bound<'_, PyDict>) -> PyResult<String> {
    let table = to_table(scene, "")?;
    toml::to_string(&table).map_err(|error| errors::input(scene.py(), &error.to_string()))
}

/// Overrides `key.path=value`, in the order of the dict.
pub fn overrides(wanted: &Bound<'_, PyDict>) -> PyResult<Vec<String>> {
    let line = |(key, value): (Bound<'_, PyAny>, Bound<'_, PyAny>)| {
        let key = key
            .cast::<PyString>()
            .map_err(|_| wrong(&key, "overrides", "this is not the name of a key"))?
            .to_str()?
            .to_owned();
        let found = to_toml(&value, &key)?;
        let found = found.ok_or_else(|| wrong(&value, &key, "the value is missing"))?;
        Ok(format!("{key}={found}"))
    };
    wanted.iter().map(line).collect()
}

/// Any serialisable value as Python dicts, lists and numbers.
pub fn to_python<'py>(py: Python<'py>, value: &impl Serialize) -> PyResult<Bound<'py, PyAny>> {
    let text = serde_json::to_string(value).map_err(|error| errors::internal(py, &error.to_string()))?;
    py.import("json")?.call_method1("loads", (text,))
}
