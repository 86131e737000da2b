//! The JSON Schema of a scene, generated from the [keys](super::spec).

use std::sync::LazyLock;

use schemars::JsonSchema;
use schemars::generate::SchemaSettings;
use schemars::transform::RecursiveTransform;
use serde_json::Value;

use super::spec::Scene;

/// JSON Schema (draft 2020-12) of a scene file; editors complete and check scenes with it.
pub fn json_schema() -> &'static Value {
    // A study reads a scene for each of its runs.
    static SCHEMA: LazyLock<Value> = LazyLock::new(json_schema_of::<Scene>);
    &SCHEMA
}

/// The same of a file with the keys of `T`.
pub fn json_schema_of<T: JsonSchema>() -> Value {
    SchemaSettings::draft2020_12()
        .with_transform(RecursiveTransform(tidy))
        .into_generator()
        .into_root_schema_for::<T>()
        .to_value()
}

/// Takes out `format`, which names Rust's number types, and the null defaults of what may be absent.
fn tidy(schema: &mut schemars::Schema) {
    schema.remove("format");
    if schema.get("default").is_some_and(Value::is_null) {
        schema.remove("default");
    }
}
