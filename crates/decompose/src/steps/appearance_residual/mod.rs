//! Appearance residual: what the model leaves unexplained of the photos, against the pictures that relighting makes of it.

mod fit;
mod options;
mod pictures;

use motes_math::srgb;
use motes_raster::{RenderOptions, render};
use motes_scene::{Gaussians, Residual};

use crate::error::DecomposeError;
use crate::progress::Tick;
use crate::report::{Term, numbers};
use crate::state::State;
use fit::{ResidualOptions, ResidualView, fit_residual};
use pictures::{Picture, pictures};

pub use options::Options;

/// Shades every photo's view under its own light as relighting does, and fits the residual. Nothing is told without steps.
///
/// # Errors
/// A scene that cannot be lit, or what `tick` says.
pub fn run(
    state: &mut State<'_>,
    options: &Options,
    tick: &mut Tick<'_>,
) -> Result<Option<Term>, DecomposeError> {
    let inputs = state.inputs;
    let Some(light) = state.light_map(0).filter(|_| options.residual_steps > 0) else {
        return Ok(None);
    };
    let mut gaussians = state.gaussians().clone();
    state.attributes.attach(&mut gaussians);
    let quality = options.residual_quality;
    let pictures = pictures(state, &gaussians, light, quality, &mut |done| tick(0.5 * done))?;
    let views: Vec<ResidualView<'_>> = pictures.iter().map(Picture::view).collect();
    let antialias = inputs.render.antialias;
    let render = RenderOptions { antialias, ..RenderOptions::default() };
    let (degree, steps) = (options.residual_degree, options.residual_steps);
    let fit = ResidualOptions { degree, steps, seed: inputs.seed };
    let residual = fit_residual(&gaussians, &views, &render, &fit, |done| tick(0.5 + 0.5 * done))?;
    let term = term(&gaussians, &residual, &views, &render);
    state.residual = Some(residual);
    Ok(Some(term))
}

/// PSNR of the views without and with the residual, dB.
fn psnr_db(
    gaussians: &Gaussians,
    residual: &Residual,
    views: &[ResidualView<'_>],
    options: &RenderOptions,
) -> [Option<f64>; 2] {
    let drawn = residual.drawn(gaussians);
    let (mut without, mut with, mut count) = (0.0, 0.0, 0.0);
    for view in views {
        let ratios = render(&drawn, &view.camera, &view.camera_from_world, options);
        for (k, model) in view.model_linear.iter().map(|m| m.to_f32()).enumerate() {
            if !(view.usable[k / 3] && model > 0.0) {
                continue;
            }
            let log_ratio = Residual::log_ratio(ratios.color.data[k], ratios.alpha.data[k / 3]);
            let seen = srgb::encode_clipped(view.photo_linear.at(k / 3)[k % 3]);
            without += f64::from(srgb::encode_clipped(model) - seen).powi(2);
            with += f64::from(srgb::encode_clipped(model * log_ratio.exp()) - seen).powi(2);
            count += 1.0;
        }
    }
    [without, with].map(|sum: f64| (count > 0.0).then(|| -10.0 * (sum / count).max(1e-12).log10()))
}

fn term(
    gaussians: &Gaussians,
    residual: &Residual,
    views: &[ResidualView<'_>],
    options: &RenderOptions,
) -> Term {
    let [without, with] = psnr_db(gaussians, residual, views, options);
    let text = |db: Option<f64>| db.map_or("none".into(), |db| format!("{db:.2}"));
    Term {
        name: "residual".into(),
        kept: true,
        evidence: format!(
            "a factor of degree {} on the model's pictures brings training views from {} to {} dB",
            residual.degree,
            text(without),
            text(with)
        ),
        numbers: numbers([
            ("psnr_db_without", without),
            ("psnr_db", with),
            ("degree", Some(f64::from(residual.degree))),
        ]),
    }
}
