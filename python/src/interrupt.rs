//! Long calls that Ctrl-C ends.

use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use std::panic::resume_unwind;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, sync_channel};
use std::time::Duration;
use trueaxis_tables::compile::Progress;

/// Time between two looks at pending signals: a person takes twice as long to notice a delay.
const LOOK: Duration = Duration::from_millis(50);

/// Whether the caller no longer waits.
#[derive(Clone, Default)]
pub struct Abandoned(Arc<AtomicBool>);

/// The payload that unwinds abandoned work.
struct Stopped;

impl Abandoned {
    /// Ends the thread's work, if the caller no longer waits.
    pub fn look(&self) {
        if self.0.load(Ordering::Relaxed) {
            resume_unwind(Box::new(Stopped));
        }
    }
}

impl Progress for Abandoned {
    fn stage(&self, _: &'static str, _: usize) {
        self.look();
    }

    fn step(&self) {
        self.look();
    }
}

/// Computes in another thread without the interpreter's lock. On Ctrl-C, raises `KeyboardInterrupt` and abandons the
/// thread: its work ends where it next reports progress, or else at its end.
pub fn interruptible<R: Send + 'static>(
    py: Python<'_>,
    work: impl FnOnce(&Abandoned) -> R + Send + 'static,
) -> PyResult<R> {
    let abandoned = Abandoned::default();
    let (sender, receiver) = sync_channel(1);
    let own = abandoned.clone();
    let spawned = std::thread::Builder::new().spawn(move || {
        // Nobody listens to abandoned work.
        let _ = sender.send(work(&own));
    });
    spawned?;
    py.detach(move || {
        loop {
            match receiver.recv_timeout(LOOK) {
                Ok(found) => return Ok(found),
                Err(RecvTimeoutError::Timeout) => {
                    if let Err(error) = Python::attach(|py| py.check_signals()) {
                        abandoned.0.store(true, Ordering::Relaxed);
                        return Err(error);
                    }
                }
                Err(RecvTimeoutError::Disconnected) => {
                    return Err(PyRuntimeError::new_err(
                        "trueaxis made a mistake: please report what led to it",
                    ));
                }
            }
        }
    })
}
