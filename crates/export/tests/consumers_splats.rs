//! splat-transform reads what `export` writes, and we read what it writes; the pictures agree.
//!
//! `make setup-consumers` installs it. Without it these tests say that they were skipped; with `CI` set they
//! fail. Losses are those of the formats, which `docs/formats/splats.md` states: what is compared closely is two
//! readers of the same file.

#![expect(clippy::unwrap_used, reason = "a test that cannot prepare its files has failed")]
#![allow(clippy::print_stdout, reason = "shown with --nocapture")]

use std::path::{Path, PathBuf};
use std::process::Command;

use motes_codecs::{
    PlyLayout, SplatFormat, SplatWriteOptions, SpzOptions, open_gaussians, write_gaussians,
};
use motes_formats::ply::RenderMode;
use motes_math::metrics::psnr_f32;
use motes_raster::{RenderOptions, render};
use motes_scene::Gaussians;
use motes_testkit::{consumer, orbit_pose, random_gaussians, small_camera};

/// A picture of two readers of one file: the same values but for rounding.
const SAME_DB: f64 = 50.0;

struct Bench {
    tool: PathBuf,
    dir: tempfile::TempDir,
    source: Gaussians,
}

impl Bench {
    fn new() -> Option<Self> {
        let tool = consumer("node_modules/@playcanvas/splat-transform/bin/cli.mjs")?;
        let dir = tempfile::tempdir().unwrap();
        let mut source = random_gaussians(5, 1500, 3);
        // As many faint, small and thin ones as a fitted scene has.
        for (i, scales) in source.log_scales.iter_mut().enumerate() {
            *scales = scales.map(|s| s - 1.0);
            scales[i % 3] -= (i % 5) as f32;
        }
        source.sh.iter_mut().for_each(|v| *v *= 0.5);
        let bench = Self { tool, dir, source };
        let ply = SplatWriteOptions { layout: PlyLayout::Inria, ..SplatWriteOptions::default() };
        write_gaussians(&bench.path("source.ply"), SplatFormat::Ply, &bench.source, &ply).unwrap();
        Some(bench)
    }

    fn path(&self, name: &str) -> PathBuf {
        self.dir.path().join(name)
    }

    /// Converts one file to another.
    #[track_caller]
    fn transform(&self, from: &str, to: &str, flags: &[&str]) {
        let mut command = Command::new("node");
        command.arg(&self.tool).args(["-q", "-w", "-g", "cpu"]).args(flags);
        let output = command.arg(self.path(from)).arg(self.path(to)).output().unwrap();
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{from} to {to}: {said}");
    }

    fn read(&self, name: &str) -> Gaussians {
        open_gaussians(&self.path(name)).unwrap().gaussians
    }
}

/// PSNR over three views round the origin.
fn psnr(a: &Gaussians, b: &Gaussians) -> f64 {
    let camera = small_camera(200, 160);
    let picture = |g: &Gaussians, angle: f64| {
        render(g, &camera, &orbit_pose(angle), &RenderOptions::default()).color.data
    };
    let views = [0.3, 2.0, 4.4].map(|angle| psnr_f32(&picture(a, angle), &picture(b, angle)));
    let mse = views.iter().map(|db| 10f64.powf(-db / 10.0)).sum::<f64>() / 3.0;
    -10.0 * mse.log10()
}

#[track_caller]
fn assert_agree(what: &str, a: &Gaussians, b: &Gaussians, least: f64) {
    assert_eq!((a.len(), a.sh_degree), (b.len(), b.sh_degree), "{what}");
    let found = psnr(a, b);
    println!("{what}: {found:.1} dB");
    assert!(found >= least, "{what}: {found:.2} dB < {least}");
}

#[test]
fn splat_transform_reads_what_we_write() {
    let Some(bench) = Bench::new() else { return };
    let spz = |version| SplatWriteOptions {
        spz: SpzOptions { version, ..SpzOptions::default() },
        ..SplatWriteOptions::default()
    };
    let plain = SplatWriteOptions::default;
    let inria = SplatWriteOptions { layout: PlyLayout::Inria, ..plain() };
    let mip = SplatWriteOptions { render_mode: Some(RenderMode::Mip), ..plain() };
    for (name, format, options, loss) in [
        ("w.ply", SplatFormat::Ply, plain(), SAME_DB),
        ("w-inria.ply", SplatFormat::Ply, inria, SAME_DB),
        ("w-mip.ply", SplatFormat::Ply, mip, SAME_DB),
        ("w.compressed.ply", SplatFormat::CompressedPly, plain(), 38.0),
        ("w.splat", SplatFormat::Splat, plain(), 15.0),
        ("w3.spz", SplatFormat::Spz, spz(3), 34.0),
        ("w4.spz", SplatFormat::Spz, spz(4), 34.0),
        ("w2.spz", SplatFormat::Spz, spz(2), 34.0),
        ("w.sog", SplatFormat::Sog, plain(), 34.0),
    ] {
        write_gaussians(&bench.path(name), format, &bench.source, &options).unwrap();
        let theirs = format!("{name}.read.ply");
        bench.transform(name, &theirs, &[]);
        let (theirs, ours) = (bench.read(&theirs), bench.read(name));
        assert_agree(&format!("{name}, read by both"), &theirs, &ours, SAME_DB);
        let degree = theirs.sh_degree;
        let source = bench.source.with_sh_degree(degree);
        assert_agree(&format!("{name}, against the source"), &theirs, &source, loss);
    }
}

