//! Posed photos of made scenes, one for each way that people take photos. They come without points.

use std::path::Path;

use glam::{DVec3, Quat, Vec3};
use motes_formats::capture::write_capture;
use motes_formats::images::write_png;
use motes_raster::{RenderOptions, render};
use motes_scene::{Camera, Capture, Gaussians, ImageU8, Pinhole, Pose, SparsePoints, Split, View};

/// One made photo.
#[derive(Clone, Debug)]
pub struct MadePhoto {
    /// Name of the view.
    pub name: String,
    /// Intrinsics.
    pub camera: Pinhole,
    /// Pose.
    pub camera_from_world: Pose,
    /// RGB, or RGBA where there is nothing behind the object.
    pub image: ImageU8,
}

/// Width of a made photo, pixels.
const WIDTH: usize = 144;
/// Height of a made photo, pixels.
const HEIGHT: usize = 112;

/// `views` photos from rings of three heights around a painted ball and a box, on transparent
/// ground.
pub fn ring_around_object(views: usize) -> Vec<MadePhoto> {
    let eyes = (0..views).map(|i| {
        let angle = 2.399_963 * i as f64;
        let height = [0.3, 1.3, 2.4][i % 3];
        DVec3::new(3.6 * angle.cos(), 3.6 * angle.sin(), height)
    });
    photos(&object(), eyes.map(|eye| (eye, DVec3::ZERO)), true)
}

/// `views` photos from rings around the object on a painted floor, a far painted wall all around.
pub fn ring_in_surroundings(views: usize) -> Vec<MadePhoto> {
    let mut scene = object();
    append(&mut scene, floor(5.0, 0.16));
    append(&mut scene, wall(24.0, 7.0));
    let eyes = (0..views).map(|i| {
        let angle = std::f64::consts::TAU * i as f64 / views as f64;
        DVec3::new(3.4 * angle.cos(), 3.4 * angle.sin(), [0.8, 1.4][i % 2])
    });
    photos(&scene, eyes.map(|eye| (eye, DVec3::new(0.0, 0.0, -0.1))), false)
}

/// `views` photos from a small grid of places that all look the same way, at painted boards at three
/// depths.
pub fn forward_facing(views: usize) -> Vec<MadePhoto> {
    let mut scene = board(DVec3::new(0.0, 9.0, 0.0), 9.0, 0.28);
    append(&mut scene, board(DVec3::new(-1.1, 5.0, -0.4), 1.1, 0.12));
    append(&mut scene, board(DVec3::new(1.2, 6.5, 0.7), 1.2, 0.14));
    let columns = (views as f64).sqrt().ceil() as usize;
    let eyes = (0..views).map(|i| {
        let step = |k: usize| 1.2 * ((k as f64 + 0.5) / columns as f64 - 0.5);
        DVec3::new(step(i % columns), 0.1 * step(i), step(i / columns))
    });
    photos(&scene, eyes.map(|eye| (eye, eye + DVec3::Y)), false)
}

/// `views` photos of a walk along a painted wall with things before it, looking ahead and sideways.
pub fn walk(views: usize) -> Vec<MadePhoto> {
    let mut scene = Gaussians::empty(0);
    for i in 0..4 {
        append(&mut scene, board(DVec3::new(3.0 * f64::from(i) - 1.0, 4.0, 0.0), 1.6, 0.14));
        let beside = DVec3::new(3.0 * f64::from(i) + 0.4, 3.0, -0.5);
        append(&mut scene, board(beside, 0.5, 0.09));
    }
    append(&mut scene, floor(12.0, 0.3));
    let places = (0..views).map(|i| {
        let t = i as f64 / views.max(2) as f64;
        let eye = DVec3::new(8.0 * t, 0.15 * (9.0 * t).sin(), 0.2 + 0.1 * (14.0 * t).cos());
        (eye, eye + DVec3::new(0.35 * (5.0 * t).sin(), 1.0, -0.1))
    });
    photos(&scene, places, false)
}

