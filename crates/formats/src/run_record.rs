//! `*.run.json`: how a product was made.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::documents::Document;

/// How a product was made. Written beside it, never read as an input.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(title = "motes run record")]
pub struct RunRecord {
    /// `motes/run`.
    pub format: String,
    /// `MAJOR.MINOR` of this document.
    pub version: String,
    /// Name of the program.
    pub tool: String,
    /// Version of the program.
    #[serde(default)]
    pub tool_version: Option<String>,
    /// Commit that the program was built from.
    #[serde(default)]
    pub git: Option<String>,
    /// Command line, the program first.
    pub argv: Vec<String>,
    /// Every option of the run, defaults included.
    #[serde(default)]
    pub config: Value,
    /// Seed of the random numbers, for programs that use some.
    #[serde(default)]
    pub seed: Option<u64>,
    /// Threads that were used.
    pub threads: u64,
    /// Files that were read.
    pub inputs: Vec<RunInput>,
    /// Files that were written, as given on the command line.
    pub outputs: Vec<String>,
    /// What the user was warned of.
    #[serde(default)]
    pub warnings: Vec<String>,
    /// Start in UTC, RFC 3339.
    pub start: String,
    /// Elapsed seconds.
    pub wall_s: f64,
    /// CPU seconds of all threads and child processes; null where the system does not tell.
    #[serde(default)]
    pub cpu_s: Option<f64>,
    /// Peak resident memory, bytes; null where the system does not tell.
    #[serde(default)]
    pub peak_memory_bytes: Option<u64>,
    /// What the program measured, as `--json` prints it.
    #[serde(default)]
    pub report: Value,
}

impl Document for RunRecord {
    const FORMAT: &'static str = "motes/run";
    const MAJOR: u32 = 1;
    const MINOR: u32 = 0;
}

/// A file that was read.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct RunInput {
    /// What it was read as: `capture`, `gaussians`.
    pub role: String,
    /// Path as given.
    pub path: String,
    /// SHA-256 in hexadecimal; of a folder, that of the listing which `sha256sum` over its sorted
    /// files prints. Null when it was not read to its end.
    #[serde(default)]
    pub sha256: Option<String>,
}
