//! Small files that stand for very much. Each is refused: soon, in little memory, as bad input.

use std::io::Write as _;
use std::path::Path;

use anyhow::Context as _;
use base64::Engine as _;
use exr::prelude::{WritableImage as _, f16};
use flate2::Compression;
use flate2::write::GzEncoder;
use image_webp::{ColorType, WebPEncoder};
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipWriter};

use crate::bench::{Bench, say};
use crate::judge::{fault, first_line};

/// A file, and the stage that shall refuse it.
struct Bomb {
    name: &'static str,
    make: fn(&Path) -> anyhow::Result<()>,
    line: &'static [&'static str],
    code: i32,
    /// A piece of what it says.
    says: &'static str,
}

const EXPORT: [&str; 3] = ["-o", "run/product.ply", "-q"];

const INSERT_TREE: [&str; 5] =
    ["edit", "--gaussians", "true.ply", "--insert", "run/mesh-tree.gltf"];
const INSERT_INSTANCES: [&str; 5] =
    ["edit", "--gaussians", "true.ply", "--insert", "run/mesh-instances.gltf"];
const INSERT_TEXTURES: [&str; 5] =
    ["edit", "--gaussians", "true.ply", "--insert", "run/mesh-textures.gltf"];

const BOMBS: &[Bomb] = &[
    Bomb {
        name: "doubling.gltf",
        make: doubling_nodes,
        line: &["export", "--gaussians", "run/doubling.gltf"],
        code: 3,
        says: "do not form a tree",
    },
    Bomb {
        name: "instances.gltf",
        make: instances,
        line: &["export", "--gaussians", "run/instances.gltf"],
        code: 3,
        says: "cannot hold",
    },
    Bomb {
        name: "aliases.gltf",
        make: aliases,
        line: &["export", "--gaussians", "run/aliases.gltf"],
        code: 3,
        says: "cannot hold",
    },
    Bomb {
        name: "mesh-tree.gltf",
        make: mesh_tree,
        line: &INSERT_TREE,
        code: 3,
        says: "do not form a tree",
    },
    Bomb {
        name: "mesh-instances.gltf",
        make: mesh_instances,
        line: &INSERT_INSTANCES,
        code: 3,
        says: "cannot hold",
    },
    Bomb {
        name: "mesh-textures.gltf",
        make: mesh_textures,
        line: &INSERT_TEXTURES,
        code: 3,
        says: "cannot hold",
    },
    Bomb {
        name: "flat.sog",
        make: flat_sog,
        line: &["export", "--gaussians", "run/flat.sog"],
        code: 3,
        says: "cannot hold",
    },
    Bomb {
        name: "zeros.spz",
        make: zeros_spz,
        line: &["export", "--gaussians", "run/zeros.spz"],
        code: 3,
        says: "cannot hold",
    },
    Bomb {
        name: "zeros.exr",
        make: zeros_exr,
        line: &["relight", "--scene", "{scene}", "--environment", "run/zeros.exr"],
        code: 3,
        says: "cannot hold",
    },
    Bomb {
        name: "huge.json",
        make: huge_camera,
        line: &[
            "relight",
            "--scene",
            "{scene}",
            "--capture",
            "run/huge.json",
            "--split",
            "all",
            "--as",
            "pictures",
        ],
        code: 3,
        says: "memory",
    },
    Bomb {
        name: "huge.json",
        make: huge_camera,
        line: &[
            "render",
            "--gaussians",
            "true.ply",
            "--capture",
            "run/huge.json",
            "--split",
            "all",
        ],
        code: 3,
        says: "memory",
    },
    Bomb {
        name: "huge.json",
        make: huge_camera,
        line: &[
            "segment-select",
            "--gaussians",
            "true.ply",
            "--capture",
            "run/huge.json",
            "--click",
            "a,1,1",
        ],
        code: 3,
        says: "memory",
    },
    Bomb {
        name: "none",
        make: nothing,
        line: &["export", "--gaussians", "true.ply", "--threads", "5000"],
        code: 0,
        says: "",
    },
];

pub(crate) fn run(bench: &mut Bench) -> anyhow::Result<()> {
    for bomb in BOMBS {
        let run = bench.clear()?;
        let file = run.join(bomb.name);
        (bomb.make)(&file).with_context(|| format!("the bomb {}", bomb.name))?;
        let line = [bomb.line, &EXPORT].concat();
        let ended = bench.run(&line)?;
        let code = ended.status.and_then(|status| status.code());
        let what = fault(&ended, &run).or_else(|| {
            let said = || format!("it ended with {code:?}: {}", first_line(&ended.stderr));
            (code != Some(bomb.code) || !ended.stderr.contains(bomb.says)).then(said)
        });
        if let Some(what) = what {
            bench.fail(&line, &what, Some(&file));
        }
    }
    say(&format!("bombs: {}", BOMBS.len()));
    Ok(())
}

