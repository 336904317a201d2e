//! The program: the protocol, threads, and files and requests that are bad.
#![expect(clippy::unwrap_used, reason = "a test that cannot prepare its files has failed")]

mod common;

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use common::*;
use motes_formats::provider::{ProviderDescription, ProviderKind};
use motes_protocol::ProviderCommand;
use motes_protocol::conformance::{Outcome, conformance};
use serde_json::{Value, json};

const PROGRAM: &str = env!("CARGO_BIN_EXE_motes-provider-diffusion");
/// Flags that make the tiny models quick.
const QUICK: [&str; 6] = ["--size", "64", "--steps", "2", "--second-scale", "1"];

fn run(arguments: &[&str], folder: &Path) -> Output {
    let model = folder.to_string_lossy().into_owned();
    Command::new(PROGRAM).args(["--model", &model]).args(arguments).args(QUICK).output().unwrap()
}

fn ic_light(folder: &Path) -> String {
    folder.join("ic-light").to_string_lossy().into_owned()
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// A request beside the pictures of the fixtures.
fn request(folder: &Path, task: &Value) -> String {
    for name in ["photo.png", "mask.png", "background.png"] {
        std::fs::copy(data(name), folder.join(name)).unwrap();
    }
    let document = json!({
        "format": "motes/provider-request", "version": "1.1", "seed": 7, "task": task,
    });
    let path = folder.join("request.json");
    std::fs::write(&path, document.to_string()).unwrap();
    path.to_string_lossy().into_owned()
}

/// Asserts one line that says this, a remedy, and the exit code.
fn assert_says(output: &Output, status: i32, said: &str) {
    let stderr = text(&output.stderr);
    assert_eq!(output.status.code(), Some(status), "{stderr}");
    assert!(stderr.contains(said), "{said}: {stderr}");
    assert!(stderr.contains("help: "), "{stderr}");
    assert_eq!(stderr.trim().lines().count(), 2, "{stderr}");
    assert!(output.stdout.is_empty());
}

#[test]
fn both_models_keep_the_protocol() {
    let folder = tempfile::tempdir().unwrap();
    let (base, edit) = (folder.path().join("sd"), folder.path().join("ip2p"));
    stable_diffusion(&base);
    ip2p(&edit);
    let of = |path: &Path| path.to_string_lossy().into_owned();
    let cases = [
        (
            vec!["--model".to_owned(), of(&base), "--weights".into(), ic_light(&base)],
            ProviderKind::Relight,
        ),
        (vec!["--model".to_owned(), of(&edit)], ProviderKind::InstructEdit),
    ];
    for (mut arguments, kind) in cases {
        arguments.extend(QUICK.map(str::to_owned));
        let command = ProviderCommand::of_program(Path::new(PROGRAM), &arguments);
        let (description, findings) = conformance(&command, kind, 120.0, &|| false).unwrap();
        assert!(description.is_some_and(|d| d.deterministic && !d.models.is_empty()));
        for finding in findings {
            assert_eq!(finding.outcome, Outcome::Passed, "{kind:?}: {}", finding.check);
        }
    }
}

#[test]
fn the_same_bytes_at_one_and_two_threads_and_others_for_another_prompt() {
    let folder = tempfile::tempdir().unwrap();
    stable_diffusion(folder.path());
    let weights = ic_light(folder.path());
    let answer = |threads: &str, task: &Value| {
        let work = tempfile::tempdir().unwrap();
        let asked = request(work.path(), task);
        let flags = ["--weights", &weights, "--threads", threads, "--request", &asked];
        let output = run(&flags, folder.path());
        assert!(output.status.success(), "{}", text(&output.stderr));
        assert!(output.stdout.is_empty());
        let reply: Value =
            serde_json::from_slice(&std::fs::read(work.path().join("reply.json")).unwrap())
                .unwrap();
        let name = reply["result"]["relight"]["picture"].as_str().unwrap().to_owned();
        std::fs::read(work.path().join(name)).unwrap()
    };
    let by_prompt =
        json!({"relight": {"picture": "photo.png", "foreground": "mask.png", "prompt": "sunset"}});
    let by_background = json!({"relight": {
        "picture": "photo.png", "foreground": "mask.png", "background": "background.png", "prompt": "",
    }});
    let [a, b] = [&by_prompt, &by_background].map(|task| answer("1", task));
    assert_eq!(a, answer("2", &by_prompt));
    assert_eq!(b, answer("2", &by_background));
    let other =
        json!({"relight": {"picture": "photo.png", "foreground": "mask.png", "prompt": "moon"}});
    assert!(a != b && a != answer("2", &other));
}

#[test]
fn descriptions_change_with_what_answers_depend_on() {
    let folder = tempfile::tempdir().unwrap();
    ip2p(folder.path());
    let describe = |more: &[&str]| -> ProviderDescription {
        let output = run(&[&["--describe"], more].concat(), folder.path());
        assert!(output.status.success(), "{}", text(&output.stderr));
        serde_json::from_slice(&output.stdout).unwrap()
    };
    let first = describe(&[]);
    assert_eq!((first.name.as_str(), first.models.len()), ("ip2p", 3));
    assert_eq!(first.models[0].license, "MIT");
    assert_eq!(first, describe(&["--threads", "1"]));
    assert_ne!(first, describe(&["--text-guidance", "9"]));
    assert_eq!(describe(&["--license", "mine"]).models[0].license, "mine");
}

type Tensors = Vec<(String, Vec<usize>, Vec<f32>)>;

fn unet_file(folder: &Path) -> PathBuf {
    folder.join("unet/diffusion_pytorch_model.fp16.safetensors")
}

/// A folder of Stable Diffusion whose file was changed, and what the program says to it.
fn broken(file: &str, change: impl FnOnce(&Path)) -> Output {
    let folder = tempfile::tempdir().unwrap();
    stable_diffusion(folder.path());
    change(&folder.path().join(file));
    run(&["--describe", "--weights", &ic_light(folder.path())], folder.path())
}

fn changed(path: &Path, change: impl FnOnce(&mut Tensors)) {
    let mut tensors = read(path);
    change(&mut tensors);
    write(path, &tensors);
}

#[test]
fn bad_weights_are_one_error_each() {
    let unet = "unet/diffusion_pytorch_model.fp16.safetensors";
    let fc = "ic-light/iclight_sd15_fc.safetensors";
    let shorten = |path: &Path| {
        let bytes = std::fs::read(path).unwrap();
        std::fs::write(path, &bytes[..bytes.len() - 1000]).unwrap();
    };
    assert_says(&broken(unet, shorten), 3, "cut short or has a tail");
    assert_says(&broken(fc, shorten), 3, "cut short or has a tail");
    let drop_one = |tensors: &mut Tensors| tensors.retain(|(n, _, _)| n != "conv_out.bias");
    let output = broken(fc, |path| changed(path, drop_one));
    assert_says(&output, 3, "conv_out.bias of the UNet that it is added to missing");
    let add_one = |tensors: &mut Tensors| tensors.push(("lora.up".into(), vec![1], vec![0.0]));
    assert_says(&broken(unet, |path| changed(path, add_one)), 3, "lora.up not of the UNet");
    let reshape = |tensors: &mut Tensors| {
        tensors.retain(|(n, _, _)| n != "conv_out.bias");
        tensors.push(("conv_out.bias".into(), vec![5], vec![0.0; 5]));
    };
    let output = broken(unet, |path| changed(path, reshape));
    assert_says(&output, 3, "conv_out.bias is 5, the UNet has 4");
    let output = broken("vae/diffusion_pytorch_model.safetensors", |path| {
        std::fs::copy(data("text_encoder/model.safetensors"), path).unwrap();
    });
    assert_says(&output, 3, "more of the autoencoder missing");
    let output =
        broken(fc, |path| std::fs::write(path, b"\x80\x02}q\x00X\x05\x00\x00\x00state").unwrap());
    assert_says(&output, 3, "could run code");
    let output = broken(fc, |path| std::fs::write(path, "version https://git-lfs\n").unwrap());
    assert_says(&output, 3, "Git LFS");
    let output = broken(fc, |path| {
        std::fs::remove_file(path).unwrap();
        std::fs::create_dir(path).unwrap();
    });
    assert_says(&output, 3, "a folder where a file is due");
    let output = broken(fc, |path| {
        std::fs::copy(data(unet), path).unwrap();
    });
    assert_says(&output, 3, "no weights of IC-Light: 4 input channels");
    let output = broken("unet/config.json", |path| {
        let config = std::fs::read_to_string(path).unwrap();
        let other =
            config.replace("\"use_linear_projection\": false", "\"use_linear_projection\": true");
        assert_ne!(config, other);
        std::fs::write(path, other).unwrap();
    });
    assert_says(&output, 2, "use_linear_projection is true");
    let output = broken("tokenizer/vocab.json", |path| std::fs::write(path, "{}").unwrap());
    assert_says(&output, 3, "no tokenizer of CLIP");
}

#[test]
fn models_in_the_wrong_place_are_one_error_each() {
    let folder = tempfile::tempdir().unwrap();
    stable_diffusion(folder.path());
    let weights = ic_light(folder.path());
    let file = unet_file(folder.path());
    assert_says(&run(&["--describe", "--weights", &weights], &file), 3, "a file where the folder");
    let none = folder.path().join("none");
    assert_says(&run(&["--describe", "--weights", &weights], &none), 3, "no such folder");
    assert_says(&run(&["--describe"], folder.path()), 3, "without the offsets of IC-Light");
    let empty = folder.path().join("empty");
    std::fs::create_dir(&empty).unwrap();
    let output = run(&["--describe", "--weights", &empty.to_string_lossy()], folder.path());
    assert_says(&output, 3, "no iclight_sd15_fc.safetensors");
    let edit = folder.path().join("ip2p");
    ip2p(&edit);
    assert_says(&run(&["--describe", "--weights", &weights], &edit), 3, "not to InstructPix2Pix");
    let output = run(&["--describe", "--weights", &weights, "--second-noise", "0"], folder.path());
    assert_says(&output, 2, "--second-noise is out of range");
    let fc = folder.path().join("ic-light/iclight_sd15_fc.safetensors");
    let work = tempfile::tempdir().unwrap();
    let asked = request(
        work.path(),
        &json!({"relight": {"picture": "photo.png", "background": "background.png"}}),
    );
    let flags = ["--request", &asked, "--weights", &fc.to_string_lossy()];
    assert_says(&run(&flags, folder.path()), 3, "a background needs iclight_sd15_fbc.safetensors");
}

#[test]
fn values_that_are_not_finite_are_found_when_they_are_loaded() {
    let folder = tempfile::tempdir().unwrap();
    stable_diffusion(folder.path());
    let fc = folder.path().join("ic-light/iclight_sd15_fc.safetensors");
    changed(&fc, |tensors| tensors[3].2[0] = f32::NAN);
    let work = tempfile::tempdir().unwrap();
    let asked = request(work.path(), &json!({"relight": {"picture": "photo.png"}}));
    let output = run(&["--request", &asked, "--weights", &ic_light(folder.path())], folder.path());
    assert_says(&output, 3, "has values that are not finite");
    assert!(!work.path().join("reply.json").exists());
}

#[test]
fn bad_requests_are_one_error_each() {
    let folder = tempfile::tempdir().unwrap();
    stable_diffusion(folder.path());
    let weights = ic_light(folder.path());
    let work = tempfile::tempdir().unwrap();
    let ask = |task: Value, prepare: &dyn Fn(&Path)| {
        let asked = request(work.path(), &task);
        prepare(work.path());
        run(&["--request", &asked, "--weights", &weights], folder.path())
    };
    let nothing = |_: &Path| ();
    let long = "warm light ".repeat(1000);
    let task = json!({"relight": {"picture": "photo.png", "prompt": long}});
    assert_says(&ask(task, &nothing), 2, "the model takes 600");
    let masked = json!({"relight": {"picture": "photo.png", "foreground": "mask.png"}});
    let black = |work: &Path| {
        let mask = motes_scene::ImageU8::filled(150, 101, 1, 0);
        motes_formats::images::write_png(&work.join("mask.png"), &mask).unwrap();
    };
    assert_says(&ask(masked.clone(), &black), 3, "the foreground is empty");
    let small = |work: &Path| {
        let mask = motes_scene::ImageU8::filled(8, 8, 1, 255);
        motes_formats::images::write_png(&work.join("mask.png"), &mask).unwrap();
    };
    assert_says(&ask(masked, &small), 3, "the foreground has 8x8 pixels, the picture 150x101");
    let edit = json!({"instruct-edit": {"prompt": "snow", "views": [{"original": "photo.png"}]}});
    assert_says(&ask(edit, &nothing), 2, "IC-Light does not do instruct-edit");
}

#[test]
fn old_names_and_a_tokenizer_in_one_file_are_read() {
    let folder = tempfile::tempdir().unwrap();
    stable_diffusion(folder.path());
    let answer = || {
        let work = tempfile::tempdir().unwrap();
        let asked = request(
            work.path(),
            &json!({"relight": {"picture": "photo.png", "prompt": "warm light"}}),
        );
        let output =
            run(&["--request", &asked, "--weights", &ic_light(folder.path())], folder.path());
        assert!(output.status.success(), "{}", text(&output.stderr));
        std::fs::read(work.path().join("relit.png")).unwrap()
    };
    let first = answer();
    changed(&folder.path().join("vae/diffusion_pytorch_model.safetensors"), |tensors| {
        for (name, shape, _) in tensors {
            let new =
                [("to_q", "query"), ("to_k", "key"), ("to_v", "value"), ("to_out.0", "proj_attn")];
            for (now, old) in new {
                *name =
                    name.replace(&format!("attentions.0.{now}."), &format!("attentions.0.{old}."));
            }
            if name.contains("proj_attn.weight") {
                shape.extend([1, 1]);
            }
        }
    });
    changed(&folder.path().join("text_encoder/model.safetensors"), |tensors| {
        for (name, _, _) in tensors {
            *name = name.replace("text_model.", "");
        }
    });
    let tokenizer = folder.path().join("tokenizer");
    let vocabulary: Value =
        serde_json::from_slice(&std::fs::read(tokenizer.join("vocab.json")).unwrap()).unwrap();
    let merges = std::fs::read_to_string(tokenizer.join("merges.txt")).unwrap();
    let merges: Vec<&str> = merges.lines().skip(1).collect();
    let one = json!({"model": {"vocab": vocabulary, "merges": merges}});
    std::fs::write(tokenizer.join("tokenizer.json"), one.to_string()).unwrap();
    std::fs::remove_file(tokenizer.join("merges.txt")).unwrap();
    std::fs::remove_file(tokenizer.join("vocab.json")).unwrap();
    assert_eq!(first, answer());
}
