use std::collections::VecDeque;
use std::rc::Rc;
use std::vec::Vec;
use std::{cell::Cell, cell::RefCell};

use trueaxis::Usual;

use super::*;
use crate::controller::tests::{leak, shared, side};
use crate::device::{Command, NoClock, ServoAccess};
use crate::spi::{Answer, CommandFrame, length};

/// The bus, seen from both ends, and the timer.
#[derive(Default)]
struct Bus {
    /// Ended frames, one per interrupt; `None`: the timer's interrupt.
    ended: RefCell<VecDeque<Option<Vec<u8>>>>,
    armed: Cell<bool>,
    answers: RefCell<Vec<Vec<u8>>>,
    /// The next frame begins while the answer is being prepared.
    hurry: Cell<bool>,
    restarts: Cell<u32>,
}

impl Slave for Rc<Bus> {
    fn has_ended(&mut self) -> bool {
        matches!(self.ended.borrow().front(), Some(Some(_)))
    }

    fn frame<'b>(&mut self, bytes: &'b mut [u8; MOST]) -> &'b [u8] {
        let frame = self.ended.borrow_mut().pop_front().flatten().unwrap();
        if !self.armed.replace(false) {
            return &[];
        }
        bytes[..frame.len()].copy_from_slice(&frame);
        &bytes[..frame.len()]
    }

    fn arm(&mut self, answer: &[u8; MOST]) -> bool {
        self.answers.borrow_mut().push(answer[..length(8)].to_vec());
        self.armed.set(!self.hurry.get());
        self.armed.get()
    }
}

impl Silence for Rc<Bus> {
    fn restart(&mut self) {
        self.restarts.set(self.restarts.get() + 1);
    }

    fn is_over(&mut self) -> bool {
        let over = matches!(self.ended.borrow().front(), Some(None));
        if over {
            self.ended.borrow_mut().pop_front();
        }
        over
    }
}

/// A board: its bus, its servo interrupt, and the main loop's view.
struct Stand {
    bus: Rc<Bus>,
    servo: ByFrames<Rc<Bus>, Rc<Bus>, 8>,
    shell: &'static Shell<Usual>,
    access: crate::controller::Access<Usual>,
    count: u8,
}

impl Stand {
    fn new() -> Self {
        let bus = Rc::new(Bus::default());
        let shell = leak(Shell::new(4000));
        Self {
            servo: ByFrames::start(bus.clone(), bus.clone(), Tolerance::USUAL),
            access: shell.share(shared(side(0.3))),
            bus,
            shell,
            count: 0,
        }
    }

    /// An interrupt, with this as the ended frame.
    fn interrupt(&mut self, ended: Option<Vec<u8>>) -> Option<bool> {
        self.bus.ended.borrow_mut().push_back(ended);
        self.servo.period(self.shell, &NoClock)
    }

    /// The next frame of the motion side, with X at `x`.
    fn next(&mut self, x: f32) -> Vec<u8> {
        self.count = self.count.wrapping_add(1);
        let command = Command::new([x, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0], 3);
        let said = CommandFrame {
            count: self.count,
            command,
        };
        said.put(&mut [0; MOST]).unwrap().to_vec()
    }

    fn updates(&mut self) -> u32 {
        self.access.with(|side| side.counters().updates)
    }

    fn overruns(&mut self) -> u32 {
        self.access.with(|side| side.counters().overruns)
    }

    /// The counter that the last prepared answer is for.
    fn answered(&self) -> Option<u8> {
        let answers = self.bus.answers.borrow();
        Answer::<[f32; 8]>::get(answers.last().unwrap())
            .unwrap()
            .count
    }
}

#[test]
fn each_frame_is_one_period_and_the_next_answer_is_for_its_command() {
    let mut stand = Stand::new();
    assert_eq!(stand.answered(), None, "laid out before anything has come");
    for n in 1..=20 {
        let frame = stand.next(n as f32);
        assert_eq!(stand.interrupt(Some(frame)), Some(true));
        assert_eq!(stand.updates(), n);
        assert_eq!(stand.answered(), Some(n as u8));
        assert_eq!(stand.access.with(|side| side.positions()[0]), n as f32);
        assert_eq!(stand.bus.restarts.get(), n, "the next one is waited for");
    }
    let seen = stand.servo.seen();
    assert_eq!((seen.frames, seen.repeated, seen.damaged), (20, 0, 0));
    assert_eq!(stand.overruns(), 0);
}

#[test]
fn an_interrupt_whose_work_the_other_has_done_is_no_period() {
    let mut stand = Stand::new();
    let frame = stand.next(1.0);
    stand.interrupt(Some(frame));
    assert_eq!(stand.servo.period(stand.shell, &NoClock), None);
    assert_eq!(stand.updates(), 1);
    assert_eq!(stand.bus.answers.borrow().len(), 2, "none is laid out anew");
}

#[test]
fn without_frames_the_timer_makes_the_periods_and_leaves_the_answer_as_it_is() {
    let mut stand = Stand::new();
    let frame = stand.next(1.0);
    stand.interrupt(Some(frame));
    for n in 1..=4 {
        assert_eq!(stand.interrupt(None), Some(true), "{n} are tolerated");
    }
    assert_eq!(stand.interrupt(None), Some(false), "and no more");
    assert_eq!(stand.updates(), 6, "the servo goes on all the same");
    assert_eq!(stand.servo.seen().repeated, 5);
    // A frame may be in progress.
    assert_eq!(stand.bus.answers.borrow().len(), 2);
    assert_eq!(stand.bus.restarts.get(), 1);
}

#[test]
fn a_frame_that_begins_before_the_answer_is_laid_out_is_lost_and_an_overrun() {
    let mut stand = Stand::new();
    stand.bus.hurry.set(true);
    let frame = stand.next(1.0);
    stand.interrupt(Some(frame));
    stand.bus.hurry.set(false);
    let frame = stand.next(2.0);
    stand.interrupt(Some(frame));
    assert_eq!(stand.overruns(), 1, "shown with the next period");
    let seen = stand.servo.seen();
    assert_eq!((seen.frames, seen.damaged, seen.repeated), (1, 1, 1));
    // That frame is complete, so the next one is received and is not an overrun.
    let frame = stand.next(3.0);
    stand.interrupt(Some(frame));
    assert_eq!((stand.servo.seen().frames, stand.overruns()), (2, 1));
    assert_eq!(stand.answered(), Some(3));
}

#[test]
fn what_is_cut_off_is_a_period_with_the_command_before() {
    let mut stand = Stand::new();
    let frame = stand.next(1.0);
    stand.interrupt(Some(frame));
    let frame = stand.next(2.0);
    stand.interrupt(Some(frame[..20].to_vec()));
    assert_eq!(stand.updates(), 2);
    assert_eq!(stand.access.with(|side| side.positions()[0]), 1.0);
    assert_eq!(stand.servo.seen().damaged, 1);
    assert_eq!(stand.answered(), Some(1));
}
