//! Every malformed file of the corpus ends in one clear error, at once and without much memory.
//!
//! One test only: the allocator counts for the whole process.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
#![allow(clippy::print_stdout, reason = "shown with --nocapture")]

mod common;
#[path = "common/memory.rs"]
mod memory;

use std::fmt::Write as _;
use std::time::Instant;

use common::{READERS, cases};
use memory::peak_bytes_of;
use motes_formats::FormatError;

const MAX_BYTES: usize = 200 << 20;
const MAX_SECONDS: f64 = 1.0;

#[test]
fn invalid_files_are_refused_for_their_reason() {
    let mut problems = String::new();
    let (mut count, mut most_bytes, mut most_seconds) = (0, 0, 0.0f64);
    for reader in &READERS {
        for path in cases(reader.document, "invalid") {
            count += 1;
            let mut problem = |text: String| {
                writeln!(problems, "{}: {text}", path.display()).unwrap();
            };
            let mut expect_path = path.clone().into_os_string();
            expect_path.push(".expect");
            let expected = std::fs::read_to_string(&expect_path).unwrap_or_default();
            let started = Instant::now();
            let (outcome, bytes) = peak_bytes_of(|| (reader.read)(&path));
            let seconds = started.elapsed().as_secs_f64();
            (most_bytes, most_seconds) = (most_bytes.max(bytes), most_seconds.max(seconds));
            if bytes > MAX_BYTES || seconds > MAX_SECONDS {
                problem(format!("took {bytes} bytes and {seconds:.3} s"));
            }
            let Err(error) = outcome else {
                problem("was accepted".into());
                continue;
            };
            let text = error.to_string();
            if !text.contains(path.parent().unwrap().to_str().unwrap()) {
                problem(format!("the file is not named: {text}"));
            }
            if matches!(error, FormatError::Io { .. }) {
                problem(format!("is blamed on the operating system: {text}"));
            }
            if expected.trim().is_empty() || !text.contains(expected.trim()) {
                problem(format!("expected {:?}, got {text:?}", expected.trim()));
            }
            if text.lines().count() > 2
                || text.lines().nth(1).is_some_and(|l| !l.starts_with("help: "))
            {
                problem(format!("is explained in too many lines: {text}"));
            }
        }
    }
    println!("{count} files, at most {most_bytes} bytes and {most_seconds:.3} s");
    assert!(problems.is_empty(), "\n{problems}");
    assert!(count > 150, "{count} files");
}
