//! Materials of the Gaussians, taken over from the vertices nearest to them.

use glam::Vec3;
use motes_math::srgb::decode;
use motes_scene::{LAMP_BASE_COLOR, Materials};
use motes_shading::frame::Frame;
use motes_shading::sampling::{PointSet, unit_f32};
use motes_shading::tracing::{Ray, Tracer, offset_origin};
use rayon::prelude::*;

use crate::observation::TracedSurface;
use crate::state::State;
use crate::steps::base_color::{colors_of, nearest_vertices};

const LAMP: [f32; 3] = [LAMP_BASE_COLOR; 3];

/// Gives every Gaussian its material.
pub fn run(state: &mut State<'_>) {
    let emission = state.illumination.emission();
    let is_lamp = |v: usize| emission.get(v).is_some_and(|e| *e != Vec3::ZERO);
    let base_colors = state.observed.scene.surface.base_color_linear.iter_mut().enumerate();
    base_colors.filter(|(v, _)| is_lamp(*v)).for_each(|(_, color)| *color = LAMP);
    let (scene, surface) = (&state.observed.scene, state.surface());
    let nearest = nearest_vertices(surface, state.gaussians());
    let visibility = vertex_visibility(scene, state.ray_bias(), state.inputs.seed);
    let colors = colors_of(&state.base_colored.gaussians);
    let colors = colors.iter().zip(&nearest).map(|(color, nearest)| match nearest {
        Some(v) if is_lamp(*v) => LAMP,
        _ => color.map(decode).to_array(),
    });
    state.attributes = Materials {
        normals: per_gaussian(&nearest, |v| surface.normals[v], [0.0, 0.0, 1.0]),
        base_color_linear: colors.collect(),
        roughness: per_gaussian(&nearest, |v| surface.roughness[v], 1.0),
        metallic: per_gaussian(&nearest, |v| surface.metallic[v], 0.0),
        visibility: per_gaussian(&nearest, |v| visibility[v], 1.0),
        observations: state.base_colored.observations.clone(),
    };
}

/// What Gaussians take over from their nearest vertices.
fn per_gaussian<T: Copy>(
    nearest: &[Option<usize>],
    of: impl Fn(usize) -> T,
    otherwise: T,
) -> Vec<T> {
    nearest.iter().map(|v| v.map_or(otherwise, &of)).collect()
}

/// Cosine-weighted share of the hemisphere over every vertex that is open.
fn vertex_visibility(scene: &TracedSurface, bias: f32, seed: u64) -> Vec<f32> {
    const RAYS: u32 = 32;
    const PURPOSE: u32 = 43;
    let surface = &scene.surface;
    (0..surface.vertices.len())
        .into_par_iter()
        .map(|v| {
            let n = Vec3::from(surface.normals[v]);
            let (frame, points) =
                (Frame::from_normal(n), PointSet::new(seed, v as u64, PURPOSE, RAYS));
            let open = (0..RAYS).filter(|&k| {
                let u = points.point(k).map(unit_f32);
                let (r, phi) = (u[1].sqrt(), std::f32::consts::TAU * u[2]);
                let w = frame.world_from_local(Vec3::new(
                    r * phi.cos(),
                    r * phi.sin(),
                    (1.0 - u[1]).sqrt(),
                ));
                let origin = offset_origin(Vec3::from(surface.vertices[v]), n, w, bias);
                !scene.tracer.occluded(&Ray::new(origin, w))
            });
            open.count() as f32 / RAYS as f32
        })
        .collect()
}
