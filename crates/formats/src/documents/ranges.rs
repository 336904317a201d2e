//! Ranges of numbers, lengths of lists and texts: declared once, in the JSON Schema of a type, and checked from it.
//!
//! Types say which keys there are; the schema, which `schemars` derives from the same type, says what their values may be:
//! `minimum`, `maximum`, `exclusiveMinimum`, `exclusiveMaximum`, `minItems`, `maxItems`, `minLength`.

use serde_json::Value;

use super::pointer::escaped;

/// A value that its schema does not allow.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct OutOfRange {
    /// JSON pointer to the value.
    pub pointer: String,
    /// What is wrong, in a sentence.
    pub cause: String,
}

/// The first value of a document that is out of the range which its schema declares. What the schema says about types and
/// keys is not looked at: the deserializer has seen to it.
pub fn out_of_range(schema: &Value, value: &Value) -> Option<OutOfRange> {
    Walk { root: schema }.first(schema, value, &mut String::new())
}

struct Walk<'a> {
    /// Where `$ref` begins.
    root: &'a Value,
}

impl Walk<'_> {
    fn first(&self, schema: &Value, value: &Value, at: &mut String) -> Option<OutOfRange> {
        let outside =
            |cause: Option<String>| cause.map(|cause| OutOfRange { pointer: at.clone(), cause });
        let found = match value {
            Value::Number(number) => outside(number_cause(schema, number)),
            Value::Array(items) => outside(count_cause(schema, "Items", "a list", items.len()))
                .or_else(|| self.in_array(schema, items, at)),
            Value::String(text) => {
                outside(count_cause(schema, "Length", "a text", text.chars().count()))
            }
            Value::Object(object) => self.in_object(schema, object, at),
            Value::Null => outside(null_cause(schema)),
            Value::Bool(_) => None,
        };
        found.or_else(|| self.in_parts(schema, value, at))
    }

    fn in_array(&self, schema: &Value, items: &[Value], at: &mut String) -> Option<OutOfRange> {
        items.iter().enumerate().find_map(|(i, item)| {
            let own = schema["prefixItems"].get(i).unwrap_or(&schema["items"]);
            self.below(own, item, &i.to_string(), at)
        })
    }

    fn in_object(
        &self,
        schema: &Value,
        object: &serde_json::Map<String, Value>,
        at: &mut String,
    ) -> Option<OutOfRange> {
        object.iter().find_map(|(key, value)| {
            let own = schema["properties"].get(key).unwrap_or(&schema["additionalProperties"]);
            self.below(own, value, &escaped(key), at)
        })
    }

    fn below(&self, own: &Value, value: &Value, key: &str, at: &mut String) -> Option<OutOfRange> {
        if !own.is_object() {
            return None;
        }
        let length = at.len();
        at.push('/');
        at.push_str(key);
        let found = self.first(own, value, at);
        at.truncate(length);
        found
    }

    /// What the schema refers to or is made of.
    fn in_parts(&self, schema: &Value, value: &Value, at: &mut String) -> Option<OutOfRange> {
        if let Some(reference) = schema["$ref"].as_str()
            && let Some(target) = reference.strip_prefix('#').and_then(|p| self.root.pointer(p))
            && let Some(found) = self.first(target, value, at)
        {
            return Some(found);
        }
        let all = schema["allOf"].as_array().into_iter().flatten();
        if let Some(found) = all.into_iter().find_map(|part| self.first(part, value, at)) {
            return Some(found);
        }
        // Of alternatives, those count that are of the kind of the value: one that allows it is enough.
        let alternatives = ["oneOf", "anyOf"].iter().find_map(|key| schema[*key].as_array())?;
        let mut found = None;
        for part in alternatives.iter().filter(|part| self.is_of_kind(part, value)) {
            found = Some(self.first(part, value, at)?);
        }
        found
    }

    /// Whether a value has the type, the constants and the keys that a schema asks for.
    fn is_of_kind(&self, schema: &Value, value: &Value) -> bool {
        if let Some(reference) = schema["$ref"].as_str() {
            let target = reference.strip_prefix('#').and_then(|p| self.root.pointer(p));
            if !target.is_some_and(|target| self.is_of_kind(target, value)) {
                return false;
            }
        }
        if let Some(alternatives) =
            ["oneOf", "anyOf"].iter().find_map(|key| schema[*key].as_array())
            && !alternatives.iter().any(|part| self.is_of_kind(part, value))
        {
            return false;
        }
        let kind = match value {
            Value::Null => "null",
            Value::Bool(_) => "boolean",
            Value::Number(n) if n.is_f64() => "number",
            Value::Number(_) => "integer",
            Value::String(_) => "string",
            Value::Array(_) => "array",
            Value::Object(_) => "object",
        };
        let is_type = |name: &Value| name == kind || (kind == "integer" && name == "number");
        let type_fits = match &schema["type"] {
            Value::Array(names) => names.iter().any(is_type),
            Value::Null => true,
            name => is_type(name),
        };
        let constant_fits = schema.get("const").is_none_or(|constant| constant == value);
        let word_fits = schema["enum"].as_array().is_none_or(|words| words.contains(value));
        let required = schema["required"].as_array().into_iter().flatten();
        let keys_fit = value.as_object().is_none_or(|object| {
            let has = |key: &Value| key.as_str().is_some_and(|key| object.contains_key(key));
            let constants = schema["properties"].as_object().into_iter().flatten();
            required.into_iter().all(has)
                && constants.into_iter().all(|(key, own)| {
                    let (Some(constant), Some(value)) = (own.get("const"), object.get(key)) else {
                        return true;
                    };
                    constant == value
                })
        });
        type_fits && constant_fits && word_fits && keys_fit
    }
}

