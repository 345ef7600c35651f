//! A progress bar for work that takes longer than a second.

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::io::{IsTerminal, stderr};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;
use trueaxis_tables::compile::Progress;

/// Shown only on a terminal, and only after a second.
pub struct ProgressBarOnScreen {
    bar: ProgressBar,
    done: Arc<AtomicBool>,
}

const PATIENCE: Duration = Duration::from_secs(1);

impl ProgressBarOnScreen {
    /// Creates a hidden bar.
    pub fn new() -> Self {
        let bar = ProgressBar::with_draw_target(None, ProgressDrawTarget::hidden());
        let done = Arc::new(AtomicBool::new(false));
        if stderr().is_terminal() {
            let (bar, done) = (bar.clone(), Arc::clone(&done));
            std::thread::spawn(move || {
                std::thread::sleep(PATIENCE);
                if !done.load(Ordering::SeqCst) {
                    bar.set_draw_target(ProgressDrawTarget::stderr());
                    bar.enable_steady_tick(Duration::from_millis(100));
                }
            });
        }
        Self { bar, done }
    }
}

impl Progress for ProgressBarOnScreen {
    fn stage(&self, what: &'static str, total: usize) {
        let look = if total == 0 {
            "{spinner} {msg}"
        } else {
            "{spinner} {msg} {wide_bar} {pos}/{len}"
        };
        if let Ok(style) = ProgressStyle::with_template(look) {
            self.bar.set_style(style);
        }
        self.bar.set_message(what);
        self.bar.set_position(0);
        match total {
            0 => self.bar.unset_length(),
            n => self.bar.set_length(n as u64),
        }
    }

    fn step(&self) {
        self.bar.inc(1);
    }
}

impl Drop for ProgressBarOnScreen {
    fn drop(&mut self) {
        self.done.store(true, Ordering::SeqCst);
        self.bar.finish_and_clear();
    }
}
