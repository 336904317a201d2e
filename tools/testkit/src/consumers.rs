//! Other people's programs that open what we write.

use std::path::{Path, PathBuf};

/// The folder into which `make setup-consumers` installed them (`.consumers`, or what
/// `MOTES_CONSUMERS` names), when `needed`, a path in it, is there.
///
/// Without it the caller should return: the reason is on standard output.
///
/// # Panics
/// When it is missing and `CI` or `MOTES_REQUIRE_CONSUMERS` is set.
#[expect(clippy::print_stdout, reason = "a test that skips says so")]
pub fn consumer(needed: &str) -> Option<PathBuf> {
    let own = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../.consumers");
    let folder = std::env::var_os("MOTES_CONSUMERS").map_or(own, PathBuf::from);
    let path = folder.join(needed);
    if path.exists() {
        return Some(path);
    }
    let required =
        ["CI", "MOTES_REQUIRE_CONSUMERS"].iter().any(|name| std::env::var_os(name).is_some());
    assert!(!required, "{} is missing: run make setup-consumers", path.display());
    println!("SKIPPED: {} is missing; make setup-consumers installs it", path.display());
    None
}
