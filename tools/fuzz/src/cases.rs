//! Every kind of input, the stages that read it, and where good ones are.

use std::path::{Path, PathBuf};

use anyhow::Context as _;

use crate::bench::Bench;

/// A stage that reads a file.
pub(crate) struct Case {
    /// Where the damaged file is put, below the folder of the bench.
    pub(crate) at: &'static str,
    /// Stage and arguments.
    pub(crate) line: &'static [&'static str],
    /// Where good files are: a folder of the repository, or a file of the bench.
    seeds: &'static str,
}

const CASES: &[Case] = &[
    Case {
        at: "run/a.ply",
        line: &["export", "--gaussians", "run/a.ply", "-o", "run/product.ply"],
        seeds: "testdata/formats/gaussians-ply/v1/valid",
    },
    Case {
        at: "run/a.ply",
        line: &[
            "edit",
            "--gaussians",
            "run/a.ply",
            "--translate",
            "1,2,3",
            "-o",
            "run/product.ply",
        ],
        seeds: "testdata/formats/gaussians-ply/v1/valid",
    },
    Case {
        at: "run/a.compressed.ply",
        line: &["export", "--gaussians", "run/a.compressed.ply", "-o", "run/product.ply"],
        seeds: "testdata/formats/compressed-ply/v1/valid",
    },
    Case {
        at: "run/a.spz",
        line: &["export", "--gaussians", "run/a.spz", "-o", "run/product.ply"],
        seeds: "testdata/formats/spz/v1/valid",
    },
    Case {
        at: "run/a.sog",
        line: &["export", "--gaussians", "run/a.sog", "-o", "run/product.ply"],
        seeds: "testdata/formats/sog/v1/valid",
    },
    Case {
        at: "run/a.glb",
        line: &["export", "--gaussians", "run/a.glb", "-o", "run/product.ply"],
        seeds: "testdata/formats/gltf/v1/valid",
    },
    Case {
        at: "run/a.splat",
        line: &["export", "--gaussians", "run/a.splat", "-o", "run/product.ply"],
        seeds: "testdata/formats/splat/v1/valid",
    },
    Case {
        at: "run/a.ksplat",
        line: &["export", "--gaussians", "run/a.ksplat", "-o", "run/product.ply"],
        seeds: "testdata/formats/ksplat/v1/valid",
    },
    Case {
        at: "damaged.json",
        line: &[
            "render",
            "--capture",
            "damaged.json",
            "--gaussians",
            "true.ply",
            "--split",
            "test",
            "-o",
            "run/pictures",
        ],
        seeds: "capture.json",
    },
    Case {
        at: "damaged.json",
        line: &["train-splat", "--capture", "damaged.json", "-n", "2", "-o", "run/product.ply"],
        seeds: "capture.json",
    },
    Case {
        at: "images/view_0.png",
        line: &["train-splat", "--capture", "capture.json", "-n", "2", "-o", "run/product.ply"],
        seeds: "images/view_0.png",
    },
    Case {
        at: "run/path.json",
        line: &[
            "render",
            "--path",
            "run/path.json",
            "--gaussians",
            "true.ply",
            "--width",
            "32",
            "-o",
            "run/pictures",
        ],
        seeds: "testdata/formats/camera-path/v1/valid",
    },
    Case {
        at: "run/light.exr",
        line: &[
            "relight",
            "--scene",
            "{scene}",
            "--environment",
            "run/light.exr",
            "--quality",
            "preview",
            "--bounces",
            "1",
            "-o",
            "run/product.ply",
        ],
        seeds: "testdata/formats/environment/v1/valid",
    },
    Case {
        at: "run/plan.json",
        line: &[
            "edit",
            "--gaussians",
            "true.ply",
            "--plan",
            "run/plan.json",
            "-o",
            "run/product.ply",
        ],
        seeds: "testdata/formats/edit-plan/v1/valid",
    },
    Case {
        at: "run/mesh.ply",
        line: &[
            "edit",
            "--scene",
            "{scene}",
            "--insert",
            "run/mesh.ply",
            "--no-reshade",
            "-o",
            "run/edited",
        ],
        seeds: "testdata/formats/surface-ply/v1/valid",
    },
    Case {
        at: "run/mesh.glb",
        line: &[
            "edit",
            "--scene",
            "{scene}",
            "--insert",
            "run/mesh.glb",
            "--no-reshade",
            "-o",
            "run/edited",
        ],
        seeds: "testdata/formats/meshes/v1/valid/mesh.glb",
    },
    Case {
        at: "run/mesh.gltf",
        line: &[
            "edit",
            "--scene",
            "{scene}",
            "--insert",
            "run/mesh.gltf",
            "--no-reshade",
            "-o",
            "run/edited",
        ],
        seeds: "testdata/formats/meshes/v1/valid/mesh.gltf",
    },
    Case {
        at: "run/mesh.obj",
        line: &[
            "edit",
            "--scene",
            "{scene}",
            "--insert",
            "run/mesh.obj",
            "--no-reshade",
            "-o",
            "run/edited",
        ],
        seeds: "testdata/formats/meshes/v1/valid/mesh.obj",
    },
    Case {
        at: "run/config.json",
        line: &[
            "render",
            "--config",
            "run/config.json",
            "--gaussians",
            "true.ply",
            "--orbit",
            "1",
            "--capture",
            "capture.json",
            "-o",
            "run/pictures",
        ],
        seeds: "config.json",
    },
    Case {
        at: "run/fit.safetensors",
        line: &[
            "train-splat",
            "--capture",
            "capture.json",
            "--resume",
            "run/fit.safetensors",
            "-o",
            "run/product.ply",
        ],
        seeds: "fit.checkpoint.safetensors",
    },
    Case {
        at: "colmap/sparse/0/images.txt",
        line: &["import-colmap", "colmap", "-o", "run/capture"],
        seeds: "colmap/sparse/0/images.txt",
    },
    Case {
        at: "colmap/sparse/0/cameras.txt",
        line: &["import-colmap", "colmap", "-o", "run/capture"],
        seeds: "colmap/sparse/0/cameras.txt",
    },
    Case {
        at: "colmap/sparse/0/points3D.txt",
        line: &["import-colmap", "colmap", "-o", "run/capture"],
        seeds: "colmap/sparse/0/points3D.txt",
    },
    Case {
        at: "colmap/images/view_01.png",
        line: &["import-colmap", "colmap", "-o", "run/capture"],
        seeds: "colmap/images/view_01.png",
    },
];

