//! Prompts on a made scene: a floor with a red box and a blue box beside it.
#![expect(clippy::unwrap_used, reason = "a test that cannot prepare its scene has failed")]

mod projected;
mod scene;

use std::path::Path;

use glam::Vec3;
use motes_formats::selection::{
    BoundGaussians, SelectionDocument, SelectionNotes, sha256_of_bytes, write_selection,
};
use motes_formats::selectors::{BoxPrompt, Click, ObjectPrompt, parse_step};
use motes_raster::Antialias;
use motes_scene::{ImageU8, Selection};
use scene::{BLUE, BLUE_TOP, FLOOR, RED, RED_TOP, click_on, held_out_iou, scene, scene_with};
use segment_select::{SelectError, SelectSource, propose, select, selection_mask};

#[test]
fn one_click_selects_the_box_under_it() {
    let (g, part, capture) = scene();
    let source =
        SelectSource::new(&g, Antialias::Classic).with_capture(&capture, Path::new("c.json"));
    for (top, label) in [(RED_TOP, RED), (BLUE_TOP, BLUE)] {
        for view in [0, 4, 8] {
            let clicks = vec![click_on(&capture, view, top, true)];
            let prompt = ObjectPrompt { clicks, ..ObjectPrompt::default() };
            let found = propose(&source, &prompt, 3).unwrap();
            let truth = Selection::where_true(g.len(), |i| part[i] == label);
            let iou = held_out_iou(&source, &capture, &found[0].selection, &truth);
            assert!(iou > 0.9, "part {label} from view {view}: IoU {iou}");
            let counts: Vec<usize> = found.iter().map(|p| p.selection.count()).collect();
            assert!(counts.windows(2).all(|w| w[1] < w[0]), "nested: {counts:?}");
        }
    }
}

#[test]
fn boxes_that_touch_are_taken_apart() {
    // They touch at their corners; together they are better closed than each alone.
    let (g, part, capture) = scene_with(Vec3::new(-0.1, -0.75, -0.2));
    let source =
        SelectSource::new(&g, Antialias::Classic).with_capture(&capture, Path::new("c.json"));
    for (top, label) in [(RED_TOP, RED), ([0.2, -0.45, 0.4], BLUE)] {
        let clicks = vec![click_on(&capture, 2, top, true)];
        let prompt = ObjectPrompt { clicks, ..ObjectPrompt::default() };
        let found = propose(&source, &prompt, 1).unwrap().remove(0).selection;
        let truth = Selection::where_true(g.len(), |i| part[i] == label);
        let iou = held_out_iou(&source, &capture, &found, &truth);
        assert!(iou > 0.85, "part {label}: IoU {iou}");
    }
}

#[test]
fn further_prompts_add_and_take_away() {
    let (g, part, capture) = scene();
    let source =
        SelectSource::new(&g, Antialias::Classic).with_capture(&capture, Path::new("c.json"));
    let iou = |prompt: &ObjectPrompt, wanted: &[u32]| {
        let found = propose(&source, prompt, 1).unwrap().remove(0).selection;
        let truth = Selection::where_true(g.len(), |i| wanted.contains(&part[i]));
        held_out_iou(&source, &capture, &found, &truth)
    };
    let clicks = vec![click_on(&capture, 1, RED_TOP, true), click_on(&capture, 2, BLUE_TOP, true)];
    let both = ObjectPrompt { clicks, ..ObjectPrompt::default() };
    assert!(iou(&both, &[RED, BLUE]) > 0.9, "two clicks, two boxes: {}", iou(&both, &[RED, BLUE]));
    let clicks = vec![click_on(&capture, 1, RED_TOP, true), click_on(&capture, 1, BLUE_TOP, false)];
    let without = ObjectPrompt { clicks, ..ObjectPrompt::default() };
    assert!(iou(&without, &[RED]) > 0.9, "a negative click on the other box");
    let p = click_on(&capture, 3, [-0.4, 0.0, 0.3], true).pixel;
    let pixels = [p[0] - 24.0, p[1] - 28.0, p[0] + 24.0, p[1] + 28.0];
    let boxes = vec![BoxPrompt { view: "v3.png".into(), pixels }];
    let boxed = ObjectPrompt { boxes, ..ObjectPrompt::default() };
    assert!(iou(&boxed, &[RED]) > 0.85, "a rectangle: {}", iou(&boxed, &[RED]));
}

