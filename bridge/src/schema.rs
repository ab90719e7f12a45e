//! The JSON schema of every topic.

use crate::form::{Form, encoding};
use ipc_types::{Message, TopicVisitor, visit_all};
use serde_json::{Map, Value, json};

/// One schema a topic, by name. What leaves as bytes is described by the fields that lie in them one behind the other.
#[must_use]
pub fn topics() -> Value {
    let mut schemas = Schemas(Map::new());
    visit_all(&mut schemas);
    json!({ "$schema": "https://json-schema.org/draft/2020-12/schema", "topics": schemas.0 })
}

struct Schemas(Map<String, Value>);

impl TopicVisitor for Schemas {
    type Output = ();
    fn visit<T: Message>(&mut self) {
        let mut text = String::new();
        // Writing into a String cannot fail, and what is written is JSON: the test of the golden file says so.
        let _ = T::write_schema(&mut text);
        let mut schema: Value = serde_json::from_str(&text).unwrap_or(Value::Null);
        if Form::of::<T>() == Form::JsonCut {
            cut(&mut schema);
        }
        let row = json!({
            "encoding": encoding::<T>(), "form": Form::of::<T>().word(), "bytes": size_of::<T>(), "schema": schema,
        });
        self.0.insert(T::TOPIC.to_owned(), row);
    }
}

/// A route leaves without its bitmaps, and its lists end where they are filled.
fn cut(schema: &mut Value) {
    let bitmaps = ["seen", "unmapped"];
    if let Some(required) = schema["required"].as_array_mut() {
        required.retain(|field| !bitmaps.iter().any(|bitmap| field == bitmap));
    }
    for bitmap in bitmaps {
        if let Some(properties) = schema["properties"].as_object_mut() {
            properties.remove(bitmap);
        }
    }
    for list in ["waypoints", "rooms"] {
        if let Some(list) = schema["properties"][list]["allOf"][0].as_object_mut() {
            list.remove("minItems");
        }
    }
}
