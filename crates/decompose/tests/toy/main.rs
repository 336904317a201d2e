//! A ball on a floor of two grays in the sun, taken apart again: surface given, light and material found.

mod lamp;
mod scene;
mod sky;

use decompose::{
    DecomposeError, DecomposeOptions, Inputs, Known, Photo, Pipeline, RenderedView, Report, State,
    Term, TracedSurface, ViewRays,
};
use glam::Vec3;
use motes_raster::RenderOptions;
use motes_scene::{Gaussians, ImageF32, Materials, Surface, Switch};
use motes_shading::brdf::{Lobes, Material};
use motes_shading::environment::Environment;
use motes_shading::integrate::{IntegrationOptions, Shader, SurfacePoint};

use scene::{base_color, boxes, gaussians, is_floor, light, photos, surface};

/// What a run came to.
struct Found {
    materials: Materials,
    refined: Option<Gaussians>,
    surface: Surface,
    lights: Vec<decompose::CellLight>,
    views: Vec<RenderedView>,
    is_specular: bool,
    terms: Vec<Term>,
}

impl Found {
    fn of(state: State<'_>, report: Report) -> Self {
        let terms = report.terms(&state);
        Self {
            materials: state.attributes.clone(),
            refined: state.refined.clone(),
            surface: state.surface().clone(),
            is_specular: state.is_specular(),
            lights: state.illumination.cells,
            views: state.views,
            terms,
        }
    }

    fn term(&self, name: &str) -> Option<&Term> {
        self.terms.iter().find(|term| term.name == name)
    }
}

fn options() -> DecomposeOptions {
    let mut options = DecomposeOptions::default();
    options.samples.samples = 1500;
    options.materials.material_rays = 48;
    options.shading.pixel_rays = 24;
    options.base_color.color_passes = 4;
    options.refinement.photo_steps = 100;
    // The residual has a test of its own, and relighting its own tests.
    options.appearance_residual.residual_steps = 0;
    // The photos here are made without a second surface.
    options.model.indirect = Switch::Off;
    options
}

fn run(photos: &[Photo], known: Known) -> Found {
    run_on(surface(), photos, known)
}

fn run_on(surface: Surface, photos: &[Photo], known: Known) -> Found {
    run_with(&options(), surface, photos, known).expect("a decomposition")
}

fn run_with(
    options: &DecomposeOptions,
    surface: Surface,
    photos: &[Photo],
    known: Known,
) -> Result<Found, DecomposeError> {
    let gaussians = gaussians(&surface);
    let known = Known { surface: Some(surface), ..known };
    let inputs = Inputs {
        gaussians: &gaussians,
        photos,
        held_out: &[],
        known: &known,
        render: RenderOptions::default(),
        model: &options.model,
        seed: 0,
    };
    let mut pipeline = Pipeline::new(&inputs)?;
    pipeline.run_all(options, &mut |_| Ok(()))?;
    Ok(Found::of(pipeline.state, pipeline.report))
}

fn assert_sound(d: &Found) {
    let m = &d.materials;
    let unit = |v: &f32| v.is_finite() && (0.0..=1.0).contains(v);
    assert!(m.base_color_linear.iter().flatten().all(unit), "base colors");
    assert!(m.roughness.iter().chain(&m.metallic).chain(&m.visibility).all(unit), "materials");
    assert!(m.normals.iter().flatten().all(|v| v.is_finite()), "normals");
    assert!(d.surface.base_color_linear.iter().flatten().all(unit), "surface");
    assert!(d.surface.is_consistent());
    let positive = |e: &Vec3| e.is_finite() && e.min_element() >= 0.0;
    assert!(d.lights.iter().flat_map(|l| &l.radiance).all(positive), "light");
}

