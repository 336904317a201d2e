//! Thin glass keeps and passes light as its two panes do; masked photos show their things alone, and only those are scored.

#![allow(clippy::unwrap_used, reason = "tests")]

use std::path::PathBuf;

use glam::Vec3;
use motes_formats::images::{read_image, write_png};
use motes_scene::ImageF32;
use motes_shading::brdf::Lobes;
use motes_shading::tracing::Ray;
use motes_truth::cameras::ring;
use motes_truth::glass::pane_reflectance;
use motes_truth::lights::environment;
use motes_truth::path::PathTracer;
use motes_truth::render::{buffers, radiance};
use motes_truth::scenes::{SceneName, SceneRecipe};
use motes_truth::score::align::Align;
use motes_truth::score::pictures::PSNR_CAP_DB;
use motes_truth::score::truth_folder::TruthFolder;
use motes_truth::score::{Results, score};
use motes_truth::world::World;
use motes_truth::{MakeOptions, make};

/// The hall's vase of clear glass, and nothing else.
fn vase() -> SceneRecipe {
    let mut recipe = SceneName::Hall.recipe();
    recipe.things.retain(|thing| thing.name == "vase");
    recipe.things[0].paint.palette.fill(Vec3::ONE);
    recipe.walls.clear();
    recipe.lamps.clear();
    recipe.has_ground = false;
    recipe
}

#[test]
fn clear_glass_in_a_furnace_cannot_be_seen() {
    let recipe = vase();
    let world = World::new(&recipe, Lobes::Burley).unwrap();
    let light = environment(&ImageF32::filled(16, 8, 3, 1.0)).unwrap();
    let tracer = PathTracer::new(&world, &light, 3, 1);
    let shot = &ring(&recipe, (240, 180), 4, 0)[1];
    let guide = buffers(&world, shot);
    let glass = (0..240 * 180).filter(|i| {
        let (x, y) = ((i % 240) as f64 + 0.5, (i / 240) as f64 + 0.5);
        world.see(&shot.ray(x, y).0).is_some()
    });
    let count = glass.count();
    assert!(count > 100, "{count}");
    let picture = radiance(&tracer, shot, &guide, 4, (1, 0));
    // A path that meets more than eight panes in a row is lost: two of a thousand at the most.
    let off = |v: &&f32| (**v - 1.0).abs() > 1e-4;
    let lost: f32 = picture.data.iter().filter(off).map(|v| 1.0 - v).sum::<f32>() / 3.0;
    assert!((0.0..2e-3 * count as f32).contains(&lost), "{lost} of {count} pixels");
}

#[test]
fn light_through_a_vessel_is_what_its_two_walls_leave() {
    let recipe = vase();
    let world = World::new(&recipe, Lobes::Burley).unwrap();
    let middle = 0.5 * (world.bounds[1].0 + world.bounds[1].1);
    // Level, through the axis: both walls are met alike.
    let ray = Ray::new(middle - Vec3::X * recipe.unit, Vec3::X);
    let first = world.see(&ray).unwrap();
    let kept = 1.0 - pane_reflectance(first.point.shading_normal.dot(Vec3::NEG_X));
    let through = world.transmittance(&ray).x;
    assert!((through - kept * kept).abs() < 2e-3, "{through} for {}", kept * kept);
    // Behind a lamp that is nearer than the second wall nothing is lost to it.
    let near = Ray { t_max: first.distance * 1.01, ..ray };
    assert!((world.transmittance(&near).x - kept).abs() < 1e-6);
    assert!(world.occluded(&ray) && world.see_through_glass(&ray).is_none());
    let mut painted = recipe.clone();
    painted.things[0].is_glass = false;
    let opaque = World::new(&painted, Lobes::Burley).unwrap();
    assert_eq!(opaque.transmittance(&ray), Vec3::ZERO);
}

#[test]
fn what_stands_behind_a_pane_is_what_buffers_show_and_the_id_is_the_pane() {
    let recipe = SceneName::Hall.recipe();
    let world = World::new(&recipe, Lobes::Burley).unwrap();
    let number = |name: &str| recipe.things.iter().position(|t| t.name == name).unwrap();
    let at = 0.5 * (world.bounds[number("pane") + 1].0 + world.bounds[number("pane") + 1].1);
    let ray = Ray::new(at - Vec3::Y * recipe.unit, Vec3::Y);
    let (pane, through) = (world.see(&ray).unwrap(), world.see_through_glass(&ray).unwrap());
    assert!(pane.is_glass && !through.is_glass);
    assert_eq!((pane.object, through.object), (number("pane") as u8 + 2, pane.object));
    assert!(through.distance > pane.distance);
    let behind = World::new(&without(&recipe, "pane"), Lobes::Burley).unwrap().see(&ray).unwrap();
    assert!((behind.distance - through.distance).abs() < 1e-4 * recipe.unit);
    let color = |seen: &motes_truth::world::Seen| seen.point.material.base_color_linear;
    assert!((color(&behind) - color(&through)).length() < 1e-3);
}

fn without(recipe: &SceneRecipe, name: &str) -> SceneRecipe {
    let mut rest = recipe.clone();
    rest.things.retain(|thing| thing.name != name);
    rest
}

#[test]
fn masked_photos_show_things_alone_and_what_is_around_them_is_not_scored() {
    let folder = tempfile::tempdir().unwrap();
    let options = MakeOptions {
        width: 64,
        train_views: 3,
        test_views: 2,
        samples: 2,
        ..MakeOptions::default()
    };
    make(SceneName::Figure, &options, folder.path(), &mut |_| {}).unwrap();
    let photo = read_image(&folder.path().join("images/train_000.png")).unwrap();
    assert_eq!(photo.channels, 4);
    let share = |wanted: fn(u8) -> bool| {
        let alphas = photo.data.chunks_exact(4).filter(|p| wanted(p[3]));
        alphas.count() as f64 / (64.0 * 48.0)
    };
    let [none, full, rim] = [share(|a| a == 0), share(|a| a == 255), share(|a| a % 255 != 0)];
    assert!(none > 0.4 && full > 0.05 && rim > 0.005, "{none} {full} {rim}");
    let objects = std::fs::read_to_string(folder.path().join("scene.json")).unwrap();
    assert!(objects.contains("\"masked\": true") && !objects.contains("\"ground\""));

    let truth = TruthFolder::open(folder.path()).unwrap();
    let own = folder.path().join("test/capture");
    let results = |pictures: PathBuf| Results { capture: Some(pictures), ..Results::default() };
    let scored = |pictures| {
        let scores = score(&truth, &results(pictures)).unwrap().capture.unwrap();
        scores.aligned[&Align::None].psnr_db
    };
    assert_eq!(scored(own.clone()), PSNR_CAP_DB);
    // Another background changes nothing, another figure does.
    for (name, changes_figure) in [("background", false), ("figure", true)] {
        let out = folder.path().join(name);
        std::fs::create_dir(&out).unwrap();
        for view in ["test_000", "test_001"] {
            let mut picture = read_image(&own.join(format!("{view}.png"))).unwrap();
            for pixel in picture.data.chunks_exact_mut(4) {
                if (pixel[3] == 255) == changes_figure {
                    pixel[0] ^= 64;
                }
            }
            write_png(&out.join(format!("{view}.png")), &picture).unwrap();
        }
        let psnr = scored(out);
        assert_eq!(psnr < 30.0, changes_figure, "{name}: {psnr} dB");
        assert_eq!(psnr == PSNR_CAP_DB, !changes_figure, "{name}: {psnr} dB");
    }
}
