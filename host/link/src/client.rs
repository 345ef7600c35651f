//! Requests to a controller: one at a time, repeated until the answer arrives.

use crate::port::Port;
use std::hash::{BuildHasher, RandomState};
use std::io;
use std::time::{Duration, Instant};
use trueaxis::link::{
    self, Activation, AtStart, Capacities, END, EvaluateRow, Fault, Framed, Header, Health, Hello,
    MOST_AXES, MOST_BODY, MOST_WIRE, MotionResult, PROTOCOL, Received, Receiver, Refusal, Reply,
    Report, Request, Slot, SlotReport, TermWeight, Upload, WhileBusy, encode,
};
use trueaxis::{Correction, LoadError, SampleFormat, Travel};
use trueaxis_tables::target::Target;

/// Why a request failed.
#[derive(Debug, thiserror::Error)]
pub enum LinkError {
    /// The connection is lost.
    #[error("the connection is lost: {0}")]
    Port(#[from] io::Error),
    /// No answer after many repetitions.
    #[error("the controller does not answer")]
    Silent,
    /// The controller supports other versions of the protocol.
    #[error(
        "the controller speaks versions {lowest} to {highest} of the link protocol, this program {PROTOCOL}"
    )]
    Version {
        /// Lowest version.
        lowest: u8,
        /// Highest version.
        highest: u8,
    },
    /// The controller refuses the request.
    #[error("{0}")]
    Refused(Refusal),
    /// The answer belongs to another request.
    #[error("the controller answers something else than was asked")]
    Unexpected,
}

impl LinkError {
    /// What to do about it.
    #[must_use]
    pub fn remedy(&self) -> &'static str {
        match self {
            Self::Port(_) => {
                "check the cable, and run the command again: an upload goes on where it was"
            }
            Self::Silent => {
                "check that the controller runs, the port, and --baud; an upload goes on where it was"
            }
            Self::Version { .. } | Self::Unexpected => OTHER_VERSION,
            Self::Refused(refusal) => after(refusal),
        }
    }
}

const OTHER_VERSION: &str = "use the version of trueaxis that belongs to the firmware";

/// What to do about a refusal.
fn after(refusal: &Refusal) -> &'static str {
    match refusal {
        Refusal::NotStandstill => {
            "stop the machine and switch its drives off: this controller pauses while it writes flash"
        }
        Refusal::Busy => {
            "wait until the change of compensation or the upload is over; `trueaxis monitor` shows it"
        }
        Refusal::Uploading { .. } => {
            "wait until the other upload is over, or until it is given up, and run the command again"
        }
        Refusal::Wear { .. } => {
            "flash memory wears: find out what uploads that often, wait, and run the command again"
        }
        Refusal::Full => {
            "flash a compensation with --activate, or `trueaxis control … rollback`: the other slot has room"
        }
        Refusal::NoCompensation => "flash one with --activate first",
        Refusal::NotValid => {
            "`trueaxis monitor` shows the slots; flash a compensation with --activate"
        }
        Refusal::Suspended => "wait until the upload is over, or until it is given up",
        Refusal::Weight(_) => {
            "give a weight within the limits; `trueaxis control … show` lists them"
        }
        Refusal::Unknown => OTHER_VERSION,
        Refusal::Load(LoadError::TooSmall { .. }) => {
            "compile it with a larger --tolerance, or build the firmware with larger capacities"
        }
        Refusal::OtherMachine => "check that this is the right file; --force if it is meant so",
        Refusal::Unusable { .. } => {
            "the active compensation stays in use; restart the controller to try the slot once more, then replace the part: its flash memory is worn out"
        }
        Refusal::NoNonce => {
            "restart the controller; if that does not help, its random number generator does not work"
        }
        Refusal::Spoiled | Refusal::Flash => {
            "flash it again; if that does not help, the flash memory is worn out"
        }
        _ => "see `trueaxis monitor` for the state of the controller",
    }
}

/// Largest number of sessions opened in a row for one request.
const SESSIONS: u32 = 10;

