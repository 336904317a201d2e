//! `--model auto` on scenes whose needs are known: they were rendered from a model that has, or
//! lacks, the component in question.

#![expect(clippy::unwrap_used, reason = "a test that cannot prepare its scene has failed")]

use motes_math::rng::keyed_rng;
use motes_raster::{RenderOptions, render};
use motes_scene::{Gaussians, SparsePoints};
use motes_testkit::{orbit_pose, random_gaussians, small_camera};
use rand::RngExt;
use train_splat::{BackgroundModel, Decision, ExposureModel, FitOptions, Trainer, TrainingImage};

/// Sensor noise, peak to peak: with little of it any flexibility helps a fit that has not settled yet.
const NOISE: f32 = 40.0 / 255.0;

/// Photos of `truth` before black from all around; photo `i` is multiplied by `gain(i)`.
fn photos(truth: &Gaussians, views: usize, gain: impl Fn(usize) -> f32) -> Vec<TrainingImage> {
    photos_before(truth, views, [0.0; 3], gain)
}

fn photos_before(
    truth: &Gaussians,
    views: usize,
    background: [f32; 3],
    gain: impl Fn(usize) -> f32,
) -> Vec<TrainingImage> {
    let options = RenderOptions { background, ..RenderOptions::default() };
    (0..views)
        .map(|i| {
            let camera = small_camera(72, 56);
            let camera_from_world = orbit_pose(0.39 * i as f64);
            let mut picture = render(truth, &camera, &camera_from_world, &options).color;
            let mut rng = keyed_rng(11, 1, i as u64);
            for value in &mut picture.data {
                *value = *value * gain(i) + NOISE * (rng.random::<f32>() - 0.5);
            }
            let name = format!("view {i}");
            TrainingImage {
                name,
                camera,
                camera_from_world,
                image: picture.to_u8().into(),
                mask: None,
                exposure_gain: 1.0,
            }
        })
        .collect()
}

/// Mid-gray colors, so that gains and view dependence neither clip nor turn negative.
fn scene(seed: u64, view_dependence: f32) -> Gaussians {
    let mut truth = random_gaussians(seed, 60, 2);
    let row = 3 * truth.sh_coefficients();
    for sh in truth.sh.chunks_exact_mut(row) {
        sh[..3].iter_mut().for_each(|v| *v = 0.5 * *v - 0.2);
        sh[3..].iter_mut().for_each(|v| *v *= view_dependence);
    }
    truth
}

fn points(truth: &Gaussians) -> SparsePoints {
    SparsePoints { positions: truth.means.clone(), colors: vec![[128; 3]; truth.len()] }
}

fn options(iterations: u32) -> FitOptions {
    FitOptions {
        iterations: Some(iterations),
        max_gaussians: Some(300),
        refine_every: Some(60),
        resolution_schedule: Some("0.5:0.5,1:0.5".into()),
        // These orbits look past the scene; the background has a test of its own.
        background_model: Some(BackgroundModel::None),
        // The start is the truth's own Gaussians.
        dense_step: Some(0),
        ..FitOptions::default()
    }
}

/// The fit after its decisions.
fn decided(images: &[TrainingImage], truth: &Gaussians, options: &FitOptions) -> Trainer {
    let mut trainer = Trainer::new(images, &points(truth), None, options, 0).unwrap();
    while !trainer.state.model.is_decided() {
        assert!(!trainer.is_done());
        trainer.step();
    }
    trainer
}

fn decision<'a>(trainer: &'a Trainer, component: &str) -> &'a Decision {
    trainer.state.model.decisions.iter().find(|d| d.component == component).unwrap()
}

