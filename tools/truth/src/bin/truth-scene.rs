//! Makes a ground-truth scene: photos, cameras, lights, relit pictures and buffers.

#![allow(clippy::print_stderr, clippy::print_stdout, reason = "a tool for developers")]

use std::path::PathBuf;
use std::str::FromStr;

use clap::{Parser, ValueEnum};
use glam::Vec3;
use motes_shading::brdf::Lobes;
use motes_truth::asset::write_asset;
use motes_truth::changed::{Move, finite_numbers, make_moved};
use motes_truth::faults::Fault;
use motes_truth::oracle::write_oracle;
use motes_truth::probe::make_probe;
use motes_truth::repainted::{Repaint, make_repainted};
use motes_truth::scenes::SceneName;
use motes_truth::world::STEPS;
use motes_truth::{MakeOptions, make, make_removed};

/// Make a ground-truth scene: photos, cameras, lights, relit pictures and buffers
#[derive(Parser, Debug)]
#[command(name = "truth-scene")]
struct Args {
    /// Which scene
    scene: SceneName,
    /// Folder to write
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// Write the scene folder of a perfect decomposition to OUTPUT instead, for these Gaussians
    #[arg(long, value_name = "FILE.ply", requires = "truth")]
    oracle: Option<PathBuf>,
    /// The ground-truth folder whose photos the Gaussians of --oracle were trained on
    #[arg(long, value_name = "DIR")]
    truth: Option<PathBuf>,
    /// Write the test views without an object, test/removed_OBJECT, into the folder OUTPUT of this scene instead
    #[arg(long, value_name = "OBJECT", conflicts_with = "oracle")]
    without: Option<String>,
    /// Write the test views with an object in another place (world units), test/moved_OBJECT, into the folder OUTPUT of this scene instead
    #[arg(long, value_name = "OBJECT=DX,DY,DZ", conflicts_with_all = ["oracle", "without"])]
    moved: Option<Move>,
    /// Write the true light at a point, units of the scene from its middle, into the folder OUTPUT of this scene instead
    #[arg(long, value_name = "X,Y,Z", value_parser = point, allow_hyphen_values = true, conflicts_with_all = ["oracle", "without", "moved"])]
    probe: Option<Vec3>,
    /// Write an object as a mesh OUTPUT (PLY), with a JSON document that says where it stands, instead
    #[arg(long, value_name = "OBJECT", conflicts_with_all = ["oracle", "without", "moved", "probe"])]
    asset: Option<String>,
    /// Steps of the mesh of --asset from pole to pole; its colors are as fine as its vertices
    #[arg(long, value_name = "COUNT", default_value_t = STEPS, requires = "asset")]
    asset_steps: u32,
    /// Write the test views under a map in Blender's axes, in photo values, into the folder OUTPUT of this scene instead; repeatable
    #[arg(long, value_name = "LIGHT=FILE", value_parser = light, conflicts_with_all = ["oracle", "without", "moved", "probe", "asset"])]
    relit: Vec<(String, PathBuf)>,
    /// Paint of objects for --relit: `handle` means `handle_1`, too; repeatable
    #[arg(long, value_name = "OBJECT=R,G,B,ROUGHNESS,METALLIC", requires = "relit")]
    repaint: Vec<Repaint>,
    /// Leave an object out
    #[arg(long, value_name = "OBJECT")]
    omit: Option<String>,
    /// The light of the photos, one of the scene's
    #[arg(long, value_name = "LIGHT")]
    light: Option<String>,
    /// Photo value over radiance [default: one percent of the photos is white]
    #[arg(long, value_name = "FACTOR")]
    exposure: Option<f64>,
    /// Make no pictures under other lights
    #[arg(long)]
    no_relights: bool,
    /// Columns; rows are three quarters of it
    #[arg(long, value_name = "PIXELS", default_value_t = 480)]
    width: usize,
    /// Photos
    #[arg(long, value_name = "COUNT", default_value_t = 20)]
    train_views: usize,
    /// Views with buffers and relit pictures
    #[arg(long, value_name = "COUNT", default_value_t = 6)]
    test_views: usize,
    /// Paths per pixel
    #[arg(long, value_name = "COUNT", default_value_t = 8)]
    samples: u32,
    /// Surfaces that a path meets after the first
    #[arg(long, value_name = "COUNT", default_value_t = 3)]
    bounces: u32,
    /// The coat takes its reflection out of the diffuse light, unlike other renderers' `principled`
    #[arg(long)]
    principled: bool,
    /// What is wrong with the camera that takes the photos: a list, all or none [default: the scene's]
    #[arg(long, value_name = "FAULT,...")]
    faults: Option<FaultList>,
    /// Key of all random numbers
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Threads; 0 for all
    #[arg(long, value_name = "COUNT", default_value_t = 0)]
    threads: usize,
}

/// What a camera does to a photo.
#[derive(Clone, Debug)]
struct FaultList(Vec<Fault>);

impl FromStr for FaultList {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let words = text.split(',').map(str::trim);
        Ok(Self(match text {
            "all" => Fault::ALL.to_vec(),
            "none" => Vec::new(),
            _ => words.map(|word| Fault::from_str(word, false)).collect::<Result<_, _>>()?,
        }))
    }
}

fn point(text: &str) -> Result<Vec3, String> {
    finite_numbers(text).map(Vec3::from_array).ok_or_else(|| "expected X,Y,Z".into())
}

fn light(text: &str) -> Result<(String, PathBuf), String> {
    let (name, file) = text.split_once('=').ok_or("expected LIGHT=FILE")?;
    Ok((name.into(), file.into()))
}

fn main() -> anyhow::Result<()> {
    let args = Args::parse();
    let options = MakeOptions {
        width: args.width.max(16),
        train_views: args.train_views.max(1),
        test_views: args.test_views,
        samples: args.samples.max(1),
        bounces: args.bounces,
        lobes: if args.principled { Lobes::Principled } else { Lobes::Burley },
        faults: args.faults.map(|list| list.0),
        seed: args.seed,
        omit: args.omit.clone(),
        light: args.light.clone(),
        exposure: args.exposure,
        no_relights: args.no_relights,
    };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(args.threads).build()?;
    pool.install(|| {
        if let (Some(gaussians), Some(truth)) = (&args.oracle, &args.truth) {
            return write_oracle(args.scene, &options, truth, gaussians, &args.output);
        }
        if let Some(object) = &args.without {
            return make_removed(args.scene, object, &args.output);
        }
        if let Some(moved) = &args.moved {
            return make_moved(args.scene, moved, &args.output);
        }
        if !args.relit.is_empty() {
            return make_repainted(args.scene, &args.repaint, &args.relit, &args.output);
        }
        if let Some(at) = args.probe {
            return make_probe(args.scene, &options, at, &args.output);
        }
        if let Some(object) = &args.asset {
            return write_asset(
                args.scene,
                &options,
                object,
                args.asset_steps.max(8),
                &args.output,
            );
        }
        make(args.scene, &options, &args.output, &mut |what| eprintln!("truth-scene: {what}"))
    })
}
