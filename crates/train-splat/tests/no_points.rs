//! Captures without start points, one for each way that people take photos, and captures that no fit
//! can do justice to.

#![expect(clippy::unwrap_used, reason = "a test that cannot prepare its scene has failed")]

use motes_raster::{RenderOptions, render};
use motes_scene::{Pose, SparsePoints};
use motes_testkit::made_photos::{
    MadePhoto, blank, forward_facing, ring_around_object, ring_in_surroundings, shuffled, walk,
};
use train_splat::{Failure, FitOptions, StartFrom, Trainer, TrainingImage};

/// Long enough to be judged like a run of a preset.
const STEPS: u32 = 500;

fn options() -> FitOptions {
    FitOptions {
        iterations: Some(STEPS),
        max_gaussians: Some(6000),
        refine_every: Some(100),
        resolution_schedule: Some("0.5:0.6,1:0.4".into()),
        ..FitOptions::default()
    }
}

fn training_images(photos: &[MadePhoto]) -> Vec<TrainingImage> {
    photos
        .iter()
        .map(|photo| TrainingImage {
            name: photo.name.clone(),
            camera: photo.camera,
            camera_from_world: photo.camera_from_world,
            image: photo.image.clone().into(),
            mask: None,
            exposure_gain: 1.0,
        })
        .collect()
}

/// Every eighth photo is held out.
fn split(photos: Vec<MadePhoto>) -> [Vec<MadePhoto>; 2] {
    let (test, train) = photos.into_iter().enumerate().partition(|(i, _)| i % 8 == 4);
    let plain = |photos: Vec<(usize, MadePhoto)>| photos.into_iter().map(|(_, p)| p).collect();
    [plain(train), plain(test)]
}

fn fit(photos: &[MadePhoto], options: &FitOptions) -> Trainer {
    let images = training_images(photos);
    let mut trainer = Trainer::new(&images, &SparsePoints::default(), None, options, 0).unwrap();
    while !trainer.is_done() {
        trainer.step();
    }
    trainer.finish();
    trainer
}

/// Mean PSNR, dB, of photos over black.
fn psnr(trainer: &Trainer, photos: &[MadePhoto]) -> f64 {
    let model = trainer.model();
    let one = |photo: &MadePhoto| {
        let got =
            render(&model, &photo.camera, &photo.camera_from_world, &RenderOptions::default());
        let channels = photo.image.channels;
        let pairs = got.color.data.chunks_exact(3).zip(photo.image.data.chunks_exact(channels));
        let squares: f64 = pairs
            .map(|(render, photo)| {
                let alpha = if channels == 4 { f32::from(photo[3]) / 255.0 } else { 1.0 };
                let error = |c: usize| (render[c] - alpha * f32::from(photo[c]) / 255.0).powi(2);
                f64::from(error(0) + error(1) + error(2))
            })
            .sum();
        -10.0 * (squares / got.color.data.len() as f64).log10()
    };
    photos.iter().map(one).sum::<f64>() / photos.len() as f64
}

/// The start's own words.
fn reason(trainer: &Trainer) -> &str {
    let decisions = &trainer.state.model.decisions;
    &decisions.iter().find(|d| d.component == "start").unwrap().reason
}

/// Fits and asks for so many dB on the held-out photos.
#[track_caller]
fn reaches(photos: Vec<MadePhoto>, least: f64) -> Trainer {
    let [train, test] = split(photos);
    let mut trainer = fit(&train, &options());
    let got = psnr(&trainer, &test);
    assert!(got >= least, "{got:.2} dB of {least} dB with {}", reason(&trainer));
    assert_eq!(trainer.state.model.start.from, StartFrom::Photos);
    let poses = trainer.state.model.start.poses.clone().unwrap();
    assert!(!poses.is_contradiction(), "{poses:?}");
    let gaussians = trainer.state.gaussians.len();
    assert_eq!(trainer.health().failure(gaussians, STEPS), None);
    trainer
}

#[test]
fn a_ring_around_an_object_on_nothing() {
    let trainer = reaches(ring_around_object(100), 29.0);
    assert!(reason(&trainer).contains("visual hull"), "{}", reason(&trainer));
}

#[test]
fn an_object_in_surroundings_with_a_far_background() {
    reaches(ring_in_surroundings(48), 20.0);
}

#[test]
fn photos_that_all_look_one_way() {
    reaches(forward_facing(25), 34.0);
}

#[test]
fn photos_of_a_walk() {
    reaches(walk(40), 29.0);
}

