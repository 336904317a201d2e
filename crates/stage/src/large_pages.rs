//! Large arrays in large pages.
//!
//! The first touch of a page is a trip into the kernel: with pages of 4 KiB, a million Gaussians cost sixty thousand of them, more
//! time than reading the file takes, and every pass over them misses the address cache of the processor as often. Linux
//! gives pages of 2 MiB to programs that ask (`transparent_hugepage/enabled`: `madvise`, the usual setting, or `always`); where
//! they are switched off or run out, asking changes nothing. Values never depend on it.

#![expect(
    unsafe_code,
    reason = "an allocator has no safe interface; this one hands on to the system's"
)]

use std::alloc::{GlobalAlloc, Layout, System};

/// Smaller arrays are left alone: they would hardly hold a whole page.
const LEAST_BYTES: usize = 4 << 20;

/// The system's allocator, which asks for large pages where they help.
struct LargePages;

#[global_allocator]
static ALLOCATOR: LargePages = LargePages;

// SAFETY: all four hand on to the system's allocator, whose contract is that of this one.
unsafe impl GlobalAlloc for LargePages {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        // SAFETY: the caller keeps the contract.
        advised(unsafe { System.alloc(layout) }, layout.size())
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        // SAFETY: the caller keeps the contract.
        advised(unsafe { System.alloc_zeroed(layout) }, layout.size())
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: the caller keeps the contract.
        unsafe { System.dealloc(pointer, layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        // SAFETY: the caller keeps the contract.
        advised(unsafe { System.realloc(pointer, layout, size) }, size)
    }
}

/// `start` again, after asking for large pages for the `bytes` bytes behind it.
fn advised(start: *mut u8, bytes: usize) -> *mut u8 {
    #[cfg(target_os = "linux")]
    if bytes >= LEAST_BYTES {
        ask(start, bytes);
    }
    start
}

#[cfg(target_os = "linux")]
fn ask(start: *mut u8, bytes: usize) {
    use std::ptr::NonNull;

    use nix::sys::mman::{MmapAdvise, madvise};

    // From the start of the first page to the end of the last, with what the allocator keeps around an array: a mapping
    // that is advised whole can be moved when it grows, one that is advised in part is copied.
    const PAGE: usize = 4 << 10;
    const AROUND: usize = 32;
    let before = start.addr() % PAGE;
    let length = before + bytes + AROUND;
    if let Some(first) = NonNull::new(start.wrapping_sub(before)).filter(|_| !start.is_null()) {
        // SAFETY: this advice changes neither the contents of a page nor whether it may be used, whoever's it is. A refusal
        // leaves small pages.
        let _ = unsafe { madvise(first.cast(), length, MmapAdvise::MADV_HUGEPAGE) };
    }
}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    use std::io::{BufRead as _, BufReader};

    /// Flags of the mapping that holds an address, as the kernel tells them.
    fn flags_at(address: usize) -> Option<String> {
        let maps = BufReader::new(std::fs::File::open("/proc/self/smaps").ok()?);
        let mut inside = false;
        for line in maps.lines().map_while(Result::ok) {
            let range = line.split(' ').next().and_then(|range| range.split_once('-'));
            let hex = |text: &str| usize::from_str_radix(text, 16).ok();
            if let Some((Some(low), Some(high))) = range.map(|(a, b)| (hex(a), hex(b))) {
                inside = (low..high).contains(&address);
            } else if inside && let Some(flags) = line.strip_prefix("VmFlags:") {
                return Some(flags.to_owned());
            }
        }
        None
    }

    #[test]
    fn large_arrays_ask_for_large_pages_and_small_ones_do_not() {
        if !std::path::Path::new("/sys/kernel/mm/transparent_hugepage").exists() {
            eprintln!("skipped: this kernel has no transparent large pages");
            return;
        }
        let asks = |values: &Vec<u64>| {
            let middle = values.as_ptr().addr() + 8 * values.capacity() / 2;
            flags_at(middle).is_some_and(|flags| flags.split_whitespace().any(|flag| flag == "hg"))
        };
        let mut values: Vec<u64> = vec![0; 4 << 20];
        assert!(asks(&values), "zeroed");
        values.extend_from_within(..);
        assert!(asks(&values), "grown");
        assert!(values.iter().all(|v| *v == 0) && values.len() == 8 << 20);
        assert!(asks(&Vec::with_capacity(4 << 20)), "reserved");
        assert!(!asks(&vec![1; 64 << 10]), "half a megabyte");
    }
}
