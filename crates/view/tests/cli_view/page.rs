//! The program around the page.

use super::*;

#[test]
fn an_interrupt_ends_it_and_the_plan_is_whole() {
    let toy = toy_scene();
    let line = ["--gaussians", "scene/gaussians.ply", "-o", "plan.json"];
    let mut served = Served::start(toy.folder.path(), &line);
    served.settled();
    // Somebody waits for news meanwhile.
    let mut waiting = served.connect();
    let (host, base) = (served.host(), &served.base);
    let ask = format!("GET {base}state?after=1000 HTTP/1.1\r\nHost: {host}\r\n\r\n");
    waiting.write_all(ask.as_bytes()).unwrap();
    std::thread::sleep(Duration::from_millis(300));
    let start = Instant::now();
    let id = served.child.id().to_string();
    assert!(Command::new("kill").args(["-INT", &id]).status().unwrap().success());
    let status = served.child.wait().unwrap();
    assert_eq!(status.code(), Some(130));
    assert!(start.elapsed() < Duration::from_secs(5), "{:?}", start.elapsed());
    assert_eq!(answer(&mut waiting).json()["over"], true);
    let plan: Value =
        serde_json::from_slice(&std::fs::read(toy.path("plan.json")).unwrap()).unwrap();
    assert_eq!(plan["format"], "motes/edit-plan");
}

#[test]
fn a_port_that_is_taken_is_said() {
    let toy = toy_scene();
    let line = ["--gaussians", "scene/gaussians.ply"];
    let served = Served::start(toy.folder.path(), &line);
    let port = served.address.port().to_string();
    let output = run(toy.folder.path(), &[&line[..], &["--port", &port]].concat());
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert!(said.contains(&port) && said.contains("help: "), "{said}");
}

#[test]
fn photos_are_served_as_they_are_asked_for() {
    let toy = scene_with_photos();
    let line = ["scene", "capture.json"];
    let served = Served::start(toy.folder.path(), &line);
    let manifest = served.get("manifest").json();
    let photos = manifest["photos"].as_array().unwrap();
    assert_eq!(photos.len(), toy.capture.views.len());
    for (i, view) in toy.capture.views.iter().enumerate() {
        assert_eq!(photos[i]["name"], view.name.as_str());
        let photo = served.get(&format!("photo/{i}"));
        assert!(photo.code == 200 && photo.body.starts_with(b"\xff\xd8\xff"), "{}", photo.head);
        assert!(photo.head.contains("Content-Type: image/jpeg"), "{}", photo.head);
    }
    std::fs::remove_file(toy.path("").join(&toy.capture.views[1].image)).unwrap();
    assert_eq!(served.get("photo/1").code, 422);
}
