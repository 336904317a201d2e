//! Language models in place of the grammar, played by a script.

use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::net::TcpListener;
use std::process::Output;
use std::thread::JoinHandle;

use motes_testkit::toy_scene::ToyScene;
use serde_json::{Value, json};

use super::{SCENE, TEXTBOOK, instruct, labeled, report, said};

fn ask(toy: &ToyScene, answers: &Value) -> Output {
    ask_to(toy, "make the box chrome", answers, &["-o", "plan.json"])
}

fn ask_to(toy: &ToyScene, sentence: &str, answers: &Value, output: &[&str]) -> Output {
    std::fs::write(toy.path("answers.json"), answers.to_string()).unwrap();
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/../../testdata/providers/scripted_chat.py");
    let command = format!("python3 '{script}' --answers answers.json");
    let more = ["--provider", &command, "--provider-cache", "none", "--json", "-w"];
    instruct(toy, &[&[sentence], &SCENE[..], &more, output].concat())
}

fn plan(ops: Value) -> Value {
    json!({ "format": "motes/edit-plan", "version": "1.6", "ops": ops })
}

fn select(path: &str) -> Value {
    json!({ "op": "select", "id": "box", "steps": [{ "by": "file", "path": path }] })
}

#[test]
fn a_valid_answer_is_the_plan() {
    let toy = labeled();
    let paint = json!({ "op": "set_material", "target": "box", "name": "chrome" });
    let answers = json!([plan(json!([select("box.json"), paint]))]);
    let answer = report(&ask(&toy, &answers));
    assert_eq!(answer["provider"]["name"], "scripted-chat");
    assert_eq!(answer["provider"]["answered"], 1);
    let written: Value =
        serde_json::from_slice(&std::fs::read(toy.path("plan.json")).unwrap()).unwrap();
    assert_eq!(written["ops"][0]["steps"][0]["path"], "labels/box.json");
}

#[test]
fn the_textbook_sentence_is_one_command_with_a_language_model_too() {
    let toy = labeled();
    let moved = json!({ "op": "transform", "target": "box", "translate": [0.5, 0.0, 0.0] });
    let light = json!({ "op": "set_environment", "sun": "sunset" });
    let answers = json!([plan(json!([select("box.json"), moved, light]))]);
    let answer = report(&ask_to(&toy, TEXTBOOK, &answers, &["--apply", "-o", "edited", "-q"]));
    assert_eq!(answer["plans"][0]["edited"]["applied"].as_array().unwrap().len(), 3);
    assert!(toy.path("edited/environment.exr").exists());
}

#[test]
fn a_broken_answer_is_repaired_once() {
    let toy = labeled();
    let bad = plan(json!([select("box.json"), { "op": "scale", "target": "box" }]));
    let good =
        plan(json!([select("box.json"), { "op": "transform", "target": "box", "scale": 2.0 }]));
    let done = ask(&toy, &json!([bad, good]));
    assert!(said(&done).contains("/ops/1/op"), "{}", said(&done));
    assert_eq!(report(&done)["provider"]["answered"], 2);
    let done = ask(&toy, &json!([bad, bad]));
    assert_eq!(done.status.code(), Some(3), "{}", said(&done));
    assert!(said(&done).contains("/ops/1/op"), "{}", said(&done));
}

#[test]
fn a_model_reads_nothing_but_the_card_names_and_starts_nothing() {
    let toy = labeled();
    let stylize = json!({ "op": "stylize", "target": "all", "prompt": "p", "editor": "touch started {input} {output} {prompt}" });
    for (ops, place) in [
        (json!([select("/etc/passwd")]), "/ops/0/steps/0/path"),
        (json!([select("../scene/gaussians.ply")]), "/ops/0/steps/0/path"),
        (json!([{ "op": "insert", "file": "/etc/passwd" }]), "/ops/0/file"),
        (json!([{ "op": "set_environment", "file": "scene/environment.exr" }]), "/ops/0/file"),
        (json!([stylize]), "/ops/0/op"),
        (json!([]), "/ops"),
        (json!("text"), "/ops"),
    ] {
        let done = ask(&toy, &json!([plan(ops)]));
        assert_ne!(done.status.code(), Some(0), "{}", said(&done));
        assert!(said(&done).contains(place), "{place}: {}", said(&done));
    }
    assert!(!toy.path("started").exists());
}

