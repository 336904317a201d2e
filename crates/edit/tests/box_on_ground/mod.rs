//! A ground, boxes on it and a sun, all known exactly.
#![allow(dead_code, reason = "every test uses a part of it")]

use edit::{EditState, SceneParts};
use glam::{DVec3, Vec3};
use motes_math::tone_curve::ToneCurve;
use motes_scene::{Gaussians, ImageF32, Materials, Surface};
use motes_shading::brdf::Lobes;
use motes_shading::environment::{Convention, MapAxes};
use relight::{
    BakeOptions, Exposure, LightSource, Place, Quality, QualityOptions, RelightScene, Relighter,
};

/// Half the side of the ground, and of the box.
pub(crate) const GROUND: f32 = 2.0;
pub(crate) const BOX: f32 = 0.2;
pub(crate) const GROUND_CELLS: usize = 64;
pub(crate) const BOX_CELLS: usize = 10;
pub(crate) const ORANGE: Vec3 = Vec3::new(0.6, 0.3, 0.1);

/// Adds a square of Gaussians and triangles; `u x v` is its normal.
pub(crate) fn add_square(
    (gaussians, materials, surface): &mut (Gaussians, Materials, Surface),
    [corner, u, v]: [Vec3; 3],
    cells: usize,
    color: Vec3,
) {
    let normal = u.cross(v).normalize();
    let rotation = glam::Quat::from_rotation_arc(Vec3::Z, normal);
    let at = |i: f32, j: f32| corner + u * (i / cells as f32) + v * (j / cells as f32);
    let first = surface.vertices.len() as u32;
    for j in 0..=cells {
        for i in 0..=cells {
            surface.vertices.push(at(i as f32, j as f32).to_array());
            surface.normals.push(normal.to_array());
            surface.base_color_linear.push(color.to_array());
            surface.roughness.push(0.9);
            surface.metallic.push(0.0);
        }
    }
    let side = 0.5 * u.length() / cells as f32;
    for j in 0..cells {
        for i in 0..cells {
            let row = cells as u32 + 1;
            let a = first + j as u32 * row + i as u32;
            surface.triangles.extend([[a, a + 1, a + row + 1], [a, a + row + 1, a + row]]);
            gaussians.means.push(at(i as f32 + 0.5, j as f32 + 0.5).to_array());
            gaussians.rotations.push([rotation.w, rotation.x, rotation.y, rotation.z]);
            gaussians.log_scales.push([side.ln(), side.ln(), (0.05 * side).ln()]);
            gaussians.opacity_logits.push(4.0);
            gaussians.sh.extend([0.0; 3]);
            materials.normals.push(normal.to_array());
            materials.base_color_linear.push(color.to_array());
            materials.roughness.push(0.9);
            materials.metallic.push(0.0);
            materials.visibility.push(1.0);
            materials.observations.push(5);
        }
    }
}

/// A ground without its hidden middle, and boxes on it with their middles at `boxes`; the surface under a box is not known,
/// unless `whole`.
pub(crate) fn geometry(boxes: &[[f32; 2]], whole: bool) -> (Gaussians, Surface) {
    let mut scene = (Gaussians::empty(0), Materials::default(), Surface::default());
    let corner = Vec3::new(-GROUND, -GROUND, 0.0);
    let gray = Vec3::splat(0.5);
    let sides = [corner, Vec3::X * 2.0 * GROUND, Vec3::Y * 2.0 * GROUND];
    add_square(&mut scene, sides, GROUND_CELLS, gray);
    if !whole {
        let under = |p: [f32; 3]| {
            boxes.iter().any(|b| (p[0] - b[0]).abs() < BOX && (p[1] - b[1]).abs() < BOX)
        };
        let (gaussians, materials, surface) = &mut scene;
        let kept: Vec<usize> =
            (0..gaussians.len()).filter(|&i| !under(gaussians.means[i])).collect();
        let rows: Vec<u32> = kept.iter().map(|&i| i as u32).collect();
        gaussians.gather(&rows);
        for columns in [&mut materials.normals, &mut materials.base_color_linear] {
            *columns = kept.iter().map(|&i| columns[i]).collect();
        }
        for column in [&mut materials.roughness, &mut materials.metallic, &mut materials.visibility]
        {
            column.truncate(kept.len());
        }
        materials.observations.truncate(kept.len());
        let vertices = surface.vertices.clone();
        surface.triangles.retain(|t| {
            let center = t.iter().map(|&v| Vec3::from(vertices[v as usize])).sum::<Vec3>() / 3.0;
            !under(center.to_array())
        });
    }
    for b in boxes {
        let [x, y] = [Vec3::X * 2.0 * BOX, Vec3::Y * 2.0 * BOX];
        let z = Vec3::Z * 2.0 * BOX;
        let low = Vec3::new(b[0] - BOX, b[1] - BOX, 0.0);
        for square in
            [[low + z, x, y], [low, x, z], [low + x, y, z], [low + x + y, -x, z], [low + y, -y, z]]
        {
            add_square(&mut scene, square, BOX_CELLS, ORANGE);
        }
    }
    let (mut gaussians, materials, surface) = scene;
    materials.attach(&mut gaussians);
    (gaussians, surface)
}

