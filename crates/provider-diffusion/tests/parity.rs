//! Each network, the schedules, and both ways from pictures to pictures, against diffusers and transformers.
#![expect(clippy::unwrap_used, reason = "a test that cannot prepare its files has failed")]

mod common;

use candle_core::{DType, Device, Tensor};
use clap::ValueEnum as _;
use common::*;
use motes_formats::images::read_image;
use provider_diffusion::edit::{Edit, EditedView, edited, edited_at, edited_latents, signal_of};
use provider_diffusion::network::{
    Autoencoder, AutoencoderConfig, TextEncoder, TextEncoderConfig, UNet, UNetConfig,
};
use provider_diffusion::parts::unet;
use provider_diffusion::pictures::{read_foreground, working_size};
use provider_diffusion::relight::{Light, Pass, Passes, Subject, denoised, on_gray, relit};
use provider_diffusion::sampler::Stepper;
use provider_diffusion::schedule::{Plan, Sampler, Schedule};
use provider_diffusion::tokens::Tokens;
use provider_diffusion::weights::{Place, Source, TensorFile, part};

/// Largest difference over the largest value.
const ALLOWED: f32 = 1e-4;

#[test]
fn texts_become_the_tokens_of_transformers() {
    let tokens = Tokens::load(&data("tokenizer"), 77).unwrap();
    let cases = document("tokens.json");
    assert!(cases.as_array().unwrap().len() > 12);
    for case in cases.as_array().unwrap() {
        let wanted: Vec<u32> = serde_json::from_value(case["tokens"].clone()).unwrap();
        assert_eq!(tokens.numbers(case["text"].as_str().unwrap()).unwrap(), wanted, "{case}");
    }
    // Pairs are joined: fewer tokens than letters.
    assert_eq!(tokens.numbers("light").unwrap().len(), 1);
}

#[test]
fn long_texts_become_chunks_with_marks() {
    let tokens = Tokens::load(&data("tokenizer"), 77).unwrap();
    let end = tokens.chunks("").unwrap()[0][1];
    let chunks = tokens.chunks(&"b ".repeat(160)).unwrap();
    assert_eq!(chunks.len(), 3);
    assert!(chunks.iter().all(|row| row.len() == 77 && row[0] == end - 1 && row[76] == end));
    assert_eq!(chunks[2].iter().filter(|t| **t == end).count(), 77 - 1 - 10);
    assert!(tokens.chunks(&"b ".repeat(601)).unwrap_err().to_string().contains("601 tokens"));
    assert!(tokens.one(&"b ".repeat(76)).unwrap_err().to_string().contains("the model reads 75"));
    assert_eq!(tokens.one(&"b ".repeat(75)).unwrap().len(), 77);
}

#[test]
fn the_text_encoder_agrees() {
    let part = part(&data(""), "text_encoder").unwrap();
    let config: TextEncoderConfig = part.config().unwrap();
    let source = Source::files(
        TensorFile::open(&part.path).unwrap(),
        None,
        (&Device::Cpu, DType::F32),
        "the text encoder",
        TextEncoder::renamed,
        |place: &Place<'_>| TextEncoder::new(place, &config).map(|_| ()),
    );
    let source = source.unwrap();
    let network = TextEncoder::new(&source.root(), &config).unwrap();
    let texts = [vec![5, 7, 300, 12, 510, 3, 3, 3], vec![1, 2, 3, 4, 5, 6, 7, 8]];
    let made = network.embedded(&texts).unwrap();
    assert_close("text encoder", &made, &expected("text.embedding"), ALLOWED);
    assert!(network.embedded(&[vec![99_999]]).is_err());
}

#[test]
fn the_autoencoder_agrees() {
    let network = parts().autoencoder;
    let photo = hashed("photo", &[1, 3, 32, 48]);
    let latents = network.encode(&photo).unwrap();
    assert_close("autoencoder, latents", &latents, &expected("autoencoder.latents"), ALLOWED);
    let pixels = network.decode(&hashed("latents", &[1, 4, 16, 24])).unwrap();
    assert_close("autoencoder, pixels", &pixels, &expected("autoencoder.pixels"), ALLOWED);
}

