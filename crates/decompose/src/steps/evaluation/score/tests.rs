use glam::Vec3;
use motes_raster::RenderOptions;
use motes_scene::{Gaussians, Pinhole, Pose};

use super::*;
use crate::appearance::ModelOptions;
use crate::observation::{PixelHit, ViewRays};
use crate::state::Known;
use crate::toy_ball::light_of;

const SIZE: [usize; 2] = [8, 6];
const LIGHT: f32 = 0.3;
/// What no error is.
const EQUAL_DB: f64 = 70.0;

/// A Gaussian that covers the left half of the picture.
fn left_half() -> Gaussians {
    let mut g = Gaussians::empty(0);
    g.means.push([-0.5, 0.0, 2.0]);
    g.rotations.push([1.0, 0.0, 0.0, 0.0]);
    g.log_scales.push([0.427f32.ln(), 5.0f32.ln(), 0.01f32.ln()]);
    g.opacity_logits.push(9.0);
    g.sh.extend([0.0; 3]);
    g
}

fn is_left(i: usize) -> bool {
    i % SIZE[0] < SIZE[0] / 2
}

fn image(channels: usize, of: impl Fn(usize) -> f32) -> ImageF32 {
    let data = (0..SIZE[0] * SIZE[1] * channels).map(|k| of(k / channels)).collect();
    ImageF32::from_data(SIZE[0], SIZE[1], channels, data)
}

fn photo(radiance: impl Fn(usize) -> f32) -> Photo {
    let (width, height) = (SIZE[0], SIZE[1]);
    Photo {
        name: "photo".into(),
        camera: Pinhole { fx: 8.0, fy: 8.0, cx: 4.0, cy: 3.0, width, height },
        camera_from_world: Pose::IDENTITY,
        radiance_linear: image(3, radiance).into(),
        gain: [1.0; 3],
        light: 0,
        usable: vec![true; width * height],
        clipped: Vec::new(),
    }
}

/// Of a photo whose pixels meet the mesh where `is_hit` says, and of which the model shows `model` there.
fn psnr_db(
    photo: &Photo,
    model: impl Fn(usize) -> f32,
    is_hit: impl Fn(usize) -> bool,
    training: &[Photo],
    is_held_out: bool,
) -> f64 {
    let triangle = |i| if is_hit(i) { 0 } else { PixelHit::MISS };
    let hit = |i| PixelHit::new(triangle(i), [0.0; 2], 2.0);
    let hits = (0..SIZE[0] * SIZE[1]).map(hit).collect();
    let view = SeenView { photo, rays: ViewRays::new(photo), hits };
    let inputs = Inputs {
        gaussians: &left_half(),
        photos: training,
        held_out: &[],
        known: &Known::default(),
        render: RenderOptions::default(),
        model: &ModelOptions::default(),
        seed: 0,
    };
    let light = light_of([16, 8], |_| Vec3::splat(LIGHT));
    let picture = image(3, |i| if is_hit(i) { model(i) } else { 0.0 });
    super::score(&inputs, Some(&light), &view, &picture, is_held_out).psnr_db
}

#[test]
fn a_hole_of_the_mesh_counts_as_the_light_behind_it() {
    let matter = photo(|_| 0.6);
    let whole = psnr_db(&matter, |_| 0.6, |_| true, &[], false);
    let torn = psnr_db(&matter, |_| 0.6, |i| i % 2 == 0, &[], false);
    assert!(whole > EQUAL_DB && torn < 20.0, "{whole} {torn}");
    // What is bad does not become better by being left out.
    let bad = psnr_db(&matter, |_| LIGHT, |_| true, &[], false);
    let missed = psnr_db(&matter, |_| LIGHT, |_| false, &[], false);
    assert!((bad - missed).abs() < 1e-3, "{bad} {missed}");
    assert!(psnr_db(&photo(|_| LIGHT), |_| 0.6, |_| false, &[], false) > EQUAL_DB);
}

#[test]
fn only_what_the_gaussians_cover_and_no_mask_hides_counts() {
    let mut half = photo(|i| if is_left(i) { 0.5 } else { 0.01 });
    let pixel = 2 * half.camera.width + 1;
    half.radiance_linear.floats_mut()[pixel] = [0.9; 3];
    let with = psnr_db(&half, |_| 0.5, |_| true, &[], false);
    half.usable[pixel] = false;
    let without = psnr_db(&half, |_| 0.5, |_| true, &[], false);
    assert!(with < 30.0 && without > EQUAL_DB, "{with} {without}");
    half.usable.fill(false);
    assert!(psnr_db(&half, |_| 0.5, |_| true, &[], false).is_nan());
}

#[test]
fn a_held_out_photo_has_a_gain_where_training_photos_have() {
    let exposed = [photo(|_| 0.5), Photo { gain: [0.8; 3], ..photo(|_| 0.5) }];
    let level = |i: usize| 0.1 + 0.01 * i as f32;
    let mut darker = photo(|i| 0.5 * level(i));
    for pixel in darker.radiance_linear.floats_mut() {
        pixel[2] *= 1.2;
    }
    let of = |training: &[Photo], held_out| {
        // A highlight that the photo does not have.
        psnr_db(&darker, |i| if i == 9 { 900.0 } else { level(i) }, |_| true, training, held_out)
    };
    let highlight_alone = -10.0 * (1.0 - f64::from(encode_clipped(0.5 * level(9)))).powi(2).log10();
    assert!(of(&exposed, true) > highlight_alone + 10.0, "{}", of(&exposed, true));
    let plain = of(&[photo(|_| 0.5)], true);
    assert!(plain < of(&exposed, true) - 1.0, "{plain}");
    assert_eq!(of(&exposed, false), plain);
    let black = psnr_db(&darker, |_| 0.0, |_| true, &exposed, true);
    assert!(black.is_finite(), "{black}");
}