#[test]
fn view_dependent_color_is_kept_only_where_the_scene_has_it() {
    for (view_dependence, expected) in [(0.0, false), (1.2, true)] {
        let truth = scene(1, view_dependence);
        let images = photos(&truth, 16, |_| 1.0);
        let trainer = decided(&images, &truth, &options(1000));
        let found = decision(&trainer, "sh-degree");
        assert_eq!(trainer.state.gaussians.sh_degree > 0, expected, "{found:?}");
        assert_eq!(trainer.state.gaussians.sh_degree.to_string(), found.kept);
        assert!(found.by == "probe" && !found.candidates.is_empty(), "{found:?}");
    }
}

#[test]
fn exposures_are_kept_only_where_the_photos_differ() {
    let truth = scene(2, 0.0);
    for uneven in [false, true] {
        let gain = |i: usize| match (uneven, i % 3) {
            (false, _) => 1.0,
            (true, 0) => 0.8,
            (true, 1) => 1.0,
            (true, _) => 1.25,
        };
        let images = photos(&truth, 16, gain);
        let mut trainer = decided(&images, &truth, &options(1000));
        assert_eq!(trainer.fits_exposure(), uneven, "{:?}", decision(&trainer, "exposure"));
        if uneven {
            // Beyond a tenth there is no probe to deny them, and no offset.
            let found = decision(&trainer, "exposure");
            assert_eq!((found.kept.as_str(), found.by.as_str()), ("gain", "measured"), "{found:?}");
            // The gains that were applied are found, up to their mean.
            for _ in 0..400 {
                trainer.step();
            }
            let log_gain = |i: usize| f64::from(trainer.state.exposures.values[i][1]);
            let ratio = (log_gain(2) - log_gain(0)).exp();
            assert!((ratio / (1.25 / 0.8) - 1.0).abs() < 0.05, "{ratio}");
        }
    }
}

#[test]
fn a_far_background_is_kept_where_the_photos_show_one() {
    let mut truth = scene(3, 0.0);
    // A far colored sphere behind the subject, which the start points do not know.
    let near = truth.len();
    for i in 0..1500 {
        let z = 1.0 - (2.0 * f64::from(i) + 1.0) / 1500.0;
        let (a, r) = (f64::from(i) * 2.399_963, (1.0 - z * z).sqrt());
        truth.means.push([
            (200.0 * r * a.cos()) as f32,
            (200.0 * r * a.sin()) as f32,
            (200.0 * z) as f32,
        ]);
        truth.rotations.push([1.0, 0.0, 0.0, 0.0]);
        truth.log_scales.push([16f32.ln(); 3]);
        truth.opacity_logits.push(4.0);
        let row = 3 * truth.sh_coefficients();
        let color = [(3.0 * a).sin() as f32, (5.0 * z).sin() as f32, (2.0 * a).cos() as f32];
        truth.sh.extend(color);
        truth.sh.extend(vec![0.0; row - 3]);
    }
    let images = photos(&truth, 16, |_| 1.0);
    let known =
        SparsePoints { positions: truth.means[..near].to_vec(), colors: vec![[128; 3]; near] };
    let options = FitOptions { background_model: None, max_gaussians: Some(1500), ..options(1000) };
    let mut trainer = Trainer::new(&images, &known, None, &options, 0).unwrap();
    trainer.step();
    let found = decision(&trainer, "background-model");
    assert_eq!(found.kept, "shell", "{found:?}");
    let far = trainer.state.gaussians.means.iter().filter(|m| m[0].hypot(m[1]).hypot(m[2]) > 30.0);
    assert!(far.count() > 50);
    // Where no photo looked it goes on, behind.
    let (center, radius) = (trainer.state.scene.shell_center, trainer.state.scene.shell_radius);
    let from_center = |m: &[f32; 3]| (glam::Vec3::from(*m).as_dvec3() - center).length();
    let behind =
        trainer.state.gaussians.means.iter().filter(|m| from_center(m) > 1.2 * radius).count();
    assert!(behind > 100, "{behind} of {}", trainer.state.gaussians.len());
}

