//! `<output>.run.json`: how a product was made.

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use anyhow::Context as _;
use serde::Serialize;
use serde_json::Value;

use crate::{Context, clock, resources};

/// An input of this run.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct Input {
    pub(crate) role: String,
    pub(crate) path: PathBuf,
    pub(crate) sha256: Option<String>,
}

/// `a/b.ply` to `a/b.ply.run.json`; a folder's record lies beside the folder.
pub(crate) fn record_path(output: &Path) -> PathBuf {
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
    let Some(product) = state.outputs.iter().find(|path| *path != Path::new("-")) else {
        return Ok(());
    };
    // A path that is not Unicode has no JSON spelling; argv still shows it.
    let config = serde_json::to_value(args).unwrap_or(Value::Null);
    let record = serde_json::json!({
        "format": "motes/run",
        "version": "1.0",
        "tool": context.program,
        "argv": arguments.iter().map(|a| a.to_string_lossy()).collect::<Vec<_>>(),
        "seed": config.get("seed").and_then(Value::as_u64),
        "config": config,
        "threads": context.threads(),
        "inputs": state.inputs,
        "outputs": state.outputs.iter().map(|p| p.to_string_lossy()).collect::<Vec<_>>(),
        "warnings": state.warnings,
        "start": clock::rfc3339(context.started),
        "wall_s": context.elapsed_seconds(),
        "cpu_s": resources::cpu_seconds(),
        "peak_memory_bytes": resources::peak_memory_bytes(),
        "report": serde_json::to_value(report)?,
    });
    let path = record_path(product);
    std::fs::write(&path, record.to_string())
        .with_context(|| format!("cannot write the run record: {}", path.display()))
}