#[test]
fn photos_that_see_a_part_each_get_more_steps_and_a_resumed_fit_as_many() {
    let preset = FitOptions { iterations: None, ..options() };
    let begun = |photos: &[MadePhoto]| {
        let images = training_images(photos);
        let trainer = Trainer::new(&images, &SparsePoints::default(), None, &preset, 0).unwrap();
        (images, trainer)
    };
    let (_, object) = begun(&ring_around_object(30));
    let (images, walked) = begun(&walk(40));
    let [own, more] = [&object, &walked].map(|trainer| trainer.plan().iterations);
    // 30 photos of all of the object, 40 of parts of a street.
    assert_eq!(object.plan().steps_factor, 1.5);
    assert!(more > own + own / 10 && walked.plan().steps_factor <= 2.0, "{own} and {more}");
    let decided =
        walked.state.model.decisions.iter().find(|d| d.component == "iterations").unwrap();
    assert_eq!(decided.kept, more.to_string(), "{}", decided.reason);
    let state = walked.state.clone();
    let again = Trainer::resume(&images, &SparsePoints::default(), state, &preset, 0).unwrap();
    assert_eq!(again.plan().iterations, more);
}

#[test]
fn poses_shuffled_among_photos_contradict_their_matches() {
    let contradiction = |photos: &[MadePhoto]| {
        let images = training_images(photos);
        Trainer::new(&images, &SparsePoints::default(), None, &options(), 0)
            .unwrap()
            .check_poses(&images)
            .clone()
    };
    let photos = ring_around_object(100);
    let (right, wrong) = (contradiction(&photos), contradiction(&shuffled(photos)));
    assert!(right.agreement().unwrap() > 0.8 && right.contradicting.is_empty(), "{right:?}");
    assert!(wrong.is_contradiction() && wrong.agreement().unwrap() < 0.2, "{wrong:?}");
    assert!(wrong.contradicting.len() > wrong.photos / 2, "{wrong:?}");
}

#[test]
fn blank_photos_have_nothing_to_find() {
    let mut trainer = fit(&blank(ring_around_object(12)), &options());
    let gaussians = trainer.state.gaussians.len();
    let failure = trainer.health().failure(gaussians, STEPS);
    assert!(matches!(failure, Some(Failure::BlankPhotos | Failure::Empty)), "{failure:?}");
    assert_eq!(trainer.check_poses(&[]).agreement(), None);
}

#[test]
fn photos_from_one_place_are_laid_on_a_sphere() {
    let one = walk(8).remove(3);
    // Thirty photos of one pose: there is no depth to find, and the picture is known all the same.
    let photos: Vec<MadePhoto> = (0..30).map(|_| one.clone()).collect();
    let mut trainer = fit(&photos, &options());
    assert!(reason(&trainer).contains("one place"), "{}", reason(&trainer));
    let got = psnr(&trainer, &photos[..1]);
    assert!(got > 20.0, "{got:.2} dB");
    let gaussians = trainer.state.gaussians.len();
    assert_eq!(trainer.health().failure(gaussians, STEPS), None);
    // Turning on the spot: photos that overlap agree by a rotation.
    let turned: Vec<MadePhoto> = (0..4)
        .map(|i| {
            let eye = one.camera_from_world.center_in_world();
            let angle = 1.4 + 0.1 * f64::from(i);
            let ahead = glam::DVec3::new(angle.cos(), angle.sin(), 0.0);
            let camera_from_world = Pose::look_at(eye, eye + ahead, glam::DVec3::Z).unwrap();
            MadePhoto { camera_from_world, ..one.clone() }
        })
        .collect();
    let images = training_images(&turned);
    let trainer = Trainer::new(&images, &SparsePoints::default(), None, &options(), 0).unwrap();
    assert!(reason(&trainer).contains("one place"), "{}", reason(&trainer));
}

#[test]
fn the_start_is_the_same_at_any_thread_count() {
    let images = training_images(&ring_around_object(16));
    let start = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let points = SparsePoints::default();
        pool.install(|| Trainer::new(&images, &points, None, &options(), 3).unwrap().state)
    };
    let one = start(1);
    assert!(one.gaussians.len() > 500, "{}", one.gaussians.len());
    assert!(start(2) == one && start(3) == one);
}

#[test]
fn a_start_that_is_asked_for_is_taken_and_the_next_one_is_another() {
    let images = training_images(&ring_around_object(12));
    let random = FitOptions { start: StartFrom::Random, init_random: 700, ..options() };
    let trainer = Trainer::new(&images, &SparsePoints::default(), None, &random, 0).unwrap();
    assert_eq!(trainer.state.gaussians.len(), 700);
    assert_eq!((trainer.state.model.start.from, trainer.next_start()), (StartFrom::Random, None));
    let again = Trainer::starting_from(
        &images,
        &SparsePoints::default(),
        None,
        &[StartFrom::Photos],
        &options(),
        0,
    );
    let start = again.unwrap().state.model.start;
    assert_eq!((start.from, start.failed), (StartFrom::Random, vec![StartFrom::Photos]));
}
