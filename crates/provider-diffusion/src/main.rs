//! IC-Light and InstructPix2Pix on safetensors files: a provider of the kinds `relight` and `instruct-edit`.
//!
//! ```text
//! motes-provider-diffusion --describe --model stable-diffusion-v1-5/ --weights ic-light/
//! motes-provider-diffusion --request work/request.json --model instruct-pix2pix/
//! ```
//!
//! Exit codes: 0 done, 1 failed, 2 usage or a bad request, 3 bad weights or pictures, 130 interrupted.
//! Manual: `docs/stages/provider-diffusion.md`.

use std::process::ExitCode;

fn main() -> ExitCode {
    motes_stage::main(provider_diffusion::command::run)
}