/// Makes what some cases start from.
pub(crate) fn prepare(bench: &mut Bench) -> anyhow::Result<&'static [Case]> {
    let ok = |bench: &mut Bench, line: &[&str]| -> anyhow::Result<()> {
        let ended = bench.run(line)?;
        let good = ended.status.is_some_and(|status| status.success());
        anyhow::ensure!(good, "{} failed on a good file: {}", line[0], ended.stderr);
        Ok(())
    };
    ok(
        bench,
        &[
            "train-splat",
            "--capture",
            "capture.json",
            "-n",
            "3",
            "--save-every",
            "1",
            "-w",
            "-o",
            "fit.ply",
        ],
    )?;
    let options = r#"{"width": 32, "split": null, "background": "0,0,0", "antialias": "classic"}"#;
    std::fs::write(bench.path("config.json"), options)?;
    let tiny = repository().join("testdata/captures/tiny");
    copy_folder(&tiny, &bench.path("colmap"))?;
    Ok(CASES)
}

impl Case {
    /// Good files to start from.
    pub(crate) fn seeds(&self, bench: &Bench) -> anyhow::Result<Vec<Vec<u8>>> {
        let of_bench = bench.path(self.seeds);
        let place = if of_bench.exists() { of_bench } else { repository().join(self.seeds) };
        let paths = if place.is_dir() {
            let mut paths: Vec<PathBuf> = std::fs::read_dir(&place)?
                .map(|e| e.map(|e| e.path()))
                .collect::<Result<_, _>>()?;
            paths.sort();
            paths
        } else {
            vec![place.clone()]
        };
        let files: Vec<Vec<u8>> = paths
            .iter()
            .filter(|path| path.is_file())
            .map(std::fs::read)
            .collect::<Result<_, _>>()
            .with_context(|| format!("seeds of {}", place.display()))?;
        anyhow::ensure!(!files.is_empty(), "no seeds: {}", place.display());
        Ok(files)
    }
}

/// The checkout that this was built from, else the current folder.
fn repository() -> PathBuf {
    let built_in = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    if built_in.join("testdata").is_dir() { built_in } else { PathBuf::from(".") }
}

fn copy_folder(from: &Path, to: &Path) -> anyhow::Result<()> {
    std::fs::create_dir_all(to)?;
    for entry in std::fs::read_dir(from)? {
        let entry = entry?;
        let place = to.join(entry.file_name());
        if entry.file_type()?.is_dir() {
            copy_folder(&entry.path(), &place)?;
        } else {
            std::fs::copy(entry.path(), place)?;
        }
    }
    Ok(())
}