#[test]
fn a_uniform_background_becomes_one_color_or_less() {
    let truth = scene(4, 0.0);
    let images = photos_before(&truth, 16, [0.2; 3], |_| 1.0);
    let options = FitOptions { background_model: None, ..options(1000) };
    let mut trainer = Trainer::new(&images, &points(&truth), None, &options, 0).unwrap();
    trainer.step();
    let found = decision(&trainer, "background-model");
    assert_eq!(found.kept, "color", "{found:?}");
    // The model that is written shows the color against black, in every direction.
    let model = trainer.model();
    let away = motes_scene::Pose::look_at(
        glam::DVec3::new(3.0, 0.0, 0.0),
        glam::DVec3::new(9.0, 0.5, 0.0),
        glam::DVec3::Z,
    );
    let got = render(&model, &small_camera(32, 24), &away.unwrap(), &RenderOptions::default());
    let mean = got.color.data.iter().sum::<f32>() / got.color.data.len() as f32;
    assert!((mean - 0.2).abs() < 0.05, "{mean}");
}

#[test]
fn decisions_do_not_depend_on_threads_and_survive_a_checkpoint() {
    let truth = scene(5, 1.0);
    let images = photos(&truth, 9, |i| if i % 2 == 0 { 0.85 } else { 1.15 });
    let parameters = FitOptions { background_model: None, ..options(800) };
    let new = || Trainer::new(&images, &points(&truth), None, &parameters, 3).unwrap();
    let run = |mut trainer: Trainer, steps: u32| {
        for _ in 0..steps {
            trainer.step();
        }
        trainer
    };
    let pool = |n| rayon::ThreadPoolBuilder::new().num_threads(n).build().unwrap();
    let whole = pool(1).install(|| run(new(), 640).state);
    assert!(whole.model.is_decided() && whole.model.decisions.iter().any(|d| d.by == "probe"));
    assert!(pool(3).install(|| run(new(), 640).state) == whole);
    // Between the decisions, and after them.
    for stop in [100, 300, 600] {
        let state = run(new(), stop).state;
        let resumed = Trainer::resume(&images, &points(&truth), state, &parameters, 3).unwrap();
        assert!(run(resumed, 640 - stop).state == whole, "stopped after {stop}");
    }
}

#[test]
fn few_views_are_decided_by_rule_and_flags_need_no_probe() {
    let truth = scene(6, 0.0);
    let images = photos(&truth, 5, |_| 1.0);
    let trainer = decided(&images, &truth, &options(1000));
    assert!(trainer.probe_costs().is_empty());
    assert_eq!(trainer.state.gaussians.sh_degree, 1);
    let images = photos(&truth, 12, |_| 1.0);
    let given = FitOptions { sh_degree: Some(2), exposure: ExposureModel::Gain, ..options(1000) };
    let trainer = decided(&images, &truth, &given);
    assert!(trainer.probe_costs().is_empty());
    assert_eq!(trainer.state.gaussians.sh_degree, 2);
    assert!(trainer.fits_exposure());
}

#[test]
fn what_carries_nothing_goes_at_the_end() {
    let truth = scene(7, 0.0);
    let images = photos(&truth, 8, |_| 1.0);
    let mut trainer = Trainer::new(&images, &points(&truth), None, &options(400), 0).unwrap();
    while !trainer.is_done() {
        trainer.step();
    }
    // Gaussians behind every camera and one inside an opaque one carry nothing.
    let before = trainer.state.gaussians.len();
    let hide = |means: &mut Vec<[f32; 3]>| means.iter_mut().take(5).for_each(|m| m[2] = -500.0);
    hide(&mut trainer.state.gaussians.means);
    trainer.finish();
    let found = decision(&trainer, "pruning");
    assert!(trainer.state.gaussians.len() <= before - 5, "{found:?}");
    assert!(trainer.state.gaussians.means.iter().all(|m| m[2] > -400.0));
    assert_eq!(trainer.state.filter_3d.len(), trainer.state.gaussians.len());
}
