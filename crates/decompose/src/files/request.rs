//! From files to a scene folder.

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use crate::geometry::{GeometryError, GeometryOptions, GeometryReport, extract};
use crate::{DecomposeError, DecomposeOptions, Known, Photo, RenderedView, decompose, up_in_world};
use motes_codecs::open_gaussians;
use motes_formats::ply::{PlyWriteOptions, RenderMode, read_surface};
use motes_formats::selection::BoundGaussians;
use motes_raster::{Antialias, RenderOptions};
use motes_scene::Split;
use motes_shading::brdf::Lobes;
use motes_shading::environment::{Convention, Orientation};
use motes_stage::{Context, StageError};

use super::inputs::{KnownArgs, load_capture, load_known, load_photos};
use super::outputs::{SceneFolder, maps_of, write_scene};
use super::report::DecomposeReport;
use super::residual::Found;

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
    /// Dials of the surface.
    pub geometry: &'a GeometryOptions,
    /// Dials of light and material.
    pub options: &'a DecomposeOptions,
    /// Key of all random numbers.
    pub seed: u64,
    /// Views with previews.
    pub previews: usize,
}

/// Steps of the progress line.
const STEPS: u64 = 100;

impl Request<'_> {
    /// Runs it.
    ///
    /// # Errors
    /// What reading, inverse rendering or writing say.
    pub fn run(&self, output: &Path, context: &Context) -> anyhow::Result<DecomposeReport> {
        let cpu_before = context.cpu_seconds();
        let (mut photos, mut score): (Vec<Photo>, Vec<Photo>) = (Vec::new(), Vec::new());
        let mut origin = None;
        for (light, path) in self.captures.iter().enumerate() {
            context.input("capture", path)?;
            let capture = load_capture(path, origin)?;
            origin = Some(capture.world_origin);
            photos.extend(load_photos(path, &capture, Split::Train, light)?);
            if light == 0 {
                score = load_photos(path, &capture, Split::Test, light)?;
            }
        }
        context.input("gaussians", self.gaussians)?;
        let file = open_gaussians(self.gaussians)?;
        let mut gaussians = file.gaussians;
        context.stop_if_dry_run()?;

        let progress = context.progress("decomposing", STEPS);
        let tick = |done: f32, reached: &mut u64| {
            let now = (done * STEPS as f32) as u64;
            progress.inc(now.saturating_sub(*reached));
            *reached = now.max(*reached);
            if context.interrupted() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        };
        let mut reached = 0;
        let (surface, geometry) = match self.surface {
            Some(path) => {
                context.input("surface", path)?;
                (read_surface(path)?, GeometryReport::default())
            }
            None => extract(&gaussians, &photos_of(&photos, 0), self.geometry, &mut |_, done| {
                tick(0.4 * done, &mut reached)
            })
            .map_err(|GeometryError::Cancelled| interrupted())?,
        };
        if surface.triangles.is_empty() {
            let text = "the Gaussians show no surface that several photos agree about";
            return Err(StageError::bad_input(text)
                .help("train with more photos, or pass --surface")
                .into());
        }
        let known: Known = load_known(self.known, self.captures.len(), &photos, &surface)?;
        for path in &self.known.environment {
            context.input("environment", path)?;
        }
        let up = up_in_world(&surface, &photos);
        let convention =
            if up.z.abs() >= up.y.abs() { Convention::Blender } else { Convention::OpenExr };
        let render = RenderOptions {
            antialias: if file.render_mode == Some(RenderMode::Mip) {
                Antialias::Mip
            } else {
                Antialias::Classic
            },
            ..RenderOptions::default()
        };
        let result = decompose(
            surface,
            &gaussians,
            &photos,
            &score,
            &known,
            &render,
            Orientation::new(convention),
            self.options,
            self.seed,
            &mut |_, done| tick(0.4 + 0.5 * done, &mut reached),
        )
        .map_err(|error| match error {
            DecomposeError::Cancelled => interrupted(),
            DecomposeError::NothingSeen(_) => StageError::bad_input(error.to_string()).help(
                "check that capture and Gaussians belong together, and that masks leave something",
            ),
            DecomposeError::Mesh(_) => StageError::bad_input(error.to_string()),
        })?;
        let maps = maps_of(known.lights.first(), convention, &result);
        if let Some(refined) = &result.refined {
            gaussians.clone_from(refined);
        }
        result.materials.attach(&mut gaussians);
        let mut residual = None;
        if let Some(light) = maps.first().filter(|_| self.options.residual_steps > 0) {
            let found = Found {
                gaussians: &gaussians,
                surface: &result.surface,
                lobes: if result.specular { self.options.lobes.into() } else { Lobes::Lambert },
                indirect: result.indirect,
                up_in_world: up,
                antialias: render.antialias,
                light: light.clone(),
                convention,
                photos: photos.iter().filter(|photo| photo.light == 0).collect(),
            };
            let options = self.options.residual(self.seed);
            let unexplained =
                found.unexplained(&options, |done| match tick(0.9 + 0.1 * done, &mut reached) {
                    ControlFlow::Continue(()) => Ok(()),
                    ControlFlow::Break(()) => Err(interrupted()),
                })?;
            unexplained.residual.attach(&mut gaussians);
            residual = Some(unexplained.term);
        }
        drop(progress);

        let trained = photos.len();
        let folder = SceneFolder {
            path: output,
            convention,
            up_in_world: up,
            lobes: self.options.lobes,
            residual,
            ply: PlyWriteOptions {
                render_mode: file.render_mode,
                exposure_response: file.exposure_response,
                ..PlyWriteOptions::default()
            },
            photos: photos.iter().chain(&score).collect(),
            trained,
            previews: self.previews,
            source: BoundGaussians::of_file(self.gaussians, gaussians.len())?,
            seconds: context.elapsed_seconds(),
            made_by: concat!("motes decompose ", env!("CARGO_PKG_VERSION")).into(),
        };
        let document = write_scene(&folder, &gaussians, &result, &maps)?;
        let unobserved = document.counts.unobserved_gaussians;
        if unobserved > 0 {
            context.warn(format!(
                "{unobserved} of {} Gaussians are seen by no photo: their material is a guess (column observations is 0)",
                document.counts.gaussians
            ));
        }
        let mean = |views: &[RenderedView]| {
            let finite: Vec<f64> =
                views.iter().map(|v| v.psnr_db).filter(|v| v.is_finite()).collect();
            (!finite.is_empty()).then(|| finite.iter().sum::<f64>() / finite.len() as f64)
        };
        Ok(DecomposeReport {
            output: output.to_owned(),
            geometry,
            samples: result.samples,
            light_cells: result.light_rounds.iter().map(|r| r.0).collect(),
            cpu_seconds: context.cpu_seconds().zip(cpu_before).map(|(a, b)| a - b),
            train_psnr_db: mean(&result.views[..trained]),
            test_psnr_db: mean(&result.views[trained..]),
            decomposition: document,
        })
    }
}

/// The photos of the first capture: the Gaussians were fitted to them.
fn photos_of(photos: &[Photo], light: usize) -> Vec<Photo> {
    photos.iter().filter(|p| p.light == light).cloned().collect()
}

fn interrupted() -> StageError {
    StageError::interrupted("interrupted: no scene was written")
}