/// A gray sky and a sun of a few pixels, 45 degrees high.
pub(crate) fn environment() -> ImageF32 {
    let mut image = ImageF32::filled(64, 32, 3, 0.25);
    for (x, y) in [(40, 7), (41, 7), (40, 8), (41, 8)] {
        for c in 0..3 {
            image.data[3 * (y * 64 + x) + c] = 60.0;
        }
    }
    image
}

pub(crate) fn lit(gaussians: Gaussians, surface: Surface) -> RelightScene {
    RelightScene::new(gaussians, surface, Lobes::Lambert, true, Vec3::Z).expect("a scene")
}

/// The scene with the colors that it has under its light.
pub(crate) fn photographed(boxes: &[[f32; 2]], whole: bool) -> (Gaussians, Surface) {
    let (gaussians, surface) = geometry(boxes, whole);
    let source =
        LightSource::Map { image: environment(), axes: MapAxes::of_world(Convention::Blender) };
    let light = source
        .light(0.0, Exposure::Factor(1.0), &Place::with_up(Vec3::Z), &|| None)
        .expect("a light");
    let scene = lit(gaussians, surface.clone());
    let quality =
        QualityOptions { light_samples: Some(512), ..QualityOptions::of(Quality::Standard) };
    let lit = Relighter::new(&scene, &light.environment, &quality, 7);
    (lit.bake(&BakeOptions { sh_degree: 0, bake_directions: 8 }), surface)
}

pub(crate) fn state(boxes: &[[f32; 2]]) -> EditState {
    let (gaussians, surface) = photographed(boxes, false);
    state_of(gaussians, surface)
}

pub(crate) fn state_of(gaussians: Gaussians, surface: Surface) -> EditState {
    let parts = SceneParts {
        environment: environment(),
        axes: MapAxes::of_world(Convention::Blender),
        environment_changed: false,
        lobes: Lobes::Lambert,
        indirect: true,
        tone_curve: ToneCurve::default(),
    };
    EditState::new("test", gaussians, Some(surface), Some(parts), DVec3::Z)
}

pub(crate) fn rows_of_box(state: &EditState, at: [f32; 2]) -> Vec<u32> {
    let inside = |m: &[f32; 3]| {
        m[2] > 0.01 && (m[0] - at[0]).abs() <= 1.01 * BOX && (m[1] - at[1]).abs() <= 1.01 * BOX
    };
    (0..state.len() as u32).filter(|i| inside(&state.gaussians.means[*i as usize])).collect()
}

/// Encoded red of the ground at its nearest Gaussian.
pub(crate) fn ground(gaussians: &Gaussians, at: [f32; 2]) -> f32 {
    let distance = |m: &[f32; 3]| (m[0] - at[0]).hypot(m[1] - at[1]) + 100.0 * m[2].abs();
    let nearest = (0..gaussians.len())
        .min_by(|a, b| distance(&gaussians.means[*a]).total_cmp(&distance(&gaussians.means[*b])));
    0.5 + 0.282_094_8 * gaussians.sh[3 * nearest.expect("Gaussians")]
}

/// Root mean square error of the ground against `truth`, on a lattice.
pub(crate) fn error(edited: &Gaussians, truth: &Gaussians, keep: impl Fn([f32; 2]) -> bool) -> f32 {
    let lattice = (0..40).flat_map(|j| (0..40).map(move |i| [i, j]));
    let points: Vec<[f32; 2]> =
        lattice.map(|p| p.map(|v| (v as f32 - 19.5) * 0.04)).filter(|p| keep(*p)).collect();
    let squares: f32 =
        points.iter().map(|p| (ground(edited, *p) - ground(truth, *p)).powi(2)).sum();
    (squares / points.len() as f32).sqrt()
}
