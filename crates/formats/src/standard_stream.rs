//! `-` where a path is expected: standard input of a reader, standard output of a writer.

use std::path::Path;

/// Whether a path stands for standard input or standard output.
pub fn is_standard_stream(path: &Path) -> bool {
    path == Path::new("-")
}
