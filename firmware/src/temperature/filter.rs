//! Filters readings into a plausible temperature of a machine part.

/// Readings outside this range, °C, are ignored for any sensor, because they would break the arithmetic.
const PLAUSIBLE: core::ops::RangeInclusive<f32> = -273.15..=2000.0;
/// Longer times between readings, s, are errors.
const LONGEST: f32 = 1e6;

/// Median of three readings, then a first-order low-pass; holds its value without readings.
#[derive(Clone, Copy, Debug)]
pub struct Filter<E> {
    /// Time constant of the low-pass, s.
    time_constant: f32,
    /// Time after which a silent sensor is lost, s.
    patience: f32,
    /// The last readings, °C, oldest first.
    readings: [f32; 3],
    /// Number of readings so far.
    count: usize,
    celsius: Option<f32>,
    /// Time since the last reading, s.
    age: f32,
    error: Option<E>,
}

impl<E: Copy> Filter<E> {
    /// Without a reading, and lost until the third one.
    ///
    /// `time_constant` of the low-pass, and `patience`, after which a silent sensor is lost, both in s.
    #[must_use]
    pub const fn new(time_constant: f32, patience: f32) -> Self {
        Self {
            time_constant,
            patience,
            readings: [0.0; 3],
            count: 0,
            celsius: None,
            age: 0.0,
            error: None,
        }
    }

    /// Processes the sensor's result, `elapsed` seconds after the last call.
    pub fn take(&mut self, reading: Result<Option<f32>, E>, elapsed: f32) {
        if (0.0..=LONGEST).contains(&elapsed) {
            self.age += elapsed;
        }
        match reading {
            Ok(Some(celsius)) if PLAUSIBLE.contains(&celsius) => self.add(celsius),
            Ok(_) => {}
            Err(error) => self.error = Some(error),
        }
        if self.is_silent() {
            // Earlier readings do not confirm later ones.
            self.count = 0;
        }
    }

    fn add(&mut self, reading: f32) {
        let [_, b, c] = self.readings;
        self.readings = [b, c, reading];
        self.count = self.readings.len().min(self.count + 1);
        let elapsed = self.age;
        self.age = 0.0;
        self.error = None;
        // One or two readings cannot outvote a wrong one, so wait for the third.
        if self.count == self.readings.len() {
            let reading = median(self.readings);
            let share = elapsed / (self.time_constant + elapsed);
            self.celsius = Some(match self.celsius {
                Some(before) if share >= 0.0 => before + (reading - before) * share,
                Some(before) => before,
                None => reading,
            });
        }
    }

    /// The filtered temperature, °C; held while there is no reading. `None` before the third.
    #[must_use]
    pub fn celsius(&self) -> Option<f32> {
        self.celsius
    }

    /// Whether there has been no reading for longer than the patience, or no temperature yet.
    #[must_use]
    pub fn lost(&self) -> bool {
        self.celsius.is_none() || self.is_silent()
    }

    /// Whether there has been no reading for longer than the patience.
    #[must_use]
    pub fn is_silent(&self) -> bool {
        self.age > self.patience
    }

    /// The last error since the last reading.
    #[must_use]
    pub fn error(&self) -> Option<E> {
        self.error
    }
}

fn median([a, b, c]: [f32; 3]) -> f32 {
    let (low, high) = if a < b { (a, b) } else { (b, a) };
    if c < low {
        low
    } else if c > high {
        high
    } else {
        c
    }
}
