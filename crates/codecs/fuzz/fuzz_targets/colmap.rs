#![no_main]

use std::path::{Path, PathBuf};
use std::sync::LazyLock;

#[path = "../parsers.rs"]
#[allow(dead_code, reason = "a target uses one parser")]
mod parsers;

/// Copies of the valid models of the corpus, by suffix.
static MODELS: LazyLock<[(PathBuf, &str); 2]> = LazyLock::new(|| {
    let corpus = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../testdata/colmap/valid");
    [("pycolmap-4-binary", "bin"), ("text", "txt")].map(|(name, suffix)| {
        let copy = std::env::temp_dir().join(format!("motes-fuzz-{}-{name}", std::process::id()));
        std::fs::create_dir_all(&copy).expect("a temporary folder");
        for stem in ["cameras", "images", "points3D"] {
            let file = format!("{stem}.{suffix}");
            std::fs::copy(corpus.join(name).join(&file), copy.join(&file)).expect("the corpus");
        }
        (copy, suffix)
    })
});

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    for (folder, suffix) in MODELS.iter() {
        parsers::colmap_file(bytes, folder, suffix);
    }
});
