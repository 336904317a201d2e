//! The instruction set that this machine has.

use std::sync::OnceLock;

use fearless_simd::Level;

/// The best level, found once.
pub(super) fn level() -> Level {
    static LEVEL: OnceLock<Level> = OnceLock::new();
    *LEVEL.get_or_init(Level::new)
}