/// Answers each request on a port of its own; what was asked, bodies alone.
fn scripted_endpoint(answers: Vec<String>) -> (String, JoinHandle<Vec<Value>>) {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let url = format!("http://{}/v1", listener.local_addr().unwrap());
    let asked = std::thread::spawn(move || {
        let one = |answer: String| {
            let (stream, _) = listener.accept().unwrap();
            let mut reader = BufReader::new(stream);
            let mut length = 0;
            loop {
                let mut line = String::new();
                reader.read_line(&mut line).unwrap();
                let lower = line.to_lowercase();
                if let Some(bytes) = lower.strip_prefix("content-length:") {
                    length = bytes.trim().parse().unwrap();
                }
                if line.trim().is_empty() {
                    break;
                }
            }
            let mut body = vec![0; length];
            reader.read_exact(&mut body).unwrap();
            let said = json!({ "choices": [{ "message": { "content": answer } }] }).to_string();
            let head = format!("HTTP/1.1 200 OK\r\nContent-Length: {}\r\n\r\n", said.len());
            reader.get_mut().write_all((head + &said).as_bytes()).unwrap();
            serde_json::from_slice(&body).unwrap()
        };
        answers.into_iter().map(one).collect()
    });
    (url, asked)
}

#[test]
fn an_endpoint_gets_the_schema_the_card_and_the_picture_and_mends_its_answer() {
    let toy = labeled();
    let good = plan(
        json!([select("box.json"), { "op": "set_material", "target": "box", "name": "chrome" }]),
    );
    let fenced = format!("```json\n{good}\n```");
    let (url, asked) = scripted_endpoint(vec!["I would paint it.".into(), fenced]);
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scripts/providers/openai_chat.py");
    let command = format!("python3 '{script}' --url {url} --model any");
    let more = ["--capture", "capture.json", "--provider", &command, "--provider-cache", "none"];
    let line =
        [&["make the box chrome"], &SCENE[..], &more, &["-o", "plan.json", "--json"]].concat();
    let answer = report(&instruct(&toy, &line));
    assert_eq!(answer["provider"]["answered"], 2);
    assert!(toy.path("plan.json").exists());

    let asked = asked.join().unwrap();
    let schema = &asked[0]["response_format"]["json_schema"]["schema"];
    assert!(schema["properties"]["ops"].is_object(), "{schema}");
    let user = &asked[0]["messages"][1]["content"];
    assert!(user[0]["text"].as_str().unwrap().contains("motes/scene-card"), "{user}");
    let picture = user[1]["image_url"]["url"].as_str().unwrap();
    assert!(picture.starts_with("data:image/png;base64,"), "{picture}");
    let last = asked[1]["messages"].as_array().unwrap().last().unwrap();
    assert!(last["content"].as_str().unwrap().contains("refused"), "{last}");
}

#[test]
fn an_endpoint_that_is_not_there_is_one_clear_error() {
    let toy = labeled();
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scripts/providers/openai_chat.py");
    // Port 9 of this machine is the discard service, which nobody runs.
    let command = format!("python3 '{script}' --url http://127.0.0.1:9/v1 --model any");
    let more = ["--provider", &command, "--provider-cache", "none", "-o", "plan.json"];
    let done = instruct(&toy, &[&["make the box chrome"], &SCENE[..], &more].concat());
    assert_eq!(done.status.code(), Some(3), "{}", said(&done));
    assert!(said(&done).contains("does not answer"), "{}", said(&done));
    assert!(said(&done).contains("start the server"), "{}", said(&done));
    assert!(!toy.path("plan.json").exists());
}
