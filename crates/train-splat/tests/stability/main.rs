//! Fits of degenerate and extreme captures; `docs/methods/numerics.md` lists the guarantees.
#![expect(clippy::unwrap_used, reason = "a test that cannot prepare its capture has failed")]

// One module, so that `cargo test stability` finds every test by its path.
#[path = "."]
mod stability {
    mod captures;
    mod degenerate;
    mod world_scale;
}