fn nothing(_: &Path) -> anyhow::Result<()> {
    Ok(())
}

/// A glTF of `splats` Gaussians in one mesh, with these nodes and further attributes of it.
fn gltf(splats: usize, nodes: &str, root: &str, attributes: &str) -> String {
    let bytes = vec![0x3c; 16 * splats];
    let data = base64::engine::general_purpose::STANDARD.encode(&bytes);
    let accessor = |shape: &str| {
        format!(r#"{{"bufferView":0,"componentType":5126,"count":{splats},"type":"{shape}"}}"#)
    };
    let own = "KHR_gaussian_splatting";
    format!(
        r#"{{"asset":{{"version":"2.0"}},"extensionsUsed":["{own}"],
        "buffers":[{{"byteLength":{0},"uri":"data:application/octet-stream;base64,{data}"}}],
        "bufferViews":[{{"buffer":0,"byteLength":{0}}}],
        "accessors":[{1},{2},{3}],
        "meshes":[{{"primitives":[{{"mode":0,"attributes":{{"POSITION":0,"{own}:SCALE":0,"{own}:ROTATION":1,"{own}:SH_DEGREE_0_COEF_0":0,
        "{own}:OPACITY":2{attributes}}},"extensions":{{"{own}":{{"kernel":"ellipse","colorSpace":"srgb_rec709_display"}}}}}}]}}],
        "scenes":[{{"nodes":[{root}]}}],"scene":0,"nodes":[{nodes}]}}"#,
        bytes.len(),
        accessor("VEC3"),
        accessor("VEC4"),
        accessor("SCALAR"),
    )
}

/// A glTF of one mesh of `triangles`, with these nodes and further keys of the document.
fn mesh_gltf(triangles: usize, nodes: &str, root: &str, more: &str) -> String {
    let bytes: Vec<u8> = (0..9 * triangles).flat_map(|i| ((i % 7) as f32).to_le_bytes()).collect();
    let data = base64::engine::general_purpose::STANDARD.encode(&bytes);
    format!(
        r#"{{"asset":{{"version":"2.0"}},
        "buffers":[{{"byteLength":{0},"uri":"data:application/octet-stream;base64,{data}"}}],
        "bufferViews":[{{"buffer":0,"byteLength":{0}}}],
        "accessors":[{{"bufferView":0,"componentType":5126,"count":{1},"type":"VEC3"}}],
        {more},"scenes":[{{"nodes":[{root}]}}],"scene":0,"nodes":[{nodes}]}}"#,
        bytes.len(),
        3 * triangles,
    )
}

const ONE_MESH: &str = r#""meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}]"#;

