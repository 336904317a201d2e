//! Previews of some views in the scene folder.

use std::path::Path;

use crate::State;
use crate::steps::evaluation::Picture;
use anyhow::Context as _;
use motes_formats::images::write_png;
use motes_math::srgb;
use motes_scene::{Gaussians, ImageF32, told_apart};

/// `previews/VIEW_COMPONENT.png` of `count` views, and the light.
///
/// # Errors
/// When a file cannot be written.
pub(super) fn previews(
    folder: &Path,
    count: usize,
    state: &State<'_>,
    gaussians: &Gaussians,
    map: Option<&ImageF32>,
) -> anyhow::Result<()> {
    if count == 0 || state.views.is_empty() {
        return Ok(());
    }
    let path = folder.join("previews");
    std::fs::create_dir_all(&path).with_context(|| format!("cannot make {}", path.display()))?;
    let photos: Vec<_> = state.inputs.photos.iter().chain(state.inputs.held_out).collect();
    let shown: Vec<_> = state.views.iter().step_by(state.views.len().div_ceil(count)).collect();
    let stem =
        |name: &str| Path::new(name).with_extension("").to_string_lossy().replace(['/', '\\'], "_");
    let stems = told_apart(shown.iter().map(|v| stem(&photos[v.photo].name)).collect());
    for (view, stem) in shown.into_iter().zip(stems) {
        let photo = photos[view.photo];
        let Some(picture) = Picture::of_photo(state, view.photo) else { continue };
        let attribute = |of: &dyn Fn(usize) -> [f32; 3]| {
            motes_raster::render(
                &gaussians.colored(of),
                &photo.camera,
                &photo.camera_from_world,
                &Default::default(),
            )
            .color
        };
        let m = &state.attributes;
        let components = [
            ("photo", encoded(&photo.radiance_linear.image())),
            ("rendered", encoded(&picture.radiance_linear)),
            ("base_color", encoded(&picture.base_color_linear)),
            ("normal", attribute(&|i| m.normals[i].map(|v| 0.5 * v + 0.5))),
            ("roughness", attribute(&|i| [m.roughness[i]; 3])),
            ("metallic", attribute(&|i| [m.metallic[i]; 3])),
            ("visibility", attribute(&|i| [m.visibility[i]; 3])),
            ("confidence", attribute(&|i| [state.confidence.get(i).copied().unwrap_or(0.0); 3])),
        ];
        for (name, image) in components {
            write_png(&path.join(format!("{stem}_{name}.png")), &image.to_u8())?;
        }
    }
    if let Some(map) = map {
        // Exposed for the mean: a sun is white in it.
        let mean = map.data.iter().sum::<f32>() / map.data.len().max(1) as f32;
        let exposed = map.clone().scaled(0.5 / mean.max(1e-6));
        write_png(&path.join("environment.png"), &encoded(&exposed).to_u8())?;
    }
    Ok(())
}

fn encoded(linear: &ImageF32) -> ImageF32 {
    let mut image = linear.clone();
    image.data.iter_mut().for_each(|v| *v = srgb::encode_clipped(*v));
    image
}