#[test]
fn we_read_what_splat_transform_writes() {
    let Some(bench) = Bench::new() else { return };
    for (name, flags, loss) in [
        ("t.ply", &[][..], SAME_DB),
        ("t.glb", &[], SAME_DB),
        ("t.compressed.ply", &[], 38.0),
        ("t3.spz", &["--spz-version", "3"], 34.0),
        ("t4.spz", &["--spz-version", "4"], 34.0),
        ("t.sog", &["-i", "3"], 34.0),
        ("folder/meta.json", &["-i", "3"], 34.0),
    ] {
        std::fs::create_dir_all(bench.path(name).parent().unwrap()).unwrap();
        bench.transform("source.ply", name, flags);
        let ours = bench.read(name);
        assert_agree(&format!("{name}, against the source"), &ours, &bench.source, loss);
        if name != "t.glb" {
            let theirs = format!("{}.read.ply", name.replace('/', "-"));
            bench.transform(name, &theirs, &[]);
            let what = format!("{name}, read by both");
            assert_agree(&what, &bench.read(&theirs), &ours, SAME_DB);
        }
    }
}

/// A ksplat that neither of us wrote: `testdata/formats/splat_cases.py` packed it.
#[test]
fn splat_transform_and_we_read_the_same_ksplat() {
    let Some(bench) = Bench::new() else { return };
    let corpus =
        Path::new(env!("CARGO_MANIFEST_DIR")).join("../../testdata/formats/ksplat/v1/valid");
    for level in 0..3 {
        let name = format!("level-{level}.ksplat");
        std::fs::copy(corpus.join(&name), bench.path(&name)).unwrap();
        bench.transform(&name, "k.ply", &[]);
        assert_agree(&name, &bench.read("k.ply"), &bench.read(&name), SAME_DB);
    }
}

/// Every error but one: the validator does not know the names that the ratified extension gives to
/// its attributes, and calls each of them invalid.
const VALIDATE: &str = "
const validator = require(process.argv[1]);
const bytes = new Uint8Array(require('fs').readFileSync(process.argv[2]));
validator.validateBytes(bytes, { maxIssues: 0 }).then(report => {
  const own = issue => issue.code === 'MESH_PRIMITIVE_INVALID_ATTRIBUTE'
    && issue.pointer.includes('/KHR_gaussian_splatting:');
  const found = report.issues.messages.filter(issue => issue.severity < 2 && !own(issue));
  console.log(JSON.stringify({ found, splats: report.info.totalVertexCount }));
});";

#[test]
fn the_khronos_validator_has_nothing_against_our_glb() {
    let Some(bench) = Bench::new() else { return };
    let Some(validator) = consumer("node_modules/gltf-validator") else { return };
    let mut source = bench.source.clone();
    source.extra.push(motes_scene::ExtraColumn {
        name: "roughness".into(),
        values: motes_scene::ColumnValues::F32(vec![0.5; source.len()]),
    });
    let options = SplatWriteOptions::default();
    let path = bench.path("v.glb");
    write_gaussians(&path, SplatFormat::Glb, &source, &options).unwrap();
    let validate = |path: &Path| {
        let mut command = Command::new("node");
        let output = command.args(["-e", VALIDATE]).arg(&validator).arg(path).output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        serde_json::from_slice::<serde_json::Value>(&output.stdout).unwrap()
    };
    let report = validate(&path);
    assert_eq!(report["found"], serde_json::json!([]), "{report}");
    assert_eq!(report["splats"], 1500);
    // A file that is wrong is noticed.
    let mut bytes = std::fs::read(&path).unwrap();
    let at = bytes.windows(6).position(|w| w == b"\"VEC4\"").unwrap();
    bytes[at..at + 6].copy_from_slice(b"\"VEC2\"");
    std::fs::write(&path, bytes).unwrap();
    assert_ne!(validate(&path)["found"], serde_json::json!([]));
}
