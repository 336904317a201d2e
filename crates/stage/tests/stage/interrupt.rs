//! What Ctrl-C and a termination leave.

use super::*;

fn start(bench: &Bench, wait: &str, extra: &[&str]) -> std::process::Child {
    let line = ["a.txt", "-o", "j.txt", "--repeat", "200", "--progress", "json", "--wait", wait];
    let mut child = demo()
        .current_dir(bench.dir.path())
        .args(line)
        .args(extra)
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    // The loop has started when this event comes; soon after, the stage looks for Ctrl-C.
    let mut event = String::new();
    BufReader::new(child.stderr.as_mut().unwrap()).read_line(&mut event).unwrap();
    assert!(event.contains("\"start\""), "{event}");
    std::thread::sleep(std::time::Duration::from_millis(300));
    child
}

fn signal(child: &std::process::Child, name: &str) {
    let status = Command::new("kill").args([name, &child.id().to_string()]).status().unwrap();
    assert!(status.success());
}

#[test]
fn the_first_ctrl_c_lets_the_stage_finish_its_step() {
    for name in ["-INT", "-TERM"] {
        let bench = Bench::new();
        let mut child = start(&bench, "50", &[]);
        signal(&child, name);
        let mut rest = String::new();
        child.stderr.take().unwrap().read_to_string(&mut rest).unwrap();
        assert_eq!(child.wait().unwrap().code(), Some(130));
        assert!(rest.contains("interrupted after "), "{rest}");
        assert_eq!(bench.files(), ["a.txt"]);
    }
}

#[test]
fn a_stage_that_does_not_listen_ends_at_once() {
    let bench = Bench::new();
    let mut child = start(&bench, "50", &["--deaf"]);
    signal(&child, "-INT");
    assert_eq!(child.wait().unwrap().code(), Some(130));
}

#[test]
fn the_second_ctrl_c_ends_a_slow_step() {
    let bench = Bench::new();
    let mut child = start(&bench, "60000", &[]);
    signal(&child, "-INT");
    // What comes within a second is one wish.
    std::thread::sleep(std::time::Duration::from_millis(1200));
    let again = std::time::Instant::now();
    signal(&child, "-INT");
    assert_eq!(child.wait().unwrap().code(), Some(130));
    assert!(again.elapsed().as_secs() < 20, "it finished its step");
}

/// `timeout` signals a process and its group: both arrive at the same process.
#[test]
fn two_signals_at_once_are_one() {
    let bench = Bench::new();
    let mut child = start(&bench, "300", &[]);
    for _ in 0..3 {
        signal(&child, "-TERM");
        std::thread::sleep(std::time::Duration::from_millis(20));
    }
    let mut rest = String::new();
    child.stderr.take().unwrap().read_to_string(&mut rest).unwrap();
    assert_eq!(child.wait().unwrap().code(), Some(130));
    assert!(rest.contains("interrupted after "), "{rest}");
}
