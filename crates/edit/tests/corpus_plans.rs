//! The corpus of plans: valid ones survive, and every malformed one ends in one clear error, at once and without much memory.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::path::{Path, PathBuf};
use std::time::Instant;

use edit::files::read_edit_plan;
use edit::plan::EditPlanDocument;
use motes_formats::FormatError;
use motes_formats::documents::{parse_document, to_pretty_json};

const MAX_BYTES: usize = 200 << 20;
const MAX_SECONDS: f64 = 1.0;

/// Most memory of this process so far, bytes; 0 where the system does not tell.
fn peak_bytes() -> usize {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    let kilobytes = line.and_then(|line| line.split_whitespace().next()?.parse::<usize>().ok());
    kilobytes.unwrap_or(0) << 10
}

fn cases(kind: &str) -> Vec<PathBuf> {
    let corpus = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../testdata/formats/edit-plan/v1");
    let entries = std::fs::read_dir(corpus.join(kind)).unwrap();
    let mut paths: Vec<PathBuf> = entries.map(|entry| entry.unwrap().path()).collect();
    paths.retain(|path| path.extension().is_some_and(|suffix| suffix == "json"));
    paths.sort();
    paths
}

#[test]
fn plans_survive_and_broken_ones_are_refused_for_their_reason() {
    let valid = cases("valid");
    for path in &valid {
        let bytes = std::fs::read(path).unwrap();
        let parsed = parse_document::<EditPlanDocument>(&bytes, path).unwrap();
        assert!(parsed.warnings.is_empty(), "{:?}", parsed.warnings);
        // The reader that knows places agrees with the derived one, and says its own minor version.
        assert_eq!(read_edit_plan(path).unwrap().document.ops, parsed.document.ops);
        let text = to_pretty_json(&parsed.document);
        let again = parse_document::<EditPlanDocument>(text.as_bytes(), path).unwrap();
        assert_eq!(again.document, parsed.document, "{}", path.display());
        assert_eq!(to_pretty_json(&again.document), text);
    }
    let invalid = cases("invalid");
    for path in &invalid {
        let mut expect_path = path.clone().into_os_string();
        expect_path.push(".expect");
        let expected = std::fs::read_to_string(&expect_path).unwrap();
        let started = Instant::now();
        let before = peak_bytes();
        let outcome = read_edit_plan(path).map(drop);
        let bytes = peak_bytes() - before;
        let seconds = started.elapsed().as_secs_f64();
        let name = path.display();
        assert!(bytes <= MAX_BYTES && seconds <= MAX_SECONDS, "{name}: {bytes} bytes, {seconds} s");
        let error = outcome.unwrap_err();
        assert!(!matches!(error, FormatError::Io { .. }), "{name}: {error}");
        let text = error.to_string();
        assert!(text.contains(path.parent().unwrap().to_str().unwrap()), "{name}: {text}");
        assert!(!expected.trim().is_empty() && text.contains(expected.trim()), "{name}: {text}");
        let mut lines = text.lines().skip(1);
        assert!(lines.next().is_none_or(|line| line.starts_with("help: ")), "{name}: {text}");
        assert!(lines.next().is_none(), "{name}: {text}");
    }
    assert!(valid.len() >= 3 && invalid.len() >= 10, "{} {}", valid.len(), invalid.len());
}
