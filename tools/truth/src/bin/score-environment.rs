//! Scores an estimated environment map against the true one by three spheres.

#![allow(clippy::print_stderr, clippy::print_stdout, reason = "a tool for developers")]

use std::path::PathBuf;

use clap::Parser;
use glam::DVec3;
use motes_figures::contact_sheet::{ContactCell, ContactRow, ContactSheet};
use motes_formats::atomic::write_atomic;
use motes_formats::environment::read_environment;
use motes_formats::images::write_png;
use motes_math::srgb;
use motes_scene::{Convention, ImageF32, ImageU8};
use motes_shading::environment::{MapAxes, Orientation};
use motes_truth::score::spheres::{MapWithAxes, compare};

/// Score an estimated environment map against the true one by a diffuse, a glossy and a mirror sphere
#[derive(Parser, Debug)]
#[command(name = "score-environment")]
struct Args {
    /// True light (EXR), Blender's axes
    truth: PathBuf,
    /// Estimated light (EXR)
    estimate: PathBuf,
    /// Factor on the true radiance: the exposure of the photos
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0)]
    exposure: f32,
    /// Axes of the estimate, upright over +z
    #[arg(long, value_enum, default_value_t = Convention::Blender)]
    convention: Convention,
    /// Scores as JSON
    #[arg(short, long, value_name = "FILE.json")]
    output: Option<PathBuf>,
    /// Picture of the spheres, truth above the estimate
    #[arg(long, value_name = "FILE.png")]
    sheet: Option<PathBuf>,
}

fn shown(image: &ImageF32, white: f32) -> ImageU8 {
    let mut out = image.clone();
    out.data.iter_mut().for_each(|v| *v = srgb::encode((*v / white).clamp(0.0, 1.0)));
    out.to_u8()
}

fn main() -> anyhow::Result<()> {
    let args = Args::parse();
    let truth = MapWithAxes {
        image: read_environment(&args.truth)?.scaled(args.exposure),
        orientation: Orientation::new(Convention::Blender),
    };
    let estimate = MapWithAxes {
        image: read_environment(&args.estimate)?,
        orientation: MapAxes::upright(args.convention, DVec3::Z).orientation(),
    };
    let spheres = compare(&truth, &estimate);
    println!(
        "| sphere | RMSE | scale-invariant | factor | angle, degrees |\n|---|---|---|---|---|"
    );
    for (name, s) in &spheres.scores {
        let (a, b, c, d) = (s.rmse, s.si_rmse, s.factor, s.angle_deg);
        println!("| {name} | {a:.3} | {b:.3} | {c:.2} | {d:.1} |");
    }
    if let Some(path) = &args.output {
        let text = serde_json::to_string_pretty(&spheres.scores)? + "\n";
        write_atomic(path, |w| w.write_all(text.as_bytes()))?;
    }
    if let Some(path) = &args.sheet {
        let mut sheet = ContactSheet { title: "truth, estimate".into(), ..ContactSheet::default() };
        for (name, truth, estimate) in &spheres.pictures {
            let white = truth.data.iter().sum::<f32>() / truth.data.len() as f32 * 4.0;
            sheet.columns.push((*name).to_owned());
            for (row, image) in [("truth", truth), ("estimate", estimate)] {
                let cell = Some(ContactCell { image: shown(image, white), caption: String::new() });
                match sheet.rows.iter_mut().find(|r| r.label[0] == row) {
                    Some(found) => found.cells.push(cell),
                    None => {
                        sheet.rows.push(ContactRow { label: vec![row.into()], cells: vec![cell] });
                    }
                }
            }
        }
        write_png(path, &sheet.draw(192))?;
    }
    Ok(())
}
