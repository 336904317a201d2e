//! Photos, a COLMAP model or a `transforms.json` in; an undistorted capture out.
//!
//! Writes `OUT/capture.json`, `OUT/images/`, `OUT/masks/` and the start points; for example
//! `import-colmap project -o capture --max-resolution 1024 --test-every 8`. Exit codes: 0 done,
//! 1 failed (no solver, a file cannot be written), 2 usage or the output exists, 3 bad input data
//! (also photos that allow no poses), 4 fewer than half of the photos have a pose, 130 interrupted. See
//! `docs/stages/import-colmap.md`.

use std::process::ExitCode;

fn main() -> ExitCode {
    motes_stage::main(import_colmap::files::run)
}
