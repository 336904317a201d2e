//! Providers that keep the protocol, and all the ways not to: each ends in one error that says what to do.
#![cfg(unix)]
#![expect(clippy::unwrap_used, reason = "a test that cannot prepare its files has failed")]

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use motes_formats::exr_aov::{AovChannel, write_exr};
use motes_formats::images::write_png;
use motes_formats::provider::{ProviderKind, ProviderReply, TaskResult};
use motes_protocol::conformance::{Outcome, conformance, request};
use motes_protocol::{Provider, ProviderCommand, ProviderError};
use motes_scene::ImageU8;

/// Does as the protocol says except for what its second argument names. The first one is a folder with files to hand out.
const BAD: &str = r#"
import json, os, shutil, sys, time
from pathlib import Path

folder, bad, what = Path(sys.argv[1]), sys.argv[2], sys.argv[3]
kinds = ["relight", "predict", "segment", "environment", "novel-view"]
description = {"format": "motes/provider", "version": "1.0", "name": "bad", "kinds": kinds, "deterministic": True}
if what == "--describe":
    if bad == "describe-late": time.sleep(60)
    if bad == "describe-text": print("Loading checkpoint...")
    if bad == "describe-fails":
        sys.stderr.write("motes x: no such file: w.onnx\nhelp: give the weights\n"); sys.exit(3)
    if bad == "normals": description["version"], description["quantities"] = "1.1", ["normal"]
    if bad == "describe-version": description["version"] = "2.0"
    print(json.dumps(description))
    sys.exit(0)

