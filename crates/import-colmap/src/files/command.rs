//! Arguments of `import-colmap` and what happens to them.

use std::convert::Infallible;
use std::io::ErrorKind::NotFound;
use std::path::PathBuf;
use std::sync::Mutex;

use crate::files::sfm::failure;
use crate::{
    ImportInput, ImportOptions, ImportReport, IngestError, SfmOptions, Source, VideoOptions,
    import, import_photos, import_video,
};
use motes_formats::FormatError;
use motes_stage::{CommonArgs, Context, HasCommon, StageError};
use serde::Serialize;

const EXAMPLES: &str = include_str!("examples.txt");

/// Import photos, a video, a COLMAP model or a transforms.json as an undistorted capture
#[derive(clap::Parser, Serialize)]
#[command(name = "import-colmap", after_help = EXAMPLES)]
pub struct Args {
    /// COLMAP project, folder with transforms*.json, such a file, or (with --photos) a folder of
    /// photos
    #[arg(required_unless_present_any = ["photos", "model", "video"])]
    input: Option<PathBuf>,

    /// Photos without poses; COLMAP estimates them (without DIR: the photos in INPUT)
    #[arg(long, value_name = "DIR", num_args = 0..=1, default_missing_value = "",
          value_parser = |text: &str| Ok::<PathBuf, Infallible>(text.into()), conflicts_with_all = ["model", "images"])]
    photos: Option<PathBuf>,

    /// Folder of a COLMAP model
    #[arg(long, value_name = "DIR", conflicts_with = "input")]
    model: Option<PathBuf>,

    /// Folder that the model's image names refer to
    #[arg(long, value_name = "DIR")]
    images: Option<PathBuf>,

    /// Folder to write, with capture.json in it
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,

    #[command(flatten)]
    #[serde(flatten)]
    options: ImportOptions,

    #[command(flatten)]
    #[serde(flatten)]
    video: VideoOptions,

    #[command(flatten)]
    #[serde(flatten)]
    sfm: SfmOptions,

    #[command(flatten)]
    #[serde(flatten)]
    common: CommonArgs,
}

impl HasCommon for Args {
    const BASIC: &'static [&'static str] = &[
        "photos",
        "video",
        "model",
        "images",
        "output",
        "max-resolution",
        "test-every",
        "masks",
        "sfm",
        "seed",
    ];

    fn common(&self) -> &CommonArgs {
        &self.common
    }
}

/// Shows the phases of an import as progress of the stage.
struct Shown<'a> {
    context: &'a Context,
    current: Mutex<Option<motes_stage::Progress>>,
}

impl crate::Progress for Shown<'_> {
    fn begin(&self, phase: &str, total: usize) {
        if let Ok(mut current) = self.current.lock() {
            *current = None;
            *current = Some(self.context.progress(phase, total as u64));
        }
    }

    fn advance_to(&self, done: usize) {
        if let Ok(current) = self.current.lock()
            && let Some(progress) = current.as_ref()
        {
            progress.set(done as u64);
        }
    }

    fn interrupted(&self) -> bool {
        self.context.interrupted()
    }
}

/// Runs the stage.
///
/// # Errors
/// Whatever ends it: bad input, a gate that is not met, a product that cannot be written.
pub fn run(args: &Args, context: &Context) -> anyhow::Result<ImportReport> {
    let shown = Shown { context, current: Mutex::new(None) };
    let photos = photos_of(args)?;
    context.output(args.output.join("capture.json"))?;
    let report = if let Some(video) = &args.video.video {
        context.input("video", video)?;
        context.stop_if_dry_run()?;
        import_video(&args.video, &args.output, &args.options, &args.sfm, &shown)
    } else if let Some(photos) = photos {
        context.input("photos", photos)?;
        context.stop_if_dry_run()?;
        import_photos(photos, &args.output, &args.options, &args.sfm, &shown)
    } else {
        let (input, model, images) = (args.input.clone(), args.model.clone(), args.images.clone());
        for (role, path) in [("input", &input), ("model", &model), ("images", &images)] {
            path.as_ref().map_or(Ok(()), |path| context.input(role, path))?;
        }
        let source = Source::recognize(&ImportInput { input, model, images }).map_err(to_stage)?;
        context.stop_if_dry_run()?;
        import(&source, &args.output, &args.options, &args.sfm, &shown)
    };
    let report = report.map_err(to_stage)?;
    report.warnings.iter().for_each(|warning| context.warn(warning.clone()));
    // Poses that others found are theirs to judge.
    if report.sfm.is_some()
        && let Some(text) = failure(report.registered, report.photos)
    {
        context.gate_not_met(text);
    }
    Ok(report)
}

/// The folder of photos to solve for; an empty path stands for `--photos` without one.
fn photos_of(args: &Args) -> Result<Option<&PathBuf>, StageError> {
    let named = args.photos.as_ref().filter(|photos| !photos.as_os_str().is_empty());
    match (&args.photos, named, &args.input) {
        (None, ..) => Ok(None),
        (_, Some(photos), None) | (_, None, Some(photos)) => Ok(Some(photos)),
        (_, Some(_), Some(_)) => Err(StageError::usage("photos are given twice")
            .help("give the folder once, as INPUT or after --photos")),
        (_, None, None) => Err(StageError::usage("--photos has no folder")
            .help("give --photos DIR, or INPUT --photos")),
    }
}

/// The exit code that each kind of error stands for.
fn to_stage(error: IngestError) -> anyhow::Error {
    let text = error.to_string();
    match error {
        IngestError::BadInput { remedy, .. } => StageError::bad_input(text).help(remedy).into(),
        IngestError::Usage { remedy, .. } => StageError::usage(text).help(remedy).into(),
        IngestError::Failed { remedy, .. } => anyhow::anyhow!("{text}\nhelp: {remedy}"),
        IngestError::Interrupted => {
            StageError::interrupted("interrupted; there is no capture").into()
        }
        IngestError::Format(FormatError::Io { ref source, .. }) if source.kind() != NotFound => {
            error.into()
        }
        IngestError::Format(_) => StageError::bad_input(text).into(),
    }
}
