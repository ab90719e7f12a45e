//! Schemas of topics as Foxglove reads them: it knows plain types only.

use serde_json::{Map, Value};

/// The same schema, said plainly: `allOf` of one thing is that thing, a number that may be null is a number, and nothing says
/// what is not allowed.
pub(crate) fn plain(schema: &Value) -> Value {
    match schema {
        Value::Object(fields) => Value::Object(object(fields)),
        Value::Array(items) => Value::Array(items.iter().map(plain).collect()),
        other => other.clone(),
    }
}

fn object(fields: &Map<String, Value>) -> Map<String, Value> {
    let mut out = Map::new();
    for (name, value) in fields {
        match (name.as_str(), value) {
            ("allOf", Value::Array(parts)) => {
                for part in parts.iter().filter_map(Value::as_object) {
                    for (name, value) in object(part) {
                        // What is said of the field beats what is said of its type.
                        out.entry(name).or_insert(value);
                    }
                }
            }
            ("type", Value::Array(types)) => {
                let word = types.iter().find(|word| *word != "null");
                out.insert(name.clone(), word.cloned().unwrap_or(Value::Null));
            }
            ("additionalProperties" | "const", _) => {}
            ("description", text) => {
                out.insert(name.clone(), text.clone());
            }
            // Names of fields, of which one may be called like a word above.
            ("properties", Value::Object(named)) => {
                let named = named.iter().map(|(name, value)| (name.clone(), plain(value))).collect();
                out.insert(name.clone(), Value::Object(named));
            }
            _ => {
                out.insert(name.clone(), plain(value));
            }
        }
    }
    out
}

#[cfg(test)]
#[allow(clippy::panic, reason = "tests")]
mod tests {
    use super::*;

    /// Every field has one type that Foxglove knows.
    fn look(path: &str, schema: &Value) {
        let word = schema["type"].as_str().unwrap_or_else(|| panic!("{path}: no type in {schema}"));
        match word {
            "object" => {
                for (name, field) in schema["properties"].as_object().into_iter().flatten() {
                    look(&format!("{path}.{name}"), field);
                }
            }
            "array" => look(&format!("{path}[]"), &schema["items"]),
            "number" | "integer" | "string" | "boolean" => {}
            other => panic!("{path}: {other}"),
        }
        assert!(schema.get("allOf").is_none(), "{path}");
    }

    #[test]
    fn every_topic_can_be_said_plainly() {
        let topics = bridge::schema::topics();
        let topics = topics["topics"].as_object().cloned().unwrap_or_default();
        assert!(topics.len() > 20);
        for (topic, row) in
            topics.iter().filter(|(_, row)| row["form"].as_str().is_some_and(|form| form.starts_with("json")))
        {
            let schema = plain(&row["schema"]);
            assert_eq!(schema["type"], "object", "{topic}");
            look(topic, &schema);
        }
        let pose = plain(&topics["localization/pose"]["schema"]);
        assert_eq!(pose["properties"]["x_m"]["type"], "number");
        assert!(pose["properties"]["header"]["properties"]["stamp_ns"]["description"].is_string());
    }
}
