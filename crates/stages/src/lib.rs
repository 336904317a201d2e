//! Stage binaries live in `src/bin`.
