//! The five exports of SAM that exist, as small graphs whose result is known: `testdata/sam/make.py` made them.
#![expect(clippy::unwrap_used, reason = "a test that cannot prepare its files has failed")]

use std::path::{Path, PathBuf};

use motes_formats::images::{read_image, write_png};
use motes_formats::provider::{PointPrompt, SegmentTask};
use motes_scene::ImageU8;
use provider_sam::{Chosen, Convention, Model, Sam, Weights};
use serde_json::Value;

const EXPORTS: [(&str, Convention); 5] = [
    ("meta", Convention::Meta),
    ("colors", Convention::Meta),
    ("js", Convention::Transformers),
    ("sam2", Convention::Sam2),
    ("sam2-js", Convention::Sam2Transformers),
];

fn data(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../testdata/sam").join(name)
}

fn sam(export: &str) -> Sam {
    Sam::load(&Weights::find(&data(export), None).unwrap(), 2, None).unwrap()
}

fn click(x: f64, y: f64, positive: bool) -> PointPrompt {
    PointPrompt { x, y, positive }
}

fn ask(export: &str, folder: &Path, task: &SegmentTask) -> Chosen {
    sam(export).chosen(task, folder).unwrap().0
}

#[test]
fn exports_are_recognized() {
    for (export, convention) in EXPORTS {
        let model = Model::load(&Weights::find(&data(export), None).unwrap(), 1).unwrap();
        assert_eq!((model.convention, model.side), (convention, 64), "{export}");
    }
}

#[test]
fn candidates_are_those_of_the_reference() {
    let expected: Value =
        serde_json::from_slice(&std::fs::read(data("expected.json")).unwrap()).unwrap();
    let numbers = |v: &Value| -> Vec<f64> {
        v.as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect()
    };
    let cases = expected.as_array().unwrap();
    assert_eq!(cases.len(), 19);
    for case in cases {
        let export = case["export"].as_str().unwrap();
        let prompt = &case["prompt"];
        let labels = prompt.get("labels").map(&numbers).unwrap_or_default();
        let points = prompt.get("points").and_then(Value::as_array).cloned().unwrap_or_default();
        let point = |(p, l): (&Value, &f64)| click(numbers(p)[0], numbers(p)[1], *l > 0.5);
        let task = SegmentTask {
            picture: prompt["picture"].as_str().unwrap().into(),
            points: points.iter().zip(&labels).map(point).collect(),
            around: prompt.get("box").map(|b| numbers(b).try_into().unwrap()),
            candidates: 3,
            ..SegmentTask::default()
        };
        let chosen = ask(export, &data(""), &task);
        let (scores, areas) = (numbers(&case["scores"]), numbers(&case["areas"]));
        // Two points are clear; exports with four masks have one for that.
        let mut meant: Vec<usize> = match (scores.len(), task.points.len()) {
            (4, 2) => vec![0],
            (4, _) => vec![1, 2, 3],
            _ => vec![0, 1, 2],
        };
        meant.sort_by(|&a, &b| areas[b].total_cmp(&areas[a]));
        assert_eq!(chosen.candidates.len(), meant.len(), "{case}");
        let every = case["every"].as_u64().unwrap() as usize;
        for (candidate, k) in chosen.candidates.iter().zip(meant) {
            assert!((candidate.predicted_iou - scores[k]).abs() < 1e-5, "{export} {prompt}");
            let area = candidate.logits.iter().filter(|v| **v > 0.0).count();
            assert_eq!(area as f64, areas[k], "{export} {prompt}");
            let found = candidate.logits.iter().step_by(every);
            for (a, b) in found.zip(numbers(&case["logits"][k])) {
                assert!((f64::from(*a) - b).abs() < 2e-3, "{export} {prompt}: {a} {b}");
            }
        }
        let best = &chosen.candidates[chosen.best];
        assert!(chosen.candidates.iter().all(|c| c.predicted_iou <= best.predicted_iou));
    }
}

/// A disc of radius 11 at a place of a picture.
fn disc(folder: &Path, (width, height): (usize, usize), at: (f64, f64)) -> Vec<bool> {
    let inside = |p: usize| {
        let (x, y) = ((p % width) as f64 + 0.5, (p / width) as f64 + 0.5);
        (x - at.0).hypot(y - at.1) <= 11.0
    };
    let mask: Vec<bool> = (0..width * height).map(inside).collect();
    let pixels = mask.iter().flat_map(|&m| if m { [230, 60, 40] } else { [20, 60, 150] }).collect();
    write_png(&folder.join("p.png"), &ImageU8::from_data(width, height, 3, pixels)).unwrap();
    mask
}

