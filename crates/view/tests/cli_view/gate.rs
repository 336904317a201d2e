//! Who gets an answer, and what hostile connections do to the others.

use std::io::{Read as _, Write as _};
use std::time::Duration;

use serde_json::json;

use super::*;

fn served() -> (ToyScene, Served) {
    let toy = toy_scene();
    let served = Served::start(toy.folder.path(), &["--gaussians", "scene/gaussians.ply"]);
    (toy, served)
}

#[test]
fn only_the_loopback_address_is_listened_to() {
    let (_toy, served) = served();
    assert!(served.address.ip().is_loopback() && served.base.len() == 34, "{}", served.base);
}

#[test]
fn a_request_needs_the_token_the_host_and_no_foreign_origin() {
    let (_toy, served) = served();
    let (host, base) = (served.host(), served.base.clone());
    let ask = |path: &str, headers: &str| {
        served.raw(format!("GET {path} HTTP/1.1\r\n{headers}\r\n").as_bytes()).code
    };
    let own = format!("Host: {host}\r\n");
    let state = format!("{base}state");
    assert_eq!(ask(&state, &own), 200);
    assert_eq!(ask(&state, &format!("{own}Origin: http://{host}\r\n")), 200);
    assert_eq!(ask(&state, &format!("{own}Sec-Fetch-Site: same-origin\r\n")), 200);
    // One digit of the token differs.
    let digit = if base.as_bytes()[5] == b'0' { "1" } else { "0" };
    let mutated = format!("{}{digit}{}state", &base[..5], &base[6..]);
    assert_eq!(mutated.len(), state.len());
    for path in [mutated.as_str(), "/state", "/", "//state", &base[..20], &base.replace('/', "")] {
        assert_eq!(ask(path, &own), 403, "{path}");
    }
    let port = served.address.port();
    for headers in [
        String::new(),
        "Host: evil.example\r\n".into(),
        format!("Host: evil.example:{port}\r\n"),
        format!("Host: 127.0.0.1.evil.example:{port}\r\n"),
        format!("Host: 127.0.0.1:{}\r\n", port ^ 1),
        format!("{own}Origin: http://evil.example\r\n"),
        format!("{own}Origin: null\r\n"),
        format!("{own}Origin: https://{host}\r\n"),
        format!("{own}Sec-Fetch-Site: cross-site\r\n"),
        format!("{own}Sec-Fetch-Site: same-site\r\n"),
    ] {
        assert_eq!(ask(&state, &headers), 403, "{headers}");
    }
    assert_eq!(ask(&state, &format!("{own}Host: evil.example\r\n")), 400);
}

#[test]
fn an_act_is_json_and_small_and_known() {
    let (_toy, served) = served();
    let (host, base) = (served.host(), &served.base);
    let post = |headers: &str, body: &str| {
        let head = format!("POST {base}undo HTTP/1.1\r\nHost: {host}\r\n{headers}");
        served.raw(format!("{head}Content-Length: {}\r\n\r\n{body}", body.len()).as_bytes()).code
    };
    let json_kind = "Content-Type: application/json; charset=utf-8\r\n";
    assert_eq!(post(json_kind, "{}"), 422, "there is nothing to undo");
    // What a form of another site can send.
    for kind in ["", "Content-Type: text/plain\r\n", "Content-Type: multipart/form-data\r\n"] {
        assert_eq!(post(kind, "{}"), 415, "{kind}");
    }
    assert_eq!(post(json_kind, &" ".repeat((1 << 20) + 1)), 413);
    assert_eq!(served.post("no-such-act", &json!({})).code, 404);
    for (path, body) in [
        ("act", json!({})),
        ("act", json!({ "op": { "op": "explode" } })),
        ("act", json!({ "op": { "op": "delete" } })),
        ("act", json!({ "op": { "op": "insert", "file": "/etc/passwd" } })),
        ("act", json!({ "op": { "op": "stylize", "prompt": "x", "editor": "touch owned" } })),
        ("act", json!({ "op": { "op": "set_environment", "sun": "noon" } })),
        ("light", json!({ "sun": "noon" })),
        ("prompt", json!({ "kind": "click", "positive": true })),
        ("prompt", json!({ "kind": "stroke", "view": "v", "points": [[0, 0]], "positive": true })),
        ("keep", json!({ "name": "a" })),
        ("choose", json!({ "name": "a" })),
        ("choose", json!([])),
    ] {
        let answer = served.post(path, &body);
        let said = String::from_utf8_lossy(&answer.body);
        assert_eq!(answer.code, 422, "{path} {body}: {said}");
        assert!(answer.json()["error"].as_str().unwrap().len() > 10, "{said}");
    }
    assert_eq!(served.state()["steps"], json!([]));
}

