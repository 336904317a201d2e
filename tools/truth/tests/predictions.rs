//! Predictions carry the truth of the test views to the photos, with the errors that their grade names.

#![allow(clippy::unwrap_used, reason = "tests")]

use glam::{DVec3, Vec3};
use motes_math::median::median;
use motes_shading::brdf::Lobes;
use motes_truth::cameras::ring;
use motes_truth::predictions::{Grade, Seen, SurfaceCloud, views};
use motes_truth::render::{Buffers, buffers};
use motes_truth::scenes::SceneName;
use motes_truth::score::truth_folder::TruthFolder;
use motes_truth::world::World;
use motes_truth::{MakeOptions, make};

const PHOTOS: usize = 3;
const WIDTH: usize = 96;

/// What the second photo of a small scene shows, and its true buffers.
fn second_photo() -> (Vec<Option<Seen>>, Buffers) {
    let folder = tempfile::tempdir().unwrap();
    let options = MakeOptions {
        width: WIDTH,
        train_views: PHOTOS,
        test_views: 6,
        samples: 1,
        bounces: 1,
        no_relights: true,
        ..MakeOptions::default()
    };
    make(SceneName::Matte, &options, folder.path(), &mut |_| {}).unwrap();
    let truth = TruthFolder::open(folder.path()).unwrap();
    let cloud = SurfaceCloud::of_test_views(&truth).unwrap();
    assert!(cloud.extent().unwrap() > 0.1);
    let view = &views(&truth, "train").unwrap()[1];
    let ids = truth.ids(&view.name).unwrap();
    let recipe = SceneName::Matte.recipe();
    let world = World::new(&recipe, Lobes::Lambert).unwrap();
    let shot = &ring(&recipe, truth.size, PHOTOS, 6)[1];
    (cloud.seen_from(view, &ids), buffers(&world, shot))
}

fn degrees(a: Vec3, b: Vec3) -> f64 {
    f64::from(a.angle_between(b).to_degrees())
}

#[test]
fn photos_get_the_truth_of_the_test_views_with_the_errors_of_a_grade() {
    let (seen, truth) = second_photo();
    let known = || seen.iter().enumerate().filter_map(|(i, s)| Some((i, (*s)?)));
    let share = known().count() as f64 / seen.len() as f64;
    assert!(share > 0.5, "{share} of the photo predicted");
    let at = |data: &[f32], i: usize| Vec3::from_slice(&data[3 * i..3 * i + 3]);
    let off = |(i, s): (usize, Seen)| degrees(s.normal, at(&truth.normal.data, i));
    assert!(median(known().map(off)).unwrap() < 2.0);
    let off =
        |(i, s): (usize, Seen)| f64::from((s.base_color - at(&truth.albedo.data, i)).length());
    assert!(median(known().map(off)).unwrap() < 0.03);

    let photo = vec![0.4; 3 * seen.len()];
    for (grade, low, high) in
        [(Grade::Good, 1.0, 8.0), (Grade::Mediocre, 5.0, 25.0), (Grade::Adversarial, 10.0, 45.01)]
    {
        let predicted = grade.predict(&seen, &photo, WIDTH, 1.0, (0, 1));
        let lean = |i: usize, s: &Seen| degrees(s.normal, predicted[i].unwrap().normal);
        let lean = median(known().map(|(i, s)| lean(i, &s))).unwrap();
        assert!((low..high).contains(&lean), "{grade:?}: {lean} degrees");
        assert_eq!(predicted.iter().flatten().count(), known().count());
    }
}

#[test]
fn adversarial_errors_are_those_of_the_place_and_others_those_of_the_photo() {
    let place = Seen { base_color: Vec3::splat(0.3), normal: Vec3::X, position: DVec3::splat(0.2) };
    let of = |grade: Grade, photo| {
        let all = grade.predict(&[None, Some(place)], &[0.5; 6], 2, 1.0, (0, photo));
        assert!(all[0].is_none());
        all[1].unwrap()
    };
    let (a, b) = (of(Grade::Adversarial, 0), of(Grade::Adversarial, 7));
    assert_eq!((a.base_color, a.normal), (b.base_color, b.normal));
    assert!((degrees(a.normal, place.normal) - 45.0).abs() < 0.01);
    let (a, b) = (of(Grade::Good, 0), of(Grade::Good, 7));
    assert!(a.base_color != b.base_color && a.normal != b.normal);
}
