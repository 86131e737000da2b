//! Global allocator. If memory is exhausted, the program ends with exit code 4 and does not abort.

use std::alloc::{GlobalAlloc, Layout, System};
use std::fmt::Write as _;

use crate::linalg::memory::allocation_failure_is_handled;

/// The allocator of the system. A failed allocation ends the program, unless the calling code handles the failure.
#[derive(Debug)]
pub struct Allocator;

// SAFETY: every call is forwarded unchanged to the allocator of the system. After a failure, either the null pointer is
// returned, or the program ends without allocating.
unsafe impl GlobalAlloc for Allocator {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        // SAFETY: the caller guarantees the conditions of `alloc`.
        exit_if_null(unsafe { System.alloc(layout) }, layout.size())
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        // SAFETY: the caller guarantees the conditions of `alloc_zeroed`.
        exit_if_null(unsafe { System.alloc_zeroed(layout) }, layout.size())
    }

    unsafe fn dealloc(&self, place: *mut u8, layout: Layout) {
        // SAFETY: the caller guarantees the conditions of `dealloc`.
        unsafe { System.dealloc(place, layout) }
    }

    unsafe fn realloc(&self, place: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        // SAFETY: the caller guarantees the conditions of `realloc`.
        exit_if_null(unsafe { System.realloc(place, layout, size) }, size)
    }
}

fn exit_if_null(place: *mut u8, bytes: usize) -> *mut u8 {
    if place.is_null() && !allocation_failure_is_handled() {
        exit_out_of_memory(bytes);
    }
    place
}

struct StackText {
    bytes: [u8; 512],
    length: usize,
}

impl std::fmt::Write for StackText {
    fn write_str(&mut self, text: &str) -> std::fmt::Result {
        let room = &mut self.bytes[self.length..];
        let n = text.len().min(room.len());
        room[..n].copy_from_slice(&text.as_bytes()[..n]);
        self.length += n;
        Ok(())
    }
}

/// Ends the program without waiting for other threads. Files that are being written have temporary names, so complete
/// results stay intact.
#[cold]
fn exit_out_of_memory(bytes: usize) -> ! {
    let mut line = StackText { bytes: [0; 512], length: 0 };
    let _ = writeln!(
        line,
        "error: out of memory: {bytes} more bytes could not be allocated. Existing checkpoints are kept, nothing else \
         is written. Use a coarser mesh or fewer cells, or raise the limit (ulimit -v), and resume with --resume"
    );
    // SAFETY: the first `length` bytes are initialised; `_exit` has no preconditions.
    unsafe {
        libc::write(libc::STDERR_FILENO, line.bytes.as_ptr().cast(), line.length);
        libc::_exit(libc::c_int::from(super::exit::RESOURCES))
    }
}
