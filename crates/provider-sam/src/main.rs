//! Masks from prompts by SAM, SAM 2.1 or MobileSAM in ONNX files: a provider of the kind `segment`.
//!
//! ```text
//! motes-provider-sam --describe --model sam/
//! motes-provider-sam --request work/request.json --model sam/
//! ```
//!
//! Exit codes: 0 done, 1 failed, 2 usage or a bad request, 3 bad weights, 130 interrupted.
//! Manual: `docs/stages/provider-sam.md`.

use std::process::ExitCode;

fn main() -> ExitCode {
    motes_stage::main(provider_sam::command::run)
}
