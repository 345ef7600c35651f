//! Progress in a browser: the page draws the bar. It reads what is written to the file `progress` in the root folder.

use std::sync::Mutex;
use std::time::{Duration, Instant};
use trueaxis_tables::compile::Progress;

/// The stage, its steps, how many are done, and when this was last written.
pub struct ProgressBarOnScreen(Mutex<(&'static str, usize, usize, Instant)>);

const PAUSE: Duration = Duration::from_millis(100);

impl ProgressBarOnScreen {
    /// A bar that shows nothing yet.
    pub fn new() -> Self {
        Self(Mutex::new(("", 0, 0, Instant::now())))
    }
}

fn write(what: &str, done: usize, total: usize) {
    // A page that does not show it loses nothing else.
    let _ = std::fs::write("/progress", format!("{done} {total} {what}"));
}

impl Progress for ProgressBarOnScreen {
    fn stage(&self, what: &'static str, total: usize) {
        if let Ok(mut bar) = self.0.lock() {
            *bar = (what, total, 0, Instant::now());
            write(what, 0, total);
        }
    }

    fn step(&self) {
        if let Ok(mut bar) = self.0.lock() {
            bar.2 += 1;
            if bar.3.elapsed() > PAUSE {
                bar.3 = Instant::now();
                write(bar.0, bar.2, bar.1);
            }
        }
    }
}

impl Drop for ProgressBarOnScreen {
    fn drop(&mut self) {
        write("", 0, 0);
    }
}