/// Largest ratio of the mean base colors of floor tiles of one gray, in the shadow and out of it.
fn shadow_ratio(d: &Found, scene: &TracedSurface, light: &Environment) -> f32 {
    let options = IntegrationOptions {
        light_samples: 64,
        brdf_samples: 8,
        ray_bias: 1e-3,
        ..IntegrationOptions::default()
    };
    let shader = Shader::new(light, &scene.tracer, None, options);
    let mut sums = [[(0.0f32, 0.0f32); 2]; 2];
    for (v, p) in d.surface.vertices.iter().map(|&p| Vec3::from(p)).enumerate() {
        // Near the middle, away from the edges of tiles.
        let edge =
            (p.x * 2.0 - (p.x * 2.0).round()).abs().min((p.y * 2.0 - (p.y * 2.0).round()).abs());
        if !is_floor(p)
            || p.truncate().length() > 1.4
            || p.truncate().length() < 0.45
            || edge < 0.15
        {
            continue;
        }
        let point = SurfacePoint {
            position: p,
            geometric_normal: Vec3::Z,
            shading_normal: Vec3::Z,
            to_viewer: Vec3::Z,
            material: Material::lambert(Vec3::ONE),
        };
        let visibility = shader.shade_point(&point, v as u64).visibility;
        let dark = match visibility {
            v if v < 0.5 => 1,
            v if v > 0.95 => 0,
            _ => continue,
        };
        let sum = &mut sums[usize::from(base_color(p) > 0.4)][dark];
        *sum = (sum.0 + d.surface.base_color_linear[v][1], sum.1 + 1.0);
    }
    let ratio = |s: &[(f32, f32); 2]| {
        assert!(s[0].1 > 5.0 && s[1].1 > 5.0, "points in and out of the shadow: {s:?}");
        (s[0].0 / s[0].1) / (s[1].0 / s[1].1)
    };
    sums.iter().map(ratio).map(|r| r.max(1.0 / r)).fold(1.0, f32::max)
}

#[test]
fn a_matte_scene_in_the_sun_loses_its_shadow_and_needs_no_highlight() {
    let scene = TracedSurface::new(surface()).expect("a mesh");
    let light = light(0.3, 60.0);
    let photos = photos(&scene, &light, |p| Material::lambert(Vec3::splat(base_color(p))));
    let d = run(&photos, Known::default());
    assert_sound(&d);
    assert!(!d.is_specular, "{:?}", d.terms);
    assert!(d.term("light by reflections").is_none(), "nothing reflects");
    let ratio = shadow_ratio(&d, &scene, &light);
    println!("base color lit over shadowed: {ratio:.3}; {:?}", d.term("sharp light"));
    // In the photos the ratio is above 2.
    assert!(ratio < 1.25, "{ratio}");
    assert_eq!(d.materials.observations.last(), Some(&0), "no camera looks there");
    let psnr: f64 = d.views.iter().map(|v| v.psnr_db).sum::<f64>() / d.views.len() as f64;
    // Without another look at the photos, the edges of tiles are as blurred as the shapes that came.
    let mut options = options();
    options.refinement.photo_steps = 0;
    let plain = run_with(&options, surface(), &photos, Known::default()).expect("a decomposition");
    let before: f64 = plain.views.iter().map(|v| v.psnr_db).sum::<f64>() / d.views.len() as f64;
    println!("re-rendered {before:.2} dB, shapes fitted to the photos {psnr:.2} dB");
    assert!(plain.refined.is_none() && psnr > before + 0.3, "{before} {psnr}");
    let refined = d.refined.as_ref().expect("fitted Gaussians");
    assert_eq!(refined.len(), gaussians(&surface()).len());

    // Bits do not depend on the number of threads.
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a pool");
    let single = pool.install(|| run(&photos, Known::default()));
    assert_eq!(single.materials, d.materials);
    assert_eq!(single.refined, d.refined);
    assert_eq!(single.surface, d.surface);
    assert_eq!(single.lights[0].radiance, d.lights[0].radiance);
}

