//! From files to a scene folder.

use std::path::{Path, PathBuf};

use crate::photometry::{Photometry, calibrate};
use crate::pipeline::STEPS;
use crate::{
    DecomposeError, DecomposeOptions, Inputs, Known, Photo, Pipeline, Progress, RenderedView,
};
use motes_codecs::open_gaussians;
use motes_formats::decomposition::{SCENE_FILES, StepTimeDocument};
use motes_formats::ply::{GaussianFile, PlyWriteOptions, RenderMode};
use motes_formats::selection::BoundGaussians;
use motes_protocol::ProviderUse;
use motes_raster::{Antialias, RenderOptions};
use motes_scene::Split;
use motes_stage::Context;

use super::errors::explained;
use super::known::{KnownArgs, load_known};
use super::photos::{held_out_views, load_capture, load_photos, training_views};
use super::report::{DecomposeReport, SceneReport, StepsReport};
use super::scene_folder::{SceneFolder, write_scene};
use super::verdict;
use super::work::{StepArgs, WorkFolder};

/// What a run of `decompose` was asked for.
#[derive(Debug)]
pub struct Request<'a> {
    /// Captures of one world.
    pub captures: &'a [PathBuf],
    /// The model.
    pub gaussians: &'a Path,
    /// A surface that was given.
    pub surface: Option<&'a Path>,
    /// What is known.
    pub known: &'a KnownArgs,
    /// Options of the steps.
    pub options: &'a DecomposeOptions,
    /// Which steps are run, and where they are kept.
    pub steps: &'a StepArgs,
    /// Key of all random numbers.
    pub seed: u64,
    /// Views with previews.
    pub previews: usize,
    /// The scene folder; none when the run ends before the last step.
    pub output: Option<&'a Path>,
}

const MADE_BY: &str = concat!("motes decompose ", env!("CARGO_PKG_VERSION"));
/// Steps of the line of progress.
const PERCENT: f32 = 100.0;

/// What was read.
struct Loaded {
    photos: Vec<Photo>,
    held_out: Vec<Photo>,
    known: Known,
    /// Who predicted what is known.
    provider: Option<ProviderUse>,
    file: GaussianFile,
    photometry: Photometry,
}

