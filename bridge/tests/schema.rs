//! The published schema is that of the messages, and messages keep to it.
#![allow(clippy::unwrap_used, reason = "tests")]

use bridge::form::encode;
use bridge::schema::topics;
use ipc_types::{Message, TopicVisitor, visit_all};
use serde_json::Value;
use std::path::Path;

#[test]
fn the_published_file_is_what_the_command_prints() {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/schema.json");
    let published: Value = serde_json::from_str(&std::fs::read_to_string(file).unwrap()).unwrap();
    assert!(published == topics(), "docs/schema.json is old: sereno schema > docs/schema.json");
}

/// Whether a value keeps to what our schemas use of the language.
fn keeps(value: &Value, schema: &Value, place: &str) -> Result<(), String> {
    if let Some(all) = schema.get("allOf").and_then(Value::as_array) {
        return all.iter().try_for_each(|schema| keeps(value, schema, place));
    }
    if let Some(constant) = schema.get("const") {
        return if value == constant { Ok(()) } else { Err(format!("{place}: {value} is not {constant}")) };
    }
    let wrong = || Err(format!("{place}: {value} against {schema}"));
    let kind = &schema["type"];
    let kinds: Vec<&str> = kind
        .as_str()
        .into_iter()
        .chain(kind.as_array().into_iter().flatten().filter_map(Value::as_str))
        .collect();
    let fits = kinds.iter().any(|kind| match *kind {
        "integer" => value.is_i64() || value.is_u64(),
        "number" => value.is_number(),
        "null" => value.is_null(),
        "string" => {
            value.as_str().is_some_and(|text| text.len() as u64 <= schema["maxLength"].as_u64().unwrap())
        }
        "array" => value.is_array(),
        "object" => value.is_object(),
        _ => false,
    });
    if !fits {
        return wrong();
    }
    if let Some(items) = value.as_array() {
        let count = items.len() as u64;
        let (least, most) = (schema["minItems"].as_u64().unwrap_or(0), schema["maxItems"].as_u64().unwrap());
        if !(least..=most).contains(&count) {
            return wrong();
        }
        for item in items {
            keeps(item, &schema["items"], place)?;
        }
    }
    if let Some(fields) = value.as_object() {
        let required = schema["required"].as_array().unwrap();
        let properties = schema["properties"].as_object().unwrap();
        assert_eq!(fields.len(), required.len(), "{place}: {:?}", fields.keys());
        for (name, value) in fields {
            let property =
                properties.get(name).ok_or_else(|| format!("{place}.{name} is not in the schema"))?;
            assert!(
                !property["description"].as_str().unwrap().is_empty(),
                "{place}.{name} has no description"
            );
            keeps(value, property, &format!("{place}.{name}"))?;
        }
    }
    Ok(())
}

#[test]
fn every_message_keeps_to_its_schema() {
    struct Check(Value, usize);
    impl TopicVisitor for Check {
        type Output = ();
        fn visit<T: Message>(&mut self) {
            let row = &self.0["topics"][T::TOPIC];
            let form = row["form"].as_str().unwrap().to_owned();
            let mut message = bytemuck::allocation::zeroed_box::<T>();
            message.header_mut().sequence = u64::MAX;
            let mut whole = String::new();
            message.write_json(&mut whole).unwrap();
            let shown =
                if form == "json, cut" { String::from_utf8(encode(&*message)).unwrap() } else { whole };
            let value: Value = serde_json::from_str(&shown).unwrap();
            keeps(&value, &row["schema"], T::TOPIC).unwrap();
            assert!(keeps(&Value::from(7.5), &row["schema"], T::TOPIC).is_err());
            self.1 += 1;
        }
    }
    let mut check = Check(topics(), 0);
    visit_all(&mut check);
    assert!(check.1 >= 20, "{}", check.1);
}
