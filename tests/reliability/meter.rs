//! Measures the memory of a thread, counted by the allocator, and the processor time of the thread.

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

thread_local! {
    static HELD: Cell<i64> = const { Cell::new(0) };
    static MOST: Cell<i64> = const { Cell::new(0) };
}

/// The allocator of the system with a count of the bytes of each thread.
pub struct Counted;

fn count(bytes: i64) {
    // The access fails only when the thread ends, and the count is no longer needed.
    let _ = HELD.try_with(|held| {
        let now = held.get() + bytes;
        held.set(now);
        MOST.with(|most| most.set(most.get().max(now)));
    });
}

// SAFETY: every call is passed unchanged to the allocator of the system.
unsafe impl GlobalAlloc for Counted {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count(layout.size() as i64);
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        count(layout.size() as i64);
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn dealloc(&self, place: *mut u8, layout: Layout) {
        count(-(layout.size() as i64));
        unsafe { System.dealloc(place, layout) }
    }

    unsafe fn realloc(&self, place: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        count(size as i64 - layout.size() as i64);
        unsafe { System.realloc(place, layout, size) }
    }
}

/// Result of `work`, largest number of bytes that this thread allocates in addition during the work, and processor time
/// in seconds.
pub fn measured<T>(work: impl FnOnce() -> T) -> (T, u64, f64) {
    let before = HELD.get();
    MOST.set(before);
    let started = seconds();
    let done = work();
    (done, u64::try_from(MOST.get() - before).unwrap_or(0), seconds() - started)
}

fn seconds() -> f64 {
    let mut time = libc::timespec { tv_sec: 0, tv_nsec: 0 };
    // SAFETY: the pointer refers to a valid timespec.
    unsafe { libc::clock_gettime(libc::CLOCK_THREAD_CPUTIME_ID, &raw mut time) };
    time.tv_sec as f64 + 1e-9 * time.tv_nsec as f64
}

/// Truth: the meter counts bytes that are allocated and not yet freed.
#[test]
fn memory_is_counted() {
    let (list, most, _) = measured(|| {
        drop(vec![0_u8; 1 << 20]);
        vec![1_u8; 1 << 10]
    });
    assert!((1 << 20..(1 << 20) + 4096).contains(&most), "{most}");
    let (_, most, _) = measured(|| drop(list));
    assert_eq!(most, 0);
}
