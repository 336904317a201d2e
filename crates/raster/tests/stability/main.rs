//! The rasterizer at the ends of what a file may hold; `docs/methods/numerics.md` lists the guarantees.

// One module, so that `cargo test stability` finds every test by its path.
#[path = "."]
mod stability {
    mod against_reference;
    mod depth;
    mod gradients;
    mod hostile;
}