/// Every node of a mesh names its child twice.
fn mesh_tree(path: &Path) -> anyhow::Result<()> {
    let node = |i: usize| match i {
        60 => r#"{"mesh":0}"#.to_owned(),
        i => format!(r#"{{"children":[{0},{0}]}}"#, i + 1),
    };
    let nodes: Vec<String> = (0..=60).map(node).collect();
    Ok(std::fs::write(path, mesh_gltf(1, &nodes.join(","), "0", ONE_MESH))?)
}

/// One mesh of five thousand triangles in twenty thousand places.
fn mesh_instances(path: &Path) -> anyhow::Result<()> {
    let nodes = vec![r#"{"mesh":0}"#; 20_000].join(",");
    let roots: Vec<String> = (0..20_000).map(|i| i.to_string()).collect();
    Ok(std::fs::write(path, mesh_gltf(5000, &nodes, &roots.join(","), ONE_MESH))?)
}

/// One flat picture of sixteen megapixels under two hundred names.
fn mesh_textures(path: &Path) -> anyhow::Result<()> {
    const NAMES: usize = 200;
    const SIDE: u32 = 4096;
    let mut image = Vec::new();
    let white = vec![255; (3 * SIDE * SIDE) as usize];
    WebPEncoder::new(&mut image).encode(&white, SIDE, SIDE, ColorType::Rgb8)?;
    let data = base64::engine::general_purpose::STANDARD.encode(&image);
    let all = |make: &dyn Fn(usize) -> String| (0..NAMES).map(make).collect::<Vec<_>>().join(",");
    let more = format!(
        r#""meshes":[{{"primitives":[{}]}}],"materials":[{}],"textures":[{}],"images":[{}]"#,
        all(&|i| format!(r#"{{"attributes":{{"POSITION":0}},"material":{i}}}"#)),
        all(&|i| format!(r#"{{"pbrMetallicRoughness":{{"baseColorTexture":{{"index":{i}}}}}}}"#)),
        all(&|i| format!(r#"{{"source":{i}}}"#)),
        all(&|_| format!(r#"{{"uri":"data:image/webp;base64,{data}"}}"#)),
    );
    Ok(std::fs::write(path, mesh_gltf(1, r#"{"mesh":0}"#, "0", &more))?)
}

/// Every node names its child twice: 2^60 paths to the mesh.
fn doubling_nodes(path: &Path) -> anyhow::Result<()> {
    let node = |i: usize| match i {
        60 => "{}".to_owned(),
        i => format!(r#"{{"children":[{0},{0}]}}"#, i + 1),
    };
    let nodes: Vec<String> = (0..=60).map(node).collect();
    Ok(std::fs::write(path, gltf(1, &nodes.join(","), "0", ""))?)
}

/// One mesh in twenty thousand places.
fn instances(path: &Path) -> anyhow::Result<()> {
    let nodes = vec![r#"{"mesh":0}"#; 20_000].join(",");
    let roots: Vec<String> = (0..20_000).map(|i| i.to_string()).collect();
    Ok(std::fs::write(path, gltf(5000, &nodes, &roots.join(","), ""))?)
}

/// One accessor as fifty thousand columns.
fn aliases(path: &Path) -> anyhow::Result<()> {
    let attributes: String = (0..50_000).map(|i| format!(r#","_A{i}":2"#)).collect();
    Ok(std::fs::write(path, gltf(20_000, r#"{"mesh":0}"#, "0", &attributes))?)
}

/// Images of one color: sixteen million Gaussians in a kilobyte.
fn flat_sog(path: &Path) -> anyhow::Result<()> {
    const SIDE: u32 = 4096;
    let mut image = Vec::new();
    WebPEncoder::new(&mut image).encode(
        &vec![128; (3 * SIDE * SIDE) as usize],
        SIDE,
        SIDE,
        ColorType::Rgb8,
    )?;
    let book: Vec<String> = (0..256).map(|i| format!("{}", f64::from(i) / 256.0)).collect();
    let book = book.join(",");
    let meta = format!(
        r#"{{"version":2,"count":{},"means":{{"mins":[0,0,0],"maxs":[1,1,1],"files":["m","m"]}},
        "scales":{{"codebook":[{book}],"files":["m"]}},"quats":{{"files":["m"]}},
        "sh0":{{"codebook":[{book}],"files":["m"]}}}}"#,
        u64::from(SIDE) * u64::from(SIDE)
    );
    let mut archive = ZipWriter::new(std::fs::File::create(path)?);
    let stored = SimpleFileOptions::default().compression_method(CompressionMethod::Deflated);
    for (name, bytes) in [("meta.json", meta.as_bytes()), ("m", &image)] {
        archive.start_file(name, stored)?;
        archive.write_all(bytes)?;
    }
    archive.finish()?;
    Ok(())
}

/// Ten million Gaussians of zeros in a gzip stream.
fn zeros_spz(path: &Path) -> anyhow::Result<()> {
    const ROWS: u32 = 10_000_000;
    let mut encoder = GzEncoder::new(std::fs::File::create(path)?, Compression::fast());
    for word in [0x5053_474e, 2, ROWS] {
        encoder.write_all(&word.to_le_bytes())?;
    }
    encoder.write_all(&[0, 12, 0, 0])?;
    let zeros = vec![0; ROWS as usize];
    for _ in 0..19 {
        encoder.write_all(&zeros)?;
    }
    encoder.finish()?;
    Ok(())
}

/// A black map of seventy megapixels.
fn zeros_exr(path: &Path) -> anyhow::Result<()> {
    let black = |_: exr::math::Vec2<usize>| (f16::ZERO, f16::ZERO, f16::ZERO);
    let channels = exr::prelude::SpecificChannels::rgb(black);
    let encoding = exr::prelude::Encoding::SMALL_LOSSLESS;
    let layer = exr::prelude::Layer::new(
        (10_000, 7_000),
        exr::prelude::LayerAttributes::default(),
        encoding,
        channels,
    );
    exr::prelude::Image::from_layer(layer).write().to_file(path)?;
    Ok(())
}

/// A camera of seventeen gigapixels.
fn huge_camera(path: &Path) -> anyhow::Result<()> {
    let text = r#"{"format":"motes/capture","version":"1.0","cameras":[{"model":"PINHOLE","width":131072,"height":131072,
        "params":[100000,100000,65536,65536]}],"views":[{"name":"a","camera":0,"image":"a.png","split":"train",
        "camera_from_world":{"rotation_wxyz":[1,0,0,0],"translation":[0,0,4]}}]}"#;
    Ok(std::fs::write(path, text)?)
}
