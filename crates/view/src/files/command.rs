//! Arguments of `view` and what happens to them.

use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::time::Duration;

use clap::Parser;
use edit::plan::EditPlanDocument;
use export::files::photo;
use motes_formats::documents::write_document;
use motes_stage::{CommonArgs, Context, HasCommon, StageError};
use segment_select::MaskProvider;
use segment_select::files::SegmenterFlags;
use serde::Serialize;
use serde_json::json;

use super::ViewReport;
use super::browser;
use super::inputs::{Loaded, command, reload};
use super::named::Named;
use super::snapshots::{Version, newest};
use crate::api::Api;
use crate::http::{Gate, Server, Stop, Token};
use crate::page::page;
use crate::session::Session;

const EXAMPLES: &str = "\
Examples:
  A decomposed scene with its photos; what is done on the page becomes plan.json:
    view --scene scene/ --capture capture/ -o plan.json
  Go on with it, with environment maps to choose from:
    view --scene scene/ --capture capture/ --plan plan.json --assets maps/
  A training run as it goes, with train-splat --export-every 500:
    view --gaussians model.ply --wait
  The address of the page for another program:
    view --scene scene/ --no-browser --json";

/// Longer side of photos on the page, pixels.
const PHOTO_PX: u32 = 1600;
/// Between looks at a file that may be written anew.
const WATCH_STEP: Duration = Duration::from_millis(500);

/// Look at a scene in a browser, select, light and edit it there
#[derive(Parser, Debug, Serialize)]
#[command(name = "view", after_help = EXAMPLES)]
pub struct Args {
    /// Scene folder written by decompose, relight or edit
    #[arg(
        long,
        value_name = "DIR",
        required_unless_present = "gaussians",
        conflicts_with = "gaussians"
    )]
    scene: Option<PathBuf>,

    /// Gaussians, read again when the file or a newer snapshot of its training is written
    #[arg(long, value_name = "FILE")]
    gaussians: Option<PathBuf>,

    /// Capture with cameras and photos, for clicks
    #[arg(long, value_name = "FILE")]
    capture: Option<PathBuf>,

    /// Edit plan to go on with (JSON)
    #[arg(long, value_name = "FILE")]
    plan: Option<PathBuf>,

    /// Folder whose environment maps the page offers, and that the plan may read from; repeatable
    #[arg(long, value_name = "DIR")]
    assets: Vec<PathBuf>,

    /// Edit plan to write, after every act on the page (JSON)
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,

    /// Port of the loopback address; 0 takes a free one
    #[arg(long, value_name = "PORT", default_value_t = 0, help_heading = "Server")]
    port: u16,

    /// Print the address of the page and open no browser
    #[arg(long, help_heading = "Server")]
    no_browser: bool,

    /// Do not keep prepared views for the next start
    #[arg(long)]
    no_cache: bool,

    /// Wait for Gaussians that are not there yet, such as the first snapshot of a training run
    #[arg(long, requires = "gaussians")]
    wait: bool,

    /// Seed of the plan [default: that of --plan, else 0]
    #[arg(long, value_name = "SEED")]
    seed: Option<u64>,

    #[command(flatten)]
    #[serde(flatten)]
    segmenter: SegmenterFlags,

    #[command(flatten)]
    #[serde(flatten)]
    common: CommonArgs,
}

impl HasCommon for Args {
    const BASIC: &'static [&'static str] =
        &["scene", "gaussians", "capture", "plan", "assets", "output", "port", "no-browser"];

    fn common(&self) -> &CommonArgs {
        &self.common
    }
}

/// Runs the stage: serves the page until it is ended there, or the user interrupts.
///
/// # Errors
/// Bad input, a port that is taken, an interruption.
pub fn run(args: &Args, context: &Context) -> anyhow::Result<ViewReport> {
    let output = args.output.as_ref().map(|path| context.json_output(path)).transpose()?;
    let named = Named {
        scene: args.scene.as_deref(),
        gaussians: args.gaussians.as_deref(),
        capture: args.capture.as_deref(),
        seed: args.seed,
        plan: args.plan.as_deref(),
        assets: &args.assets,
        wait: args.wait,
        cache: args.capture.is_some() && !args.no_cache,
    };
    let Loaded { scene, state, version, command, ops } = Loaded::load(&named, context)?;
    let segmenter = args.segmenter.command(context)?;
    context.stop_if_dry_run()?;
    let segmenter = args.segmenter.open(segmenter, context)?;
    let segmenter = segmenter.as_ref().map(|segmenter| segmenter as &dyn MaskProvider);
    let server = Server::bind(args.port).map_err(|error| {
        StageError::usage(format!("port {} of the loopback address: {error}", args.port))
            .help("choose another --port; 0 takes a free one")
    })?;
    let gate = Gate::new(server.address()?, Token::random());
    let session = Session::new(scene, state, command, segmenter);
    if let Some(path) = &args.plan {
        let misfit = |cause| StageError::bad_input(format!("{cause}: {}", path.display()));
        session.reopen(ops).map_err(misfit)?;
    }
    let watch = Watch { version, named };
    serve(args, &session, &server, &gate, output.as_deref(), watch, context)?;
    context.check_interrupted()?;
    Ok(ViewReport { acts: session.acts(), output })
}

