//! `scripts/package`: an installed tree becomes an archive and a wheel that pip installs.
//!
//! It needs Python 3.9 and binutils; a machine without them skips it and says so.
#![expect(clippy::unwrap_used, reason = "a test that cannot prepare its files has failed")]
#![allow(clippy::print_stderr, reason = "a test that skips says so")]

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

fn script() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scripts/package")
}

fn has(program: &str, arguments: &[&str]) -> bool {
    let found = Command::new(program).args(arguments).output();
    let found = found.is_ok_and(|output| output.status.success());
    if !found {
        eprintln!("skipped: no {program} {}", arguments.join(" "));
    }
    found
}

fn can_package() -> bool {
    let new = "import sys; sys.exit(sys.version_info < (3, 9))";
    has("python3", &["-c", new]) && has("strip", &["--version"]) && has("objdump", &["--version"])
}

/// `bin/motes` of this build, and a stage that prints a line.
fn tree(folder: &Path) -> PathBuf {
    use std::os::unix::fs::PermissionsExt as _;
    let tree = folder.join("tree");
    std::fs::create_dir_all(tree.join("bin")).unwrap();
    std::fs::create_dir_all(tree.join("libexec/motes")).unwrap();
    std::fs::copy(env!("CARGO_BIN_EXE_motes"), tree.join("bin/motes")).unwrap();
    let stage = tree.join("libexec/motes/render");
    std::fs::write(&stage, "#!/bin/sh\necho packaged\n").unwrap();
    std::fs::set_permissions(&stage, std::fs::Permissions::from_mode(0o755)).unwrap();
    tree
}

fn package(tree: &Path, out: &Path) -> Output {
    let mut command = Command::new("python3");
    command.arg(script()).args([tree, out]).args(["--version", "9.8.7"]);
    command.env("SOURCE_DATE_EPOCH", "1700000000").output().unwrap()
}

fn product(folder: &Path, end: &str) -> PathBuf {
    let mut entries = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    entries.find(|path| path.to_str().unwrap().ends_with(end)).unwrap()
}

#[track_caller]
fn assert_done(output: &Output) {
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

/// What `motes render` prints; no other stage is found.
fn rendered(motes: &Path) -> String {
    let mut command = Command::new(motes);
    command.arg("render").env_remove("MOTES_STAGE_PATH").env("PATH", "/usr/bin:/bin");
    String::from_utf8(command.output().unwrap().stdout).unwrap()
}

#[test]
fn the_archive_runs_where_it_is_unpacked_and_has_the_same_bytes_again() {
    if !can_package() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let tree = tree(folder.path());
    let [first, second] = ["one", "two"].map(|name| folder.path().join(name));
    for out in [&first, &second] {
        assert_done(&package(&tree, out));
    }
    for end in [".tar.gz", ".whl", "SHA256SUMS"] {
        let same = std::fs::read(product(&first, end)).unwrap()
            == std::fs::read(product(&second, end)).unwrap();
        assert!(same, "{end}");
    }
    let check = Command::new("sha256sum").args(["-c", "SHA256SUMS"]).current_dir(&first).output();
    assert_done(&check.unwrap());
    let archive = product(&first, ".tar.gz");
    let unpack = Command::new("tar").arg("xzf").arg(&archive).current_dir(&first).output();
    assert_done(&unpack.unwrap());
    let name = archive.file_name().unwrap().to_str().unwrap().strip_suffix(".tar.gz").unwrap();
    assert!(name.starts_with("motes-9.8.7-"), "{name}");
    assert_eq!(rendered(&first.join(name).join("bin/motes")), "packaged\n");
    assert!(first.join(name).join("share/doc/motes/LICENSE-MIT").is_file());
}

#[test]
fn pip_installs_the_wheel_and_puts_one_program_on_the_path() {
    if !can_package() || !has("python3", &["-m", "pip", "--version"]) {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    assert_done(&package(&tree(folder.path()), &out));
    let environment = folder.path().join("venv");
    let mut make = Command::new("python3");
    if !make
        .args(["-m", "venv", "--without-pip"])
        .arg(&environment)
        .output()
        .unwrap()
        .status
        .success()
    {
        eprintln!("skipped: python3 makes no environments");
        return;
    }
    let mut pip = Command::new("python3");
    pip.args(["-m", "pip", "--python"]).arg(environment.join("bin/python"));
    pip.args(["install", "--quiet", "--no-index", "--no-deps"]).arg(product(&out, ".whl"));
    assert_done(&pip.output().unwrap());
    assert_eq!(rendered(&environment.join("bin/motes")), "packaged\n");
    assert!(!environment.join("bin/render").exists());
}

#[test]
fn a_folder_without_the_programs_is_refused() {
    if !can_package() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let refused = package(folder.path(), &folder.path().join("out"));
    let said = String::from_utf8_lossy(&refused.stderr).into_owned();
    assert!(!refused.status.success() && said.contains("help: make install"), "{said}");
}