fn number_cause(schema: &Value, number: &serde_json::Number) -> Option<String> {
    let value = number.as_f64()?;
    let bound = |key: &str| schema[key].as_f64();
    let (low, high) = (bound("minimum"), bound("maximum"));
    let (above, below) = (bound("exclusiveMinimum"), bound("exclusiveMaximum"));
    let fits = low.is_none_or(|low| value >= low)
        && high.is_none_or(|high| value <= high)
        && above.is_none_or(|above| value > above)
        && below.is_none_or(|below| value < below);
    if fits {
        return None;
    }
    let from = match (low, above) {
        (Some(low), _) => format!(" from {low}"),
        (None, Some(above)) => format!(" above {above}"),
        (None, None) => String::new(),
    };
    let to = match (high, below) {
        (Some(high), _) => format!(" to {high}"),
        (None, Some(below)) => format!(" and below {below}"),
        (None, None) if low.is_some() => " on".into(),
        (None, None) => String::new(),
    };
    Some(format!("{number} is not a number{from}{to}"))
}

fn count_cause(schema: &Value, of: &str, what: &str, count: usize) -> Option<String> {
    let bound = |side: &str| schema[format!("{side}{of}")].as_u64();
    if let Some(least) = bound("min").filter(|least| (count as u64) < *least) {
        return Some(match (least, of) {
            (1, "Items") => format!("{what} with nothing in it"),
            (1, _) => format!("{what} without a character"),
            _ => format!("{what} of {count}, at least {least} are needed"),
        });
    }
    let most = bound("max").filter(|most| count as u64 > *most)?;
    Some(format!("{what} of {count}, at most {most} are allowed"))
}

/// Numbers that JSON cannot write are null.
fn null_cause(schema: &Value) -> Option<String> {
    let number = ["number", "integer"].iter().any(|name| schema["type"] == *name);
    number.then(|| "this is not a finite number".into())
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    fn found(schema: &Value, value: &Value) -> Option<(String, String)> {
        out_of_range(schema, value).map(|found| (found.pointer, found.cause))
    }

    #[test]
    fn bounds_hold_at_their_ends() {
        let schema = json!({"type": "number", "minimum": 0, "maximum": 1});
        assert_eq!(found(&schema, &json!(1)), None);
        assert_eq!(found(&schema, &json!(1.5)).unwrap().1, "1.5 is not a number from 0 to 1");
        let open = json!({"type": "number", "exclusiveMinimum": 0});
        assert_eq!(found(&open, &json!(0.0)).unwrap().1, "0.0 is not a number above 0");
        assert_eq!(found(&open, &json!(1e-300)), None);
        assert_eq!(found(&open, &Value::Null).unwrap().1, "this is not a finite number");
    }

    #[test]
    fn the_pointer_leads_through_references_lists_and_keys() {
        let schema = json!({
            "$defs": {"size": {"type": "integer", "minimum": 1}},
            "properties": {"a/b": {"type": "array", "minItems": 1, "items": {"$ref": "#/$defs/size"}}},
        });
        let (pointer, _) = found(&schema, &json!({"a/b": [1, 0]})).unwrap();
        assert_eq!(pointer, "/a~1b/1");
        assert_eq!(found(&schema, &json!({"a/b": []})).unwrap().1, "a list with nothing in it");
        assert_eq!(found(&schema, &json!({"a/b": [1], "unknown": -1})), None);
    }

    #[test]
    fn of_alternatives_the_one_of_the_kind_counts() {
        let schema = json!({"oneOf": [
            {"type": "object", "properties": {"op": {"const": "a"}, "n": {"type": "integer", "maximum": 3}}},
            {"type": "object", "properties": {"op": {"const": "b"}, "n": {"type": "integer", "maximum": 9}}},
            {"type": "null"},
        ]});
        assert_eq!(found(&schema, &json!({"op": "b", "n": 5})), None);
        assert_eq!(found(&schema, &json!({"op": "a", "n": 5})).unwrap().0, "/n");
        assert_eq!(found(&schema, &Value::Null), None);
    }
}
