//! Splats and scene folders with their new light.

use super::*;

#[test]
fn a_baked_splat_looks_like_the_pictures() {
    let toy = toy_scene();
    let light = ["--sun", "azimuth=60,elevation=35", "--sky"];
    let lit = picture(&toy, "lit", &[&light[..], &["--background", "black"]].concat());
    assert_code(&relight(&toy, &[&light[..], &["-o", "baked.ply"]].concat()), 0);
    let baked = read_gaussians(&toy.path("baked.ply")).unwrap();
    assert_eq!(baked.sh_degree, 3);
    assert!(baked.extra.iter().any(|c| c.name == "roughness"), "columns are kept");
    let render = ["--gaussians", "baked.ply", "--no-provenance", "-o", "renders"];
    let done = run_program(motes_testkit::program("render"), &toy, &[&VIEW[..], &render].concat());
    assert_code(&done, 0);
    let rendered = read_image(&toy.path("renders/view_0.png")).unwrap();
    let square = |(a, b): (&u8, &u8)| f64::from(a.abs_diff(*b)).powi(2);
    let error: f64 = lit.data.iter().zip(&rendered.data).map(square).sum::<f64>();
    let psnr = 48.13 - 10.0 * (error / lit.data.len() as f64).log10();
    assert!(psnr > 26.0, "{psnr}");
    let other =
        picture(&toy, "other", &["--sun", "azimuth=-60,elevation=35", "--background", "black"]);
    let error: f64 = other.data.iter().zip(&rendered.data).map(square).sum::<f64>();
    assert!(
        48.13 - 10.0 * (error / lit.data.len() as f64).log10() < psnr - 6.0,
        "it is this light"
    );
}

#[test]
fn a_relit_scene_opens_again_with_its_light() {
    let toy = toy_scene();
    toy.map("light.exr", 16, 8, |x, y| [0.1 * x as f32, 0.3, 0.2 * y as f32]);
    let light =
        ["--environment", "light.exr", "--env-convention", "threejs", "--env-exposure", "0.7"];
    assert_code(&relight(&toy, &[&light[..], &["--as", "scene", "-o", "relit"]].concat()), 0);
    let direct = picture(&toy, "direct", &light);
    let document = read_decomposition(&toy.path("relit")).unwrap().document;
    assert!(document.views.is_empty() && document.counts.gaussians > 0);
    let done = run_program(
        env!("CARGO_BIN_EXE_relight"),
        &toy,
        &[&["--scene", "relit", "--no-provenance", "-o", "again"], &VIEW[..]].concat(),
    );
    assert_code(&done, 0);
    assert_eq!(read_image(&toy.path("again/view_0.png")).unwrap(), direct);
    // The rasterizer shows the colors of the folder, which are those of its own light.
    let done = run_program(
        motes_testkit::program("render"),
        &toy,
        &[&["--scene", "relit", "--no-provenance", "-o", "splatted"], &VIEW[..]].concat(),
    );
    assert_code(&done, 0);
    let splatted = read_image(&toy.path("splatted/view_0.png")).unwrap();
    let direct = picture(&toy, "on-black", &[&light[..], &["--background", "black"]].concat());
    let off: u64 =
        splatted.data.iter().zip(&direct.data).map(|(a, b)| u64::from(a.abs_diff(*b))).sum();
    assert!(off < 6 * direct.data.len() as u64, "mean difference {off} / {}", direct.data.len());
    // A sky becomes a map of its own.
    let sky = ["--sun", "azimuth=60,elevation=35", "--sky"];
    assert_code(&relight(&toy, &[&sky[..], &["--as", "scene", "-o", "sky"]].concat()), 0);
    let done = run_program(
        env!("CARGO_BIN_EXE_relight"),
        &toy,
        &[&["--scene", "sky", "--no-provenance", "-o", "sky-again"], &VIEW[..]].concat(),
    );
    assert_code(&done, 0);
    let (a, b) =
        (picture(&toy, "sky-direct", &sky), read_image(&toy.path("sky-again/view_0.png")).unwrap());
    let far = a.data.iter().zip(&b.data).filter(|(a, b)| a.abs_diff(**b) > 16).count();
    assert!(far < a.data.len() / 50, "{far} of {}", a.data.len());
}
