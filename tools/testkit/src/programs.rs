//! The programs of the suite, for tests of one that run another.

use std::path::PathBuf;

/// The path of a stage beside the running test: `cargo test --workspace` builds all of them.
///
/// # Panics
/// When the program is not built.
pub fn program(name: &str) -> &'static str {
    let test = std::env::current_exe().expect("a test knows its own path");
    let folder = test.parent().and_then(|deps| deps.parent()).expect("tests lie in target/X/deps");
    let path: PathBuf = folder.join(format!("{name}{}", std::env::consts::EXE_SUFFIX));
    assert!(path.exists(), "{} is missing: run `cargo build --release -p {name}`", path.display());
    Box::leak(path.to_string_lossy().into_owned().into_boxed_str())
}
