//! Pseudo-views: what a learned model makes of the splat's pictures between photos, as further views of the fit.

use std::path::{Path, PathBuf};

use clap::Args;
use glam::DVec3;
use motes_formats::atomic::ScratchFolder;
use motes_formats::exr_aov::open_exr;
use motes_formats::images::{read_image, write_png};
use motes_formats::provider::{
    NovelViewResult, NovelViewTask, PosedPicture, ProviderKind, ProviderRequest, Task, TaskResult,
    ViewCamera,
};
use motes_protocol::{Provider, ProviderCommand, ProviderFlags, ProviderUse};
use motes_raster::{RenderOptions, render};
use motes_scene::{Gaussians, ImageU8, Pinhole, Pose};
use motes_stage::{Context, StageError};
use serde::Serialize;

use super::Start;
use crate::TrainingImage;
use crate::gaps::{Between, between_photos};

/// Confidence below which a pixel does not count.
const LEAST_CONFIDENCE: f32 = 0.5;
/// Photos that go with a view.
const REFERENCES: usize = 4;

/// Who makes pseudo-views, and how many.
#[derive(Args, Clone, Debug, Serialize)]
#[command(next_help_heading = "Provider (expert)")]
pub struct PseudoOptions {
    /// Which one.
    #[command(flatten)]
    #[serde(flatten)]
    pub flags: ProviderFlags,

    /// Views in the widest gaps between the photos that --provider makes of what --init-ply shows there; they count with the
    /// weight of their confidence
    #[arg(long, value_name = "COUNT", default_value_t = 0)]
    pub pseudo_views: u32,

    /// Folder for the pictures that the provider made
    #[arg(long, value_name = "DIR", requires = "provider")]
    pub pseudo_pictures: Option<PathBuf>,
}

/// What became of pseudo-views, for the report.
#[derive(Clone, Debug, Serialize)]
pub struct PseudoReport {
    /// Views that the provider made.
    pub made: usize,
    /// Those of them that are in the fit.
    pub used: usize,
    /// Weights of those.
    pub weights: Vec<f32>,
    /// Who made them.
    pub provider: ProviderUse,
}

/// Views of the fit that are no photos.
#[derive(Default)]
pub struct PseudoViews {
    /// Pictures with their poses, in the unit world.
    pub images: Vec<TrainingImage>,
    /// The weight of each, 0 to 1.
    pub weights: Vec<f32>,
}

impl PseudoOptions {
    /// The provider to ask; none when no pseudo-views are wanted.
    ///
    /// # Errors
    /// Flags that mean nothing without each other.
    pub fn command(
        &self,
        init_ply: bool,
        context: &Context,
    ) -> Result<Option<ProviderCommand>, StageError> {
        let command = self.flags.command(context)?;
        match (command, self.pseudo_views) {
            (None, 0) => Ok(None),
            (Some(_), 0) => {
                Err(StageError::usage("--provider makes nothing without --pseudo-views")
                    .help("say how many views it makes: --pseudo-views 8"))
            }
            (None, _) => Err(StageError::usage("--pseudo-views needs a program that makes them")
                .help("name one: --provider COMMAND")),
            (Some(_), _) if !init_ply => {
                Err(StageError::usage("--pseudo-views are made of what a splat shows")
                    .help("fit one without them, and give it as --init-ply"))
            }
            (command, _) => Ok(command),
        }
    }
}

/// Has the pseudo-views made, and puts them beside the photos.
///
/// # Errors
/// The provider fails or answers what nobody asked for, a picture cannot be written, or the user asked to stop.
pub(super) fn add_pseudo_views(
    start: &mut Start,
    command: ProviderCommand,
    options: &PseudoOptions,
    context: &Context,
) -> anyhow::Result<PseudoReport> {
    let folder = match &options.pseudo_pictures {
        Some(folder) => Some(context.output(folder)?),
        None => None,
    };
    let mut provider = options.flags.open(command, ProviderKind::NovelView, context)?;
    let poses = &start.world_poses[0];
    let centers: Vec<DVec3> = poses.iter().map(Pose::center_in_world).collect();
    let places = between_photos(&centers, options.pseudo_views as usize);
    let progress = context.progress("making pseudo-views", places.len() as u64);
    let mut views = PseudoViews::default();
    for (k, place) in places.iter().enumerate() {
        context.check_interrupted()?;
        let asked = Asked { start, centers: &centers, place, name: format!("pseudo-{k:03}") };
        let (image, weight) = asked.made(&mut provider, folder.as_deref(), context)?;
        if weight > 0.0 {
            views.images.push(image);
            views.weights.push(weight);
        }
        progress.set(k as u64 + 1);
    }
    let (made, used) = (places.len(), views.images.len());
    if used < made {
        context.warn(format!(
            "{} of {made} pseudo-views are left out: the provider is not sure of them",
            made - used
        ));
    }
    let report = PseudoReport {
        made,
        used,
        weights: views.weights.clone(),
        provider: provider.used().clone(),
    };
    start.pseudo = views;
    Ok(report)
}

/// What goes to the provider for one view.
struct Asked<'a> {
    start: &'a Start,
    centers: &'a [DVec3],
    place: &'a Between,
    name: String,
}