#[test]
fn corrections_take_back_and_turn_from_the_support() {
    let (g, part, capture) = scene();
    let source =
        SelectSource::new(&g, Antialias::Classic).with_capture(&capture, Path::new("c.json"));
    let iou = |clicks: &[Click], wanted: &[u32]| {
        let prompt = ObjectPrompt { clicks: clicks.to_vec(), ..ObjectPrompt::default() };
        let found = propose(&source, &prompt, 1).unwrap().remove(0).selection;
        let truth = Selection::where_true(g.len(), |i| wanted.contains(&part[i]));
        held_out_iou(&source, &capture, &found, &truth)
    };
    let [red, blue, no_blue] = [
        click_on(&capture, 1, RED_TOP, true),
        click_on(&capture, 2, BLUE_TOP, true),
        click_on(&capture, 4, BLUE_TOP, false),
    ];
    let taken_back = iou(&[red.clone(), blue, no_blue.clone()], &[RED]);
    assert!(taken_back > 0.9, "a second box, taken back: {taken_back}");
    // The first click missed the box and finds the floor; the others tell.
    let missed = click_on(&capture, 4, [-0.85, 0.0, 0.0], true);
    let missed = iou(&[missed, red, no_blue], &[RED]);
    assert!(missed > 0.85, "the support is not meant where one click is on a thing: {missed}");
}

#[test]
fn the_number_of_threads_changes_nothing() {
    let (g, _, capture) = scene();
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let source = SelectSource::new(&g, Antialias::Classic)
                .with_capture(&capture, Path::new("c.json"));
            let clicks = vec![click_on(&capture, 2, RED_TOP, true)];
            let prompt = ObjectPrompt { clicks, ..ObjectPrompt::default() };
            propose(&source, &prompt, 1).unwrap().remove(0).selection
        })
    };
    assert_eq!(run(1), run(3));
}

#[test]
fn the_cache_changes_nothing_and_damage_is_mended() {
    let (g, _, capture) = scene();
    let folder = tempfile::tempdir().unwrap();
    let bound = BoundGaussians {
        sha256: sha256_of_bytes(b"g"),
        count: g.len() as u64,
        name: String::new(),
        same_rows_as: None,
    };
    let run = || {
        let source = SelectSource::new(&g, Antialias::Classic)
            .with_capture(&capture, Path::new("c.json"))
            .bound_to(bound.clone())
            .with_cache(folder.path());
        let clicks = vec![click_on(&capture, 2, RED_TOP, true)];
        let prompt = ObjectPrompt { clicks, ..ObjectPrompt::default() };
        propose(&source, &prompt, 1).unwrap().remove(0).selection
    };
    let first = run();
    let files: Vec<_> =
        std::fs::read_dir(folder.path()).unwrap().map(|e| e.unwrap().path()).collect();
    assert_eq!(files.len(), 8);
    assert_eq!(run(), first);
    let bytes = std::fs::read(&files[0]).unwrap();
    std::fs::write(&files[0], &bytes[..bytes.len() / 2]).unwrap();
    assert_eq!(run(), first);
}

