//! `<output>.run.json`: how a product was made.

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use motes_formats::documents::{Document as _, write_document};
use motes_formats::run_record::RunRecord;
use motes_formats::standard_stream::is_standard_stream;
use serde::Serialize;
use serde_json::Value;

use crate::{Context, clock, resources, revision};

/// The run record of a product: `a/b.ply` to `a/b.ply.run.json`; a folder's record lies beside the folder.
pub fn record_path(output: &Path) -> PathBuf {
    // Going through components drops a trailing slash.
    let mut name: OsString = output.components().collect::<PathBuf>().into();
    name.push(".run.json");
    name.into()
}

/// Writes the record beside the first output, if there is one on disk.
pub(crate) fn write<A: Serialize, R: Serialize>(
    context: &Context,
    arguments: &[OsString],
    args: &A,
    report: &R,
) -> anyhow::Result<()> {
    let state = context.lock();
    let Some(product) = state.outputs.iter().find(|path| has_record(path)) else {
        return Ok(());
    };
    // A path that is not Unicode has no JSON spelling; argv still shows it.
    let config = to_value(args).unwrap_or(Value::Null);
    let record = RunRecord {
        format: RunRecord::FORMAT.to_owned(),
        version: RunRecord::version(),
        tool: context.program.clone(),
        tool_version: Some(env!("CARGO_PKG_VERSION").to_owned()),
        git: revision::git().map(str::to_owned),
        argv: arguments.iter().map(|argument| argument.to_string_lossy().into_owned()).collect(),
        seed: config.get("seed").and_then(Value::as_u64),
        config,
        threads: context.threads() as u64,
        inputs: state.inputs.clone(),
        outputs: state.outputs.iter().map(|path| path.to_string_lossy().into_owned()).collect(),
        warnings: state.warnings.clone(),
        start: clock::rfc3339(context.started),
        wall_s: context.elapsed_seconds(),
        cpu_s: resources::cpu_seconds(),
        peak_memory_bytes: resources::peak_memory_bytes(),
        report: to_value(report)?,
    };
    Ok(write_document(&record_path(product), &record)?)
}

/// Through text, so that single-precision numbers keep their short form: 0.005, not
/// 0.004999999888241291.
fn to_value<T: Serialize>(value: &T) -> serde_json::Result<Value> {
    serde_json::from_str(&serde_json::to_string(value)?)
}

/// Standard output and devices keep no files beside them.
fn has_record(output: &Path) -> bool {
    !is_standard_stream(output)
        && std::fs::metadata(output).is_ok_and(|meta| meta.is_file() || meta.is_dir())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_record_lies_beside_its_product() {
        for (output, record) in
            [("a/b.ply", "a/b.ply.run.json"), ("renders/", "renders.run.json"), ("b", "b.run.json")]
        {
            assert_eq!(record_path(Path::new(output)), Path::new(record));
        }
    }

    #[test]
    fn single_precision_stays_short() {
        assert_eq!(to_value(&[0.005f32, f32::NAN]).unwrap().to_string(), "[0.005,null]");
    }

    #[test]
    fn only_products_on_disk_have_one() {
        let dir = tempfile::tempdir().unwrap();
        assert!(has_record(dir.path()));
        assert!(!has_record(Path::new("-")));
        assert!(!has_record(&dir.path().join("never written")));
        #[cfg(unix)]
        assert!(!has_record(Path::new("/dev/null")));
    }
}
