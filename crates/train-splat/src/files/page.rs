//! The page that shows a fit as it goes: the program `view`, which follows the snapshots of a product.

use std::io::{BufRead as _, BufReader, Read};
use std::path::Path;
use std::process::{Child, Command, Stdio};

use motes_protocol::stage_program;
use motes_stage::{Context, StageError};
use serde_json::Value;

/// Snapshots over a whole fit.
const SNAPSHOTS: u32 = 20;

/// Steps between the snapshots of a page.
pub(super) fn snapshot_every(iterations: u32) -> u32 {
    (iterations / SNAPSHOTS).max(1)
}

/// A running page. One that was not left open ends with the fit.
pub(super) struct Page {
    child: Option<Child>,
}

impl Page {
    /// Starts the page of a product that is yet to be written; its address is told as soon as it has one.
    ///
    /// # Errors
    /// When there is no program `view`.
    pub(super) fn open(
        gaussians: &Path,
        capture: &Path,
        no_browser: bool,
    ) -> Result<Self, StageError> {
        let Some(program) = stage_program("view") else {
            let help = "put it beside this program, or into a folder of MOTES_STAGE_PATH";
            return Err(StageError::usage("--view needs the program view").help(help));
        };
        let mut command = Command::new(&program);
        command.arg("--gaussians").arg(gaussians).arg("--capture").arg(capture);
        command.args(["--wait", "--json", "--quiet"]);
        if no_browser {
            command.arg("--no-browser");
        }
        // Pipes of its own: who reads this program's output is not made to wait for the page.
        command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child = command.spawn().map_err(|error| {
            StageError::usage(format!("cannot run view ({error}): {}", program.display()))
        })?;
        for_each_line(child.stdout.take(), |line| {
            let line: Value = serde_json::from_str(line).unwrap_or_default();
            if let Some(url) = line["url"].as_str() {
                tracing::info!("the fit so far: {url}");
            }
        });
        for_each_line(child.stderr.take(), |line| tracing::warn!("{line}"));
        Ok(Self { child: Some(child) })
    }

    /// Leaves the page open after this program, or says that it has ended.
    pub(super) fn leave_open(mut self, context: &Context) {
        let Some(mut child) = self.child.take() else { return };
        match child.try_wait() {
            Ok(Some(status)) if !status.success() => {
                context.warn(format!("the page of --view ended ({status})"));
            }
            Ok(Some(_)) => {}
            _ => tracing::info!("the page stays until you end it there"),
        }
    }
}

/// Reads to the end, so that the page never waits for a full pipe.
fn for_each_line(pipe: Option<impl Read + Send + 'static>, hear: impl Fn(&str) + Send + 'static) {
    let Some(pipe) = pipe else { return };
    let lines = BufReader::new(pipe).lines();
    std::thread::spawn(move || lines.map_while(Result::ok).for_each(|line| hear(&line)));
}

impl Drop for Page {
    fn drop(&mut self) {
        if let Some(child) = &mut self.child {
            // It may have ended by itself.
            let _ = child.kill();
            let _ = child.wait();
        }
    }
}