#[test]
fn shapes_properties_and_sets_combine() {
    let (g, part, capture) = scene();
    let bound = BoundGaussians {
        sha256: sha256_of_bytes(b"g"),
        count: g.len() as u64,
        name: String::new(),
        same_rows_as: None,
    };
    let source = SelectSource::new(&g, Antialias::Classic)
        .with_capture(&capture, Path::new("c.json"))
        .bound_to(bound.clone());
    let count = |steps: &[&str]| {
        let steps: Vec<_> = steps.iter().map(|s| parse_step(s).unwrap()).collect();
        select(&source, &steps).map(|s| s.count())
    };
    let of = |label: u32| part.iter().filter(|&&p| p == label).count();
    assert_eq!(count(&["all"]).unwrap(), g.len());
    assert_eq!(count(&["label=1", "add:label=2"]).unwrap(), of(RED) + of(BLUE));
    assert_eq!(count(&["all", "subtract:label=0"]).unwrap(), of(RED) + of(BLUE));
    assert_eq!(count(&["label=1", "invert"]).unwrap(), g.len() - of(RED));
    assert_eq!(count(&["property=z,gt,0.001"]).unwrap(), of(RED) + of(BLUE));
    assert_eq!(count(&["property=z,gt,0.001", "intersect:property=x,lt,0"]).unwrap(), of(RED));
    assert_eq!(count(&["box=-0.71,-0.31,0.01,-0.09,0.31,0.7"]).unwrap(), of(RED));
    assert_eq!(count(&["ids=0-9,12"]).unwrap(), 11);
    // Within half a cell of the floor's own spacing nothing is added, beyond it the neighbors are.
    assert_eq!(count(&["ids=0", "grow=0.05"]).unwrap(), 1);
    assert_eq!(count(&["ids=0", "grow=0.11"]).unwrap(), 3);
    assert_eq!(count(&["ids=0", "shrink=0.11"]).unwrap(), 0);
    // Gaussians of 0.06 put the depths of the floor that much in front of it.
    let floor = count(&["ground=on,0.12"]).unwrap();
    assert!(floor >= of(FLOOR) && floor < of(FLOOR) + of(RED) / 2, "{floor}");
    let red = count(&["color=0.7,0.2,0.2,30", "intersect:property=z,gt,0.01"]).unwrap();
    assert_eq!(red, of(RED));
    let near = count(&["connected=-0.4,0,0.6,0.06"]).unwrap();
    assert_eq!(near, of(RED), "the red box is closed and apart from the rest");
    let seen = count(&["property=visibility_count,gte,1"]).unwrap();
    assert!(seen > g.len() / 2 && seen <= g.len());
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("s.json");
    let red = Selection::where_true(g.len(), |i| part[i] == RED);
    let document = SelectionDocument::new(&red, bound, SelectionNotes::default());
    write_selection(&path, &document).unwrap();
    assert_eq!(count(&[&format!("file={}", path.display())]).unwrap(), of(RED));
}

#[test]
fn shapes_in_views_and_masks_select() {
    let (g, part, capture) = scene();
    let source =
        SelectSource::new(&g, Antialias::Classic).with_capture(&capture, Path::new("c.json"));
    let of = |step: &str| select(&source, &[parse_step(step).unwrap()]).unwrap();
    let p = click_on(&capture, 0, RED_TOP, true).pixel;
    let brush = of(&format!("brush=v0,6,{},{}", p[0], p[1]));
    assert!(brush.count() > 3 && brush.rows().iter().all(|&i| part[i as usize] == RED));
    // Deep: a rectangle takes the floor behind as well.
    let deep =
        of(&format!("rectangle=v0,{},{},{},{}", p[0] - 6.0, p[1] - 6.0, p[0] + 6.0, p[1] + 6.0));
    assert!(deep.rows().iter().any(|&i| part[i as usize] != RED));
    // A mask of one view finds the sides that the view does not show.
    let truth = Selection::where_true(g.len(), |i| part[i] == RED);
    let camera = capture.cameras[0].as_pinhole().unwrap();
    let pose = &capture.views[2].camera_from_world;
    let mask: ImageU8 = selection_mask(&g, &truth, &camera, pose, &source.options).to_u8();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("mask.png");
    motes_formats::images::write_png(&path, &mask).unwrap();
    let found = of(&format!("mask=v2,{}", path.display()));
    let iou = held_out_iou(&source, &capture, &found, &truth);
    assert!(iou > 0.9, "mask: {iou}");
}

#[test]
fn what_does_not_exist_is_named() {
    let (g, _, capture) = scene();
    let source =
        SelectSource::new(&g, Antialias::Classic).with_capture(&capture, Path::new("c.json"));
    let error = |step: &str| select(&source, &[parse_step(step).unwrap()]).unwrap_err();
    assert!(matches!(error("click=nope,1,1"), SelectError::NoSuchView { .. }));
    assert!(matches!(error("click=v0,160,1"), SelectError::PixelOutside { .. }));
    assert!(matches!(error("click=v0,5,5,-"), SelectError::NothingPositive));
    assert!(matches!(error("property=nope,lt,1"), SelectError::NoSuchProperty { .. }));
    assert!(matches!(error("ids=4000000"), SelectError::BadValue(_)));
    assert!(matches!(error("file=nope.json"), SelectError::BadValue(_)));
    assert!(matches!(error("mask=v0,nope.png"), SelectError::Format(_)));
    let blind = SelectSource::new(&g, Antialias::Classic);
    let step = parse_step("click=v0,5,5").unwrap();
    assert!(matches!(select(&blind, &[step]).unwrap_err(), SelectError::NoCapture(_)));
}