fn iou(logits: &[f32], mask: &[bool]) -> f64 {
    let both = logits.iter().zip(mask).filter(|(l, m)| **l > 0.0 && **m).count();
    let any = logits.iter().zip(mask).filter(|(l, m)| **l > 0.0 || **m).count();
    both as f64 / any as f64
}

#[test]
fn a_click_lands_on_the_pixel_whatever_the_shape_of_the_picture() {
    let folder = tempfile::tempdir().unwrap();
    for (export, _) in EXPORTS {
        for (size, at) in [
            ((64, 64), (20.0, 40.0)),
            ((64, 40), (50.0, 15.0)),
            ((40, 64), (24.0, 49.0)),
            ((90, 61), (70.0, 45.0)),
            ((61, 90), (14.0, 74.0)),
        ] {
            let mask = disc(folder.path(), size, at);
            let task = |x: f64, y: f64| SegmentTask {
                picture: "p.png".into(),
                points: vec![click(x, y, true)],
                candidates: 1,
                ..SegmentTask::default()
            };
            let chosen = ask(export, folder.path(), &task(at.0, at.1));
            let found = iou(&chosen.candidates[0].logits, &mask);
            assert!(found > 0.8, "{export} {size:?} {at:?}: {found:.3}");
            // The bad case: beside the disc the answer is what surrounds it.
            let beside = ask(export, folder.path(), &task(at.0 - 13.5, at.1));
            assert!(iou(&beside.candidates[0].logits, &mask) < 0.3, "{export} {size:?}");
        }
    }
}

#[test]
fn pictures_of_one_pixel_and_of_one_row_have_masks_of_their_size() {
    let folder = tempfile::tempdir().unwrap();
    for (export, _) in EXPORTS {
        for (w, h) in [(1, 1), (300, 1), (1, 200)] {
            let picture = ImageU8::filled(w, h, 3, 100);
            write_png(&folder.path().join("p.png"), &picture).unwrap();
            let task = SegmentTask {
                picture: "p.png".into(),
                points: vec![click(0.5, 0.5, true)],
                candidates: 3,
                ..SegmentTask::default()
            };
            let chosen = ask(export, folder.path(), &task);
            assert!(chosen.candidates.iter().all(|c| c.logits.len() == w * h), "{export} {w}x{h}");
        }
    }
}

#[test]
fn results_are_the_same_at_any_number_of_threads() {
    let task = SegmentTask {
        picture: "wide.png".into(),
        points: vec![click(15.0, 12.0, true)],
        candidates: 3,
        ..SegmentTask::default()
    };
    for (export, _) in EXPORTS {
        let weights = Weights::find(&data(export), None).unwrap();
        let with =
            |threads| Sam::load(&weights, threads, None).unwrap().chosen(&task, &data("")).unwrap();
        assert_eq!(with(1).0, with(2).0, "{export}");
    }
}

#[test]
fn an_embedding_on_disk_answers_as_a_new_one() {
    let cache = tempfile::tempdir().unwrap();
    let folder = cache.path().to_owned();
    let weights = Weights::find(&data("sam2"), None).unwrap();
    let task = |x, y| SegmentTask {
        picture: "wide.png".into(),
        points: vec![click(x, y, true)],
        candidates: 3,
        ..SegmentTask::default()
    };
    let ask = |task: &SegmentTask, cache: Option<&PathBuf>| {
        Sam::load(&weights, 1, cache).unwrap().chosen(task, &data("")).unwrap().0
    };
    let fresh = ask(&task(15.0, 12.0), Some(&folder));
    assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 1);
    assert_eq!(ask(&task(15.0, 12.0), Some(&folder)), fresh);
    assert_eq!(ask(&task(37.0, 21.0), Some(&folder)), ask(&task(37.0, 21.0), None));
    assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 1);
}

/// Why a model cannot be loaded: cause and remedy.
fn refused(folder: &Path) -> (String, String) {
    let weights = Weights::find(folder, None).unwrap();
    let error = Model::load(&weights, 1).err().expect("it loads").to_string();
    let (cause, help) = error.split_once("\nhelp: ").unwrap();
    assert!(!cause.contains('\n') && cause.contains(".onnx"), "{error}");
    (cause.to_owned(), help.to_owned())
}