/// Serves the page until it is over.
fn serve(
    args: &Args,
    session: &Session<'_>,
    server: &Server,
    gate: &Gate,
    output: Option<&Path>,
    mut watch: Watch<'_>,
    context: &Context,
) -> anyhow::Result<()> {
    let stop = Stop::default();
    let photos = |view: usize| picture(session, view);
    let page = page(&session.scene.title);
    let api = Api { session, page, photos: &photos, stop: stop.clone() };
    let mut failed = None;
    std::thread::scope(|scope| {
        scope.spawn(|| session.follow_light());
        scope.spawn(|| session.prepare_views());
        scope.spawn(|| {
            while !stop.is_set() && watch.version.is_some() {
                std::thread::sleep(WATCH_STEP);
                watch.look(session, context);
            }
        });
        let announced = announce(args, &gate.url(), context);
        let mut written = Written { output, serial: None, plan: None };
        if let Err(error) = announced {
            failed = Some(error);
            stop.now();
        }
        server.run(gate, &stop, &|path, request| api.answer(path, request), || {
            if context.interrupted() {
                stop.now();
            }
            if let Err(error) = written.keep_up(session) {
                failed.get_or_insert(error);
                stop.now();
            }
            if stop.is_set() {
                // Those who wait for news go first.
                session.end();
            }
        });
        session.end();
    });
    match failed {
        Some(error) => Err(error),
        None => Written { output, serial: None, plan: None }.keep_up(session),
    }
}

/// Says where the page is, and opens it.
fn announce(args: &Args, url: &str, context: &Context) -> anyhow::Result<()> {
    if args.common.json {
        let mut stdout = context.stdout();
        writeln!(stdout, "{}", json!({ "url": url }))?;
        stdout.flush()?;
    }
    tracing::info!("{url}");
    if !args.no_browser
        && let Err(error) = browser::open(url)
    {
        context.warn(format!("no browser was opened ({error}): open the address yourself"));
    }
    Ok(())
}

/// A photo for the page.
fn picture(session: &Session<'_>, view: usize) -> Result<Vec<u8>, String> {
    let Some((capture, path)) = &session.scene.capture else {
        return Err("there is no capture".into());
    };
    let folder = path.parent().unwrap_or(Path::new(""));
    let photo = photo(capture, view, folder, PHOTO_PX);
    photo.map(|photo| photo.jpeg).map_err(|error| error.to_string())
}

/// A file that may be written anew.
struct Watch<'a> {
    version: Option<Version>,
    named: Named<'a>,
}

impl Watch<'_> {
    fn look(&mut self, session: &Session<'_>, context: &Context) {
        let Some(version) = &self.version else { return };
        let Some(now) = newest(&version.path).filter(|now| now != version) else { return };
        if !session.is_pristine() {
            session.notice("the file was written anew: undo everything to see it".into());
            return;
        }
        let capture = session.scene.capture.as_ref().map(|(capture, _)| capture);
        match reload(&now, capture, context) {
            Ok(state) => {
                if !session.replace(state, command(&self.named, Some(&now))) {
                    return;
                }
            }
            Err(error) => session.notice(format!("the file cannot be read: {error}")),
        }
        self.version = Some(now);
    }
}

/// The plan in a file.
struct Written<'a> {
    output: Option<&'a Path>,
    /// When it was looked at.
    serial: Option<u64>,
    /// The plan that is there.
    plan: Option<EditPlanDocument>,
}

impl Written<'_> {
    fn keep_up(&mut self, session: &Session<'_>) -> anyhow::Result<()> {
        let Some(path) = self.output else { return Ok(()) };
        let serial = session.serial();
        if self.serial.replace(serial) == Some(serial) {
            return Ok(());
        }
        let plan = session.plan();
        if self.plan.as_ref() != Some(&plan) {
            write_document(path, &plan)?;
            self.plan = Some(plan);
        }
        Ok(())
    }
}
