//! Code shared by the fuzz targets: turns arbitrary bytes into blobs that pass the header check, drafts that encode,
//! and numbers with arbitrary bits.
#![forbid(unsafe_code)]

use trueaxis::{
    AUXILIARIES, AlignedBlob, Auxiliary, AuxiliaryKind, Axis, Compensation, Direction, Draft,
    DraftBank, DraftGrid, FACTORS, GridAxis, HEADER, Holds, Interpolation, LoadError, MAGIC, Notes,
    Policy, SampleFormat, Sensor, Term, VERSION,
};

/// Large enough for every seed and for the fuzzer's mutations of them.
pub type Fuzzed<'a> = Compensation<'a, Holds<8, 16, 32, 64, 2>>;

/// The input, read from front to back; zeros after its end.
pub struct Bytes<'a>(pub &'a [u8]);

impl Bytes<'_> {
    pub fn byte(&mut self) -> u8 {
        let Some((&first, rest)) = self.0.split_first() else {
            return 0;
        };
        self.0 = rest;
        first
    }

    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// 0 … `end` − 1
    pub fn below(&mut self, end: u8) -> u8 {
        self.byte() % end
    }

    pub fn flag(&mut self) -> bool {
        self.byte() & 1 == 1
    }

    /// An arbitrary f32: includes subnormal, infinite and NaN.
    pub fn bits(&mut self) -> f32 {
        f32::from_le_bytes([self.byte(), self.byte(), self.byte(), self.byte()])
    }

    /// −16 … 16 in steps of 1/8: short to write for the fuzzer.
    pub fn small(&mut self) -> f32 {
        f32::from(self.byte() as i8) / 8.0
    }

    /// Usually a small number, sometimes an arbitrary one.
    pub fn number(&mut self) -> f32 {
        match self.byte() {
            0..224 => self.small(),
            _ => self.bits(),
        }
    }
}

/// Bytes that are serialised unchanged.
pub struct Raw<'a>(pub &'a [u8]);

impl serde::Serialize for Raw<'_> {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        use serde::ser::SerializeTuple;
        let mut tuple = serializer.serialize_tuple(self.0.len())?;
        for byte in self.0 {
            tuple.serialize_element(byte)?;
        }
        tuple.end()
    }
}

/// Writes magic, version, length and checksum over the first 16 bytes.
pub fn seal(blob: &mut Vec<u8>) {
    const CRC: crc::Crc<u32> = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC);
    blob.resize(blob.len().max(HEADER), 0);
    let length = blob.len() as u32;
    blob[..4].copy_from_slice(&MAGIC);
    blob[4..6].copy_from_slice(&VERSION.to_le_bytes());
    blob[6..8].fill(0);
    blob[8..12].copy_from_slice(&length.to_le_bytes());
    let mut digest = CRC.digest();
    digest.update(&blob[..12]);
    digest.update(&blob[HEADER..]);
    blob[12..16].copy_from_slice(&digest.finalize().to_le_bytes());
}

/// A blob with a valid header, and as many sample bytes as its description requires, unless that is too many.
pub fn repaired(bytes: &[u8]) -> AlignedBlob {
    let mut blob = bytes.to_vec();
    seal(&mut blob);
    let aligned = AlignedBlob::from_bytes(&blob);
    let mut trial = Fuzzed::empty();
    if let Err(LoadError::SectionLength { computed, .. }) = trial.load(&aligned)
        && computed <= 16_384
    {
        blob.resize(computed as usize, 0);
        seal(&mut blob);
        return AlignedBlob::from_bytes(&blob);
    }
    aligned
}

/// A draft determined by the bytes; most of them encode.
pub fn draft(b: &mut Bytes<'_>) -> Draft {
    let axes: Vec<Axis> = (0..1 + b.below(4)).map(|i| axis(b, i)).collect();
    let auxiliaries: Vec<Auxiliary> = (0..b.below(3)).map(|i| auxiliary(b, i)).collect();
    let inputs = (axes.len() + auxiliaries.len()) as u8;
    let banks: Vec<DraftBank> = (0..b.below(5)).map(|_| bank(b, &axes, inputs)).collect();
    let tables = banks.iter().map(|bank| bank.columns.len() as u8).sum();
    let outputs = axes.len() as u8;
    let terms = (0..b.below(12)).map(|_| term(b, outputs, tables)).collect();
    let grids = (0..b.below(3)).map(|_| grid(b, &axes, inputs)).collect();
    Draft {
        machine: "fuzz".to_owned(),
        policy: Policy::Direction { damping: 0.1 },
        axes,
        auxiliaries,
        banks,
        terms,
        grids,
        notes: Notes::default(),
    }
}

