use std::path::Path;

use motes_formats::documents::to_pretty_json;

use super::*;
use crate::files::read_edit_plan;
use crate::ops::OP_NAMES;

fn plan(ops: &str) -> String {
    format!(r#"{{"format": "motes/edit-plan", "version": "1.0", "ops": [{ops}]}}"#)
}

fn error(ops: &str) -> String {
    parse_edit_plan(plan(ops).as_bytes(), Path::new("plan.json")).unwrap_err().to_string()
}

#[test]
fn a_plan_survives() {
    let text = plan(
        r#"{"op": "select", "id": "ball", "steps": [{"by": "sphere", "center": [0, 1, 2], "radius": 0.5}, {"post": "grow", "distance": 0.1}]},
           {"op": "transform", "target": "ball", "translate": [0.02, 0.34, 0], "pivot": "base"},
           {"op": "transform", "rotate_axis": {"axis": [0, 0, 2], "deg": 30}, "pivot": [1, 2, 3]},
           {"op": "set_material", "name": "brass", "roughness": 0.2},
           {"op": "delete", "target": "ball", "fill": "plane"},
           {"op": "drop_nan"}, {"op": "undo", "steps": 2}"#,
    );
    let parsed = parse_edit_plan(text.as_bytes(), Path::new("plan.json")).unwrap();
    assert_eq!((parsed.document.ops.len(), parsed.warnings.len()), (7, 0));
    let written = to_pretty_json(&parsed.document);
    let again = parse_edit_plan(written.as_bytes(), Path::new("plan.json")).unwrap();
    assert_eq!(again.document, parsed.document);
    assert_eq!(to_pretty_json(&again.document), written);
    // The derived reader agrees with the one that knows places.
    let derived: EditPlanDocument = serde_json::from_str(&written).unwrap();
    assert_eq!(derived, parsed.document);
}

#[test]
fn every_mistake_has_a_pointer() {
    let select = r#"{"op": "select", "id": "a", "steps": [{"by": "ids", "ids": [1]}]}"#;
    for (ops, place) in [
        (r#"{"op": "explode"}"#, "/ops/0/op"),
        (r#"{"target": "all"}"#, "/ops/0/op"),
        (r#"7"#, "/ops/0"),
        (r#"{"op": "transform", "scale": 0}"#, "/ops/0/scale"),
        (r#"{"op": "transform", "scale": -1}"#, "/ops/0/scale"),
        (r#"{"op": "transform", "scale": NaN}"#, "/ops/0/scale line 1"),
        (r#"{"op": "transform", "scale": 1e999}"#, "/ops/0/scale line 1"),
        (r#"{"op": "transform", "translate": [0, "NaN", 0]}"#, "/ops/0/translate/1"),
        (r#"{"op": "transform", "translate": [0, 1]}"#, "/ops/0/translate"),
        (r#"{"op": "transform", "rotate_quaternion": [0, 0, 0, 0]}"#, "/ops/0/rotate_quaternion"),
        (r#"{"op": "transform", "translat": [0, 1, 2]}"#, "/ops/0"),
        (r#"{"op": "delete", "target": "a"}"#, "/ops/0/target"),
        (r#"{"op": "select", "steps": [{"by": "ids", "ids": []}]}"#, "/ops/0/steps/0/ids"),
        (r#"{"op": "select", "steps": [{"by": "all"}, {"by": "magic"}]}"#, "/ops/0/steps/1"),
        (
            r#"{"op": "select", "steps": [{"by": "sphere", "center": [0, 0, 0], "radius": 0}]}"#,
            "/ops/0/steps/0/radius",
        ),
        (r#"{"op": "select", "from": "x", "steps": [{"post": "invert"}]}"#, "/ops/0/from"),
        (r#"{"op": "select"}"#, "/ops/0"),
        (r#"{"op": "duplicate", "translate": [1, 0, 0], "count": 1000000000}"#, "/ops/0/count"),
        (r#"{"op": "recolor", "rgb_linear": [0, 2, 0]}"#, "/ops/0/rgb_linear/1"),
        (r#"{"op": "set_material"}"#, "/ops/0"),
        (r#"{"op": "set_material", "roughness": 1.5}"#, "/ops/0/roughness"),
        (r#"{"op": "undo"}"#, "/ops/0/steps"),
        (r#"{"op": "crop"}"#, "/ops/0"),
        (r#"{"op": "stylize", "editor": "prog {input}"}"#, "/ops/0/editor"),
        (&format!("{select}, {select}"), "/ops/1/id"),
        (&format!(r#"{{"op": "delete", "target": "a"}}, {select}"#), "/ops/0/target"),
        (
            r#"{"op": "duplicate", "translate": [0, 0, 1], "target": "b", "as": "b"}"#,
            "/ops/0/target",
        ),
        (r#"{"op": "transform", "translate": [0, -1e19, 0]}"#, "/ops/0/translate/1"),
        (r#"{"op": "transform", "scale": 1e-300}"#, "/ops/0/scale"),
        (r#"{"op": "transform", "pivot": [0, 0, 1e40]}"#, "/ops/0/pivot/2"),
        (r#"{"op": "insert", "file": "a.ply", "at": [1e300, 0, 0]}"#, "/ops/0/at/0"),
        (r#"{"op": "insert", "file": "a.ply", "height": 1e30}"#, "/ops/0/height"),
        (r#"{"op": "insert", "file": "a.ply", "rotate_deg": 1e30}"#, "/ops/0/rotate_deg"),
        (r#"{"op": "set_environment", "file": "a.exr", "exposure": 1e-30}"#, "/ops/0/exposure"),
        (r#"{"op": "set_environment", "file": "a.exr", "up": [0, 0, 0]}"#, "/ops/0/up"),
        (r#"{"op": "keep_largest", "reach": 1e19}"#, "/ops/0/reach"),
        (
            r#"{"op": "crop", "sphere": {"center": [0, 1e19, 0], "radius": 1}}"#,
            "/ops/0/sphere/center/1",
        ),
        (
            r#"{"op": "select", "steps": [{"by": "all"}, {"post": "grow", "distance": -1}]}"#,
            "/ops/0/steps/1/distance",
        ),
        (
            r#"{"op": "select", "steps": [{"by": "brush", "view": "a", "points": [[0, 0], [1, 1e20]], "radius": 3}]}"#,
            "/ops/0/steps/0/points/1/1",
        ),
        (
            r#"{"op": "select", "steps": [{"by": "object", "clicks": [{"view": "a", "pixel": [1e99, 2]}]}]}"#,
            "/ops/0/steps/0/clicks/0/pixel/0",
        ),
        (
            r#"{"op": "select", "steps": [{"by": "connected", "seed": [0, 0, 0], "distance": 0}]}"#,
            "/ops/0/steps/0/distance",
        ),
    ] {
        let text = error(ops);
        assert!(text.contains(&format!("({place}")), "{ops}: {text}");
    }
    let text = error(r#"{"op": "select", "steps": [{"by": "magic"}]}"#);
    assert!(text.contains("unknown variant `magic`"), "{text}");
    assert!(error(r#"{"op": "explode"}"#).contains("help: the operations are select, transform"));
    assert!(error(&format!(r#"{{"op": "delete", "target": "a"}}, {select}"#)).contains("later"));
}

#[test]
fn cycles_are_refused_where_they_begin() {
    let select = |id: &str, from: &str| {
        format!(
            r#"{{"op": "select", "id": "{id}", "from": "{from}", "steps": [{{"post": "invert"}}]}}"#
        )
    };
    let (undo, measure) = (r#"{"op": "undo", "steps": 1}"#, r#"{"op": "measure", "target": "a"}"#);
    let (a, b) = (select("a", "all"), select("b", "a"));
    for (ops, place) in [
        (select("a", "a"), "/ops/0/from"),
        (format!("{}, {}", select("a", "b"), b), "/ops/0/from"),
        (format!("{}, {}, {}", select("a", "c"), b, select("c", "b")), "/ops/0/from"),
        // What was taken back is not there, and what takes back is not taken back.
        (undo.to_owned(), "/ops/0/steps"),
        (format!("{a}, {undo}, {undo}"), "/ops/2/steps"),
        (format!("{a}, {undo}, {measure}"), "/ops/2/target"),
        (format!("{a}, {b}, {}, {measure}", r#"{"op": "undo", "steps": 2}"#), "/ops/3/target"),
        (format!("{a}, {}", r#"{"op": "undo", "steps": 18446744073709551615}"#), "/ops/1/steps"),
    ] {
        let text = error(&ops);
        assert!(text.contains(&format!("({place})")), "{ops}: {text}");
    }
    // A name that was taken back may be given again.
    let again = plan(&format!("{a}, {undo}, {a}, {measure}"));
    assert!(parse_edit_plan(again.as_bytes(), Path::new("plan.json")).is_ok());
}

#[test]
fn too_many_operations_are_refused() {
    let many = vec![r#"{"op":"drop_nan"}"#; MAX_OPS + 1].join(",");
    assert!(error(&many).contains("(/ops/10000)"), "{}", &error(&many)[..200]);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("huge.json");
    // A billion operations are some 20 GB: a sparse file of that size is refused unread.
    let file = std::fs::File::create(&path).unwrap();
    file.set_len(20 << 30).unwrap();
    let text = read_edit_plan(&path).unwrap_err().to_string();
    assert!(text.contains("(/ops)") && text.contains("help: split the plan"), "{text}");
}

#[test]
fn the_schema_describes_every_operation() {
    let schema = schemars::schema_for!(EditPlanDocument).to_value().to_string();
    for name in OP_NAMES {
        assert!(schema.contains(&format!("\"const\":\"{name}\"")), "{name}");
    }
}
