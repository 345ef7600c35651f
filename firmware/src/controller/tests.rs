use std::boxed::Box;
use std::cell::{Cell, RefCell};
use std::convert::Infallible;
use std::rc::Rc;
use std::vec::Vec;
use std::{thread_local, vec};

use embedded_hal::digital::{self, ErrorKind};
use embedded_io::ErrorType;
use trueaxis::link::{
    Framed, Header, MOST_BODY, MOST_WIRE, Received, Receiver, Reply, Request, Restart, encode,
};
use trueaxis::{AlignedBlob, Auxiliary, AuxiliaryKind, Draft, Interpolation, Usual};

use crate::desktop::Line;
use crate::device::tests::{Source, draft};
use crate::device::{Command, LinkOnly, Machine, NoClock, PositionSource, ServoSide};
use crate::double_buffer::{BufferedServo, DoubleBuffer};
use crate::link::BootNonce;
use crate::mock_flash::MockFlash;
use crate::temperature::Settings;

use super::*;

const PERIOD: f32 = 0.00025;

pub(super) fn leak<T>(value: T) -> &'static T {
    Box::leak(Box::new(value))
}

/// A pin that the test can access from its other end.
pub(super) struct Pin {
    pub high: Cell<bool>,
    /// It can be neither read nor set.
    pub broken: Cell<bool>,
}

impl Pin {
    pub fn new(high: bool) -> Rc<Self> {
        Rc::new(Self {
            high: Cell::new(high),
            broken: Cell::new(false),
        })
    }
}

#[derive(Debug)]
pub(super) struct Broken;

impl digital::Error for Broken {
    fn kind(&self) -> ErrorKind {
        ErrorKind::Other
    }
}

/// A board's end of a [`Pin`].
#[derive(Clone)]
pub(super) struct Wire(pub Rc<Pin>);

impl digital::ErrorType for Wire {
    type Error = Broken;
}

impl OutputPin for Wire {
    fn set_low(&mut self) -> Result<(), Broken> {
        self.set(false)
    }

    fn set_high(&mut self) -> Result<(), Broken> {
        self.set(true)
    }
}

impl Wire {
    fn set(&self, high: bool) -> Result<(), Broken> {
        if self.0.broken.get() {
            return Err(Broken);
        }
        self.0.high.set(high);
        Ok(())
    }
}

impl InputPin for Wire {
    fn is_high(&mut self) -> Result<bool, Broken> {
        if self.0.broken.get() {
            return Err(Broken);
        }
        Ok(self.0.high.get())
    }

    fn is_low(&mut self) -> Result<bool, Broken> {
        self.is_high().map(|high| !high)
    }
}

/// A servo with the compensation of [`draft`].
pub(super) fn loaded(scale: f32) -> BufferedServo<Usual> {
    let buffers: &'static DoubleBuffer = Box::leak(Box::default());
    let (mut loader, mut servo) = buffers.split().unwrap();
    let blob: &'static AlignedBlob = leak(draft("m", b"XY", scale).encode().unwrap());
    servo.replace(loader.load(&**blob).unwrap()).unwrap();
    servo
}

/// A servo side with the compensation of [`draft`].
pub(super) fn side(scale: f32) -> ServoSide<Usual> {
    ServoSide::new(loaded(scale), PERIOD)
}

pub(super) fn shared(side: ServoSide<Usual>) -> &'static mut ServoSide<Usual> {
    Box::leak(Box::new(side))
}

/// The main loop's access to a side that no interrupt updates.
pub(super) fn access(side: ServoSide<Usual>) -> Access<Usual> {
    leak(Shell::new(4000)).share(shared(side))
}

/// An unchanging nonce at every start.
struct Nonce;

impl BootNonce for Nonce {
    fn boot_nonce(&mut self) -> Option<u64> {
        Some(1)
    }
}

/// A serial line that the test can access from its other end.
#[derive(Clone, Default)]
struct Port(Rc<RefCell<Line>>);

impl ErrorType for Port {
    type Error = Infallible;
}

impl Read for Port {
    fn read(&mut self, buffer: &mut [u8]) -> Result<usize, Infallible> {
        self.0.borrow_mut().read(buffer)
    }
}

