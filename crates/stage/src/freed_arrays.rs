//! What is freed goes back to the system.
//!
//! glibc maps large arrays one by one and unmaps them when they are freed, but what counts as large grows with every one that is
//! freed, up to 32 MiB: from then on the pictures of a capture share one heap, where the room between those that stay is lost.

#![cfg_attr(
    all(target_os = "linux", target_env = "gnu"),
    expect(unsafe_code, reason = "the allocator of the C library has no safe interface")
)]

/// Arrays of this size and more are mapped one by one: a page is touched anew for every 4 KiB of them, a thousandth of the time
/// it takes to fill one with anything worth keeping.
#[cfg(all(target_os = "linux", target_env = "gnu"))]
const LEAST_BYTES: i32 = 1 << 20;

/// From now on arrays of a megabyte and more are given back as soon as they are freed. For stages that hold many pictures, one
/// step after the other. Values never depend on it; on other systems than Linux with glibc it does nothing.
pub fn give_back_freed_arrays() {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    {
        // SAFETY: sets a number that the allocator reads under its own lock; a refusal leaves it as it was.
        let _ = unsafe { nix::libc::mallopt(nix::libc::M_MMAP_THRESHOLD, LEAST_BYTES) };
    }
}

/// Gives back what was freed since: smaller arrays lie in heaps that keep their room. For the end of a step; a hundredth of a second.
pub fn give_back_freed_memory() {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    {
        // SAFETY: looks through free room only, under the allocator's own locks.
        let _ = unsafe { nix::libc::malloc_trim(0) };
    }
}