/// The photos with their pictures moved on to other poses: every pose shows another place.
pub fn shuffled(mut photos: Vec<MadePhoto>) -> Vec<MadePhoto> {
    let n = photos.len();
    let images: Vec<ImageU8> = photos.iter().map(|photo| photo.image.clone()).collect();
    // A stride without a common divisor visits every photo once, none in its own place.
    let stride = (n / 3..n).find(|s| gcd(*s, n) == 1).unwrap_or(1);
    for (i, photo) in photos.iter_mut().enumerate() {
        photo.image = images[(i * stride + n / 2) % n].clone();
    }
    photos
}

fn gcd(a: usize, b: usize) -> usize {
    if b == 0 { a } else { gcd(b, a % b) }
}

/// The photos, each of one color.
pub fn blank(mut photos: Vec<MadePhoto>) -> Vec<MadePhoto> {
    for photo in &mut photos {
        photo.image = ImageU8::filled(photo.image.width, photo.image.height, 3, 120);
    }
    photos
}

/// Writes the photos as `folder/capture.json` without points; every eighth is held out.
///
/// # Errors
/// When a file cannot be written.
pub fn write(folder: &Path, photos: &[MadePhoto]) -> motes_formats::Result<()> {
    let mut capture = Capture {
        cameras: photos.iter().take(1).map(|photo| Camera::from_pinhole(photo.camera)).collect(),
        views: Vec::new(),
        points: SparsePoints::default(),
        world_origin: DVec3::ZERO,
        exposure_response: None,
    };
    for (i, photo) in photos.iter().enumerate() {
        let image = format!("{i:03}.png");
        write_png(&folder.join(&image), &photo.image)?;
        capture.views.push(View {
            name: photo.name.clone(),
            camera: 0,
            camera_from_world: photo.camera_from_world,
            image: image.into(),
            mask: None,
            split: if i % 8 == 4 { Split::Test } else { Split::Train },
            exposure_stops: None,
        });
    }
    write_capture(&folder.join("capture.json"), &capture)
}

fn photos(
    scene: &Gaussians,
    places: impl Iterator<Item = (DVec3, DVec3)>,
    transparent: bool,
) -> Vec<MadePhoto> {
    let (width, height) = (WIDTH, HEIGHT);
    let camera = Pinhole {
        fx: 1.1 * width as f64,
        fy: 1.1 * width as f64,
        cx: 0.5 * width as f64,
        cy: 0.5 * height as f64,
        width,
        height,
    };
    let photo = |(i, (eye, target)): (usize, (DVec3, DVec3))| {
        let camera_from_world = Pose::look_at(eye, target, DVec3::Z).unwrap_or(Pose::IDENTITY);
        let picture = render(scene, &camera, &camera_from_world, &RenderOptions::default());
        let rgb = picture.color.to_u8();
        let image = match transparent {
            true => with_alpha(&rgb, &picture.alpha.to_u8()),
            false => rgb,
        };
        MadePhoto { name: format!("photo {i:03}"), camera, camera_from_world, image }
    };
    places.enumerate().map(photo).collect()
}

/// Straight colors of a picture over black, and its opacity.
fn with_alpha(rgb: &ImageU8, alpha: &ImageU8) -> ImageU8 {
    let pixels = rgb.data.chunks_exact(3).zip(&alpha.data).flat_map(|(p, &a)| {
        let straight = |v: u8| (u32::from(v) * 255 / u32::from(a.max(1))).min(255) as u8;
        [straight(p[0]), straight(p[1]), straight(p[2]), a]
    });
    ImageU8::from_data(rgb.width, rgb.height, 4, pixels.collect())
}

