use motes_raster::render;
use motes_scene::{ImageU8, Pinhole, Pose};
use motes_testkit::{orbit_pose, random_gaussians, small_camera};

use super::*;
use crate::loss::{ColorTransform, PhotometricLoss};
use crate::options::AlphaMode;
use crate::target::TrainingImage;

#[test]
fn the_color_gradient_matches_finite_differences() {
    let gaussians = random_gaussians(3, 30, 0);
    let camera = small_camera(40, 32);
    let pose = orbit_pose(0.4);
    let transform = motes_raster::ViewTransform::new(&camera, &pose);
    let image = TrainingImage {
        name: String::new(),
        camera,
        camera_from_world: pose,
        image: ImageU8::from_data(
            40,
            32,
            3,
            (0..3 * 40 * 32).map(|i| (i * 7 % 251) as u8).collect(),
        )
        .into(),
        mask: None,
        exposure_gain: 1.0,
    };
    let target = Target::new(&image, 40, 32, AlphaMode::Ignore);
    let mut frame = Frame::new();
    let mut loss_of = |background: [f32; 3]| {
        let options = RenderOptions { background, ..RenderOptions::default() };
        let planes = frame.forward(&gaussians, &transform, &Modifiers::default(), &options).clone();
        let mut gradient = Planes::new(40, 32, 4);
        let value = PhotometricLoss::new().evaluate(
            &planes,
            &target,
            background,
            ColorTransform::IDENTITY,
            0.2,
            &mut gradient,
        );
        (value.loss, color_gradient(&planes, &gradient))
    };
    let at = [0.3, 0.6, 0.45];
    let (_, analytic) = loss_of(at);
    let h = 2e-3f32;
    for c in 0..3 {
        let mut side = |step: f32| {
            let mut b = at;
            b[c] += step;
            loss_of(b).0
        };
        let numeric = (side(h) - side(-h)) / f64::from(2.0 * h);
        let error = (numeric - f64::from(analytic[c])).abs();
        assert!(error < 0.03 * numeric.abs() + 1e-4, "{c}: {numeric} {}", analytic[c]);
    }
}

#[test]
fn the_dome_hides_what_is_behind_it_in_every_direction() {
    let camera = Pinhole { fx: 30.0, fy: 30.0, cx: 24.0, cy: 24.0, width: 48, height: 48 };
    let g = dome([0.2, 0.5, 0.8], DVec3::new(1.0, 2.0, 3.0), 50.0);
    for angle in [0.0, 1.3, 2.9] {
        let eye = DVec3::new(1.5, 2.0, 2.5);
        let to = eye + DVec3::new(f64::cos(angle), f64::sin(angle), 0.7 * f64::sin(2.0 * angle));
        let pose = Pose::look_at(eye, to, DVec3::Z).unwrap();
        let got = render(&g, &camera, &pose, &RenderOptions::default());
        for pixel in got.color.data.chunks_exact(3) {
            for (value, want) in pixel.iter().zip([0.2, 0.5, 0.8]) {
                assert!((value - want).abs() < 2.0 / 255.0, "{value} {want}");
            }
        }
    }
}

#[test]
fn the_shell_shows_what_the_photos_show_beyond_the_points() {
    // Photos from one place, turned: left half red, right half blue in the world.
    let camera = Pinhole { fx: 60.0, fy: 60.0, cx: 32.0, cy: 24.0, width: 64, height: 48 };
    let views: Vec<TrainingView> = (0..3)
        .map(|i| {
            let eye = DVec3::new(0.1 * f64::from(i), 0.0, 0.0);
            let pose = Pose::look_at(eye, eye + DVec3::Y, DVec3::Z).unwrap();
            let data =
                (0..64 * 48).flat_map(|p| if p % 64 < 32 { [200, 20, 20] } else { [20, 20, 200] });
            let image = TrainingImage {
                name: String::new(),
                camera,
                camera_from_world: pose,
                image: ImageU8::from_data(64, 48, 3, data.collect()).into(),
                mask: None,
                exposure_gain: 1.0,
            };
            TrainingView::new(&image, &[1.0], AlphaMode::Ignore)
        })
        .collect();
    let nothing = Gaussians::empty(0);
    let sky = OpenSky::find(&nothing, &views, &[0, 1, 2], 0);
    assert_eq!(sky.share, 1.0);
    let where_to = place(&views, &SparsePoints::default(), 1.0);
    assert_eq!(where_to.1, 20.0);
    let g = shell(&sky, &views, 0, where_to, 100_000);
    assert!(g.is_consistent() && g.len() > 500 && g.invalid_rows().is_empty(), "{}", g.len());
    let transform = &views[1].levels[0].0;
    let image = Frame::new()
        .forward(&g, transform, &Modifiers::default(), &RenderOptions::default())
        .clone();
    assert!(image.row(0, 24)[8] > 0.6 && image.row(2, 24)[8] < 0.25, "{}", image.row(0, 24)[8]);
    assert!(image.row(2, 24)[56] > 0.6 && image.row(0, 24)[56] < 0.25, "{}", image.row(2, 24)[56]);
    assert_eq!(shell(&sky, &views, 0, where_to, 100).len(), 100);
}

#[test]
fn beside_the_photos_the_shell_goes_on_in_the_colors_at_their_edge() {
    // Open directions around +x are red, those around -x blue; the mean of all is green.
    let mut seen = Gaussians::empty(0);
    for (x, color) in [(1.0, [0.9, 0.1, 0.1]), (-1.0, [0.1, 0.1, 0.9])] {
        for i in 0..40 {
            let angle = 0.05 * (f64::from(i) - 20.0);
            let direction = DVec3::new(x, angle, 0.3 * angle).normalize();
            push(&mut seen, direction.as_vec3() * 20.0, color, 1.0, 0.9);
        }
    }
    let g = surroundings(&seen, [0.1, 0.8, 0.1], (DVec3::ZERO, 20.0), 100_000);
    assert!(g.means.iter().all(|m| Vec3::from(*m).length() > 25.0), "behind the shell");
    assert_eq!(surroundings(&seen, [0.5; 3], (DVec3::ZERO, 20.0), 100).len(), 100);
    let camera = Pinhole { fx: 30.0, fy: 30.0, cx: 24.0, cy: 24.0, width: 48, height: 48 };
    let middle = |to: DVec3| {
        let pose = Pose::look_at(DVec3::ZERO, to, DVec3::Z).unwrap();
        let got = render(&g, &camera, &pose, &RenderOptions::default());
        let at = 3 * (24 * 48 + 24);
        [got.color.data[at], got.color.data[at + 1], got.color.data[at + 2]]
    };
    let [red, _, blue] = middle(DVec3::new(1.0, 0.0, 0.5));
    assert!(red > 0.7 && blue < 0.3, "above the red ones: {red} {blue}");
    let [red, _, blue] = middle(DVec3::new(-1.0, 0.0, 0.5));
    assert!(blue > 0.7 && red < 0.3, "above the blue ones: {red} {blue}");
    let [red, green, blue] = middle(DVec3::new(0.0, 0.1, -1.0));
    assert!(green > 0.6 && red < 0.3 && blue < 0.3, "far from both: {red} {green} {blue}");
}
