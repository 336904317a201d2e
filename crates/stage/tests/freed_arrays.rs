//! What is freed goes back to the system. A program of its own: other tests would change its memory meanwhile.
#![cfg(all(target_os = "linux", target_env = "gnu"))]

use std::sync::Mutex;

use motes_stage::{give_back_freed_arrays, give_back_freed_memory};

/// One test after the other.
static ALONE: Mutex<()> = Mutex::new(());

/// Bytes of memory that this program has now.
fn resident() -> Option<usize> {
    let pages = std::fs::read_to_string("/proc/self/statm").ok()?;
    Some(4096 * pages.split(' ').nth(1)?.parse::<usize>().ok()?)
}

#[test]
fn room_between_arrays_that_stay_is_given_back() {
    let _alone = ALONE.lock();
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
    let _alone = ALONE.lock();
    let mut arrays: Vec<Option<Vec<u8>>> = (0..2048).map(|_| Some(vec![1; 64 << 10])).collect();
    // Every hundredth stays, so that no heap just shrinks.
    arrays.iter_mut().enumerate().filter(|(i, _)| i % 100 != 0).for_each(|(_, a)| *a = None);
    let Some(before) = resident() else { return };
    give_back_freed_memory();
    let after = resident().unwrap_or(before);
    assert!(after + (80 << 20) < before, "{before} {after}");
    assert_eq!(arrays.iter().flatten().count(), 21);
}