impl ReadReady for Port {
    fn read_ready(&mut self) -> Result<bool, Infallible> {
        self.0.borrow_mut().read_ready()
    }
}

impl Write for Port {
    fn write(&mut self, bytes: &[u8]) -> Result<usize, Infallible> {
        self.0.borrow_mut().write(bytes)
    }

    fn flush(&mut self) -> Result<(), Infallible> {
        Ok(())
    }
}

/// A sensor with a preset reading that counts its readings.
struct Probe {
    celsius: Rc<Cell<Option<f32>>>,
    asked: Rc<Cell<u32>>,
}

impl Thermometer for Probe {
    type Error = Infallible;

    fn celsius(&mut self) -> Result<Option<f32>, Infallible> {
        self.asked.set(self.asked.get() + 1);
        Ok(self.celsius.get())
    }
}

thread_local! {
    static LOG: RefCell<Vec<Event>> = const { RefCell::new(Vec::new()) };
}

fn log(event: Event) {
    LOG.with_borrow_mut(|log| log.push(event));
}

/// Events logged since the last call.
fn logged() -> Vec<Event> {
    LOG.take()
}

fn here() -> Source {
    let place = [0.0, -50.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    Source(Some(Command::new(place, u16::MAX)))
}

/// A frame with a hello.
fn hello() -> Vec<u8> {
    let (mut scratch, mut out) = ([0; MOST_BODY], [0; MOST_WIRE]);
    let (session, sequence) = (7, 0);
    let header = Header { session, sequence };
    let frame = encode(header, &Request::Hello, &mut scratch, &mut out);
    frame.unwrap().to_vec()
}

type Main = MainLoop<'static, MockFlash, Port, Wire, Wire, Probe, Usual, 1>;

/// Counts its feeds.
pub(super) struct Dog(pub Rc<Cell<u32>>);

impl Watchdog for Dog {
    fn feed(&mut self) {
        self.0.set(self.0.get() + 1);
    }
}

/// A board of mocks, with the other ends of its wires.
struct Bench {
    main: Main,
    shell: &'static Shell<Usual>,
    heart: Heart<Wire, Dog>,
    line: Rc<RefCell<Line>>,
    drives_off: Rc<Pin>,
    lamp: Rc<Pin>,
    healthy: Rc<Pin>,
    fed: Rc<Cell<u32>>,
    celsius: Rc<Cell<Option<f32>>>,
    asked: Rc<Cell<u32>>,
}

impl Bench {
    /// With or without a compensation in slot A.
    fn start(blob: Option<&[u8]>) -> Self {
        LOG.take();
        let mut slots = Slots::open(MockFlash::new(16));
        if let Some(blob) = blob {
            let word = |at: usize| u32::from_le_bytes(blob[at..at + 4].try_into().unwrap());
            slots.begin(word(8), word(12)).unwrap();
            while let Ok(crate::slots::Progress::Erasing { .. }) = slots.erase_step() {}
            slots.write(0, blob).unwrap();
            let slot = slots.commit(|_| true).unwrap();
            slots.choose(slots.choosing(slot)).unwrap();
        }
        let buffers: &'static DoubleBuffer = Box::leak(Box::default());
        let (loader, servo) = buffers.split().unwrap();
        let shell = leak(Shell::new(4000));
        let port = Port::default();
        let [drives_off, lamp, healthy] = [true, false, false].map(Pin::new);
        let (celsius, asked, fed) = (Rc::default(), Rc::default(), Rc::default());
        let probe = Probe {
            celsius: Rc::clone(&celsius),
            asked: Rc::clone(&asked),
        };
        let line = Rc::clone(&port.0);
        let board = Board {
            flash: slots.close(),
            port,
            drives_off: Wire(Rc::clone(&drives_off)),
            lamp: Wire(Rc::clone(&lamp)),
            temperatures: Temperatures::new([("bed", probe)], Settings::MACHINE),
            log,
        };
        let identity = Identity {
            firmware: "test",
            board: "bench",
            period: PERIOD,
            restart: Restart::Unknown,
        };
        let access = shell.share(shared(ServoSide::new(servo, PERIOD)));
        Self {
            main: MainLoop::start(
                board,
                Box::leak(Box::new(Link::new(&mut Nonce))),
                loader,
                access,
                identity,
            ),
            shell,
            heart: Heart::new(Wire(Rc::clone(&healthy)), Dog(Rc::clone(&fed))),
            line,
            drives_off,
            lamp,
            healthy,
            fed,
            celsius,
            asked,
        }
    }

    /// Runs without commands, with one turn after each servo period.
    fn run(&mut self, milliseconds: u32) {
        for _ in 0..4 * milliseconds {
            self.period(&mut LinkOnly);
            self.main.turn();
        }
    }

    /// One servo interrupt.
    fn period(&mut self, source: &mut impl PositionSource<[f32; 8]>) -> Beat {
        let healthy = self.shell.tick(source, &mut LinkOnly, &NoClock);
        self.heart.beat(self.shell.liveness(), healthy)
    }

    /// Servo interrupts and main loop for some time, while the motion side commands a fixed place.
    fn run_there(&mut self, milliseconds: u32) {
        for _ in 0..4 * milliseconds {
            self.period(&mut here());
            self.main.turn();
        }
    }

    /// Value of the first auxiliary input, K, and the mask of inputs without a sensor.
    fn auxiliary(&mut self) -> (f32, u8) {
        let snapshot = self.main.servo.with(|side| side.snapshot());
        (snapshot.auxiliaries[0], snapshot.sensors_lost)
    }
}

/// A compensation whose first auxiliary is the temperature of `sensor`.
fn warm(sensor: &str) -> AlignedBlob {
    warm_draft(sensor, 0.3).encode().unwrap()
}

fn warm_draft(sensor: &str, scale: f32) -> Draft {
    let mut draft = draft("m", b"XY", scale);
    draft.auxiliaries = vec![Auxiliary {
        name: sensor.try_into().unwrap(),
        kind: AuxiliaryKind::Temperature,
        reference: 20.0,
        sensor: trueaxis::Sensor::USUAL,
    }];
    draft
}

#[test]
fn at_start_it_logs_what_the_slots_hold_and_then_only_changes() {
    let mut bench = Bench::start(None);
    let found = Slot::BOTH.map(|slot| Event::Found(slot, SlotState::Blank));
    assert_eq!(logged(), found);
    bench.run(300);
    assert_eq!(logged(), [Event::Active(None), Event::Shown(Shown::Fault)]);

    let mut bench = Bench::start(Some(&warm("bed")));
    assert!(matches!(
        logged()[..],
        [
            Event::Found(Slot::A, SlotState::Valid { .. }),
            Event::Found(Slot::B, SlotState::Blank)
        ]
    ));
    bench.run(300);
    assert_eq!(
        logged(),
        [Event::Active(Some(Slot::A)), Event::Shown(Shown::Idle)]
    );
    bench.main.servo.with(|side| side.enable(true));
    bench.celsius.set(Some(20.0));
    bench.run_there(3000);
    // Until its first command, the first temperature and the ramp.
    assert_eq!(logged().last(), Some(&Event::Shown(Shown::Correcting)));
}

#[test]
fn the_pins_show_a_controller_without_a_compensation_as_a_fault() {
    let mut bench = Bench::start(None);
    bench.run(5);
    assert_eq!(
        (bench.lamp.high.get(), bench.healthy.high.get()),
        (true, false)
    );
    bench.run(100);
    assert_eq!(
        (bench.lamp.high.get(), bench.healthy.high.get()),
        (false, false)
    );

    let mut bench = Bench::start(Some(&warm("bed")));
    bench.period(&mut LinkOnly);
    assert!(!bench.healthy.high.get(), "the main loop has not begun");
    bench.run(1);
    assert!(bench.healthy.high.get());
}

#[test]
fn the_fault_pin_is_set_from_the_servo_interrupt() {
    let mut bench = Bench::start(Some(&warm("bed")));
    bench.celsius.set(Some(20.0));
    bench.main.servo.with(|side| side.enable(true));
    bench.run_there(5000);
    assert!(bench.healthy.high.get());
    // In the period without a command, without a turn of the main loop.
    bench.period(&mut LinkOnly);
    assert!(!bench.healthy.high.get());
    bench.period(&mut here());
    assert!(bench.healthy.high.get());
}

#[test]
fn a_main_loop_that_stops_drops_the_fault_pin_after_a_second_and_starves_the_watchdog() {
    let mut bench = Bench::start(Some(&warm("bed")));
    bench.run(10);
    let fed = bench.fed.get();
    assert_eq!(fed, 40, "once in each period");
    for _ in 0..4000 {
        assert_eq!(bench.period(&mut LinkOnly), Beat::Alive);
        assert!(bench.healthy.high.get());
    }
    for _ in 0..100 {
        assert_eq!(bench.period(&mut LinkOnly), Beat::Dead);
        assert!(!bench.healthy.high.get());
        bench.main.turn();
    }
    assert_eq!(bench.fed.get(), fed + 4000);
}

#[test]
fn nothing_but_the_link_goes_on_between_two_milliseconds() {
    let mut bench = Bench::start(Some(&warm("bed")));
    bench.shell.tick(&mut LinkOnly, &mut LinkOnly, &NoClock);
    bench.main.turn();
    assert!(!bench.lamp.high.get());
    for _ in 0..3 {
        bench.shell.tick(&mut LinkOnly, &mut LinkOnly, &NoClock);
    }
    bench.main.turn();
    assert!(bench.lamp.high.get());
    // And only once in each.
    bench.lamp.high.set(false);
    bench.main.turn();
    assert!(!bench.lamp.high.get());
}

#[test]
fn requests_are_answered_and_a_turn_says_whether_more_bytes_wait() {
    let mut bench = Bench::start(None);
    assert!(!bench.main.turn());
    let frame = hello();
    // One frame after the other, one per turn.
    for _ in 0..2 {
        bench.line.borrow_mut().incoming.extend(&frame);
    }
    let mut more = Vec::new();
    while !bench.line.borrow().incoming.is_empty() {
        more.push(bench.main.turn());
    }
    assert_eq!(more.pop(), Some(false));
    assert!(more.iter().all(|more| *more));
    let mut receiver = Receiver::new();
    let mut boards = Vec::new();
    for byte in &bench.line.borrow().outgoing {
        if receiver.push(*byte) == Received::Frame {
            let Some(Framed::Message(_, body)) = receiver.frame() else {
                panic!("no message")
            };
            match postcard::from_bytes(body).unwrap() {
                Reply::Hello(hello) => boards.push(std::string::String::from(hello.board)),
                other => panic!("{other:?}"),
            }
        }
    }
    assert_eq!(boards, ["bench", "bench"]);
}

#[test]
fn sensors_are_read_once_per_second_and_their_inputs_moved_every_20_ms() {
    let mut bench = Bench::start(Some(&warm("bed")));
    bench.celsius.set(Some(23.0));
    bench.run(999);
    assert_eq!(bench.asked.get(), 0);
    let (value, lost) = bench.auxiliary();
    assert!(value.is_nan() && lost == 1, "until the third reading");
    bench.run(1);
    assert_eq!(bench.asked.get(), 1);
    bench.run(2000);
    assert_eq!(bench.asked.get(), 3);
    // At zero it jumps there with the next input step.
    bench.run(20);
    assert_eq!(bench.auxiliary(), (3.0, 0));

    // With corrections on: limited to 0.1 K/s.
    bench.main.servo.with(|side| side.enable(true));
    bench.run_there(2000);
    let (before, _) = bench.auxiliary();
    bench.celsius.set(Some(30.0));
    bench.run_there(10_000);
    let (after, _) = bench.auxiliary();
    assert!(
        after > before + 0.5 && after < before + 1.01,
        "{before} to {after}"
    );
    // In steps of 20 ms.
    let (mut steps, mut last) = (0, after);
    for _ in 0..100 {
        bench.run_there(1);
        let (now, _) = bench.auxiliary();
        steps += u32::from(now != last);
        last = now;
    }
    assert_eq!(steps, 5);
}

/// After a reset, while the motion side still asks for corrections.
#[test]
fn a_warm_machine_is_corrected_as_warm_from_the_start() {
    let mut draft = warm_draft("bed", 0.1);
    let mut bank = draft.banks[0].clone();
    bank.interpolation = Interpolation::Linear;
    (bank.input, bank.start, bank.step) = (2, -50.0, 25.0);
    bank.columns = vec![vec![-0.5, -0.25, 0.0, 0.25, 0.5]];
    draft.banks.insert(1, bank);
    draft.terms[1].factors = [2].as_slice().try_into().unwrap();
    let mut growth = draft.terms[0].clone();
    growth.weight = 1.0;
    growth.factors = [1].as_slice().try_into().unwrap();
    draft.terms.insert(1, growth);
    let blob = draft.encode().unwrap();
    // 10 µm/K, or as at the reference if there is no sensor.
    for (celsius, known, kelvin, lost, expected) in
        [(Some(35.0), 3000, 15.0, 0, 0.25), (None, 6000, 0.0, 1, 0.1)]
    {
        let mut bench = Bench::start(Some(&blob));
        bench.celsius.set(celsius);
        bench.main.servo.with(|side| side.enable(true));
        bench.run_there(known - 1);
        let dq = |bench: &mut Bench| bench.main.servo.with(|side| side.last().dq[0]);
        assert_eq!(dq(&mut bench), 0.0);
        assert!(!bench.healthy.high.get(), "a fault until it is known");
        bench.run_there(1000);
        for _ in 0..2 {
            assert_eq!(bench.auxiliary(), (kelvin, lost));
            let dq = dq(&mut bench);
            assert!((dq - expected).abs() < 1e-6, "{dq}");
            assert!(bench.healthy.high.get());
            bench.run_there(1000);
        }
    }
}

#[test]
fn filters_are_told_the_time_between_two_readings() {
    let mut bench = Bench::start(Some(&warm("bed")));
    bench.celsius.set(Some(20.0));
    bench.run(3020);
    assert_eq!(bench.auxiliary(), (0.0, 0));
    bench.celsius.set(Some(30.0));
    // With the second new reading the median changes: one second of a time constant of five is one sixth of the
    // distance.
    bench.run(2000);
    let (value, _) = bench.auxiliary();
    assert!((value - 10.0 / 6.0).abs() < 1e-5, "{value}");
}

#[test]
fn it_waits_only_when_nothing_is_left_to_do_and_goes_on_afterwards() {
    let bench = Bench::start(None);
    let frame = hello();
    // Enough for more than one turn.
    let say = |line: &RefCell<Line>| line.borrow_mut().incoming.extend(frame.repeat(30));
    say(&bench.line);
    let (line, mut waits) = (bench.line, 0);
    let main = bench.main;
    // It never returns.
    let ended = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| {
        main.run(|| {
            assert!(line.borrow().incoming.is_empty(), "bytes are waiting");
            waits += 1;
            if waits == 3 {
                std::panic::resume_unwind(Box::new("at last"));
            }
            say(&line);
        })
    }));
    assert_eq!(ended.unwrap_err().downcast_ref(), Some(&"at last"));
}

#[test]
fn an_input_without_its_sensor_is_reported_as_lost() {
    let mut bench = Bench::start(Some(&warm("spindle")));
    bench.celsius.set(Some(23.0));
    bench.run(4000);
    assert_eq!(bench.auxiliary(), (0.0, 1));

    let mut bench = Bench::start(Some(&warm("bed")));
    bench.celsius.set(Some(23.0));
    bench.run(4000);
    assert_eq!(bench.auxiliary(), (3.0, 0));
    bench.celsius.set(None);
    bench.run(10_000);
    assert_eq!(bench.auxiliary(), (3.0, 1), "held");
}

#[test]
fn the_machine_is_seen_by_its_commands_and_its_drives() {
    let mut bench = Bench::start(Some(&warm("bed")));
    bench.run(10);
    assert!(bench.main.device.machine().standstill());
    bench.drives_off.high.set(false);
    assert!(!bench.main.device.machine().standstill());
    bench.drives_off.high.set(true);
    bench.run_there(10);
    assert!(
        !bench.main.device.machine().standstill(),
        "it has come from 0"
    );
    bench.run_there(200);
    assert!(bench.main.device.machine().standstill());
}
