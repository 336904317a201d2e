//! Runs of a solver, until one has a pose for every photo or there is nothing left to try.

use std::path::{Path, PathBuf};

use super::choose::Tool;
use super::judge;
use super::options::Keypoints;
use super::pycolmap::cannot_write;
use super::{FocalPrior, Request, Solution};
use crate::error::{IngestError, Result};
use crate::progress::Progress;

/// Files and folders of a run that a user may look at.
const KEPT_FILES: [&str; 2] = ["database.db", "sparse"];

/// What was run, and the best of it.
pub(super) struct Runs<'a> {
    tool: &'a Tool,
    request: Request<'a>,
    progress: &'a dyn Progress,
    /// The best solution, its focal prior and the number of its run, from 1.
    kept: Option<(Solution, FocalPrior, usize)>,
    /// Why the first run came to nothing.
    failure: Option<IngestError>,
    told: Vec<String>,
    seconds: f64,
}

impl<'a> Runs<'a> {
    pub(super) fn new(tool: &'a Tool, request: Request<'a>, progress: &'a dyn Progress) -> Self {
        let (kept, failure, told) = (None, None, Vec::new());
        Self { tool, request, progress, kept, failure, told, seconds: 0.0 }
    }

    /// Runs with clear keypoints, once more with a focal length prior where the first is doubtful, and once more with faint
    /// keypoints where photos have no pose; as far as the options allow. The best solution: the one with most photos, then the smallest
    /// error. All runs are told.
    ///
    /// # Errors
    /// That of the first run when none has a solution; when the user interrupts.
    pub(super) fn best(mut self) -> Result<Solution> {
        let (prior, keypoints) = (self.request.focal_prior, self.request.options.keypoints);
        let faint = keypoints == Keypoints::Faint;
        self.run(prior, faint)?;
        let options = self.request.options;
        let second = self.kept.as_ref().and_then(|(first, ..)| judge::second_prior(first, options));
        if let Some(prior) = second {
            self.run(prior, faint)?;
        }
        let has_gaps = self.kept.as_ref().is_none_or(|(kept, ..)| judge::may_gain_photos(kept));
        if keypoints == Keypoints::Auto && has_gaps && self.tool.checks_matches() {
            let prior = self.kept.as_ref().map_or(prior, |kept| kept.1);
            self.run(prior, true)?;
        }
        self.finish()
    }

    fn run(&mut self, prior: FocalPrior, faint: bool) -> Result<()> {
        let number = self.told.len() + 1;
        let workspace = folder_of(self.request.workspace, number);
        let request = Request { workspace: &workspace, focal_prior: prior, faint, ..self.request };
        let solved = self.tool.solve(&request, self.progress);
        match solved {
            Err(IngestError::Interrupted) => return Err(IngestError::Interrupted),
            // Something is wrong with the program, not with the photos.
            Err(error @ IngestError::Failed { .. }) if number == 1 => return Err(error),
            Err(error) => {
                self.told.push(format!("{} failed: {error}", judge::name(prior.pixels(), faint)));
                self.failure.get_or_insert(error);
            }
            Ok(mut solution) => {
                if matches!(prior, FocalPrior::Guess(_)) {
                    solution.report.focal_prior_source = judge::GUESSED.into();
                }
                self.seconds += solution.report.seconds;
                solution.faint = faint;
                self.told.push(judge::describe(&solution));
                if self.kept.as_ref().is_none_or(|(kept, ..)| judge::is_better(&solution, kept)) {
                    self.kept = Some((solution, prior, number));
                }
            }
        }
        Ok(())
    }

    fn finish(mut self) -> Result<Solution> {
        let Some((mut solution, _, number)) = self.kept else {
            let nothing = || IngestError::bad_input("no run has a solution", "take more photos");
            return Err(self.failure.unwrap_or_else(nothing));
        };
        if self.told.len() > 1 {
            let names = ["first", "second", "third"];
            self.told.push(format!("the {} was kept", names[number - 1]));
            solution.report.attempts = self.told;
        }
        solution.report.seconds = self.seconds;
        if number > 1 {
            put_first(self.request.workspace, number, &mut solution.models)?;
        }
        Ok(solution)
    }
}

fn folder_of(workspace: &Path, number: usize) -> PathBuf {
    if number == 1 { workspace.to_path_buf() } else { workspace.join(format!("run-{number}")) }
}

/// Exchanges the files of the kept run with those of the first, so that the kept model lies where users look for it.
fn put_first(workspace: &Path, number: usize, models: &mut [PathBuf]) -> Result<()> {
    let (first, kept) = (folder_of(workspace, 1), folder_of(workspace, number));
    let aside = |name: &str| workspace.join(format!("{name}.aside"));
    let rename = |from: &Path, to: &Path| match std::fs::rename(from, to) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => Err(cannot_write(to, &error)),
        _ => Ok(()),
    };
    for name in KEPT_FILES {
        rename(&first.join(name), &aside(name))?;
        rename(&kept.join(name), &first.join(name))?;
        rename(&aside(name), &kept.join(name))?;
    }
    // Tools may answer with absolute paths.
    let absolute = |path: &Path| std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
    let kept = absolute(&kept);
    for model in models {
        if let Ok(below) = absolute(model).strip_prefix(&kept) {
            *model = first.join(below);
        }
    }
    Ok(())
}
