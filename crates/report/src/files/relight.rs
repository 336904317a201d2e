//! Put a relit scene on one page: before and after, components, what was left out, what it cost.
//!
//! Inputs: a scene folder, a capture, folders of pictures of its held-out views as `relight` makes
//! them, run records. Outputs: an HTML page that needs nothing else, a PNG.
//!
//! ```text
//! report relight --scene scene/ --capture capture/capture.json --own own/ --light evening=evening/ -o report.html
//! ```
//!
//! Exit codes: 0 done, 1 failed, 2 usage or would overwrite, 3 bad input. Manual: `docs/tutorial.md`.

use std::fmt;
use std::path::PathBuf;
use std::str::FromStr;

use super::page_flags::{links, notes};
use super::relit_scene::{RelightFiles, load_relight};
use clap::Parser;
use motes_formats::atomic::write_atomic;
use motes_formats::images::write_png;
use motes_stage::{CommonArgs, Context, HasCommon};
use serde::Serialize;

/// Report a relit scene as an HTML page: before and after, components, model selection, times
#[derive(Parser, Debug, Serialize)]
#[command(
    name = "report relight",
    after_help = "Examples:\n  \
    A scene under its capture illumination and at sunrise:\n    \
    report relight --scene scene --capture c.json --own own --light sunrise=dawn -o relight.html\n  \
    With a contact sheet:\n    \
    report relight --scene scene --capture c.json --own own -o relight.html --contact-sheet s.png"
)]
pub struct Args {
    /// Scene folder written by decompose
    #[arg(long, value_name = "DIR")]
    scene: PathBuf,

    /// Capture whose held-out views are shown
    #[arg(long, value_name = "FILE")]
    capture: PathBuf,

    /// Images of the held-out views under the capture illumination; EXR files beside them hold the
    /// components
    #[arg(long, value_name = "DIR")]
    own: PathBuf,

    /// Images of the held-out views under another light; repeatable
    #[arg(long, value_name = "NAME=DIR")]
    light: Vec<NamedFolder>,

    /// Run record of a program, for its times; repeatable
    #[arg(long, value_name = "FILE.run.json")]
    run: Vec<PathBuf>,

    /// HTML page to write
    #[arg(short, long, value_name = "FILE.html")]
    output: PathBuf,

    /// Contact sheet to write
    #[arg(long, value_name = "FILE.png")]
    contact_sheet: Option<PathBuf>,

    /// Width of an image on the contact sheet in pixels
    #[arg(long, value_name = "PIXELS", default_value_t = 300,
        value_parser = clap::value_parser!(u32).range(32..=2048))]
    cell_width: u32,

    /// File that the page links to, such as an interactive page of the model; repeatable
    #[arg(long, value_name = "NAME=FILE")]
    link: Vec<String>,

    /// Line for the end of the page; repeatable
    #[arg(long, value_name = "NAME=VALUE")]
    note: Vec<String>,

    #[command(flatten)]
    #[serde(flatten)]
    common: CommonArgs,
}

impl HasCommon for Args {
    const BASIC: &'static [&'static str] =
        &["scene", "capture", "own", "light", "run", "output", "contact-sheet", "note"];

    fn common(&self) -> &CommonArgs {
        &self.common
    }
}

#[derive(Clone, Debug)]
struct NamedFolder(String, PathBuf);

impl FromStr for NamedFolder {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (name, folder) = text.split_once('=').ok_or("expected NAME=DIR")?;
        Ok(Self(name.into(), folder.into()))
    }
}

impl Serialize for NamedFolder {
    /// As the flag takes it.
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(&format_args!("{}={}", self.0, self.1.display()))
    }
}

#[derive(Serialize)]
/// What the page says, as a report.
pub struct Report {
    output: PathBuf,
    views: usize,
    lights: Vec<String>,
    own_psnr_db: Option<f64>,
    left_out: Vec<String>,
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let psnr = self.own_psnr_db.map_or("-".into(), |db| format!("{db:.2}"));
        writeln!(
            f,
            "{} views under {}; capture illumination {psnr} dB",
            self.views,
            self.lights.join(", ")
        )?;
        if !self.left_out.is_empty() {
            writeln!(f, "left out: {}", self.left_out.join(", "))?;
        }
        writeln!(f, "report: {}", self.output.display())
    }
}

/// Makes the page.
///
/// # Errors
/// When a folder of the run is not what the page needs, or a product cannot be written.
pub fn run(args: &Args, context: &Context) -> anyhow::Result<Report> {
    let output = context.output(&args.output)?;
    let sheet = args.contact_sheet.as_ref().map(|path| context.output(path)).transpose()?;
    context.input("scene", args.scene.join("decomposition.json"))?;
    context.input("capture", &args.capture)?;
    let mut page = load_relight(&RelightFiles {
        scene: args.scene.clone(),
        capture: args.capture.clone(),
        own: args.own.clone(),
        lights: args.light.iter().map(|l| (l.0.clone(), l.1.clone())).collect(),
        runs: args.run.clone(),
    })?;
    page.links = links(&args.link, &output, context)?;
    page.protocol = notes(&args.note);
    context.stop_if_dry_run()?;

    write_atomic(&output, |writer| writer.write_all(page.to_html().as_bytes()))?;
    if let Some(path) = &sheet {
        write_png(path, &page.to_contact_sheet().draw(args.cell_width as usize))?;
    }
    let left_out = page.terms.iter().filter(|t| !t.kept).map(|t| t.name.clone()).collect();
    let own_psnr_db = page.own_psnr_db();
    Ok(Report { output, views: page.views.len(), lights: page.lights, own_psnr_db, left_out })
}
