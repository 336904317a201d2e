//! Environment light: look-up, sampling, clean-up, closed forms.

use glam::{DVec3, Vec3};
use motes_math::rng::keyed_rng;
use motes_scene::ImageF32;
use motes_shading::environment::{
    AXIS_COLORS, Convention, Environment, EnvironmentError, EnvironmentMap, MapOptions,
    Orientation, SunDisc, axis_test_map, direction_from_uv, irradiance, reference,
    uv_from_direction,
};
use motes_testkit::chi_square_z;
use rand::RngExt;

const CONVENTIONS: [Convention; 3] =
    [Convention::OpenExr, Convention::Blender, Convention::ThreeJs];

fn options(convention: Convention) -> MapOptions {
    MapOptions { orientation: Orientation::new(convention), ..MapOptions::default() }
}

fn map_of(image: &ImageF32) -> EnvironmentMap {
    EnvironmentMap::new(image, &MapOptions::default()).expect("a valid map")
}

fn random_image(width: usize, height: usize) -> ImageF32 {
    let mut rng = keyed_rng(3, width as u64, height as u64);
    let data = (0..width * height * 3)
        .map(|_| {
            let u: f32 = rng.random();
            if u < 0.3 { 0.0 } else { (5.0 * u).exp() }
        })
        .collect();
    ImageF32::from_data(width, height, 3, data)
}

#[test]
fn every_convention_shows_the_axes_where_they_are() {
    for convention in CONVENTIONS {
        let o = options(convention);
        let image = axis_test_map(64, &o.orientation);
        let map = EnvironmentMap::new(&image, &o).unwrap();
        for (i, (axis, color)) in AXIS_COLORS.into_iter().enumerate() {
            // Off the center, so that the holes of negative axes are missed.
            let d = (axis + 0.2 * DVec3::new(axis.y, axis.z, axis.x)).normalize();
            let (radiance, _) = map.radiance_pdf(d.as_vec3());
            assert!((radiance - color).length() < 1e-4, "{convention:?} axis {i}: {radiance}");
        }
    }
}

#[test]
fn the_density_of_maps_is_that_of_their_samples() {
    for (width, height) in [(1, 1), (1, 2), (2, 1), (3, 2), (16, 8), (64, 32)] {
        let image = random_image(width, height);
        let environment = Environment::new(Some(map_of(&image)), None);
        for fast in [true, false] {
            let z = environment_z(&environment, fast, width as u64 * 100 + height as u64);
            assert!(z < 4.0, "{width}x{height} fast {fast}: z {z}");
        }
    }
}

#[test]
fn sun_and_map_together_have_the_density_of_the_mixture() {
    let sun = SunDisc::new(Vec3::new(0.3, 0.8, 0.2), 0.3, Vec3::splat(40.0));
    let environment = Environment::new(Some(map_of(&random_image(16, 8))), Some(sun));
    for fast in [true, false] {
        let z = environment_z(&environment, fast, 5);
        assert!(z < 4.0, "fast {fast}: z {z}");
    }
}

/// Bins in (u, v) of the map; expected counts by quadrature of the density.
fn environment_z(environment: &Environment, fast: bool, key: u64) -> f64 {
    let (columns, rows, samples, fine) = (24, 12, 100_000, 32);
    let mut rng = keyed_rng(11, key, u64::from(fast));
    let mut observed = vec![0u64; columns * rows];
    for _ in 0..samples {
        let d = if fast {
            environment.sample(rng.random()).expect("light").to_light.as_dvec3()
        } else {
            reference::sample(environment, rng.random()).expect("light").to_light
        };
        let (u, v) = uv_from_direction(d.normalize());
        let (x, y) = ((u * columns as f64) as usize, (v * rows as f64) as usize);
        observed[y.min(rows - 1) * columns + x.min(columns - 1)] += 1;
    }
    let mut expected = vec![0.0; columns * rows];
    for y in 0..rows * fine {
        let v = (y as f64 + 0.5) / (rows * fine) as f64;
        let area = 2.0 * std::f64::consts::PI.powi(2) * (std::f64::consts::PI * v).sin()
            / (rows * fine * columns * fine) as f64;
        for x in 0..columns * fine {
            let u = (x as f64 + 0.5) / (columns * fine) as f64;
            let d = direction_from_uv(u, v);
            let pdf = if fast {
                f64::from(environment.radiance_pdf(d.as_vec3()).1)
            } else {
                reference::radiance_pdf(environment, d).1
            };
            expected[(y / fine) * columns + x / fine] += pdf * area * samples as f64;
        }
    }
    let total: f64 = expected.iter().sum::<f64>() / samples as f64;
    assert!((total - 1.0).abs() < 2e-3, "the density integrates to {total}");
    chi_square_z(&observed, &expected)
}

