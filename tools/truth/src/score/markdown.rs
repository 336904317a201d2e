//! Scores as tables for people.

use std::fmt::Write as _;

use super::align::Align;
use super::materials::RegionScores;
use super::pictures::PictureScores;
use super::{MaterialScores, Scores};

/// The scores of a scene.
pub fn page(scores: &Scores) -> String {
    let mut out = format!("## {}\n\n", scores.scene);
    out.push_str("| pictures of the test views | none dB | SSIM | scalar dB | channel dB | SSIM | factors |\n");
    out.push_str("|---|---|---|---|---|---|---|\n");
    let mut row = |name: &str, of: &PictureScores| {
        let Some([none, scalar, channel]) = Align::ALL
            .map(|a| of.aligned.get(&a))
            .into_iter()
            .collect::<Option<Vec<_>>>()
            .and_then(|v| <[_; 3]>::try_from(v).ok())
        else {
            return;
        };
        let f = channel.factors;
        let _ = writeln!(
            out,
            "| {name} | {:.2} | {:.3} | {:.2} | {:.2} | {:.3} | {:.2} {:.2} {:.2} |",
            none.psnr_db,
            none.ssim,
            scalar.psnr_db,
            channel.psnr_db,
            channel.ssim,
            f[0],
            f[1],
            f[2]
        );
    };
    if let Some(splat) = &scores.splat {
        row("splat, light of the photos", splat);
    }
    if let Some(capture) = &scores.capture {
        row("decomposed, its own light", capture);
    }
    for (light, of) in &scores.relit {
        row(&format!("relit: {light}"), of);
    }
    if let (Some(none), Some(scalar), Some(channel)) = (
        scores.relit_mean.get(&Align::None),
        scores.relit_mean.get(&Align::Scalar),
        scores.relit_mean.get(&Align::Channel),
    ) {
        let _ = writeln!(
            out,
            "| mean of the relit | {:.2} | {:.3} | {:.2} | {:.2} | {:.3} | |",
            none.psnr_db, none.ssim, scalar.psnr_db, channel.psnr_db, channel.ssim
        );
    }
    if let Some(materials) = &scores.materials {
        materials_table(&mut out, materials);
    }
    out.push('\n');
    for sentence in &scores.protocol {
        let _ = writeln!(out, "- {sentence}");
    }
    out
}

fn materials_table(out: &mut String, materials: &MaterialScores) {
    out.push_str("\n| pixels of | base color dB none | scalar | channel | sRGB channel | roughness MSE | mean (true) | metallic MSE | mean (true) | normal MAE deg |\n");
    out.push_str("|---|---|---|---|---|---|---|---|---|---|\n");
    let mut row = |name: &str, r: &RegionScores| {
        let db = |a: Align| r.base_color.get(&a).map_or(f64::NAN, |b| b.psnr_linear_db);
        let srgb = r.base_color.get(&Align::Channel).map_or(f64::NAN, |b| b.psnr_srgb_db);
        let _ = writeln!(
            out,
            "| {name} | {:.2} | {:.2} | {:.2} | {srgb:.2} | {:.4} | {:.2} ({:.2}) | {:.4} | {:.2} ({:.2}) | {:.2} |",
            db(Align::None),
            db(Align::Scalar),
            db(Align::Channel),
            r.roughness_mse,
            r.mean_roughness,
            r.true_roughness,
            r.metallic_mse,
            r.mean_metallic,
            r.true_metallic,
            r.normal_mae_deg
        );
    };
    row("all", &materials.all);
    row("objects", &materials.objects);
    row("support", &materials.support);
    for (name, region) in &materials.by_object {
        row(name, region);
    }
    let [objects, support] = materials.whole_normal_mae_deg;
    let _ = writeln!(
        out,
        "\nNormals over whole masks: objects {objects:.2}, support {support:.2} degrees."
    );
}
