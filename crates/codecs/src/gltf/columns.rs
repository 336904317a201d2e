//! Extra columns as application attributes `_NAME`, and back.
//!
//! Attributes are f32. Integers of 8 and 16 bits are exact in it; the accessor's extras say which type
//! they were. Columns of other types have no place.

use motes_scene::{ColumnValues, ExtraColumn};
use serde_json::{Value, json};

/// Attribute name and extras of a column that can travel.
pub(super) fn attribute(column: &ExtraColumn) -> Option<(String, Value)> {
    let kind = match column.values {
        ColumnValues::I8(_) => "i8",
        ColumnValues::U8(_) => "u8",
        ColumnValues::I16(_) => "i16",
        ColumnValues::U16(_) => "u16",
        ColumnValues::F32(_) => "f32",
        _ => return None,
    };
    let name = format!("_{}", column.name.to_uppercase());
    Some((name, json!({ "column": column.name, "type": kind })))
}

/// Value `i` of a column that can travel.
pub(super) fn value(column: &ExtraColumn, i: usize) -> f32 {
    match &column.values {
        ColumnValues::I8(v) => f32::from(v[i]),
        ColumnValues::U8(v) => f32::from(v[i]),
        ColumnValues::I16(v) => f32::from(v[i]),
        ColumnValues::U16(v) => f32::from(v[i]),
        ColumnValues::F32(v) => v[i],
        ColumnValues::I32(v) => v[i] as f32,
        ColumnValues::U32(v) => v[i] as f32,
        ColumnValues::F64(v) => v[i] as f32,
    }
}

/// The column of an attribute.
pub(super) fn column(attribute: &str, extras: Option<&Value>, values: Vec<f32>) -> ExtraColumn {
    let say = |key: &str| extras.and_then(|extras| extras.get(key)).and_then(Value::as_str);
    let name = say("column").map_or_else(
        || attribute.trim_start_matches('_').to_lowercase(),
        |name| name.chars().filter(|c| !c.is_whitespace() && !c.is_control()).collect(),
    );
    let values = match say("type") {
        Some("i8") => ColumnValues::I8(values.iter().map(|v| *v as i8).collect()),
        Some("u8") => ColumnValues::U8(values.iter().map(|v| *v as u8).collect()),
        Some("i16") => ColumnValues::I16(values.iter().map(|v| *v as i16).collect()),
        Some("u16") => ColumnValues::U16(values.iter().map(|v| *v as u16).collect()),
        _ => ColumnValues::F32(values),
    };
    ExtraColumn { name, values }
}
