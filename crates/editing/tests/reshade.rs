//! Shadows follow what casts them: a ground, a box and a sun that are known exactly.

use glam::{DVec3, Vec3};
use motes_editing::ops::decimate::decimate;
use motes_editing::reshade::{ReshadeError, ReshadeOptions, ReshadeReport, moved_surface, reshade};
use motes_editing::{EditState, Fill, SceneParts, Similarity};
use motes_relighting::{
    BakeOptions, Exposure, LightSource, Quality, QualityOptions, RelightScene, Relighter,
};
use motes_scene::{Gaussians, ImageF32, Materials, Surface};
use motes_shading::brdf::Lobes;
use motes_shading::environment::Convention;

/// Half the side of the ground, and of the box.
const GROUND: f32 = 2.0;
const BOX: f32 = 0.2;
const GROUND_CELLS: usize = 64;
const BOX_CELLS: usize = 10;
const ORANGE: Vec3 = Vec3::new(0.6, 0.3, 0.1);

/// Adds a square of Gaussians and triangles; `u x v` is its normal.
fn add_square(
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
fn geometry(boxes: &[[f32; 2]], whole: bool) -> (Gaussians, Surface) {
    let mut scene = (Gaussians::empty(0), Materials::default(), Surface::default());
    let corner = Vec3::new(-GROUND, -GROUND, 0.0);
    let grey = Vec3::splat(0.5);
    let sides = [corner, Vec3::X * 2.0 * GROUND, Vec3::Y * 2.0 * GROUND];
    add_square(&mut scene, sides, GROUND_CELLS, grey);
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

/// A grey sky and a sun of a few pixels, 45 degrees high.
fn environment() -> ImageF32 {
    let mut image = ImageF32::filled(64, 32, 3, 0.25);
    for (x, y) in [(40, 7), (41, 7), (40, 8), (41, 8)] {
        for c in 0..3 {
            image.data[3 * (y * 64 + x) + c] = 60.0;
        }
    }
    image
}

fn lit(gaussians: Gaussians, surface: Surface) -> RelightScene {
    RelightScene::new(gaussians, surface, Lobes::Lambert, true, Vec3::Z).expect("a scene")
}

/// The scene with the colours that it has under its light.
fn photographed(boxes: &[[f32; 2]], whole: bool) -> (Gaussians, Surface) {
    let (gaussians, surface) = geometry(boxes, whole);
    let source = LightSource::Map { image: environment(), convention: Convention::Blender };
    let light = source.light(0.0, Exposure::Factor(1.0), Vec3::Z, &|| None).expect("a light");
    let scene = lit(gaussians, surface.clone());
    let quality =
        QualityOptions { light_samples: Some(512), ..QualityOptions::of(Quality::Standard) };
    let lit = Relighter::new(&scene, &light.environment, &quality, 7);
    (lit.bake(&BakeOptions { sh_degree: 0, bake_directions: 8 }), surface)
}

fn state(boxes: &[[f32; 2]]) -> EditState {
    let (gaussians, surface) = photographed(boxes, false);
    state_of(gaussians, surface)
}

fn state_of(gaussians: Gaussians, surface: Surface) -> EditState {
    let parts = SceneParts {
        environment: environment(),
        convention: Convention::Blender,
        environment_changed: false,
        lobes: Lobes::Lambert,
        indirect: true,
    };
    EditState::new("test", gaussians, Some(surface), Some(parts), DVec3::Z)
}

fn rows_of_box(state: &EditState, at: [f32; 2]) -> Vec<u32> {
    let inside = |m: &[f32; 3]| {
        m[2] > 0.01 && (m[0] - at[0]).abs() <= 1.01 * BOX && (m[1] - at[1]).abs() <= 1.01 * BOX
    };
    (0..state.len() as u32).filter(|i| inside(&state.gaussians.means[*i as usize])).collect()
}

/// Encoded red of the ground at its nearest Gaussian.
fn ground(gaussians: &Gaussians, at: [f32; 2]) -> f32 {
    let distance = |m: &[f32; 3]| (m[0] - at[0]).hypot(m[1] - at[1]) + 100.0 * m[2].abs();
    let nearest = (0..gaussians.len())
        .min_by(|a, b| distance(&gaussians.means[*a]).total_cmp(&distance(&gaussians.means[*b])));
    0.5 + 0.282_094_8 * gaussians.sh[3 * nearest.expect("Gaussians")]
}

/// Root mean square error of the ground against `truth`, on a lattice.
fn error(edited: &Gaussians, truth: &Gaussians, keep: impl Fn([f32; 2]) -> bool) -> f32 {
    let lattice = (0..40).flat_map(|j| (0..40).map(move |i| [i, j]));
    let points: Vec<[f32; 2]> =
        lattice.map(|p| p.map(|v| (v as f32 - 19.5) * 0.04)).filter(|p| keep(*p)).collect();
    let squares: f32 =
        points.iter().map(|p| (ground(edited, *p) - ground(truth, *p)).powi(2)).sum();
    (squares / points.len() as f32).sqrt()
}

fn run(state: &mut EditState) -> (Surface, ReshadeReport) {
    reshade(state, &ReshadeOptions::default()).expect("light follows")
}

#[test]
fn a_shadow_goes_with_its_box_and_the_ground_closes() {
    let mut state = state(&[[0.0, 0.0]]);
    let before = state.gaussians.clone();
    let (truth, _) = photographed(&[], true);
    let rows = rows_of_box(&state, [0.0, 0.0]);
    assert_eq!(rows.len(), 5 * BOX_CELLS * BOX_CELLS);
    state.remove(&rows, Fill::Plane);
    let (surface, report) = run(&mut state);
    let shadow = error(&before, &truth, |_| true);
    let left = error(&state.gaussians, &truth, |_| true);
    assert!(left < 0.2 * shadow, "{left} of {shadow}, {report:?}");
    let under = error(&state.gaussians, &truth, |p| p.iter().all(|v| v.abs() < BOX));
    assert!(under < 0.03, "under the box: {under}, {report:?}");
    assert!(report.filled > 20 && report.warnings.is_empty(), "{report:?}");
    assert!(surface.is_consistent() && surface.has_materials());
    let highest = surface.vertices.iter().map(|v| v[2]).fold(0.0, f32::max);
    assert!(highest < 0.02, "no triangle of the box is left: {highest}");
}

#[test]
fn ground_that_nobody_saw_is_replaced_although_the_surface_goes_on() {
    // The sheet continues under the box; what the splat holds there, and below it, is red.
    let red = |p: &[f32; 3]| p[0].abs() < BOX && p[1].abs() < BOX && p[2] < 0.5 * BOX;
    let (mut gaussians, surface) = photographed(&[[0.0, 0.0]], true);
    let hidden: Vec<u32> = (0..gaussians.len() as u32)
        .filter(|&i| {
            let m = gaussians.means[i as usize];
            m[2].abs() < 1e-3 && red(&m)
        })
        .collect();
    let mut junk = gaussians.clone();
    junk.gather(&hidden);
    junk.means.iter_mut().enumerate().for_each(|(i, m)| m[2] = [-0.05, 0.1][i % 2]);
    for &i in &hidden {
        gaussians.sh[3 * i as usize..][..3].copy_from_slice(&[1.5, -1.5, -1.5]);
    }
    let n = gaussians.len();
    gaussians.means.extend(&junk.means);
    gaussians.rotations.extend(&junk.rotations);
    gaussians.log_scales.extend(&junk.log_scales);
    gaussians.opacity_logits.extend(&junk.opacity_logits);
    gaussians.sh.extend(vec![1.5; junk.sh.len()]);
    for (column, more) in gaussians.extra.iter_mut().zip(&mut junk.extra) {
        column.values.append(&mut more.values);
    }
    let mut state = state_of(gaussians, surface);
    let rows = rows_of_box(&state, [0.0, 0.0]);
    let rows: Vec<u32> = rows.into_iter().filter(|&i| (i as usize) < n).collect();
    state.remove(&rows, Fill::Plane);
    let (surface, report) = run(&mut state);
    assert!(report.leftovers >= 2 * hidden.len() * 3 / 4, "{report:?} of {}", hidden.len());
    let (truth, _) = photographed(&[], true);
    let under = error(&state.gaussians, &truth, |p| p.iter().all(|v| v.abs() < BOX));
    assert!(under < 0.03, "under the box: {under}, {report:?}");
    let inside = state.gaussians.means.iter().filter(|m| red(m) && m[2].abs() > 0.02).count();
    assert!(inside == 0, "{inside} are left in the air or below");
    assert!(surface.vertices.iter().all(|v| v[2].abs() < 0.02), "the box is gone");
}

#[test]
fn a_moved_box_takes_its_shadow_along_and_nothing_far_changes() {
    let mut state = state(&[[0.0, 0.0]]);
    let (truth, _) = photographed(&[[0.5, 0.25]], true);
    let before = state.gaussians.clone();
    let rows = rows_of_box(&state, [0.0, 0.0]);
    let shift = DVec3::new(0.5, 0.25, 0.0);
    for &i in &rows {
        let mean = &mut state.gaussians.means[i as usize];
        *mean = (Vec3::from(*mean) + shift.as_vec3()).to_array();
    }
    state.note_motion(&rows, &Similarity::translation(shift));
    let (_, report) = run(&mut state);
    let seen = |p: [f32; 2]| (p[0] - 0.5).abs() > 1.3 * BOX || (p[1] - 0.25).abs() > 1.3 * BOX;
    let wrong = error(&before, &truth, seen);
    let left = error(&state.gaussians, &truth, seen);
    assert!(left < 0.3 * wrong, "{left} of {wrong}, {report:?}");
    let far = [-1.9, -1.9];
    assert_eq!(ground(&before, far).to_bits(), ground(&state.gaussians, far).to_bits());
}

#[test]
fn the_surface_of_a_box_goes_with_it_when_it_was_decimated_and_when_light_stays() {
    let mut state = state(&[[0.0, 0.0]]);
    let rows = rows_of_box(&state, [0.0, 0.0]);
    decimate(&mut state, &rows, rows.len() / 4);
    let rows = rows_of_box(&state, [0.0, 0.0]);
    state.remove(&rows, Fill::None);
    let high = |surface: &Surface| surface.vertices.iter().filter(|v| v[2] > 0.1).count();
    let before = state.sources[0].surface.as_deref().map(high).expect("a surface");
    assert!(before > 400, "{before}");
    let surface = moved_surface(&state);
    assert!(surface.is_consistent() && surface.has_materials());
    assert_eq!(high(&surface), 0, "of {before}");
    assert_eq!(high(&run(&mut state).0), 0, "of {before}");
}

#[test]
fn a_piece_of_the_ground_can_fill_it_and_threads_do_not_matter() {
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| {
            let mut state = state(&[[0.0, 0.0]]);
            let rows = rows_of_box(&state, [0.0, 0.0]);
            state.remove(&rows, Fill::Patch);
            let (surface, report) = run(&mut state);
            (state.gaussians, surface, report)
        })
    };
    let (gaussians, surface, report) = run(1);
    let (truth, _) = photographed(&[], true);
    let under = error(&gaussians, &truth, |p| p.iter().all(|v| v.abs() < BOX));
    assert!(under < 0.05 && report.filled > 20, "{under}, {report:?}");
    assert!(report.warnings.is_empty(), "{report:?}");
    assert!(run(3) == (gaussians, surface, report), "one thread or three");
}

#[test]
fn nothing_changes_where_nothing_was_edited() {
    let mut state = state(&[[0.0, 0.0]]);
    let before = state.gaussians.clone();
    let (_, report) = run(&mut state);
    assert_eq!((report.scaled, report.shaded, report.filled), (0, 0, 0));
    assert_eq!(state.gaussians, before);
}

#[test]
fn another_environment_lights_all_and_a_splat_has_none() {
    let mut state = state(&[[0.0, 0.0]]);
    let parts = state.parts.as_mut().expect("parts");
    parts.environment = ImageF32::filled(4, 2, 3, 0.0);
    parts.environment_changed = true;
    let (_, report) = run(&mut state);
    assert_eq!(report.shaded, state.len());
    assert!(ground(&state.gaussians, [1.0, 1.0]) < 0.01, "no light");
    state.parts = None;
    let error = reshade(&mut state, &ReshadeOptions::default());
    assert_eq!(error.map(|_| ()), Err(ReshadeError::NoScene));
}
