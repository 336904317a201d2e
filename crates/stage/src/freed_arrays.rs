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

#[cfg(all(test, target_os = "linux", target_env = "gnu"))]
mod tests {
    use super::*;

    /// Bytes of memory that this program has now.
    fn resident() -> Option<usize> {
        let pages = std::fs::read_to_string("/proc/self/statm").ok()?;
        Some(4096 * pages.split(' ').nth(1)?.parse::<usize>().ok()?)
    }

    #[test]
    fn room_between_arrays_that_stay_is_given_back() {
        give_back_freed_arrays();
        let Some(before) = resident() else { return };
        // The largest first: without the setting all that follow share a heap.
        drop(vec![1u8; 30 << 20]);
        let mut arrays: Vec<Option<Vec<u8>>> = (0..64).map(|_| Some(vec![1; 2 << 20])).collect();
        let full = resident().unwrap_or(0);
        assert!(full > before + (120 << 20), "{before} {full}");
        arrays.iter_mut().step_by(2).for_each(|a| *a = None);
        let half = resident().unwrap_or(0);
        assert!(half + (56 << 20) < full, "{full} {half}");
        assert_eq!(arrays.iter().flatten().count(), 32);
    }

    #[test]
    fn small_arrays_are_given_back_when_asked() {
        let mut arrays: Vec<Option<Vec<u8>>> = (0..2048).map(|_| Some(vec![1; 64 << 10])).collect();
        // Every hundredth stays, so that no heap just shrinks.
        arrays.iter_mut().enumerate().filter(|(i, _)| i % 100 != 0).for_each(|(_, a)| *a = None);
        let Some(before) = resident() else { return };
        give_back_freed_memory();
        let after = resident().unwrap_or(before);
        assert!(after + (80 << 20) < before, "{before} {after}");
        assert_eq!(arrays.iter().flatten().count(), 21);
    }
}