#[test]
fn the_suns_disc_is_sampled_uniformly() {
    let sun = SunDisc::new(Vec3::new(-0.5, 0.1, 0.7), 4.65e-3, Vec3::ONE);
    let axis = sun.to_sun().as_dvec3().normalize();
    let frame = motes_shading::frame::FrameF64::from_normal(axis);
    let mut rng = keyed_rng(1, 1, 1);
    let (mut fast, mut slow) = (vec![0u64; 80], vec![0u64; 80]);
    for _ in 0..80_000 {
        let bits: [u32; 2] = rng.random();
        let a = sun.sample(bits[0], bits[1]);
        assert!(sun.contains(a));
        let b = sun.sample_f64(rng.random(), rng.random());
        for (w, bins) in [(a.as_dvec3(), &mut fast), (b, &mut slow)] {
            let l = frame.local_from_world(w);
            let depth = 0.5 * (w - axis).length_squared() / sun.one_minus_cos();
            let ring = ((depth * 10.0) as usize).min(9);
            let phi = l.y.atan2(l.x).rem_euclid(std::f64::consts::TAU);
            bins[ring * 8 + ((phi / std::f64::consts::TAU * 8.0) as usize).min(7)] += 1;
        }
    }
    for bins in [fast, slow] {
        let z = chi_square_z(&bins, &[1000.0; 80]);
        assert!(z < 4.0, "z {z}");
    }
}

#[test]
fn radiance_over_density_is_steady_even_for_a_one_pixel_sun() {
    // A density that is constant per texel would vary by a factor of thousands here.
    let mut image = ImageF32::filled(64, 32, 3, 0.01);
    image.pixel_mut(20, 9).fill(1e6);
    let environment = Environment::new(Some(map_of(&image)), None);
    let mut rng = keyed_rng(2, 2, 2);
    let (mut low, mut high) = (f32::INFINITY, 0.0f32);
    for _ in 0..20_000 {
        let s = environment.sample(rng.random()).unwrap();
        let weight = s.radiance.x / s.pdf;
        low = low.min(weight);
        high = high.max(weight);
    }
    assert!(high / low < 1.2, "{low} to {high}");
    let exact = environment.map().unwrap().power() as f32;
    assert!((low..high).contains(&exact));
}

#[test]
fn fast_and_reference_look_ups_agree() {
    let image = random_image(32, 16);
    for convention in CONVENTIONS {
        let o =
            MapOptions { exposure: 0.5, orientation: Orientation::new(convention).rotated(33.0) };
        let map = EnvironmentMap::new(&image, &o).unwrap();
        let environment = Environment::new(Some(map), None);
        let mut rng = keyed_rng(5, 5, 5);
        for _ in 0..2000 {
            let d =
                DVec3::new(rng.random::<f64>() - 0.5, rng.random::<f64>() - 0.5, 0.3).normalize();
            let (fast, fast_pdf) = environment.radiance_pdf(d.as_vec3());
            let (slow, slow_pdf) = reference::radiance_pdf(&environment, d);
            assert!((fast.as_dvec3() - slow).length() < 1e-3 * (slow.length() + 1.0));
            assert!((f64::from(fast_pdf) - slow_pdf).abs() < 1e-3 * (slow_pdf + 0.01));
        }
    }
}

#[test]
fn bad_pixels_are_repaired_and_counted() {
    let mut image = ImageF32::filled(4, 2, 3, 1.0);
    image.data[0] = -2.0;
    image.data[4] = f32::NAN;
    image.data[8] = f32::INFINITY;
    image.data[9] = f32::NEG_INFINITY;
    let map = map_of(&image);
    let counts = map.clean_up();
    assert_eq!((counts.negative, counts.nan, counts.infinite), (2, 1, 1));
    assert!(counts.any() && map.power().is_finite());
    for i in 0..100 {
        let d = direction_from_uv(f64::from(i) * 0.013 % 1.0, f64::from(i) * 0.0371 % 1.0);
        let (radiance, pdf) = map.radiance_pdf(d.as_vec3());
        assert!(radiance.is_finite() && radiance.min_element() >= 0.0 && pdf.is_finite());
    }
    assert!(!map_of(&ImageF32::filled(2, 1, 3, 0.5)).clean_up().any());
}

