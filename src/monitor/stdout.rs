//! Standard output, for as long as somebody takes it: a log that cannot be written ends a run, but not in a panic.

use std::io::{self, Write};
use std::sync::OnceLock;

/// Why the stream of this process could not be written, the first time.
static FAILURE: OnceLock<io::Error> = OnceLock::new();

/// Takes all that is written, and writes it to standard output until that fails.
#[derive(Clone, Copy, Debug, Default)]
pub struct Log;

impl Write for Log {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if FAILURE.get().is_none()
            && let Err(error) = io::stdout().write_all(bytes).and_then(|()| io::stdout().flush())
        {
            // Somebody else may have been first.
            let _ = FAILURE.set(error);
        }
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// Why standard output could not be written, if so.
pub fn failure() -> Option<&'static io::Error> {
    FAILURE.get()
}