#[test]
fn paths_lead_nowhere_else() {
    let (_toy, served) = served();
    for path in [
        "../etc/passwd",
        "photo/../../etc/passwd",
        "%2e%2e/etc/passwd",
        "photo/0",
        "photo/-1",
        "block/0/99999999999999999999",
        "block/0/7",
        "mask/0/0",
        "nothing",
    ] {
        assert_eq!(served.get(path).code, 404, "{path}");
    }
    assert_eq!(served.get("block/77/0").code, 410);
    assert_eq!(served.get("mask/0").code, 410, "nothing is selected");
    assert_eq!(served.get("block/0/0").code, 200);
}

#[test]
fn ten_people_look_at_once_and_see_the_same() {
    let (_toy, served) = served();
    let looked: Vec<Vec<u8>> = std::thread::scope(|scope| {
        let look = || {
            let page = served.get("");
            assert_eq!(page.code, 200);
            assert!(page.head.contains("Content-Security-Policy: default-src 'none'"));
            assert_eq!(served.get("manifest").code, 200);
            let serial = served.state()["serial"].as_u64().unwrap();
            // News that never come are waited for by all at once.
            assert_eq!(served.get(&format!("state?after={serial}")).code, 200);
            served.get("block/0/0").body
        };
        let all: Vec<_> = (0..10).map(|_| scope.spawn(look)).collect();
        all.into_iter().map(|one| one.join().unwrap()).collect()
    });
    assert!(looked.iter().all(|block| block == &looked[0] && !block.is_empty()));
}

#[test]
fn lost_and_silent_connections_harm_nobody() {
    let (_toy, served) = served();
    let (host, base) = (served.host(), &served.base);
    // Lost in the headers, in the body, before the answer was read.
    for start in [
        format!("GET {base}st"),
        format!("POST {base}undo HTTP/1.1\r\nHost: {host}\r\nContent-Length: 100\r\n\r\n{{"),
        format!("GET {base}manifest HTTP/1.1\r\nHost: {host}\r\n\r\n"),
    ] {
        for _ in 0..5 {
            let mut stream = served.connect();
            stream.write_all(start.as_bytes()).unwrap();
        }
    }
    assert_eq!(served.state()["settled"], true);
    // More silent connections than are held: the last ones are turned away at once, and there is room when they go. Silent ones
    // are let go after ten seconds, which a busy machine may take to see them all.
    let crowded = || {
        let silent: Vec<_> = (0..view::http::MOST_CONNECTIONS).map(|_| served.connect()).collect();
        std::thread::sleep(Duration::from_millis(500));
        let mut said = Vec::new();
        // Nothing was asked: the connection may be cut before the answer is read.
        let _ = served.connect().read_to_end(&mut said);
        drop(silent);
        said.starts_with(b"HTTP/1.1 503")
    };
    assert!((0..4).any(|_| crowded()), "nobody is turned away");
    let patient = Instant::now();
    while served.get("state").code != 200 {
        assert!(patient.elapsed() < Duration::from_secs(30), "there is no room again");
        std::thread::sleep(Duration::from_millis(200));
    }
    // Headers without end, a head that is none.
    let endless =
        format!("GET {base}state HTTP/1.1\r\nHost: {host}\r\nA: {}", "a".repeat(20 << 10));
    assert_eq!(served.raw(endless.as_bytes()).code, 431);
    assert_eq!(served.raw(b"\x16\x03\x01\x02\x00\r\n\r\n").code, 400);
}