/// The controller at the other end; see [`Hello`].
#[derive(Clone, Debug, PartialEq)]
#[expect(missing_docs, reason = "the fields are those of `Hello`")]
pub struct LinkedController {
    pub firmware: String,
    pub board: String,
    pub formats: [u16; 2],
    pub capacities: Capacities,
    pub period: f32,
    pub while_busy: WhileBusy,
    pub machine: String,
    pub axes: String,
    pub auxiliaries: u8,
    pub active: Option<Slot>,
    pub slots: [SlotReport; 2],
    pub fault: Option<Fault>,
}

impl LinkedController {
    /// Capacity for a compensation. The preferred sample format is not reported: `f32`.
    #[must_use]
    pub fn target(&self) -> Target {
        let room = &self.capacities;
        Target {
            name: self.board.clone(),
            axes: room.axes.into(),
            banks: room.banks.into(),
            tables: room.tables.into(),
            terms: room.terms.into(),
            grids: room.grids.into(),
            bytes: Some(room.slot as usize),
            samples: SampleFormat::F32,
        }
    }
}

impl From<&Hello<'_>> for LinkedController {
    fn from(hello: &Hello<'_>) -> Self {
        Self {
            firmware: hello.firmware.to_owned(),
            board: hello.board.to_owned(),
            formats: hello.formats,
            capacities: hello.capacities,
            period: hello.period,
            while_busy: hello.while_busy,
            machine: hello.machine.to_owned(),
            axes: hello.axes.to_string(),
            auxiliaries: hello.auxiliaries,
            active: hello.active,
            slots: hello.slots,
            fault: hello.fault,
        }
    }
}

/// The host's end of the link.
pub struct Client<P> {
    port: P,
    receiver: Receiver,
    /// Received bytes that have not been decoded yet.
    incoming: Vec<u8>,
    session: u32,
    sequence: u16,
    patience: Duration,
    tries: u32,
}

impl<P: Port> Client<P> {
    /// Opens a session.
    ///
    /// # Errors
    /// [`LinkError`]
    pub fn connect(port: P) -> Result<(Self, LinkedController), LinkError> {
        Self::connect_with(port, Duration::from_millis(400), 15)
    }

    /// Opens a session with another time limit for each try and another number of tries.
    ///
    /// # Errors
    /// [`LinkError`]
    pub fn connect_with(
        port: P,
        patience: Duration,
        tries: u32,
    ) -> Result<(Self, LinkedController), LinkError> {
        let mut client = Self {
            port,
            receiver: Receiver::new(),
            incoming: Vec::new(),
            session: 0,
            sequence: 0,
            patience,
            tries,
        };
        let controller = client.hello()?;
        Ok((client, controller))
    }

    /// The port.
    pub fn port(&mut self) -> &mut P {
        &mut self.port
    }

    /// Ends the session, which needs no message.
    pub fn into_port(self) -> P {
        self.port
    }

    /// Opens a new session and queries the controller.
    ///
    /// # Errors
    /// [`LinkError`]
    pub fn hello(&mut self) -> Result<LinkedController, LinkError> {
        let name = RandomState::new().hash_one(0) as u32;
        self.sequence = self.sequence.wrapping_add(1);
        let header = Header {
            session: name,
            sequence: self.sequence,
        };
        self.exchange(header, &Request::Hello)?;
        match self.reply()? {
            Reply::Hello(hello) => {
                let (session, controller) = (hello.session, LinkedController::from(&hello));
                self.session = session;
                Ok(controller)
            }
            Reply::Refused(refusal) => Err(LinkError::Refused(refusal)),
            _ => Err(LinkError::Unexpected),
        }
    }