#[test]
fn a_black_map_samples_nothing_and_says_so() {
    let environment = Environment::new(Some(map_of(&ImageF32::filled(8, 4, 3, 0.0))), None);
    assert!(environment.is_black() && environment.sample([1, 2, 3]).is_none());
    assert_eq!(environment.radiance_pdf(Vec3::Y), (Vec3::ZERO, 0.0));
    assert!(Environment::default().is_black() && Environment::default().sample([0; 3]).is_none());
    let lit = Environment::new(Some(map_of(&ImageF32::filled(1, 2, 3, 1.0))), None);
    assert!(!lit.is_black());
}

#[test]
fn unusable_maps_are_refused_with_a_reason() {
    let new = |image: &ImageF32, exposure| {
        EnvironmentMap::new(image, &MapOptions { exposure, ..MapOptions::default() }).map(|_| ())
    };
    let gray = ImageF32::filled(4, 2, 1, 1.0);
    assert_eq!(new(&gray, 1.0), Err(EnvironmentError::Shape(4, 2, 1)));
    assert!(matches!(new(&ImageF32::filled(0, 2, 3, 1.0), 1.0), Err(EnvironmentError::Shape(..))));
    for exposure in [0.0, -1.0, f32::NAN, f32::INFINITY] {
        assert!(new(&ImageF32::filled(4, 2, 3, 1.0), exposure).is_err());
    }
    assert!(new(&ImageF32::filled(4, 2, 4, 1.0), 2.0).is_ok());
}

#[test]
fn uniform_light_has_one_coefficient_and_irradiance_pi() {
    for (w, h) in [(1, 2), (32, 16), (400, 200)] {
        let sh = map_of(&ImageF32::filled(w, h, 3, 2.0)).harmonics();
        let expected = 2.0 * (4.0 * std::f64::consts::PI).sqrt();
        assert!((sh[0].x - expected).abs() < 1e-9 && sh[1..].iter().all(|c| c.length() < 1e-3));
        let e = irradiance(&sh, DVec3::new(0.6, 0.0, 0.8)).y;
        assert!((e - 2.0 * std::f64::consts::PI).abs() < 2e-3, "{e}");
    }
}

#[test]
fn half_a_sphere_of_light_gives_the_closed_form() {
    // L = 1 above the horizon: E = π (1 + cos β) / 2, with harmonics within 1.5 % of π.
    let (w, h) = (256, 128);
    let mut image = ImageF32::filled(w, h, 3, 0.0);
    image.data[..w * h / 2 * 3].fill(1.0);
    for convention in CONVENTIONS {
        let o = options(convention);
        let sh = EnvironmentMap::new(&image, &o).unwrap().harmonics();
        let up = o.orientation.world_from_map(DVec3::Y);
        for i in 0..20 {
            let beta = std::f64::consts::PI * f64::from(i) / 19.0;
            let n = up * beta.cos() + o.orientation.world_from_map(DVec3::X) * beta.sin();
            let expected = 0.5 * std::f64::consts::PI * (1.0 + beta.cos());
            let e = irradiance(&sh, n).x;
            assert!((e - expected).abs() < 0.015 * std::f64::consts::PI, "{e} {expected}");
        }
    }
}

#[test]
fn a_sun_gives_its_irradiance_by_harmonics_within_the_ringing_of_degree_four() {
    // Facing the light, Σ A_l (2 l + 1) / 4π = 1/4 + 1/2 + 5/16 - 3/32 of it.
    let sun = SunDisc::new(Vec3::Y, 4.65e-3, Vec3::splat(1e4));
    let sh = Environment::new(None, Some(sun)).harmonics();
    let e = irradiance(&sh, DVec3::Y).x / (1e4 * sun.solid_angle());
    assert!((e - 0.96875).abs() < 1e-4, "{e}");
}

#[test]
fn a_large_map_is_usable() {
    // 8192 x 4096: 33 million texels, more than 24 bits can address.
    let mut image = ImageF32::filled(8192, 4096, 3, 0.1);
    image.pixel_mut(5000, 777).fill(1e6);
    let map = map_of(&image);
    drop(image);
    let environment = Environment::new(Some(map), None);
    let mut rng = keyed_rng(9, 9, 9);
    let mut sun = 0;
    for _ in 0..2000 {
        let s = environment.sample(rng.random()).unwrap();
        assert!(s.pdf.is_finite() && s.radiance.is_finite());
        sun += u32::from(s.radiance.x > 10.0);
    }
    assert!(sun > 0, "the pixel of 1e6 was never met");
}
