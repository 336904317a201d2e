//! The provider's side of the protocol, for providers in Rust.

use std::io::{self, BufRead, Write};
use std::path::{Path, PathBuf};

use motes_formats::documents::write_document;
use motes_formats::provider::{ProviderReply, ProviderRequest, read_request};
use motes_stage::StageError;

pub use crate::server::{ServeReply, ServeRequest};

/// Reads the request at `path`, has it answered, and writes `reply.json` beside it; its path is returned. `work` puts its
/// pictures into the folder that it gets.
///
/// # Errors
/// The request is bad (a usage error: the caller is a program), or what `work` says.
pub fn answer(
    path: &Path,
    work: &mut dyn FnMut(&ProviderRequest, &Path) -> anyhow::Result<ProviderReply>,
) -> anyhow::Result<PathBuf> {
    let request = read_request(path).map_err(|error| usage(&error))?;
    let folder = path.parent().unwrap_or(Path::new("."));
    for file in request.files(path).map_err(|error| usage(&error))? {
        let file = folder.join(file);
        if !file.is_file() {
            let text = format!("the request names no such file: {}", file.display());
            return Err(StageError::usage(text).into());
        }
    }
    let reply = work(&request, folder)?;
    let written = folder.join("reply.json");
    write_document(&written, &reply)?;
    Ok(written)
}

fn usage(error: &motes_formats::FormatError) -> StageError {
    StageError::usage(error.to_string())
}

/// Answers requests, a line each, until the input ends: the body of `--serve`.
///
/// # Errors
/// The lines cannot be read or written. A request that cannot be answered is said in its line.
pub fn serve(
    input: impl BufRead,
    mut output: impl Write,
    work: &mut dyn FnMut(&ProviderRequest, &Path) -> anyhow::Result<ProviderReply>,
) -> io::Result<()> {
    for line in input.lines() {
        let line = line?;
        if line.trim().is_empty() {
            continue;
        }
        let reply = match serde_json::from_str::<ServeRequest>(&line) {
            Err(error) => {
                failed(&StageError::usage(format!("not a line of the protocol: {error}")).into())
            }
            Ok(asked) => match answer(&asked.request, work) {
                Ok(reply) => ServeReply::Done { reply },
                Err(error) => failed(&error),
            },
        };
        serde_json::to_writer(&mut output, &reply)?;
        output.write_all(b"\n")?;
        output.flush()?;
    }
    Ok(())
}

fn failed(error: &anyhow::Error) -> ServeReply {
    let (explanation, status) = motes_stage::outcome_of(error);
    let (error, help) = (explanation.text, explanation.help);
    ServeReply::Failed { error, help, exit_code: status as u8 }
}