    /// Sends a request until its answer arrives. If the controller has forgotten the session, it is opened again and
    /// the request is repeated, unless it is a motion.
    ///
    /// # Errors
    /// [`LinkError`], including refusals.
    pub fn ask(&mut self, request: &Request<'_>) -> Result<Reply<'_>, LinkError> {
        self.send_next(request)?;
        // Another host on the same line also says hello and takes over the session; they take turns.
        for turn in 0..SESSIONS {
            let forgotten = matches!(self.reply()?, Reply::Refused(Refusal::NoSession));
            if !forgotten || matches!(request, Request::Motion(_)) {
                break;
            }
            if turn > 0 {
                // A random pause, so that two hosts do not stay in step.
                let pause = RandomState::new().hash_one(turn) % 64;
                self.port.wait(Duration::from_millis(pause));
            }
            self.hello()?;
            self.send_next(request)?;
        }
        match self.reply()? {
            Reply::Refused(refusal) => Err(LinkError::Refused(refusal)),
            reply => Ok(reply),
        }
    }

    fn send_next(&mut self, request: &Request<'_>) -> Result<(), LinkError> {
        self.sequence = self.sequence.wrapping_add(1);
        let header = Header {
            session: self.session,
            sequence: self.sequence,
        };
        self.exchange(header, request)
    }

    /// The answer that `exchange` has left in the receiver.
    fn reply(&self) -> Result<Reply<'_>, LinkError> {
        match self.receiver.frame() {
            Some(Framed::Message(_, body)) => {
                postcard::from_bytes(body).map_err(|_| LinkError::Unexpected)
            }
            _ => Err(LinkError::Unexpected),
        }
    }

    fn exchange(&mut self, header: Header, request: &Request<'_>) -> Result<(), LinkError> {
        let mut scratch = [0; MOST_BODY];
        // A leading zero ends any noise received before.
        let mut wire = [END; 1 + MOST_WIRE];
        let length = encode(header, request, &mut scratch, &mut wire[1..])
            .map_err(|_| LinkError::Unexpected)?
            .len();
        for _ in 0..self.tries {
            self.port.send(&wire[..1 + length])?;
            let end = Instant::now() + self.patience;
            while let Some(left) = end.checked_duration_since(Instant::now()) {
                if self.incoming.is_empty() {
                    let mut buffer = [0; 2048];
                    let count = self.port.receive(&mut buffer, left)?;
                    if count == 0 {
                        break;
                    }
                    // Reversed, so that the next byte can be popped from the end.
                    self.incoming.extend(buffer[..count].iter().rev());
                }
                if self.answered(header)? {
                    return Ok(());
                }
            }
        }
        Err(LinkError::Silent)
    }

    /// Decodes received bytes up to the answer.
    fn answered(&mut self, header: Header) -> Result<bool, LinkError> {
        while let Some(byte) = self.incoming.pop() {
            if self.receiver.push(byte) != Received::Frame {
                continue;
            }
            match self.receiver.frame() {
                Some(Framed::Message(found, _)) if found == header => return Ok(true),
                Some(Framed::VersionAnswer(versions)) => {
                    return Err(LinkError::Version {
                        lowest: versions.lowest,
                        highest: versions.highest,
                    });
                }
                Some(Framed::OtherVersion(version)) => {
                    return Err(LinkError::Version {
                        lowest: version,
                        highest: version,
                    });
                }
                // An answer to an earlier request.
                Some(Framed::Message(..)) | None => {}
            }
        }
        Ok(false)
    }

    /// The status of the controller.
    ///
    /// # Errors
    /// [`LinkError`]
    pub fn status(&mut self) -> Result<Report, LinkError> {
        match self.ask(&Request::Status)? {
            Reply::Status(report) => Ok(report),
            _ => Err(LinkError::Unexpected),
        }
    }

    /// The health of the controller; `None` if it does not support this request.
    ///
    /// # Errors
    /// [`LinkError`]
    pub fn health(&mut self) -> Result<Option<Health>, LinkError> {
        match self.ask(&Request::Health) {
            Ok(Reply::Health(health)) => Ok(Some(health)),
            Err(LinkError::Refused(Refusal::Unknown)) => Ok(None),
            Ok(_) => Err(LinkError::Unexpected),
            Err(error) => Err(error),
        }
    }

    /// An upload request: begin, chunk, commit, abort.
    ///
    /// # Errors
    /// [`LinkError`]
    pub fn upload(&mut self, request: &Request<'_>) -> Result<Upload, LinkError> {
        match self.ask(request)? {
            Reply::Upload(upload) => Ok(upload),
            _ => Err(LinkError::Unexpected),
        }
    }

    /// The settings for the next start.
    ///
    /// # Errors
    /// [`LinkError`]
    pub fn at_start(&mut self) -> Result<AtStart, LinkError> {
        self.ask_at_start(&Request::AtStart)
    }