#[test]
fn the_unet_agrees_with_8_and_12_inputs() {
    for (name, channels) in [("fc", 8), ("fbc", 12)] {
        let network = iclight(name, channels);
        let (seen, text) = (hashed("seen", &[2, channels, 16, 24]), hashed("text", &[2, 77, 32]));
        let made = network.forward(&seen, 601.25, &text, 1).unwrap();
        assert_close(&format!("UNet, {name}"), &made, &expected(&format!("unet.{name}")), ALLOWED);
    }
}

#[test]
fn a_unet_of_three_widths_agrees_alone_and_with_joint_views() {
    let folder = tempfile::tempdir().unwrap();
    ip2p(folder.path());
    let network = unet(folder.path(), None, (&Device::Cpu, DType::F32)).unwrap();
    let (seen, text) = (hashed("seen", &[4, 8, 16, 24]), hashed("text", &[4, 77, 32]));
    let alone = network.forward(&seen, 37.0, &text, 1).unwrap();
    assert_close("UNet, three widths", &alone, &expected("unet.hashed"), ALLOWED);
    let joint = network.forward(&seen, 37.0, &text, 2).unwrap();
    assert_close("UNet, joint views", &joint, &expected("unet.joint"), ALLOWED);
    let apart = (alone - joint).unwrap().abs().unwrap().max_all().unwrap();
    assert!(apart.to_scalar::<f32>().unwrap() > 1e-3);
}

#[test]
fn schedules_and_their_states_are_those_of_diffusers() {
    let (mut worst, mut worst_sigma) = (0f64, 0f64);
    for case in document("schedules.json").as_array().unwrap() {
        let sampler = Sampler::from_str(case["sampler"].as_str().unwrap(), false).unwrap();
        let schedule = Schedule::from_str(case["schedule"].as_str().unwrap(), false).unwrap();
        let plan = Plan::new(sampler, schedule, case["steps"].as_u64().unwrap() as usize);
        let numbers = |key: &str| -> Vec<f64> {
            serde_json::from_value(case[key].clone()).unwrap_or_default()
        };
        let label = format!("{sampler:?} {schedule:?} {}", plan.len());
        let (times, sigmas) = (numbers("times"), numbers("sigmas"));
        assert_eq!(plan.times.len(), times.len(), "{label}");
        for (a, b) in plan.times.iter().zip(&times) {
            assert!((a - b).abs() < 1e-3, "{label}: {:?} {times:?}", plan.times);
        }
        for (a, b) in plan.sigmas.iter().zip(&sigmas) {
            // Small ones over 1: diffusers makes them of 1 - s in 32 bits, where the smallest, 0.03, keeps four digits.
            worst_sigma = worst_sigma.max((a - b).abs() / b.max(1.0));
        }
        let states: Vec<Vec<f64>> = serde_json::from_value(case["states"].clone()).unwrap();
        let mut noise = Hashed::default();
        let mut latents = plan.pure(&hashed("state", &[1, 1, 2, 2])).unwrap();
        let mut stepper = Stepper::new(&plan);
        for (step, wanted) in states.iter().enumerate() {
            let predicted = hashed(&format!("prediction {step}"), &[1, 1, 2, 2]);
            latents = stepper.step(step, &latents, &predicted, &mut noise).unwrap();
            for (a, b) in flat(&latents).iter().zip(wanted) {
                worst = worst.max((f64::from(*a) - b).abs() / b.abs().max(1.0));
            }
        }
        assert!(worst < 1e-4 && worst_sigma < 1e-5, "{label}: {worst:.1e} {worst_sigma:.1e}");
    }
    println!("schedules: sigmas {worst_sigma:.1e}, states {worst:.1e}");
}

fn passes(sampler: Sampler, steps: usize, guidance: f64) -> Passes {
    Passes {
        sampler,
        schedule: Schedule::Published,
        steps,
        guidance,
        light: Light::None,
        light_noise: 0.9,
        second_scale: 1.5,
        second_noise: 0.5,
    }
}

