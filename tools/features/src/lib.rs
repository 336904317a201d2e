//! Features of shared dependencies, declared once.
//!
//! Cargo unifies features over the packages that a command selects. `cargo test -p edit`, `cargo run -p xtask` and
//! `cargo build -p relight` would each compile `libc` or `regex-syntax` with other features, and with them most of the house.
//! The lowest crate depends on this empty one, whose manifest asks for what any of them needs.