#[test]
fn with_the_light_given_roughness_metal_and_base_color_come_out() {
    let scene = TracedSurface::new(surface()).expect("a mesh");
    let light = light(0.3, 60.0);
    let of = |p: Vec3| {
        let (base, roughness, metallic) = match is_floor(p) {
            true => (Vec3::splat(base_color(p)), 0.6, 0.0),
            false => (Vec3::new(0.8, 0.5, 0.3), 0.3, 1.0),
        };
        Material { lobes: Lobes::Burley, ..Material::principled(base, roughness, metallic) }
    };
    let photos = photos(&scene, &light, of);
    let d = run(&photos, Known { lights: vec![light], ..Known::default() });
    assert_sound(&d);
    let mut ball = (0.0f32, 0.0f32, Vec3::ZERO, 0.0f32);
    for (v, p) in d.surface.vertices.iter().enumerate().filter(|(_, p)| p[2] > 0.3) {
        let _ = p;
        ball.0 += d.surface.metallic[v];
        ball.1 += d.surface.roughness[v];
        ball.2 += Vec3::from(d.surface.base_color_linear[v]);
        ball.3 += 1.0;
    }
    let (metallic, roughness, base) = (ball.0 / ball.3, ball.1 / ball.3, ball.2 / ball.3);
    println!("ball: metallic {metallic:.2} roughness {roughness:.2} base {base:.2}");
    assert!(metallic > 0.9 && (roughness - 0.3).abs() < 0.12, "{metallic} {roughness}");
    assert!((base - Vec3::new(0.8, 0.5, 0.3)).abs().max_element() < 0.2, "{base}");
    // Of the surface as it was: vertices of metal move.
    let floor: Vec<usize> = (0..d.surface.vertices.len())
        .filter(|&v| is_floor(Vec3::from(scene.surface.vertices[v])))
        .collect();
    assert!(floor.len() > 1000 && floor.iter().all(|&v| d.surface.metallic[v] == 0.0));
    assert!(floor.iter().all(|&v| d.surface.vertices[v] == scene.surface.vertices[v]));
    // The ball was right before it was turned to what noisy photos mirror; it is nearly right after.
    let upper =
        (floor.len()..d.surface.vertices.len()).filter(|&v| scene.surface.vertices[v][2] > 0.3);
    let off: Vec<f32> = upper
        .map(|v| {
            let [a, b] = [&scene.surface, &d.surface].map(|s| Vec3::from(s.normals[v]));
            a.angle_between(b).to_degrees()
        })
        .collect();
    let mean = off.iter().sum::<f32>() / off.len() as f32;
    println!("normals of the ball turned by {mean} degrees");
    assert!(mean < 8.0, "{mean}");
}

#[test]
fn what_is_reflected_tells_a_soft_light() {
    let scene = TracedSurface::new(surface()).expect("a mesh");
    let light = boxes();
    let of = |p: Vec3| {
        let (base, roughness) = if is_floor(p) { (base_color(p), 0.5) } else { (0.3, 0.2) };
        Material { lobes: Lobes::Burley, ..Material::principled(Vec3::splat(base), roughness, 0.0) }
    };
    let photos = photos(&scene, &light, of);
    let [fitted, shading] = [2, 0].map(|rounds| {
        let mut options = options();
        options.reflected_light.reflected_light_rounds = rounds;
        options.refinement.photo_steps = 0;
        let d = run_with(&options, surface(), &photos, Known::default()).expect("a decomposition");
        assert_sound(&d);
        d
    });
    let name = "light by reflections";
    assert!(shading.term(name).is_none());
    let report = fitted.term(name).expect("the ball reflects").clone();
    assert!(report.kept && report.numbers["cost"] < report.numbers["cost_before"], "{report:?}");
    let [fitted, shading] = [fitted, shading].map(|d| {
        let found = decompose::environment(&d.lights[0]);
        errors_of_irradiance(&found, &light)
    });
    println!(
        "log irradiance off by (mean, spread): {fitted:?}, by shading alone {shading:?}; {report:?}"
    );
    assert!(fitted[1] < 0.7 * shading[1], "{fitted:?} {shading:?}");
}

/// Mean and standard deviation of the logarithm of irradiance, found over true, for normals that look up.
fn errors_of_irradiance(found: &Environment, truth: &Environment) -> [f32; 2] {
    let directions = |n: u32| {
        (0..n).map(move |k| {
            let z = 1.0 - (k as f32 + 0.5) * 2.0 / n as f32;
            let (sin, cos) = (k as f32 * 2.399_963_2).sin_cos();
            Vec3::new(cos, sin, 0.0) * (1.0 - z * z).sqrt() + Vec3::Z * z
        })
    };
    let irradiance = |light: &Environment, n: Vec3| -> f32 {
        directions(4000).map(|w| light.radiance_pdf(w).0.y * n.dot(w).max(0.0)).sum()
    };
    let off: Vec<f32> = directions(100)
        .filter(|n| n.z > -0.2)
        .map(|n| (irradiance(found, n) / irradiance(truth, n)).ln())
        .collect();
    let mean = off.iter().sum::<f32>() / off.len() as f32;
    let square = off.iter().map(|v| (v - mean) * (v - mean)).sum::<f32>() / off.len() as f32;
    [mean, square.sqrt()]
}