def answer(path):
    here = path.parent
    kind = next(iter(json.loads(path.read_text())["task"]))
    name = {"size": "other.png", "escape": "../picture.png", "absent": "nothing.png", "truncated": "half.png"}.get(bad, "answer.png")
    if bad != "escape" and (folder / name).is_file(): shutil.copyfile(folder / name, here / name)
    maps = ["X.exr", "depth.exr", "base.exr", "y.exr", "y.exr"]
    for file in set(maps): shutil.copyfile(folder / file, here / file)
    if bad == "nan": maps[1] = "nan.exr"; shutil.copyfile(folder / "nan.exr", here / "nan.exr")
    quantities = ["normal", "depth", "base-color", "roughness", "metallic"]
    mask = {"mask": name, "predicted_iou": 2 if bad == "score" else 1, "stability": 1}
    result = {
        "relight": {"picture": name},
        "predict": {"maps": [{"picture": 0, "quantity": q, "map": m} for q, m in zip(quantities, maps)]},
        "segment": {"masks": [mask] * (4 if bad == "many" else 1), "best": 7 if bad == "best" else 0},
        "environment": {"environment": "base.exr"},
        "novel-view": {"picture": name, "confidence": "base.exr" if bad == "doubt" else "y.exr"},
    }[kind]
    reply = json.dumps({"format": "motes/provider-reply", "version": "1.0", "result": {"relight" if bad == "kind" else kind: result}})
    if bad == "late": time.sleep(60)
    if bad == "killed": os.kill(os.getpid(), 9)
    if bad == "fails": sys.stderr.write("out of memory\n"); sys.exit(1)
    if bad == "partial": reply = reply[: len(reply) // 2]
    if bad != "silent": (here / "reply.json").write_text(reply)
    return here / "reply.json"

if what == "--request":
    if bad == "stdout": print("step 1 of 20")
    answer(Path(sys.argv[4]))
else:
    for line in sys.stdin:
        if bad == "stdout": print("step 1 of 20", flush=True)
        print(json.dumps({"reply": str(answer(Path(json.loads(line)["request"])))}), flush=True)
"#;

const SIZE: (usize, usize) = (6, 4);

struct Bench {
    dir: tempfile::TempDir,
}

impl Bench {
    fn new() -> Self {
        let dir = tempfile::tempdir().unwrap();
        let at = |name: &str| dir.path().join(name);
        std::fs::write(at("bad.py"), BAD).unwrap();
        std::fs::create_dir(at("work")).unwrap();
        let picture = |w, h| ImageU8::filled(w, h, 3, 90);
        write_png(&at("answer.png"), &picture(SIZE.0, SIZE.1)).unwrap();
        write_png(&at("other.png"), &picture(SIZE.0 + 1, SIZE.1)).unwrap();
        let whole = std::fs::read(at("answer.png")).unwrap();
        std::fs::write(at("half.png"), &whole[..whole.len() / 2]).unwrap();
        let n = SIZE.0 * SIZE.1;
        let exr = |name: &str, channels: &[(&str, f32)]| {
            let channel = |&(c, v): &(&str, f32)| AovChannel::float(c, vec![v; n]);
            let channels: Vec<AovChannel> = channels.iter().map(channel).collect();
            write_exr(&at(name), SIZE.0, SIZE.1, &channels, &[]).unwrap();
        };
        exr("X.exr", &[("X", 0.0), ("Y", 0.0), ("Z", -1.0)]);
        exr("depth.exr", &[("Z", 2.0)]);
        exr("base.exr", &[("R", 0.5), ("G", 0.5), ("B", 0.5)]);
        exr("y.exr", &[("Y", 0.5)]);
        exr("nan.exr", &[("Z", f32::NAN)]);
        Self { dir }
    }

    fn command(&self, bad: &str) -> ProviderCommand {
        let folder = self.dir.path().display();
        ProviderCommand::new(&format!("python3 '{folder}/bad.py' '{folder}' {bad}")).unwrap()
    }

    fn work(&self) -> PathBuf {
        self.dir.path().join("work")
    }

    fn ask(
        &self,
        bad: &str,
        kind: ProviderKind,
        once: bool,
    ) -> Result<ProviderReply, ProviderError> {
        let seconds = match bad {
            "describe-late" => 0.7,
            "late" => 4.0,
            _ => 60.0,
        };
        let mut provider = Provider::open(self.command(bad), kind, seconds, None, &|| false)?;
        let asked = request(kind, &self.work(), SIZE)?;
        match once {
            true => provider.ask_once(&self.work(), &asked, &|| false),
            false => provider.ask(&self.work(), &asked, &|| false),
        }
    }
}

#[test]
fn what_a_provider_does_wrong_is_said_with_a_remedy() {
    use ProviderKind::{Environment, NovelView, Predict, Relight, Segment};
    let cases = [
        ("describe-late", Relight, "did not answer within 0.7 s (describing itself)", "--describe"),
        ("describe-text", Relight, "does not keep the protocol: ", "motes provider check"),
        ("describe-fails", Relight, "no such file: w.onnx", "give the weights"),
        ("describe-version", Relight, "version 2.0 of motes/provider is not known", "check"),
        ("size", Relight, "other.png has 7x4 pixels where the picture has 6x4", "check"),
        ("size", Segment, "other.png has 7x4 pixels where the picture has 6x4", "check"),
        ("escape", Relight, "leads out of the folder", "check"),
        ("absent", Relight, "names nothing.png, which is not there", "check"),
        ("truncated", Relight, "half.png", "check"),
        ("nan", Predict, "nan.exr has values that are not finite (NaN)", "check"),
        ("kind", Segment, "reply.json", "check"),
        ("many", Segment, "a list of 4, at most 3 are allowed", "check"),
        ("best", Segment, "its best mask is 7, the last is 0", "check"),
        ("score", Segment, "predicted_iou", "check"),
        ("none", Environment, "panorama has 6x4 pixels, not 2:1", "check"),
        ("size", NovelView, "other.png has 7x4 pixels where the picture has 6x4", "check"),
        ("doubt", NovelView, "base.exr has no channel Y", "check"),
        ("normals", Predict, "does not predict depth", "it predicts normal"),
        ("late", Relight, "did not answer within 4 s (a request)", "--provider-time-limit"),
        ("killed", Relight, "failed on ", ""),
        ("fails", Relight, "out of memory", ""),
        ("partial", Relight, "the document ends early", "check"),
        ("silent", Relight, "left no reply.json", "check"),
        ("stdout", Relight, "step 1 of 20", "check"),
    ];
    let bench = Bench::new();
    for (bad, kind, says, help) in cases {
        for once in [true, false] {
            let began = Instant::now();
            let error = bench.ask(bad, kind, once).unwrap_err().to_string();
            let (text, remedy) = error.split_once("\nhelp: ").unwrap_or((&error, ""));
            assert!(text.contains(says) && !text.contains('\n'), "{bad} {once}: {error}");
            assert!(remedy.contains(help), "{bad} {once}: {error}");
            assert!(began.elapsed() < Duration::from_secs(30), "{bad} {once}");
        }
    }
    for kind in [Relight, Predict, Segment, NovelView] {
        bench.ask("none", kind, false).unwrap();
    }
}

#[test]
fn an_interruption_ends_the_provider() {
    let bench = Bench::new();
    let began = Instant::now();
    let stopped = || began.elapsed() > Duration::from_millis(800);
    let command = bench.command("late");
    let mut provider =
        Provider::open(command, ProviderKind::Relight, 60.0, None, &|| false).unwrap();
    let asked = request(ProviderKind::Relight, &bench.work(), SIZE).unwrap();
    let error = provider.ask(&bench.work(), &asked, &stopped);
    assert!(matches!(error, Err(ProviderError::Stopped)));
    assert!(began.elapsed() < Duration::from_secs(10));
}

#[test]
fn an_answer_is_kept_and_serves_again_unless_something_differs() {
    let bench = Bench::new();
    let (work, answers) = (bench.work(), bench.dir.path().join("answers"));
    let kind = ProviderKind::Relight;
    let open = |bad| Provider::open(bench.command(bad), kind, 60.0, Some(&answers), &|| false);
    let mut asked = request(kind, &work, SIZE).unwrap();
    let first = open("none").unwrap().ask(&work, &asked, &|| false).unwrap();
    std::fs::remove_file(work.join("reply.json")).unwrap();
    // The same program would fail now: what it said before is enough.
    let mut again = open("fails").unwrap();
    assert_eq!(again.ask(&work, &asked, &|| false).unwrap(), first);
    assert_eq!((again.used().kept, again.used().answered), (1, 0));
    assert!(work.join("reply.json").is_file());
    asked.seed += 1;
    assert!(again.ask(&work, &asked, &|| false).is_err(), "another request");
    asked.seed -= 1;
    write_png(&work.join("picture.png"), &ImageU8::filled(6, 4, 3, 91)).unwrap();
    assert!(again.ask(&work, &asked, &|| false).is_err(), "another picture");
    // A kept answer that is damaged is asked for again.
    let asked = request(kind, &work, SIZE).unwrap();
    for entry in std::fs::read_dir(&answers).unwrap() {
        std::fs::write(entry.unwrap().path().join("reply.json"), "{").unwrap();
    }
    assert!(again.ask(&work, &asked, &|| false).is_err(), "a damaged answer");
}

#[test]
fn a_provider_of_another_kind_is_told_before_it_is_asked() {
    let bench = Bench::new();
    let error = bench.ask("none", ProviderKind::Chat, false).unwrap_err().to_string();
    assert!(error.contains("does not do chat"), "{error}");
    assert!(
        error.contains("it does relight, predict, segment, environment, novel-view"),
        "{error}"
    );
}

fn copy() -> ProviderCommand {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../testdata/providers/copy.py");
    ProviderCommand::new(&format!("python3 '{}'", script.display())).unwrap()
}

#[test]
fn the_smallest_provider_conforms() {
    for kind in [ProviderKind::Relight, ProviderKind::InstructEdit, ProviderKind::NovelView] {
        let (description, findings) = conformance(&copy(), kind, 60.0, &|| false).unwrap();
        assert_eq!(description.unwrap().name, "copy");
        for finding in &findings {
            assert_eq!(finding.outcome, Outcome::Passed, "{}", finding.check);
        }
        assert_eq!(findings.len(), 8);
    }
}

#[test]
fn what_does_not_conform_is_found() {
    let bench = Bench::new();
    for (bad, check) in [
        ("describe-text", "describes itself"),
        ("size", "answers a picture of one pixel"),
        ("stdout", "answers a picture, and says nothing on standard output"),
        ("none", "refuses a bad request with exit code 2 and one line"),
    ] {
        let command = bench.command(bad);
        let (_, findings) = conformance(&command, ProviderKind::Relight, 20.0, &|| false).unwrap();
        let found = findings.iter().find(|f| f.check == check).unwrap();
        assert!(matches!(found.outcome, Outcome::Failed(_)), "{bad}: {findings:?}");
    }
}

#[test]
fn pictures_reach_the_provider_and_come_back() {
    let bench = Bench::new();
    let work = bench.work();
    let kind = ProviderKind::InstructEdit;
    let mut provider = Provider::open(copy(), kind, 60.0, None, &|| false).unwrap();
    let asked = request(kind, &work, (5, 3)).unwrap();
    let reply = provider.ask(&work, &asked, &|| false).unwrap();
    let TaskResult::InstructEdit(result) = reply.result else { panic!("{reply:?}") };
    let bytes = |name: &str| std::fs::read(work.join(name)).unwrap();
    assert_eq!(bytes(&result.pictures[1]), bytes("picture.png"));
}