impl Request<'_> {
    /// Runs it.
    ///
    /// # Errors
    /// What reading, inverse rendering or writing say.
    pub fn run(&self, context: &Context) -> anyhow::Result<DecomposeReport> {
        let cpu_before = context.cpu_seconds();
        let work = self.steps.work.as_deref().map(|path| WorkFolder {
            path,
            steps: self.steps.range(),
            captures: self.captures,
            gaussians: self.gaussians,
            made_by: MADE_BY,
            hashes: Default::default(),
        });
        let output = self.output.map(|path| context.output(path)).transpose()?;
        if let Some(folder) = &output {
            context.output_files(folder, &SCENE_FILES)?;
        }
        if let Some(work) = &work {
            work.claim(context)?;
        }
        let loaded = self.load(context)?;
        let inputs = Inputs {
            gaussians: &loaded.file.gaussians,
            photos: &loaded.photos,
            held_out: &loaded.held_out,
            known: &loaded.known,
            render: render_options(&loaded.file),
            model: &self.options.model,
            seed: self.seed,
        };
        let mut pipeline = match &work {
            Some(work) => work.restore(&inputs)?,
            None => Pipeline::new(&inputs).map_err(|e| explained(&e))?,
        };
        pipeline.report.photometry.clone_from(&loaded.photometry.terms);
        self.run_steps(&mut pipeline, work.as_ref(), context)?;
        let Some(output) = output else {
            return Ok(DecomposeReport::Steps(self.steps_report(&pipeline)));
        };
        let folder = SceneFolder {
            path: &output,
            ply: PlyWriteOptions {
                render_mode: loaded.file.render_mode,
                exposure_response: loaded.file.exposure_response,
                ..PlyWriteOptions::default()
            },
            previews: self.previews,
            tone_curve: loaded.photometry.tone_curve,
            source: BoundGaussians::of_file(self.gaussians, inputs.gaussians.len())?,
            seconds: (!context.skips_provenance()).then(|| context.elapsed_seconds()),
            made_by: MADE_BY,
        };
        let decomposition = write_scene(&folder, &pipeline)?;
        let Pipeline { state, report } = pipeline;
        let (train, test) = state.views.split_at(inputs.photos.len());
        let scene = SceneReport {
            output,
            geometry: report.geometry,
            samples: state.observed.samples.len(),
            light_cells: state.light_cells,
            cpu_seconds: context.cpu_seconds().zip(cpu_before).map(|(a, b)| a - b),
            train_psnr_db: mean_psnr_db(train),
            test_psnr_db: mean_psnr_db(test),
            test_views: test.len(),
            decomposition,
            provider: loaded.provider.clone(),
        };
        warn_of_unobserved(&scene, context);
        // A surface that was given may be larger than what the photos show.
        let failure = verdict::failure(&scene.decomposition.terms, inputs.photos.len())
            .filter(|_| self.surface.is_none());
        match failure {
            Some(failure) => context.gate_not_met(failure),
            None => warn_of_low_confidence(&scene, context),
        }
        Ok(DecomposeReport::Scene(Box::new(scene)))
    }

    fn load(&self, context: &Context) -> anyhow::Result<Loaded> {
        let (mut photos, mut held_out): (Vec<Photo>, Vec<Photo>) = (Vec::new(), Vec::new());
        let (mut origin, mut captures) = (None, Vec::new());
        for path in self.captures {
            context.input("capture", path)?;
            let capture = load_capture(path, origin)?;
            origin = Some(capture.world_origin);
            captures.push((path, capture));
        }
        context.input("gaussians", self.gaussians)?;
        let mut file = open_gaussians(self.gaussians)?;
        let most = self.options.samples.most_photos;
        for (light, (path, capture)) in captures.iter().enumerate() {
            let named = self.known.anchored_views();
            let views = training_views(path, capture, &file.gaussians, most, &named)?;
            let all = capture.views_of(Split::Train).len();
            if views.len() < all {
                context.warn(format!(
                    "{}: of {all} photos the {} that show most of the scene are looked at (--most-photos 0 takes all)",
                    path.display(),
                    views.len()
                ));
            }
            photos.extend(load_photos(path, capture, &views, light)?);
            if light == 0 {
                let views = held_out_views(capture, self.options.samples.most_held_out);
                held_out = load_photos(path, capture, &views, light)?;
            }
        }
        let (known, provider) =
            load_known(self.known, self.surface, self.captures.len(), &photos, context)?;
        context.stop_if_dry_run()?;
        let render = render_options(&file);
        let photometry = calibrate(&photos, &file.gaussians, &render, &self.options.photometry);
        photometry.develop(&mut photos);
        photometry.develop_held_out(&mut held_out);
        photometry.develop_gaussians(&mut file.gaussians);
        Ok(Loaded { photos, held_out, known, provider, file, photometry })
    }

    /// Runs the steps that were asked for, and keeps each in the work folder as soon as it is done.
    fn run_steps(
        &self,
        pipeline: &mut Pipeline<'_>,
        work: Option<&WorkFolder<'_>>,
        context: &Context,
    ) -> anyhow::Result<()> {
        let line = context.progress("decomposing", PERCENT as u64);
        let mut shown = |progress: Progress| {
            let Progress { doing, step, of, done } = progress;
            line.message(format!("{doing}, {step} of {of}"));
            line.set((PERCENT * done).round() as u64);
            if context.interrupted() { Err(DecomposeError::Canceled) } else { Ok(()) }
        };
        for step in self.steps.range() {
            pipeline.run(step, self.options, &mut shown).map_err(|e| explained(&e))?;
            if let Some(work) = work {
                work.save(step, pipeline)?;
            }
            motes_stage::give_back_freed_memory();
        }
        if self.steps.range().end() + 1 == STEPS.len() {
            line.set(PERCENT as u64);
        }
        Ok(())
    }

    fn steps_report(&self, pipeline: &Pipeline<'_>) -> StepsReport {
        let range = self.steps.range();
        let ran = pipeline.report.steps.iter().skip(*range.start());
        StepsReport {
            work: self.steps.work.clone().unwrap_or_default(),
            step_times: ran
                .map(|step| StepTimeDocument { step: step.name.clone(), seconds: step.seconds })
                .collect(),
            next: STEPS.get(range.end() + 1).map(|step| step.name.into()),
        }
    }
}

fn render_options(file: &GaussianFile) -> RenderOptions {
    let is_mip = file.render_mode == Some(RenderMode::Mip);
    let antialias = if is_mip { Antialias::Mip } else { Antialias::Classic };
    RenderOptions { antialias, ..RenderOptions::default() }
}

fn mean_psnr_db(views: &[RenderedView]) -> Option<f64> {
    let finite: Vec<f64> = views.iter().map(|v| v.psnr_db).filter(|v| v.is_finite()).collect();
    (!finite.is_empty()).then(|| finite.iter().sum::<f64>() / finite.len() as f64)
}

/// A result that is mostly a guess is not a quiet success.
fn warn_of_low_confidence(scene: &SceneReport, context: &Context) {
    let mean = verdict::number(&scene.decomposition.terms, "mean");
    if let Some(mean) = mean.filter(|mean| *mean < LOW_CONFIDENCE) {
        context.warn(format!(
            "surface, Gaussians and photos agree badly (mean confidence {mean:.2}): relight will show mostly the captured colors \
             times a smooth ratio of light; more photos from more sides, sharp and of one exposure, help"
        ));
    }
}

/// Mean confidence below which less than half of what is shown under another light is the model.
const LOW_CONFIDENCE: f64 = 0.5;

fn warn_of_unobserved(scene: &SceneReport, context: &Context) {
    let counts = &scene.decomposition.counts;
    let unobserved = counts.unobserved_gaussians;
    if unobserved > 0 {
        context.warn(format!(
            "{unobserved} of {} Gaussians are seen by no photo: their material is a guess (column observations is 0)",
            counts.gaussians
        ));
    }
}
