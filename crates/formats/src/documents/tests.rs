use super::*;
use crate::camera_path::CameraPathDocument;

const PATH: &str = r#"{
  "format": "motes/camera-path",
  "version": "1.0",
  "width": 64, "height": 48, "vertical_fov_deg": 50,
  "poses": [{"camera_from_world": {"rotation_wxyz": [1, 0, 0, 0], "translation": [0, 0, 1]}}]
}"#;

fn parse(text: &str) -> Result<Parsed<CameraPathDocument>> {
    parse_document(text.as_bytes(), Path::new("p.json"))
}

fn fault(from: &str, to: &str) -> String {
    assert!(PATH.contains(from), "{from}");
    parse(&PATH.replace(from, to)).unwrap_err().to_string()
}

#[test]
fn defaults_are_filled_in() {
    let parsed = parse(PATH).unwrap();
    assert!(parsed.warnings.is_empty());
    assert_eq!(parsed.document.fps, 30.0);
    assert_eq!(parse(&format!("\u{feff}{PATH}\r\n")).unwrap(), parsed);
}

#[test]
fn versions_follow_the_rule() {
    let newer = PATH.replace("\"1.0\"", "\"1.7\"").replace("\"width\"", "\"lens\": {}, \"width\"");
    let warnings = parse(&newer).unwrap().warnings;
    assert_eq!(warnings, ["unknown keys of a newer version in p.json were ignored: \"lens\""]);
    let misspelt = parse(&PATH.replace("\"width\"", "\"fsp\": 3, \"width\"")).unwrap().warnings;
    assert!(misspelt[0].starts_with("unknown keys in p.json"), "{misspelt:?}");

    let text = fault("\"1.0\"", "\"2.0\"");
    assert!(text.contains("version 2.0 of motes/camera-path is not known (/version): p.json"));
    assert!(text.contains("help: use motes 2 or newer"), "{text}");
    for version in ["1", "\"one\"", "\"1\"", "null", "\"-1.0\"", "\"1.0.0\""] {
        assert!(fault("\"1.0\"", version).contains("must be like \"1.0\""), "{version}");
    }
    assert!(
        fault("motes/camera-path", "motes/capture").contains("not a motes/camera-path document")
    );
    assert!(fault("\"format\"", "\"formet\"").contains("\"format\" is missing"));
}

#[test]
fn faults_have_a_place() {
    assert!(fault("64", "\"64\"").contains("invalid type: string \"64\""));
    assert!(fault("64", "\"64\"").contains("(/width line 4 column 15)"));
    assert!(fault("64", "-64").contains("invalid value: integer `-64`"));
    let pose = fault("[0, 0, 1]", "[0, \"up\", 1]");
    assert!(pose.contains("(/poses/0/camera_from_world/translation/1 line 5"), "{pose}");
    assert!(pose.contains("help: docs/formats/schema/camera-path-v1.schema.json"), "{pose}");
    let long = fault("64", &format!("\"{}, expected \"", "x".repeat(10_000)));
    assert!(long.contains("…, expected u64 (/width") && long.len() < 300, "{long}");
    assert!(
        fault("50", "180")
            .contains("180.0 is not a number above 0 and below 180 (/vertical_fov_deg)")
    );
    assert!(fault("64", "1e999").contains("not JSON: number out of range"));
    assert!(fault("64", "NaN").contains("not JSON: expected"));
    assert!(fault("\"width\": 64,", "").contains("missing field `width`"));
    assert!(fault("\"width\": 64,", "\"width\": 64, \"width\": 65,").contains("duplicate field"));
    assert!(fault("}}]\n}", "}}]").contains("the document ends early"));
    assert!(fault("}}]\n}", "}}]\n}{}").contains("trailing characters"));
    assert!(parse("").unwrap_err().to_string().contains("the file is empty"));
    let deep = "[".repeat(100_000);
    assert!(parse(&deep).is_err());
    // Deep nesting that is ignored costs no stack.
    let nested = format!("\"x\": {deep}{}, \"poses\"", "]".repeat(100_000));
    assert_eq!(parse(&PATH.replace("\"poses\"", &nested)).unwrap().warnings.len(), 1);
}
