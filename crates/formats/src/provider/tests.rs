use std::path::Path;

use super::*;
use crate::documents::{Document, parse_document, to_pretty_json};

fn request(text: &str) -> crate::error::Result<ProviderRequest> {
    let opening = r#"{"format": "motes/provider-request", "version": "1.0", "task": "#;
    let parsed =
        parse_document::<ProviderRequest>(format!("{opening}{text}}}").as_bytes(), Path::new("r"))?;
    parsed.document.files(Path::new("r"))?;
    Ok(parsed.document)
}

#[test]
fn a_request_survives_and_has_the_defaults_of_its_kind() {
    let read = request(
        r#"{"segment": {"picture": "a.png", "points": [{"x": 1, "y": 2, "positive": true}]}}"#,
    );
    let read = read.unwrap();
    assert_eq!(read.kind(), ProviderKind::Segment);
    let Task::Segment(task) = &read.task else { panic!("{read:?}") };
    assert_eq!((task.candidates, task.around, task.points.len()), (3, None, 1));
    let again = parse_document::<ProviderRequest>(to_pretty_json(&read).as_bytes(), Path::new("r"));
    assert_eq!(again.unwrap().document, read);
}

#[test]
fn a_request_that_leaves_its_folder_or_its_range_is_refused() {
    for (text, says) in [
        (r#"{"segment": {"picture": "../a.png"}}"#, "leads out of the folder"),
        (r#"{"relight": {"picture": "a", "background": "/etc/b"}}"#, "is absolute"),
        (r#"{"segment": {"picture": "a", "candidates": 4}}"#, "/task/segment/candidates"),
        (r#"{"instruct-edit": {"prompt": "", "views": [{"original": "a"}]}}"#, "prompt"),
        (r#"{"instruct-edit": {"prompt": "x", "views": []}}"#, "views"),
        (r#"{"dream": {}}"#, "unknown variant"),
    ] {
        let error = request(text).unwrap_err().to_string();
        assert!(error.contains(says), "{text}: {error}");
    }
}

const CAMERA: &str = r#"{"focal_px": [9, 9], "center_px": [4, 3], "rotation_wxyz": [1, 0, 0, 0], "translation": [0, 0, 0]}"#;

#[test]
fn the_files_of_every_kind_are_known() {
    for (text, files) in [
        (r#"{"segment": {"picture": "a", "logits": "b"}}"#, 2),
        (r#"{"relight": {"picture": "a", "background": "b", "foreground": "c"}}"#, 3),
        (r#"{"instruct-edit": {"prompt": "x", "views": [{"original": "a", "start": "b"}]}}"#, 2),
        (r#"{"predict": {"pictures": ["a", "b"], "quantities": ["normal"]}}"#, 2),
        (r#"{"environment": {"picture": "a"}}"#, 1),
        (
            r#"{"novel-view": {"rendering": "a", "camera": CAMERA, "references": [{"picture": "b", "camera": CAMERA}]}}"#,
            2,
        ),
        (r#"{"chat": {"messages": [{"role": "user", "text": "x", "pictures": ["a"]}]}}"#, 1),
    ] {
        let text = text.replace("CAMERA", CAMERA);
        let found = request(&text).unwrap().files(Path::new("r")).unwrap();
        assert_eq!(found.len(), files, "{text}");
    }
}

#[test]
fn scores_beyond_one_are_refused() {
    let mask = |score: &str| {
        format!(
            r#"{{"format": "motes/provider-reply", "version": "1.0", "result": {{"segment": {{"best": 0,
            "masks": [{{"mask": "m.png", "predicted_iou": {score}, "stability": 1}}]}}}}}}"#
        )
    };
    let parse = |text: String| parse_document::<ProviderReply>(text.as_bytes(), Path::new("r"));
    assert!(parse(mask("0.5")).is_ok());
    let error = parse(mask("1.5")).unwrap_err().to_string();
    assert!(error.contains("/result/segment/masks/0/predicted_iou"), "{error}");
    assert_eq!(ProviderReply::version(), "1.1");
}
