//! Life signs from inside a Newton step.
//!
//! On a terminal one line that is overwritten in place; in a log file, for who wants it, at most one line every ten
//! seconds, and no control characters.

use std::io::{IsTerminal, Write};
use std::time::{Duration, Instant};

use super::events::{Event, Sink};

/// What `--progress` says.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Mode {
    /// In place on a terminal, else nothing.
    #[default]
    Auto,
    /// Log lines.
    Plain,
    /// Nothing inside a step.
    Off,
}

/// Shows progress.
pub struct Progress {
    style: Style,
    last: Option<Instant>,
}

enum Style {
    /// Overwrites one line of a terminal; says whether there is something on it.
    InPlace {
        terminal: Box<dyn Write>,
        visible: bool,
    },
    Lines,
    Silent,
}

/// Log files grow, terminals flicker.
const PAUSE_BETWEEN_LINES: Duration = Duration::from_secs(10);
const PAUSE_IN_PLACE: Duration = Duration::from_millis(100);

/// Carriage return, and "erase to the end of the line" (ECMA-48).
const CLEAR: &str = "\r\x1b[K";

impl Progress {
    /// Progress on the standard error stream.
    pub fn on_stderr(mode: Mode) -> Self {
        let stderr = std::io::stderr();
        let style = match mode {
            Mode::Auto if stderr.is_terminal() => Style::InPlace { terminal: Box::new(stderr), visible: false },
            Mode::Auto | Mode::Off => Style::Silent,
            Mode::Plain => Style::Lines,
        };
        Self { style, last: None }
    }

    /// Whether the time for a life sign has come; the first one waits as well, so that quick steps show none.
    fn is_due(&mut self, pause: Duration) -> bool {
        let now = Instant::now();
        let due = now - *self.last.get_or_insert(now) >= pause;
        if due {
            self.last = Some(now);
        }
        due
    }
}

impl Sink for Progress {
    fn event(&mut self, event: &Event) {
        let pause = match self.style {
            Style::InPlace { .. } => PAUSE_IN_PLACE,
            _ => PAUSE_BETWEEN_LINES,
        };
        let text = match event {
            Event::Inner { step, hessian_multiplications } => {
                if !self.is_due(pause) {
                    return;
                }
                format!("     step {step}: {hessian_multiplications} applications of F")
            }
            _ => String::new(),
        };
        match &mut self.style {
            Style::InPlace { terminal, visible } if *visible || !text.is_empty() => {
                *visible = !text.is_empty();
                // A terminal that went away is no reason to stop computing.
                let _ = write!(terminal, "{CLEAR}{text}").and_then(|()| terminal.flush());
            }
            Style::Lines if !text.is_empty() => tracing::info!("{text}"),
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::{Arc, Mutex};

    #[derive(Clone, Default)]
    struct Screen(Arc<Mutex<Vec<u8>>>);

    impl Write for Screen {
        fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
            self.0.lock().unwrap().write(bytes)
        }
        fn flush(&mut self) -> std::io::Result<()> {
            Ok(())
        }
    }

    #[test]
    fn the_line_is_cleared_before_the_log_continues() {
        let screen = Screen::default();
        let style = Style::InPlace { terminal: Box::new(screen.clone()), visible: false };
        let long_ago = Instant::now().checked_sub(Duration::from_secs(1));
        let mut progress = Progress { style, last: long_ago };
        let inner = Event::Inner { step: 2, hessian_multiplications: 91 };
        progress.event(&inner);
        progress.event(&inner);
        progress.event(&Event::Warning("slow".into()));
        progress.event(&Event::Warning("slow".into()));
        let text = String::from_utf8(screen.0.lock().unwrap().clone()).unwrap();
        assert_eq!(text, format!("{CLEAR}     step 2: 91 applications of F{CLEAR}"));
    }
}