#[test]
fn bad_weights_are_told_with_a_remedy() {
    let (encoder, decoder) = ("vision_encoder.onnx", "prompt_encoder_mask_decoder.onnx");
    let folder = |parts: [(&str, Vec<u8>); 2]| {
        let folder = tempfile::tempdir().unwrap();
        parts
            .iter()
            .for_each(|(name, bytes)| std::fs::write(folder.path().join(name), bytes).unwrap());
        folder
    };
    let bytes = |export: &str, name: &str| std::fs::read(data(export).join(name)).unwrap();
    let good = bytes("meta", decoder);
    for part in [0, 10, 1000, good.len() - 40] {
        let half = folder([(encoder, bytes("meta", encoder)), (decoder, good[..part].to_vec())]);
        let (cause, help) = refused(half.path());
        assert!(
            cause.contains("cannot be loaded") && help.contains("incomplete"),
            "{part}: {cause}"
        );
    }
    let text = folder([(encoder, b"<html>not found</html>".to_vec()), (decoder, good.clone())]);
    assert!(refused(text.path()).0.contains("cannot be loaded"));
    // Encoders where decoders belong, and of another export.
    let twice = folder([(encoder, bytes("meta", encoder)), (decoder, bytes("meta", encoder))]);
    let (cause, help) = refused(twice.path());
    assert!(cause.contains("not a decoder of SAM, its inputs are images"), "{cause}");
    assert!(help.contains("segment-anything") && help.contains("SAM 2.1"), "{help}");
    let swapped = folder([(encoder, good.clone()), (decoder, good)]);
    assert!(refused(swapped.path()).0.contains("not an encoder of SAM"));
    let mixed = folder([(encoder, bytes("meta", encoder)), (decoder, bytes("sam2", decoder))]);
    let (cause, help) = refused(mixed.path());
    assert!(cause.contains("image_embed, which the encoder does not make"), "{cause}");
    assert!(help.contains("of one export"), "{help}");
}

#[test]
fn weights_of_16_bits_answer_as_those_of_32() {
    let task = SegmentTask {
        picture: "wide.png".into(),
        points: vec![click(15.0, 12.0, true)],
        candidates: 3,
        ..SegmentTask::default()
    };
    let (half, full) = (ask("half", &data(""), &task), ask("meta", &data(""), &task));
    for (a, b) in half.candidates.iter().zip(&full.candidates) {
        assert!(a.logits.iter().zip(&b.logits).all(|(a, b)| (a - b).abs() < 0.05));
    }
}

#[test]
fn a_mask_of_an_earlier_answer_is_a_prompt_where_the_export_takes_one() {
    use motes_formats::provider::{ProviderRequest, Task, TaskResult};
    let folder = tempfile::tempdir().unwrap();
    std::fs::copy(data("wide.png"), folder.path().join("wide.png")).unwrap();
    let mut task = SegmentTask {
        picture: "wide.png".into(),
        points: vec![click(15.0, 12.0, true)],
        candidates: 3,
        ..SegmentTask::default()
    };
    let mut sam_meta = sam("meta");
    let first = ProviderRequest::new(Task::Segment(task.clone()), 0);
    let reply = sam_meta.answer(&first, folder.path()).unwrap();
    let TaskResult::Segment(result) = reply.result else { panic!() };
    assert_eq!((result.masks.len(), reply.warnings.len()), (3, 0));
    let mask = read_image(&folder.path().join(&result.masks[0].mask)).unwrap();
    assert_eq!((mask.width, mask.height), (50, 30));
    task.logits = result.masks[0].logits.clone();
    let (chosen, ..) = sam_meta.chosen(&task, folder.path()).unwrap();
    // The graph adds half of the mask's logits to its own, and a click and a mask are clear.
    assert_eq!(chosen.candidates.len(), 1);
    let (without, ..) =
        sam_meta.chosen(&SegmentTask { logits: None, ..task.clone() }, folder.path()).unwrap();
    let sharper =
        |k: usize| chosen.candidates[0].logits[k].abs() > without.candidates[0].logits[k].abs();
    assert!(sharper(12 * 50 + 15) && sharper(28 * 50 + 2));
    let (_, _, warnings) = sam("js").chosen(&task, folder.path()).unwrap();
    assert!(warnings[0].contains("takes no mask"), "{warnings:?}");
    task.around = Some([1.0, 1.0, 30.0, 29.0]);
    let (_, _, warnings) = sam("js").chosen(&task, folder.path()).unwrap();
    assert!(warnings[0].contains("takes no box"), "{warnings:?}");
}

#[cfg(unix)]
#[test]
fn the_program_conforms() {
    use motes_formats::provider::ProviderKind;
    use motes_protocol::ProviderCommand;
    use motes_protocol::conformance::{Outcome, conformance};
    let program = Path::new(env!("CARGO_BIN_EXE_motes-provider-sam"));
    for (export, _) in EXPORTS {
        let folder = data(export).display().to_string();
        let arguments = ["--model", &folder, "--cache", "none"].map(str::to_owned);
        let command = ProviderCommand::of_program(program, &arguments);
        let (_, findings) = conformance(&command, ProviderKind::Segment, 60.0, &|| false).unwrap();
        for finding in findings {
            assert_eq!(finding.outcome, Outcome::Passed, "{export}: {}", finding.check);
        }
    }
}
