//! Base color: the photos divided by their shading, brought to the vertices and into the Gaussians.

mod gaussian_colors;
mod options;
mod vertices;

use glam::Vec3;
use motes_math::srgb::encode;

use crate::appearance::vertex_materials::vertex_materials;
use crate::observation::Observed;
use crate::state::{BaseColored, State};
use gaussian_colors::FittedColors;
use vertices::vertex_base_color;

pub(crate) use gaussian_colors::{ColorTarget, colors_of, fit_colors};
pub use options::Options;
pub(crate) use vertices::nearest_vertices;

/// Gives the surface its material and every Gaussian one base color.
pub fn run(state: &mut State<'_>, options: &Options) {
    let inputs = state.inputs;
    let Observed { scene, views, samples, .. } = &state.observed;
    let found = &state.illumination.materials;
    let targets: Vec<ColorTarget> = views
        .iter()
        .zip(&state.shading)
        .map(|(view, shading)| {
            let (color, weight) = shading.base_color(view);
            let (camera, camera_from_world) = (view.photo.camera, view.photo.camera_from_world);
            ColorTarget { camera, camera_from_world, color, weight }
        })
        .collect();
    let base = vertex_base_color(scene, views, &targets, found);
    let nearest = nearest_vertices(&scene.surface, inputs.gaussians);
    let typical = Vec3::splat(inputs.model.typical_base_color);
    let start: Vec<Vec3> =
        nearest.iter().map(|v| v.map_or(typical, |v| base[v]).map(encode)).collect();
    let FittedColors { colors, observations } =
        fit_colors(inputs.gaussians, &targets, &start, options.color_passes, &inputs.render);
    let materials = vertex_materials(scene, samples, found);
    let surface = &mut state.observed.scene.surface;
    surface.base_color_linear = base.iter().map(Vec3::to_array).collect();
    surface.roughness = materials.roughness;
    surface.metallic = materials.metallic;
    let gaussians = inputs.gaussians.colored(|i| colors[i].to_array());
    state.base_colored = BaseColored { gaussians, observations };
}