    /// Switches the corrections on at start, or not; stored when the answer confirms it.
    ///
    /// # Errors
    /// [`LinkError`]
    pub(crate) fn enable_at_start(&mut self, on: bool) -> Result<AtStart, LinkError> {
        self.ask_at_start(&Request::EnableAtStart(on))
    }

    fn ask_at_start(&mut self, request: &Request<'_>) -> Result<AtStart, LinkError> {
        match self.ask(request)? {
            Reply::AtStart(at_start) => Ok(at_start),
            _ => Err(LinkError::Unexpected),
        }
    }

    /// The adjustable terms of the compensation in use.
    ///
    /// # Errors
    /// [`LinkError`]
    pub fn weights(&mut self) -> Result<Vec<TermWeight>, LinkError> {
        match self.ask(&Request::Weights)? {
            Reply::Weights(weights) => Ok(weights.to_vec()),
            _ => Err(LinkError::Unexpected),
        }
    }

    /// Switches to a slot, or queries the progress of that.
    ///
    /// # Errors
    /// [`LinkError`]
    pub fn activate(&mut self, slot: Slot, force: bool) -> Result<Activation, LinkError> {
        match self.ask(&Request::Activate { slot, force })? {
            Reply::Activation(activation) => Ok(activation),
            _ => Err(LinkError::Unexpected),
        }
    }

    /// A request that changes a setting: enable, dry run, weight, tool length, referenced axes.
    ///
    /// # Errors
    /// [`LinkError`]
    pub fn set(&mut self, request: &Request<'_>) -> Result<(), LinkError> {
        match self.ask(request)? {
            Reply::Done => Ok(()),
            _ => Err(LinkError::Unexpected),
        }
    }

    /// Corrections of the active compensation at any number of positions, without changing state: of the first
    /// `axes` axes (those of the compensation) and `auxiliaries`.
    ///
    /// # Errors
    /// [`LinkError`]
    pub fn evaluate<const AXES: usize>(
        &mut self,
        rows: &[EvaluateRow<[f32; AXES], [Travel; AXES]>],
        axes: usize,
        auxiliaries: usize,
    ) -> Result<Vec<[f32; AXES]>, LinkError> {
        let most = link::evaluate_rows(axes, auxiliaries);
        let mut corrections = Vec::with_capacity(rows.len());
        for rows in rows.chunks(most.max(1)) {
            let mut bytes = vec![0; rows.len() * EvaluateRow::bytes(axes, auxiliaries)];
            let mut rest = &mut bytes[..];
            for row in rows {
                rest = row
                    .put(axes, auxiliaries, rest)
                    .ok_or(LinkError::Unexpected)?;
            }
            let Reply::Corrections(mut answer) = self.ask(&Request::Evaluate(&bytes))? else {
                return Err(LinkError::Unexpected);
            };
            for _ in rows {
                let (dq, rest) = link::positions(answer, axes).ok_or(LinkError::Unexpected)?;
                corrections.push(dq);
                answer = rest;
            }
        }
        Ok(corrections)
    }

    /// Commands any number of positions of the first `axes` axes, one per servo period, and returns the servo's
    /// results.
    ///
    /// # Errors
    /// [`LinkError`]
    pub fn motion<const AXES: usize>(
        &mut self,
        rows: &[[f32; AXES]],
        axes: usize,
    ) -> Result<Vec<Correction<[f32; AXES]>>, LinkError> {
        let most = link::motion_rows(axes.min(MOST_AXES));
        let mut corrections = Vec::with_capacity(rows.len());
        for rows in rows.chunks(most) {
            let mut bytes = vec![0; rows.len() * 4 * axes];
            let mut rest = &mut bytes[..];
            for row in rows {
                rest = link::put_positions(row, axes, rest).ok_or(LinkError::Unexpected)?;
            }
            let Reply::Motion(mut answer) = self.ask(&Request::Motion(&bytes))? else {
                return Err(LinkError::Unexpected);
            };
            for _ in rows {
                let (result, rest) =
                    MotionResult::get(answer, axes).ok_or(LinkError::Unexpected)?;
                corrections.push(result.0);
                answer = rest;
            }
        }
        Ok(corrections)
    }
}
