//! Pictures of a scene edited by a program, and the scene fitted to them: the loop of Instruct-NeRF2NeRF (Haque et al. 2023).
//!
//! The editor sees one picture at a time and does not know what it did to the others, so its pictures disagree. Two
//! remedies, both without knowing the editor:
//!
//! - Key views are edited first. They are brought to agree on the brightness of each channel, and warped into the other
//!   views by depth; where a point is seen by a key view, the other views take its color from there (after DGE, Chen et al. 2024,
//!   and GaussCtrl, Wu et al. 2024, which do so inside a diffusion model).
//! - Views are weighed by how far they agree: a picture that disagrees twice as much as usual counts a fifth.
//!
//! The disagreement of a view is the root mean square difference, sRGB-encoded, between its picture and what the other pictures
//! show at the same points of the surface.

mod consensus;
mod editor;
mod refit;
mod warp;

use glam::Vec3;
use motes_raster::{Antialias, RenderOptions, render};
use motes_scene::{Gaussians, ImageF32, Pinhole, Pose};
use thiserror::Error;

use consensus::{disagreements, harmonized, is_key, targets};
pub use editor::{EditorError, Picture, PictureEditor, Round};
use refit::refit;
use warp::Sight;

/// Share of noise in the first and the last round (Instruct-NeRF2NeRF draws from this range).
const NOISE: [f64; 2] = [0.98, 0.02];

/// A view to be edited.
#[derive(Clone, Debug)]
pub struct StyleView {
    /// Name, for reports.
    pub name: String,
    /// Intrinsics.
    pub camera: Pinhole,
    /// Pose.
    pub camera_from_world: Pose,
}

/// Parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StyleOptions {
    /// Views that are edited first and warped to the others; 0: each on its own.
    pub key_views: usize,
    /// How often all views are edited.
    pub rounds: u32,
    /// Steps of the fit in each round.
    pub steps: u32,
    /// Whether views count by how far they agree.
    pub weigh: bool,
    /// Of the fit.
    pub seed: u64,
}

/// What came of it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct StyleReport {
    /// Per view: disagreement of the editor's own pictures; NaN where no other view sees the same.
    pub edited: Vec<f64>,
    /// Per view: disagreement of the pictures that were fitted to.
    pub fitted_to: Vec<f64>,
    /// Per view: root mean square difference between the picture fitted to and the result.
    pub residual: Vec<f64>,
}

/// Why it failed.
#[derive(Debug, Error)]
pub enum StyleError {
    /// The editor did.
    #[error(transparent)]
    Editor(#[from] EditorError),
    /// The fit did.
    #[error(transparent)]
    Fit(#[from] train_splat::FitError),
    /// The user asked to stop.
    #[error("interrupted")]
    Stopped,
}

/// Edits the colors of the Gaussians that `chosen` says, through pictures of `views`.
///
/// # Errors
/// The editor fails or returns something that is not a picture of the same size; the fit refuses its input; the user asked to stop.
pub fn stylize(
    gaussians: &mut Gaussians,
    chosen: &[bool],
    antialias: Antialias,
    views: &[StyleView],
    editor: &dyn PictureEditor,
    prompt: &str,
    options: &StyleOptions,
    stopped: &dyn Fn() -> bool,
) -> Result<StyleReport, StyleError> {
    let mut report = StyleReport::default();
    let sights: Vec<Sight> =
        views.iter().map(|view| Sight::new(gaussians, chosen, antialias, view)).collect();
    let originals: Vec<ImageF32> = sights.iter().map(|s| s.color.clone()).collect();
    for round in 0..options.rounds {
        if stopped() {
            return Err(StyleError::Stopped);
        }
        let current: Vec<ImageF32> = match round {
            0 => originals.clone(),
            _ => views.iter().map(|view| picture(gaussians, antialias, view)).collect(),
        };
        let asked: Vec<Picture<'_>> = (0..views.len())
            .map(|i| Picture {
                view: &views[i].name,
                original: &originals[i],
                current: &current[i],
            })
            .collect();
        let how = Round { noise: noise_of(round, options.rounds), seed: options.seed };
        let mut edited = match edit_all(editor, prompt, &asked, options.key_views, how, stopped) {
            Err(EditorError::Stopped) => return Err(StyleError::Stopped),
            edited => edited?,
        };
        for (i, picture) in edited.iter_mut().enumerate() {
            *picture = limited(&originals[i], picture, &sights[i].share);
        }
        report.edited = disagreements(&sights, &edited);
        let targets = if options.key_views > 0 || options.weigh {
            let even = harmonized(&sights, edited);
            targets(&sights, even, options.key_views, options.weigh)
        } else {
            edited
        };
        report.fitted_to = disagreements(&sights, &targets);
        refit(gaussians, chosen, views, &targets, options, round)?;
        report.residual = views
            .iter()
            .zip(&targets)
            .map(|(view, target)| rms(&picture(gaussians, antialias, view), target))
            .collect();
    }
    Ok(report)
}

/// Key views together, then each of the others.
fn edit_all(
    editor: &dyn PictureEditor,
    prompt: &str,
    asked: &[Picture<'_>],
    key_views: usize,
    round: Round,
    stopped: &dyn Fn() -> bool,
) -> Result<Vec<ImageF32>, EditorError> {
    let is_key = is_key(asked.len(), key_views);
    let together: Vec<usize> = (0..asked.len()).filter(|&i| key_views > 0 && is_key[i]).collect();
    let mut edited: Vec<Option<ImageF32>> = vec![None; asked.len()];
    if !together.is_empty() {
        let keys: Vec<Picture<'_>> = together.iter().map(|&i| asked[i]).collect();
        let pictures = editor.edit(prompt, &keys, round, stopped)?;
        together.iter().zip(pictures).for_each(|(&i, picture)| edited[i] = Some(picture));
    }
    let one = |(i, done): (usize, Option<ImageF32>)| match done {
        Some(picture) => Ok(picture),
        None => {
            let mut pictures = editor.edit(prompt, &asked[i..=i], round, stopped)?;
            pictures.pop().ok_or_else(|| EditorError::NoPicture { view: asked[i].view.to_owned() })
        }
    };
    edited.into_iter().enumerate().map(one).collect()
}

/// Noise of a round: from nearly all of it, which lets the first one repaint, to nearly none.
fn noise_of(round: u32, rounds: u32) -> f64 {
    let [first, last] = NOISE;
    first + (last - first) * f64::from(round) / f64::from(rounds.saturating_sub(1).max(1))
}

fn picture(gaussians: &Gaussians, antialias: Antialias, view: &StyleView) -> ImageF32 {
    let options = RenderOptions { antialias, ..RenderOptions::default() };
    render(gaussians, &view.camera, &view.camera_from_world, &options).color
}

/// The edit where the chosen Gaussians are seen, the original elsewhere.
fn limited(original: &ImageF32, edited: &ImageF32, share: &ImageF32) -> ImageF32 {
    let mut mixed = original.clone();
    for (i, value) in mixed.data.iter_mut().enumerate() {
        *value += (edited.data[i] - *value) * share.data[i / 3];
    }
    mixed
}

fn rms(a: &ImageF32, b: &ImageF32) -> f64 {
    let squares = a.data.iter().zip(&b.data).map(|(a, b)| f64::from(a - b).powi(2));
    (squares.sum::<f64>() / a.data.len().max(1) as f64).sqrt()
}

fn pixel(image: &ImageF32, at: usize) -> Vec3 {
    Vec3::new(image.data[3 * at], image.data[3 * at + 1], image.data[3 * at + 2])
}

#[cfg(test)]
mod tests;
