//! Memory for the whole program, with an end of its own where the system has no more.
//!
//! Asks the system's allocator and looks at nothing but whether it answered. Rust would abort without an answer, which looks
//! like a crash; this program says what happened and ends with [`EXIT_MEMORY`], upon which the launcher ends the other
//! ranks. Linux often promises more memory than there is and kills a process that uses it: that end is not seen here, which
//! is why runs that cannot fit are refused before they start.

use std::alloc::{GlobalAlloc, Layout, System};
use std::fs::File;
use std::io::Write;
use std::mem::ManuallyDrop;
use std::os::fd::FromRawFd;

use signal_hook::low_level;

/// Exit code of a run that the machine has not enough memory for (sysexits: operating system error).
pub const EXIT_MEMORY: i32 = 71;

/// The system's allocator.
pub struct Heap;

/// Ends this process at once. Takes no memory.
pub fn exhausted(bytes: usize) -> ! {
    // Safety: it is the process' own, and is not closed. Unlike that of the library it has no lock that may be taken.
    let mut stderr = ManuallyDrop::new(unsafe { File::from_raw_fd(2) });
    let mut text = [0; 512];
    let mut left = &mut text[..];
    // A message that does not fit, or that nobody reads, is lost.
    let _ = writeln!(
        left,
        "fetiplast: out of memory: {} MiB more were asked for, and the system has no more; take more machines or a coarser \
         mesh. `fetiplast check` tells what a scene takes",
        bytes.div_ceil(1 << 20)
    );
    let unused = left.len();
    let _ = stderr.write_all(&text[..text.len() - unused]);
    low_level::exit(EXIT_MEMORY)
}

/// The pointer, unless it is null: then there is no memory, and the process ends.
fn there(pointer: *mut u8, bytes: usize) -> *mut u8 {
    if pointer.is_null() {
        exhausted(bytes);
    }
    pointer
}

// Safety: all calls go to the system's allocator. A null pointer is never returned: the process ends.
unsafe impl GlobalAlloc for Heap {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        there(unsafe { System.alloc(layout) }, layout.size())
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        there(unsafe { System.alloc_zeroed(layout) }, layout.size())
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, bytes: usize) -> *mut u8 {
        there(unsafe { System.realloc(pointer, layout, bytes) }, bytes)
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        unsafe { System.dealloc(pointer, layout) }
    }
}