/// A painted ball and a painted box beside it.
fn object() -> Gaussians {
    let mut g = Gaussians::empty(0);
    let n = 5000;
    for i in 0..n {
        let z = 1.0 - 2.0 * (i as f32 + 0.5) / n as f32;
        let phi = 2.399_963 * i as f32;
        let r = (1.0 - z * z).sqrt();
        let normal = Vec3::new(r * phi.cos(), r * phi.sin(), z);
        tile(&mut g, 0.7 * normal + Vec3::new(-0.25, 0.0, 0.1), normal, 0.02);
    }
    let (half, steps) = (0.35f32, 14);
    for side in 0..6 {
        let normal = [Vec3::X, Vec3::Y, Vec3::Z][side % 3] * if side < 3 { 1.0 } else { -1.0 };
        let (u, v) = normal.any_orthonormal_pair();
        for k in 0..steps * steps {
            let at = |i: usize| half * (2.0 * (i as f32 + 0.5) / steps as f32 - 1.0);
            let place = half * normal + at(k % steps) * u + at(k / steps) * v;
            tile(&mut g, place + Vec3::new(0.75, 0.2, -0.25), normal, 0.035);
        }
    }
    g
}

/// A flat opaque Gaussian of a color that depends on its place, smooth over a few of its widths.
fn tile(g: &mut Gaussians, place: Vec3, normal: Vec3, width: f32) {
    let turn = Quat::from_rotation_arc(Vec3::Z, normal);
    g.means.push(place.to_array());
    g.rotations.push([turn.w, turn.x, turn.y, turn.z]);
    g.log_scales.push([width.ln(), width.ln(), (0.05 * width).ln()]);
    g.opacity_logits.push(6.0);
    for c in 0..3 {
        g.sh.push(1.5 * paint(place / (3.0 * width), c));
    }
}

/// Noise without direction: -1 to 1, by cells of one unit.
fn paint(place: Vec3, channel: u32) -> f32 {
    let cell = place.floor().as_ivec3();
    let mut hash = 0x9e37_79b9u32.wrapping_mul(channel + 1);
    for v in [cell.x, cell.y, cell.z] {
        hash = (hash ^ v as u32).wrapping_mul(0x85eb_ca6b);
        hash ^= hash >> 13;
    }
    (hash >> 8) as f32 / 8_388_608.0 - 1.0
}

/// A floor below the object.
fn floor(half: f64, width: f32) -> Gaussians {
    sheet(DVec3::new(0.0, 0.0, -0.8), Vec3::Z, half, width)
}

/// A board that faces the cameras, along x and z.
fn board(center: DVec3, half: f64, width: f32) -> Gaussians {
    sheet(center, Vec3::NEG_Y, half, width)
}

fn sheet(center: DVec3, normal: Vec3, half: f64, width: f32) -> Gaussians {
    let mut g = Gaussians::empty(0);
    let (u, v) = if normal == Vec3::Z { (Vec3::X, Vec3::Y) } else { (Vec3::X, Vec3::Z) };
    let steps = (2.0 * half as f32 / (1.2 * width)).ceil() as usize;
    let at = |i: usize| half as f32 * (2.0 * (i as f32 + 0.5) / steps as f32 - 1.0);
    for k in 0..steps * steps {
        tile(&mut g, center.as_vec3() + at(k % steps) * u + at(k / steps) * v, normal, width);
    }
    g
}

/// A round wall that faces inwards.
fn wall(radius: f32, half_height: f32) -> Gaussians {
    let mut g = Gaussians::empty(0);
    let width = 0.5f32;
    let around = (std::f32::consts::TAU * radius / (1.2 * width)) as usize;
    let up = (2.0 * half_height / (1.2 * width)) as usize;
    for k in 0..around * up {
        let angle = std::f32::consts::TAU * (k % around) as f32 / around as f32;
        let z = half_height * (2.0 * ((k / around) as f32 + 0.5) / up as f32 - 1.0) + 3.0;
        let outwards = Vec3::new(angle.cos(), angle.sin(), 0.0);
        tile(&mut g, radius * outwards + Vec3::new(0.0, 0.0, z), -outwards, width);
    }
    g
}

fn append(g: &mut Gaussians, more: Gaussians) {
    g.means.extend(more.means);
    g.rotations.extend(more.rotations);
    g.log_scales.extend(more.log_scales);
    g.opacity_logits.extend(more.opacity_logits);
    g.sh.extend(more.sh);
}
