//! The stage `view` as a program: who gets an answer, what is acted becomes a plan, and the plan makes what the page shows.
#![expect(clippy::unwrap_used, reason = "a test that cannot prepare its files has failed")]
#![allow(clippy::print_stdout, reason = "shown with --nocapture")]

mod acts;
mod browser;
mod gate;
mod page;
mod reopen;
mod segmenters;
mod watch;

use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::net::{SocketAddr, TcpStream};
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

use motes_formats::images::write_png;
use motes_formats::ply::read_gaussians;
use motes_raster::{RenderOptions, render};
use motes_testkit::toy_scene::{ToyScene, toy_scene};
use serde_json::Value;

/// The toy scene with photos that are renders of it.
fn scene_with_photos() -> ToyScene {
    let scene = toy_scene();
    let gaussians = read_gaussians(&scene.path("scene/gaussians.ply")).unwrap();
    std::fs::create_dir(scene.path("images")).unwrap();
    let camera = scene.capture.cameras[0].as_pinhole().unwrap();
    for view in &scene.capture.views {
        let options = RenderOptions::default();
        let photo = render(&gaussians, &camera, &view.camera_from_world, &options).color;
        write_png(&scene.path("").join(&view.image), &photo.to_u8()).unwrap();
    }
    scene
}

fn command(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_view"));
    command.args(arguments).args(["--no-browser", "--no-cache", "--json", "--no-provenance"]);
    command.current_dir(folder).stdin(Stdio::null());
    command.stdout(Stdio::piped()).stderr(Stdio::piped());
    command
}

fn run(folder: &Path, arguments: &[&str]) -> Output {
    command(folder, arguments).output().unwrap()
}

/// A running server; it ends with the test.
struct Served {
    child: Child,
    address: SocketAddr,
    /// `/TOKEN/`.
    base: String,
}

/// An answer.
struct Answer {
    code: u16,
    head: String,
    body: Vec<u8>,
}

impl Answer {
    #[track_caller]
    fn json(&self) -> Value {
        serde_json::from_slice(&self.body).unwrap_or_else(|error| panic!("{error}: {}", self.head))
    }
}

impl Served {
    fn start(folder: &Path, arguments: &[&str]) -> Self {
        let mut child = command(folder, arguments).spawn().unwrap();
        let mut line = String::new();
        let mut stdout = BufReader::new(child.stdout.take().unwrap());
        stdout.read_line(&mut line).unwrap();
        if line.is_empty() {
            let output = child.wait_with_output().unwrap();
            panic!("{}", String::from_utf8_lossy(&output.stderr));
        }
        child.stdout = Some(stdout.into_inner());
        let said: Value = serde_json::from_str(&line).unwrap();
        let url = said["url"].as_str().unwrap().strip_prefix("http://").unwrap().to_owned();
        let (host, token) = url.split_once('/').unwrap();
        Self { child, address: host.parse().unwrap(), base: format!("/{token}") }
    }

    fn host(&self) -> String {
        self.address.to_string()
    }

    fn connect(&self) -> TcpStream {
        let stream = TcpStream::connect(self.address).unwrap();
        stream.set_read_timeout(Some(Duration::from_secs(60))).unwrap();
        stream
    }

    /// Sends bytes as they are.
    fn raw(&self, request: &[u8]) -> Answer {
        let mut stream = self.connect();
        // The server may answer and leave before it has read all.
        let _ = stream.write_all(request);
        answer(&mut stream)
    }

    fn get(&self, path: &str) -> Answer {
        let (host, base) = (self.host(), &self.base);
        self.raw(format!("GET {base}{path} HTTP/1.1\r\nHost: {host}\r\n\r\n").as_bytes())
    }

    fn post(&self, path: &str, body: &Value) -> Answer {
        let (host, base, body) = (self.host(), &self.base, body.to_string());
        let length = body.len();
        let head = format!(
            "POST {base}{path} HTTP/1.1\r\nHost: {host}\r\nContent-Type: application/json\r\n\
             Content-Length: {length}\r\n\r\n{body}"
        );
        self.raw(head.as_bytes())
    }

    /// Acts, which must go well; the state after it.
    #[track_caller]
    fn act(&self, path: &str, body: &Value) -> Value {
        let answer = self.post(path, body);
        assert_eq!(answer.code, 200, "{path}: {}", String::from_utf8_lossy(&answer.body));
        answer.json()
    }

    #[track_caller]
    fn state(&self) -> Value {
        let answer = self.get("state");
        assert_eq!(answer.code, 200, "{}", answer.head);
        answer.json()
    }

    /// The state when it is as wished.
    #[track_caller]
    fn wait(&self, what: &str, wished: impl Fn(&Value) -> bool) -> Value {
        let start = Instant::now();
        let mut state = self.state();
        while !wished(&state) {
            assert!(start.elapsed() < Duration::from_secs(120), "never {what}: {state}");
            let serial = state["serial"].as_u64().unwrap();
            state = self.get(&format!("state?after={serial}")).json();
        }
        state
    }

    #[track_caller]
    fn settled(&self) -> Value {
        self.wait("settled", |state| state["settled"] == true)
    }

    /// Ends it from the page.
    fn quit(mut self) -> Output {
        self.act("quit", &serde_json::json!({}));
        let (mut stdout, mut stderr) = (Vec::new(), Vec::new());
        self.child.stdout.take().unwrap().read_to_end(&mut stdout).unwrap();
        self.child.stderr.take().unwrap().read_to_end(&mut stderr).unwrap();
        let status = self.child.wait().unwrap();
        Output { status, stdout, stderr }
    }
}

impl Drop for Served {
    fn drop(&mut self) {
        // It may have ended.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

fn answer(stream: &mut TcpStream) -> Answer {
    let mut bytes = Vec::new();
    stream.read_to_end(&mut bytes).unwrap();
    let end = bytes.windows(4).position(|four| four == b"\r\n\r\n");
    let end = end.unwrap_or_else(|| panic!("no answer: {}", String::from_utf8_lossy(&bytes)));
    let head = String::from_utf8(bytes[..end].to_vec()).unwrap();
    let code = head.split(' ').nth(1).unwrap().parse().unwrap();
    let body = bytes.split_off(end + 4);
    let length = format!("Content-Length: {}", body.len());
    assert!(head.contains(&length), "{head} is not {length}");
    Answer { code, head, body }
}