#[test]
fn predicted_normals_mend_wrong_ones_and_what_contradicts_the_surface_is_left_alone() {
    let light = light(0.2, 8.0);
    let truth = surface();
    let traced = TracedSurface::new(truth.clone()).expect("a mesh");
    let photos = photos(&traced, &light, |_| Material::lambert(Vec3::splat(0.4)));
    // The ball's normals are off by 17 degrees to all sides; the floor's stay.
    let mut wrong = truth.clone();
    for (v, n) in wrong.normals.iter_mut().enumerate() {
        if wrong.vertices[v][2] > 0.0 {
            let angle = v as f32 * 2.4;
            let exact = Vec3::from(*n);
            let side = exact.any_orthonormal_vector();
            let aside = side * angle.cos() + exact.cross(side) * angle.sin();
            *n = (exact + 0.3 * aside).normalize().to_array();
        }
    }
    let predicted = |photo: &Photo, sign: f32| {
        let rays = ViewRays::new(photo);
        let data = rays
            .hits(&traced)
            .iter()
            .flat_map(|hit| {
                let to_viewer = -rays.forward();
                let n = if hit.is_hit() { traced.frame(hit, to_viewer).1 } else { Vec3::ZERO };
                (n * sign).to_array()
            })
            .collect();
        Some(ImageF32::from_data(photo.camera.width, photo.camera.height, 3, data))
    };
    let error = |sign: Option<f32>| {
        let normal_priors =
            sign.map_or_else(Vec::new, |s| photos.iter().map(|p| predicted(p, s)).collect());
        let known = Known { lights: vec![light.clone()], normal_priors, ..Known::default() };
        let found = run_on(wrong.clone(), &photos, known).surface.normals;
        // What some photo sees: the upper half of the ball.
        let upper = |v: &usize| truth.vertices[*v][2] > 0.6;
        let angles: Vec<f32> = (0..found.len())
            .filter(upper)
            .map(|v| Vec3::from(found[v]).angle_between(truth.normals[v].into()).to_degrees())
            .collect();
        angles.iter().sum::<f32>() / angles.len() as f32
    };
    let (without, with, against) = (error(None), error(Some(1.0)), error(Some(-1.0)));
    println!("normals off by {without}, with predictions {with}, with inverted ones {against}");
    assert!(without > 10.0 && with < 3.0, "{without} {with}");
    assert!((against - without).abs() < 1e-3, "{against} {without}");
}

#[test]
fn photos_that_tell_nothing_give_something_finite() {
    let scene = TracedSurface::new(surface()).expect("a mesh");
    let even = light(0.5, 0.5);
    let flat = photos(&scene, &even, |_| Material::lambert(Vec3::splat(0.4)));
    let mut black = flat.clone();
    black.iter_mut().for_each(|p| p.radiance_linear.floats_mut().fill([0.0; 3]));
    let mut bright = flat.clone();
    bright.iter_mut().for_each(|p| p.radiance_linear.floats_mut().fill([1e6; 3]));
    for photos in [&flat, &black, &bright] {
        assert_sound(&run(photos, Known::default()));
    }
    let dark = Known { lights: vec![Environment::default()], ..Known::default() };
    assert_sound(&run(&flat, dark));
    let mut masked = flat;
    masked.iter_mut().for_each(|p| p.usable.fill(false));
    let nothing = run_with(&options(), surface(), &masked, Known::default()).map(|_| ());
    assert!(nothing.is_err_and(|e| e.to_string().contains("no point of the surface")));
}

#[test]
fn two_captures_under_different_light_have_one_base_color() {
    let scene = TracedSurface::new(surface()).expect("a mesh");
    let (sunny, even) = (light(0.3, 60.0), light(0.8, 0.8));
    let lambert = |p: Vec3| Material::lambert(Vec3::splat(base_color(p)));
    let mut both = photos(&scene, &sunny, lambert);
    both.extend(photos(&scene, &even, lambert).into_iter().map(|p| Photo { light: 1, ..p }));
    let d = run(&both, Known::default());
    assert_sound(&d);
    assert_eq!(d.lights.len(), 2);
    let ratio = shadow_ratio(&d, &scene, &sunny);
    let brightest = |k: usize| {
        let radiance = &d.lights[k].radiance;
        let mean = radiance.iter().map(|e| e.y).sum::<f32>() / radiance.len() as f32;
        radiance.iter().map(|e| e.y).fold(0.0, f32::max) / mean
    };
    println!(
        "lit over shadowed {ratio:.3}; peak over mean {:.1} and {:.1}",
        brightest(0),
        brightest(1)
    );
    assert!(ratio < 1.25, "{ratio}");
    assert!(brightest(0) > 3.0 * brightest(1), "the sun is in the first capture only");
}