fn axis(b: &mut Bytes<'_>, number: u8) -> Axis {
    let kind = b.below(5);
    Axis {
        name: b"XYZC"[usize::from(number)],
        travel: match kind {
            0 | 1 => [-f32::MAX, f32::MAX],
            2 => [-100.0, 100.0],
            _ => {
                let low = b.number();
                [low, low + b.small().abs() + 0.125]
            }
        },
        period: if kind == 0 { 360.0 } else { 0.0 },
        value_bound: 0.001 + b.small().abs(),
        rate_bound: 0.001 + b.small().abs(),
        reversal_threshold: b.small().abs(),
        ramp_rate: 0.001 + b.small().abs(),
        reversal_rate: 0.001 + b.small().abs(),
        reversal_acceleration: 20.0 * (0.001 + b.small().abs()),
    }
}

fn auxiliary(b: &mut Bytes<'_>, number: u8) -> Auxiliary {
    let kind = match b.flag() {
        true => AuxiliaryKind::ToolLength,
        false => AuxiliaryKind::Temperature,
    };
    let lags = kind == AuxiliaryKind::Temperature && number == 1;
    Auxiliary {
        kind,
        name: ["t", "bed"][usize::from(number)].try_into().expect("short"),
        reference: b.small(),
        sensor: Sensor {
            lag_rate: if lags { 0.125 } else { 0.0 },
            ..Sensor::USUAL
        },
    }
}

/// The period of a modulo table fits once or twice into the turn of its axis; on other axes it is arbitrary.
fn step(b: &mut Bytes<'_>, axes: &[Axis], input: u8, points: u32, modulo: bool) -> f32 {
    let period = axes.get(usize::from(input)).map_or(0.0, |a| a.period);
    let step = 0.125 + b.number().abs();
    match modulo && period > 0.0 {
        true => period / (points * (1 + u32::from(step > 1.0))) as f32,
        false => step,
    }
}

fn format(b: &mut Bytes<'_>) -> SampleFormat {
    match b.flag() {
        true => SampleFormat::I16,
        false => SampleFormat::F32,
    }
}

fn bank(b: &mut Bytes<'_>, axes: &[Axis], inputs: u8) -> DraftBank {
    let outputs = axes.len() as u8;
    let input = b.below(inputs);
    let columns = 1 + b.below(3);
    let points = 2 + b.below(6);
    let modulo = b.flag();
    DraftBank {
        input,
        start: b.number(),
        step: step(b, axes, input, points.into(), modulo),
        modulo,
        direction: match b.below(4) {
            1 if input < outputs => Direction::Positive,
            2 if input < outputs => Direction::Negative,
            3 if input < outputs => Direction::Signed,
            _ => Direction::Both,
        },
        interpolation: match b.flag() && points >= 4 {
            true => Interpolation::Cubic,
            false => Interpolation::Linear,
        },
        format: format(b),
        columns: (0..columns)
            .map(|_| (0..points).map(|_| b.number()).collect())
            .collect(),
    }
}

fn term(b: &mut Bytes<'_>, outputs: u8, tables: u8) -> Term {
    let limits = (b.below(3) == 0).then(|| {
        let low = b.number();
        [low, low + b.small().abs()]
    });
    Term {
        output: b.below(outputs),
        weight: limits.map_or_else(|| b.number(), |[low, _]| low),
        limits,
        factors: (0..b.below(FACTORS as u8 + 1))
            .filter(|_| tables > 0)
            .map(|_| b.below(tables.max(1)))
            .collect(),
    }
}

fn grid(b: &mut Bytes<'_>, axes: &[Axis], inputs: u8) -> DraftGrid {
    let axis = |b: &mut Bytes<'_>| {
        let (input, points) = (b.below(inputs), u32::from(2 + b.below(3)));
        let modulo = b.flag();
        GridAxis {
            input,
            start: b.number(),
            step: step(b, axes, input, points, modulo),
            points,
            modulo,
        }
    };
    let along: Vec<GridAxis> = (0..1 + b.below(3)).map(|_| axis(b)).collect();
    let outputs = axes.len() as u8;
    let outputs: Vec<u8> = (b.below(outputs)..outputs).collect();
    let nodes: u32 = along.iter().map(|a| a.points).product();
    DraftGrid {
        values: (0..nodes as usize * outputs.len())
            .map(|_| b.number())
            .collect(),
        axes: along,
        outputs,
        format: format(b),
    }
}

/// Positions and auxiliaries with arbitrary bits.
pub fn inputs(b: &mut Bytes<'_>) -> trueaxis::Inputs<[f32; 8]> {
    let mut inputs = trueaxis::Inputs::at([0.0; 8]);
    for axis in &mut inputs.axes[..4] {
        *axis = b.number();
    }
    for auxiliary in &mut inputs.auxiliaries[..AUXILIARIES.min(2)] {
        *auxiliary = b.number();
    }
    inputs
}
