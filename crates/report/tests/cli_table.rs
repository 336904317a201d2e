//! `report table`: metrics documents in, one table out.
#![expect(clippy::unwrap_used, reason = "a test that cannot prepare its files has failed")]

use std::path::Path;
use std::process::{Command, Output};

use motes_formats::documents::{read_document, write_document};
use motes_formats::metrics::MetricsDocument;

fn table(folder: &Path, arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_report"));
    command.arg("table").args(arguments).current_dir(folder).output().unwrap()
}

/// Runs `a`, `b`, and `c`, whose renders had another background.
fn runs() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let valid = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../../testdata/formats/metrics/v1/valid/plain.json");
    for (name, psnr, red) in [("a", 24.0, 0.0), ("b", 26.0, 0.0), ("c", 25.0, 1.0)] {
        let mut document = read_document::<MetricsDocument>(&valid).unwrap().document;
        document.mean.psnr = Some(psnr);
        document.seeds = None;
        document.protocol.background[0] = red;
        std::fs::create_dir(folder.path().join(name)).unwrap();
        write_document(&folder.path().join(name).join("metrics.json"), &document).unwrap();
    }
    folder
}

#[test]
fn runs_of_one_name_share_a_row_and_the_protocol_stands_below() {
    let folder = runs();
    let done = table(folder.path(), &["ours=a/metrics.json", "ours=b/metrics.json"]);
    let text = String::from_utf8(done.stdout).unwrap();
    assert!(text.contains("| ours | 25.00 ± 1.41 |"), "{text}");
    assert!(text.contains("Protocol: split: "), "{text}");
    let said = String::from_utf8_lossy(&done.stderr);
    assert!(!said.contains("warning"), "{said}");
    let json = table(folder.path(), &["ours=a/metrics.json", "ours=b/metrics.json", "--json"]);
    let json: serde_json::Value = serde_json::from_slice(&json.stdout).unwrap();
    assert_eq!(json["rows"][0]["cells"][0]["mean"], 25.0);
}

#[test]
fn different_protocols_are_said_and_named() {
    let folder = runs();
    let all = ["a/metrics.json", "b/metrics.json", "c/metrics.json"];
    let done = table(folder.path(), &[&all[..], &["-o", "table.tex"]].concat());
    assert!(done.status.success());
    assert!(String::from_utf8_lossy(&done.stderr).contains("2 protocols"));
    let text = std::fs::read_to_string(folder.path().join("table.tex")).unwrap();
    assert!(text.contains("% Protocol of a, b: ") && text.contains("% Protocol of c: "), "{text}");
    assert!(text.contains("b & \\textbf{26.00}"), "{text}");
}

#[test]
fn a_suffix_of_no_table_and_a_file_that_is_none_are_refused() {
    let folder = runs();
    let refused = table(folder.path(), &["a/metrics.json", "-o", "table.xlsx"]);
    assert_eq!(refused.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&refused.stderr).contains(".md, .tex or .csv"));
    std::fs::write(folder.path().join("text.json"), "{}").unwrap();
    let refused = table(folder.path(), &["text.json"]);
    assert_eq!(refused.status.code(), Some(3));
    assert!(String::from_utf8_lossy(&refused.stderr).contains("text.json"));
}