#[test]
fn both_passes_of_ic_light_agree_by_every_sampler() {
    for (name, channels) in [("fc", 8), ("fbc", 12)] {
        let network = iclight(name, channels);
        let texts = [hashed("prompt", &[1, 77, 32]), hashed("negative", &[1, 77, 32])];
        let conditions = hashed("conditions", &[1, channels - 4, 16, 24]);
        for sampler in [Sampler::Dpm, Sampler::EulerA, Sampler::Ddim] {
            let how = passes(sampler, 6, 2.0);
            let key = how.sampler.to_possible_value().unwrap().get_name().to_owned();
            let run = |start: Option<Tensor>| {
                let pass = Pass { start, strength: 0.5, conditions: conditions.clone() };
                denoised(&network, &pass, &texts, &how, &mut Hashed::default(), &|| ()).unwrap()
            };
            let first = run(None);
            let label = format!("trajectory.{name}.{key}");
            assert_close(&label, &first, &expected(&format!("{label}.first")), ALLOWED);
            let second = run(Some(first));
            assert_close(&label, &second, &expected(&format!("{label}.second")), ALLOWED);
        }
    }
}

#[test]
fn pictures_relit_by_prompt_and_by_background_are_those_of_the_reference() {
    let parts = parts();
    let picture = read_image(&data("photo.png")).unwrap();
    let mask = read_foreground(&data("mask.png"), &picture).unwrap();
    let texts = parts.embedded_pair("warm light, best quality", "lowres").unwrap();
    for (name, channels, steps, guidance) in [("fc", 8, 4, 2.0), ("fbc", 12, 3, 7.0)] {
        let mut seen = vec![on_gray(&picture, Some(&mask))];
        let mut how = passes(Sampler::Dpm, steps, guidance);
        match name {
            "fbc" => seen.push(read_image(&data("background.png")).unwrap()),
            _ => how.light = Light::Left,
        }
        let subject = Subject { seen: &seen, texts: &texts, size: working_size((150, 101), 128) };
        let network = iclight(name, channels);
        let made = relit((&parts, &network), &subject, &how, &mut Hashed::default(), &|| ());
        let made = provider_diffusion::pictures::resized(&made.unwrap(), (150, 101));
        let found = psnr(&made, &read_image(&data(&format!("relit-{name}.png"))).unwrap());
        println!("picture relit by {name}: {found:.1} dB");
        assert!(found >= 50.0, "{name}: {found:.1} dB");
    }
}

fn edit(steps: usize, noise: f64) -> Edit {
    let signal = signal_of(&document("scheduler/scheduler_config.json")).unwrap();
    Edit { steps, text_guidance: 7.5, picture_guidance: 1.5, noise, signal }
}

#[test]
fn edits_agree_with_the_pipeline_and_jointly() {
    let folder = tempfile::tempdir().unwrap();
    ip2p(folder.path());
    let (parts, fresh) = (parts(), hashed("fresh", &[1, 4, 16, 24]));
    let network = unet(folder.path(), None, (&Device::Cpu, DType::F32)).unwrap();
    let photo = parts.autoencoder.encode(&hashed("photo", &[1, 3, 32, 48])).unwrap();
    let texts = |negative: &str| ["make it snow", negative].map(|t| parts.embedded(t).unwrap());
    let times: Vec<usize> =
        flat(&expected_whole("edit.pipeline.times")).iter().map(|t| *t as usize).collect();
    let how = edit(5, 1.0);
    let pair = (&photo, &photo);
    let made = edited_at(&network, &times, pair, &texts(""), &how, &fresh, &|| ()).unwrap();
    assert_close("edit, pipeline", &made, &expected("edit.pipeline"), ALLOWED);
    let (photos, starts) = (hashed("photos", &[2, 4, 16, 24]), hashed("starts", &[2, 4, 16, 24]));
    let how = edit(5, 0.6);
    let pair = (&photos, &starts);
    let made = edited_latents(&network, pair, &texts("ugly"), &how, &fresh, &|| ()).unwrap();
    assert_close("edit, two views jointly", &made, &expected("edit.joint"), ALLOWED);
}

