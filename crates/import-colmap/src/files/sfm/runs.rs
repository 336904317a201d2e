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

/// A solution, its focal prior and the number of its run, from 1.
struct Kept {
    solution: Solution,
    prior: FocalPrior,
    number: usize,
}

/// Runs with clear keypoints, once more with a focal length prior where the first is doubtful, and once more with faint keypoints where
/// photos have no pose; as far as the options allow. The best solution: the one with most photos, then the smallest error. All runs are
/// told.
///
/// # Errors
/// That of the first run when none has a solution; when the user interrupts.
pub(super) fn best(tool: &Tool, request: Request<'_>, progress: &dyn Progress) -> Result<Solution> {
    let (prior, options, workspace) = (request.focal_prior, request.options, request.workspace);
    let faint = options.keypoints == Keypoints::Faint;
    let mut runs = Runs { tool, request, progress, told: Vec::new(), seconds: 0.0 };
    let mut best = runs.run(prior, faint);
    let second = best.as_ref().ok().and_then(|b| judge::second_prior(&b.solution, options));
    if let Some(prior) = second {
        best = better(best, runs.run(prior, faint));
    }
    let has_gaps = match &best {
        Ok(best) => judge::may_gain_photos(&best.solution),
        // All else is wrong with the program or the options, not with the photos.
        Err(error) => matches!(error, IngestError::BadInput { .. }),
    };
    if options.keypoints == Keypoints::Auto && has_gaps && tool.checks_matches() {
        let prior = best.as_ref().map_or(prior, |best| best.prior);
        best = better(best, runs.run(prior, true));
    }
    let Kept { mut solution, number, .. } = best?;
    if runs.told.len() > 1 {
        runs.told.push(format!("the {} was kept", ["first", "second", "third"][number - 1]));
        solution.report.attempts = runs.told;
    }
    solution.report.seconds = runs.seconds;
    if number > 1 {
        put_first(workspace, number, &mut solution.models)?;
    }
    Ok(solution)
}

/// The better of two outcomes, the first of two failures; an interrupt ends all.
fn better(best: Result<Kept>, next: Result<Kept>) -> Result<Kept> {
    match (best, next) {
        (_, Err(IngestError::Interrupted)) => Err(IngestError::Interrupted),
        (Ok(best), Ok(next)) if !judge::is_better(&next.solution, &best.solution) => Ok(best),
        (_, Ok(next)) => Ok(next),
        (best, Err(_)) => best,
    }
}

/// What was run.
struct Runs<'a> {
    tool: &'a Tool,
    request: Request<'a>,
    progress: &'a dyn Progress,
    told: Vec<String>,
    seconds: f64,
}

impl Runs<'_> {
    fn run(&mut self, prior: FocalPrior, faint: bool) -> Result<Kept> {
        let number = self.told.len() + 1;
        let workspace = folder_of(self.request.workspace, number);
        let request = Request { workspace: &workspace, focal_prior: prior, faint, ..self.request };
        let mut solution = self.tool.solve(&request, self.progress).inspect_err(|error| {
            self.told.push(format!("{} failed: {error}", judge::name(prior.pixels(), faint)));
        })?;
        if matches!(prior, FocalPrior::Guess(_)) {
            solution.report.focal_prior_source = judge::GUESSED.into();
        }
        self.seconds += solution.report.seconds;
        solution.faint = faint;
        self.told.push(judge::describe(&solution));
        Ok(Kept { solution, prior, number })
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