impl Asked<'_> {
    /// The view as the fit takes it, and its weight: the mean confidence of the pixels that count; 0 when none does.
    fn made(
        &self,
        provider: &mut Provider,
        kept: Option<&Path>,
        context: &Context,
    ) -> anyhow::Result<(TrainingImage, f32)> {
        let start = self.start;
        let [a, b] = self.place.photos;
        let pose =
            Pose::between(&start.world_poses[0][a], &start.world_poses[0][b], self.place.share);
        let in_unit = start.world.pose(&pose);
        let camera = start.train[a].camera;
        let nothing = Gaussians::default();
        let shown = start.model.as_ref().unwrap_or(&nothing);
        let drawn = render(shown, &camera, &in_unit, &RenderOptions::default());
        let scratch = ScratchFolder::new()?;
        let folder = scratch.path();
        write_png(&folder.join("rendering.png"), &drawn.color.to_u8())?;
        let task = NovelViewTask {
            rendering: "rendering.png".into(),
            camera: view_camera(&camera, &pose),
            references: self.references(&pose, folder)?,
        };
        let request = ProviderRequest::new(Task::NovelView(task), start.seed);
        let reply = provider.ask(folder, &request, &|| context.interrupted())?;
        reply.warnings.iter().for_each(|warning| context.warn(warning.clone()));
        let TaskResult::NovelView(NovelViewResult { picture, confidence }) = reply.result else {
            anyhow::bail!("the provider answered another kind");
        };
        let image = rgb(&read_image(&folder.join(picture))?);
        if let Some(kept) = kept {
            std::fs::create_dir_all(kept)?;
            write_png(&kept.join(format!("{}.png", self.name)), &image)?;
        }
        let sure = match confidence {
            Some(name) => {
                open_exr(&folder.join(name))?.channel("Y").map(|channel| channel.to_f32())
            }
            None => None,
        };
        let (mask, weight) = sure.map_or((None, 1.0), |sure| counted(&sure, &camera));
        let view = TrainingImage {
            name: self.name.clone(),
            camera,
            camera_from_world: in_unit,
            image: image.into(),
            mask,
            exposure_gain: 1.0,
        };
        Ok((view, weight))
    }

    /// The nearest photos, written into `folder`.
    fn references(&self, pose: &Pose, folder: &Path) -> anyhow::Result<Vec<PosedPicture>> {
        let here = pose.center_in_world();
        let mut near: Vec<usize> = (0..self.centers.len()).collect();
        near.sort_by(|&a, &b| {
            let distance = |i: usize| self.centers[i].distance_squared(here);
            distance(a).total_cmp(&distance(b)).then(a.cmp(&b))
        });
        let mut references = Vec::new();
        for &photo in near.iter().take(REFERENCES) {
            let picture = format!("reference-{photo}.png");
            let image = &self.start.train[photo];
            write_png(&folder.join(&picture), &rgb(&image.image))?;
            let camera = view_camera(&image.camera, &self.start.world_poses[0][photo]);
            references.push(PosedPicture { picture, camera });
        }
        Ok(references)
    }
}

/// Which pixels count, and the mean confidence of those.
fn counted(sure: &[f32], camera: &Pinhole) -> (Option<ImageU8>, f32) {
    let counts = |c: &f32| *c >= LEAST_CONFIDENCE;
    let mask = sure.iter().map(|c| if counts(c) { 255 } else { 0 }).collect();
    let kept = sure.iter().copied().filter(counts);
    let (sum, count) = kept.fold((0.0, 0u32), |(sum, n), c| (sum + f64::from(c), n + 1));
    let mask = ImageU8::from_data(camera.width, camera.height, 1, mask);
    (Some(mask), (sum / f64::from(count.max(1))) as f32)
}

fn view_camera(camera: &Pinhole, pose: &Pose) -> ViewCamera {
    let q = pose.rotation;
    ViewCamera {
        focal_px: [camera.fx, camera.fy],
        center_px: [camera.cx, camera.cy],
        rotation_wxyz: [q.w, q.x, q.y, q.z],
        translation: pose.translation.to_array(),
    }
}

/// Colors without alpha; gray becomes color.
fn rgb(image: &ImageU8) -> ImageU8 {
    let pixels = image.data.chunks_exact(image.channels);
    let data = match image.channels {
        1 | 2 => pixels.flat_map(|p| [p[0]; 3]).collect(),
        _ => pixels.flat_map(|p| [p[0], p[1], p[2]]).collect(),
    };
    ImageU8::from_data(image.width, image.height, 3, data)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pixels_count_from_half_confidence_and_weigh_their_mean() {
        let camera = Pinhole { fx: 2.0, fy: 2.0, cx: 1.0, cy: 1.0, width: 2, height: 2 };
        let (mask, weight) = counted(&[0.2, 0.5, 1.0, 0.9], &camera);
        assert_eq!(mask.unwrap().data, [0, 255, 255, 255]);
        assert!((weight - 0.8).abs() < 1e-6);
        assert_eq!(counted(&[0.1; 4], &camera).1, 0.0);
    }
}