/// Whole numbers of a file.
fn expected_whole(name: &str) -> Tensor {
    let bytes = std::fs::read(data("expected.safetensors")).unwrap();
    let file = safetensors::SafeTensors::deserialize(&bytes).unwrap();
    let tensor = file.tensor(name).unwrap();
    let values = tensor.data().as_chunks::<8>().0.iter().map(|b| i64::from_le_bytes(*b) as f32);
    Tensor::from_vec(values.collect::<Vec<f32>>(), tensor.shape(), &Device::Cpu).unwrap()
}

#[test]
fn edited_pictures_are_those_of_the_reference() {
    let folder = tempfile::tempdir().unwrap();
    ip2p(folder.path());
    let parts = parts();
    let network = unet(folder.path(), None, (&Device::Cpu, DType::F32)).unwrap();
    let (photo, other) = (data("photo.png"), data("background.png"));
    let [photo, other] = [photo, other].map(|path| read_image(&path).unwrap());
    let views = [
        EditedView { photo: photo.clone(), start: photo.clone() },
        EditedView { photo, start: other },
    ];
    let size = working_size((150, 101), 64);
    let texts = ["make it snow", ""].map(|text| parts.embedded(text).unwrap());
    let fresh = hashed("fresh", &parts.latent_shape(size));
    let chosen: Vec<&EditedView> = views.iter().collect();
    let how = edit(4, 0.8);
    let made = edited((&parts, &network), &chosen, (&texts, size), &how, &fresh, &|| ());
    for (k, made) in made.unwrap().iter().enumerate() {
        let found = psnr(made, &read_image(&data(&format!("edited-{k}.png"))).unwrap());
        println!("picture {k} edited: {found:.1} dB");
        assert!(found >= 50.0, "{k}: {found:.1} dB");
    }
}

#[test]
fn the_real_networks_have_the_tensors_of_diffusers() {
    let layouts = document("layouts.json");
    for (name, layout) in layouts.as_object().unwrap() {
        let source = Source::shapes();
        let config = layout["config"].clone();
        if name.starts_with("unet") {
            let config: UNetConfig = serde_json::from_value(config).unwrap();
            UNet::new(&source.root(), &config).unwrap();
        } else if name == "vae" {
            let config: AutoencoderConfig = serde_json::from_value(config).unwrap();
            Autoencoder::new(&source.root(), &config).unwrap();
        } else {
            let config: TextEncoderConfig = serde_json::from_value(config).unwrap();
            TextEncoder::new(&source.root(), &config).unwrap();
        }
        let shapes = source.asked();
        let sides =
            |shape: &[usize]| shape.iter().map(ToString::to_string).collect::<Vec<_>>().join("x");
        let lines: String =
            shapes.iter().map(|(name, shape)| format!("{name} {}\n", sides(shape))).collect();
        let numbers: usize = shapes.values().map(|shape| shape.iter().product::<usize>()).sum();
        assert_eq!(shapes.len() as u64, layout["tensors"].as_u64().unwrap(), "{name}");
        assert_eq!(numbers as u64, layout["numbers"].as_u64().unwrap(), "{name}");
        let digest = motes_formats::selection::sha256_of_bytes(lines.as_bytes());
        assert_eq!(digest, layout["sha256"].as_str().unwrap(), "{name}");
    }
}

#[test]
fn the_same_bits_at_one_and_two_threads() {
    let folder = tempfile::tempdir().unwrap();
    ip2p(folder.path());
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let parts = parts();
            let network = unet(folder.path(), None, (&Device::Cpu, DType::F32)).unwrap();
            let seen = hashed("seen", &[2, 8, 48, 40]);
            let text = parts.embedded("warm light").unwrap();
            let text = Tensor::cat(&[&text, &text], 0).unwrap();
            let made = network.forward(&seen, 500.0, &text, 2).unwrap();
            let pixels = parts.autoencoder.decode(&made).unwrap();
            let latents = parts.autoencoder.encode(&pixels.clamp(-1f32, 1f32).unwrap()).unwrap();
            [flat(&made), flat(&pixels), flat(&latents)].concat()
        })
    };
    let [one, two, three] = [1, 2, 3].map(run);
    let bits = |values: &[f32]| values.iter().map(|v| v.to_bits()).collect::<Vec<_>>();
    assert!(bits(&one) == bits(&two) && bits(&one) == bits(&three));
}
