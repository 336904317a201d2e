//! Whole programs at the extremes; `docs/methods/numerics.md` lists the guarantees.
#![cfg(target_os = "linux")]
#![expect(clippy::unwrap_used, reason = "a test that cannot prepare its files has failed")]

// One module, so that `cargo test stability` finds every test by its path.
#[path = "."]
mod stability {
    mod bench;
    mod extremes;
    mod interrupted_writes;
    mod memory;
    mod world;
}
