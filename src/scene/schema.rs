//! JSON Schema of a scene, generated from the [keys](super::spec).

use std::sync::LazyLock;

use schemars::JsonSchema;
use schemars::generate::SchemaSettings;
use schemars::transform::RecursiveTransform;
use serde_json::Value;

use super::spec::Scene;

/// JSON Schema (draft 2020-12) of a scene file, for completion and checks in editors.
pub fn json_schema() -> &'static Value {
    // Generated once, because a study reads many scenes.
    static SCHEMA: LazyLock<Value> = LazyLock::new(json_schema_of::<Scene>);
    &SCHEMA
}

/// JSON Schema of a file with the keys of `T`.
pub fn json_schema_of<T: JsonSchema>() -> Value {
    SchemaSettings::draft2020_12()
        .with_transform(RecursiveTransform(tidy))
        .into_generator()
        .into_root_schema_for::<T>()
        .to_value()
}

/// Simplifies a schema. Removes `format`, which names number types of Rust. Removes null, because a TOML file cannot
/// contain null. Replaces a choice by its branch if only one branch remains.
fn tidy(schema: &mut schemars::Schema) {
    let Some(schema) = schema.as_object_mut() else { return };
    if let Some(Value::Array(branches)) = schema.get_mut("anyOf") {
        branches.retain(|branch| branch["type"] != "null");
        if let [Value::Object(only)] = &mut branches[..] {
            let only = std::mem::take(only);
            schema.remove("anyOf");
            for (key, value) in only {
                schema.entry(key).or_insert(value);
            }
        }
    }
    if let Some(Value::Array(types)) = schema.get_mut("type") {
        types.retain(|name| name != "null");
        if let [only] = &types[..] {
            let only = only.clone();
            schema.insert("type".to_owned(), only);
        }
    }
    if let Some(Value::Array(words)) = schema.get_mut("enum") {
        words.retain(|word| !word.is_null());
    }
    if schema.get("default").is_some_and(Value::is_null) {
        schema.remove("default");
    }
    schema.remove("format");
}
