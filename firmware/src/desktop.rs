//! A controller on the desktop: the device with a mock flash, and time advanced by the caller.
//!
//! For tests of both ends of the link. Nothing runs by itself: [`Desktop::turn`] runs one turn of the main loop and a
//! number of servo periods.

use std::boxed::Box;
use std::collections::VecDeque;
use std::convert::Infallible;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::vec::Vec;

use embedded_io::{ErrorType, Read, ReadReady, Write};

use trueaxis::Usual;
use trueaxis::link::Restart;

use crate::device::{Device, Identity, LinkOnly, Machine, NoClock, ServoAccess, ServoSide};
use crate::double_buffer::DoubleBuffer;
use crate::link::{BootNonce, Link};
use crate::mock_flash::MockFlash;
use crate::slots::Slots;

/// The servo side with the default capacities.
pub type Side = ServoSide<Usual>;

/// The servo side, protected by a lock instead of by masking the interrupt.
#[derive(Clone)]
pub struct Shared(Arc<Mutex<Side>>);

impl Shared {
    /// One servo period in which only the link commands positions.
    pub fn tick(&self) {
        self.lock(|side| side.tick(&mut LinkOnly, &mut LinkOnly, &NoClock));
    }

    /// Calls `f` with exclusive access.
    pub fn lock<R>(&self, f: impl FnOnce(&mut Side) -> R) -> R {
        // A failure in another test is reported there.
        f(&mut self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

impl ServoAccess<Usual> for Shared {
    fn with<R>(&mut self, f: impl FnOnce(&mut Side) -> R) -> R {
        self.lock(f)
    }
}

/// Whether the machine stands still with its drives off; initially it does.
#[derive(Clone, Debug)]
pub struct Standstill(Arc<AtomicBool>);

impl Standstill {
    /// Starts or stops the machine.
    pub fn set(&self, standstill: bool) {
        self.0.store(standstill, Ordering::SeqCst);
    }
}

impl Machine for Standstill {
    fn standstill(&self) -> bool {
        self.0.load(Ordering::SeqCst)
    }
}

/// Both directions of a serial line, from the controller's point of view.
#[derive(Debug, Default)]
pub struct Line {
    /// Bytes that the controller has not read yet.
    pub incoming: VecDeque<u8>,
    /// Bytes that the controller has sent.
    pub outgoing: Vec<u8>,
}

impl ErrorType for Line {
    type Error = Infallible;
}

impl Read for Line {
    fn read(&mut self, buffer: &mut [u8]) -> Result<usize, Infallible> {
        let count = buffer.len().min(self.incoming.len());
        for (place, byte) in buffer.iter_mut().zip(self.incoming.drain(..count)) {
            *place = byte;
        }
        Ok(count)
    }
}

impl ReadReady for Line {
    fn read_ready(&mut self) -> Result<bool, Infallible> {
        Ok(!self.incoming.is_empty())
    }
}

impl Write for Line {
    fn write(&mut self, bytes: &[u8]) -> Result<usize, Infallible> {
        self.outgoing.extend(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> Result<(), Infallible> {
        Ok(())
    }
}

/// Counts desktop starts in this program.
struct Starts;

impl BootNonce for Starts {
    fn boot_nonce(&mut self) -> Option<u64> {
        static STARTS: AtomicU64 = AtomicU64::new(0);
        Some(STARTS.fetch_add(1, Ordering::Relaxed))
    }
}

/// The device with a mock flash.
pub type MockDevice<const WRITE: usize, const ERASE: usize> =
    Device<MockFlash<WRITE, ERASE>, Shared, Standstill, Usual>;

/// A controller with default capacities.
pub struct Desktop<const WRITE: usize = 4, const ERASE: usize = 256> {
    /// The main loop's side.
    pub device: MockDevice<WRITE, ERASE>,
    /// The servo interrupt's side.
    pub servo: Shared,
    /// The state of the machine.
    pub standstill: Standstill,
    /// The link.
    pub link: Link,
    /// The serial line.
    pub line: Line,
    buffers: &'static DoubleBuffer,
    period: f32,
}

impl<const WRITE: usize, const ERASE: usize> Desktop<WRITE, ERASE> {
    /// Starts with the content of `flash`; `period` in s.
    #[must_use]
    pub fn start(flash: MockFlash<WRITE, ERASE>, period: f32) -> Self {
        Self::start_watched(flash, period, |_, _| ())
    }

    /// Starts a controller; `watch` may attach a listener to the flash that knows the servo.
    #[must_use]
    pub fn start_watched(
        mut flash: MockFlash<WRITE, ERASE>,
        period: f32,
        watch: impl FnOnce(&mut MockFlash<WRITE, ERASE>, &Shared),
    ) -> Self {
        let pooled = pool().pop();
        let buffers = pooled.unwrap_or_else(|| Box::leak(Box::default()));
        let Some((loader, servo)) = buffers.split() else {
            unreachable!("the buffers are new");
        };
        let servo = Shared(Arc::new(Mutex::new(ServoSide::new(servo, period))));
        let standstill = Standstill(Arc::new(AtomicBool::new(true)));
        watch(&mut flash, &servo);
        let identity = Identity {
            firmware: concat!("trueaxis-firmware ", env!("CARGO_PKG_VERSION")),
            board: "desktop",
            period,
            restart: Restart::PowerOn,
        };
        let slots = Slots::open(flash);
        let device = Device::start(slots, loader, servo.clone(), standstill.clone(), identity);
        Self {
            device,
            servo,
            standstill,
            link: Link::new(&mut Starts),
            line: Line::default(),
            buffers,
            period,
        }
    }

    /// One turn of the main loop, then `ticks` servo periods.
    pub fn turn(&mut self, ticks: u32) {
        match self.link.poll(&mut self.line, &mut self.device) {
            Ok(()) => {}
            Err(never) => match never {},
        }
        for _ in 0..ticks {
            self.servo.tick();
        }
    }

    /// Switches the power off: returns the flash, without its listener and powered again.
    #[must_use]
    pub fn stop(self) -> MockFlash<WRITE, ERASE> {
        let Self {
            device,
            servo,
            buffers,
            ..
        } = self;
        let (slots, loader, other) = device.close();
        let mut flash = slots.close();
        // The listener may hold the servo too.
        flash.set_listener(|_| ());
        drop(other);
        // If anything else still holds the servo, its buffers are never reused.
        if let Some(side) = Arc::into_inner(servo.0) {
            let side = side.into_inner().unwrap_or_else(PoisonError::into_inner);
            if buffers.unite(loader, side.into_servo()) {
                pool().push(buffers);
            }
        }
        flash.set_fuel(None);
        flash
    }

    /// Switches the power off and on again.
    #[must_use]
    pub fn restart(self) -> Self {
        let period = self.period;
        Self::start(self.stop(), period)
    }
}

/// Unused double buffers: about 40 kB each, and they must live for ever.
fn pool() -> MutexGuard<'static, Vec<&'static DoubleBuffer>> {
    static POOL: Mutex<Vec<&'static DoubleBuffer>> = Mutex::new(Vec::new());
    POOL.lock().unwrap_or_else(PoisonError::into_inner)
}
