//! Positions of the machine during a measurement.

use trueaxis::{Compensation, Inputs, Room, Row};

/// Half the stroke of an endless axis, degrees.
const ENDLESS: f32 = 720.0;

/// Inputs of a period while all axes move, see [`Path::smooth`]. Every 20 ms a sensor reads another temperature, by as
/// much as is followed within 5 ms.
pub fn moving<A: Row<f32>>(path: &Path, period: usize) -> Inputs<A> {
    let mut inputs = inputs(path.smooth(period));
    let reading = if period / 20 % 2 == 0 { 2.0 } else { 2.0005 };
    inputs.auxiliaries.fill(reading);
    inputs
}

/// The first positions of `q`, as many as the axis capacity.
pub fn inputs<A: Row<f32>>(q: [f32; 8]) -> Inputs<A> {
    let mut axes = A::all(0.0);
    for (axis, q) in axes.as_mut().iter_mut().zip(q) {
        *axis = q;
    }
    Inputs::at(axes)
}

/// Travel of each axis, and a generator of positions within it.
pub struct Path {
    travel: [[f32; 2]; 8],
    state: u32,
}

impl Path {
    pub fn new<C: Room>(c: &Compensation<'_, C>) -> Self {
        let mut travel = [[0.0; 2]; 8];
        for (travel, axis) in travel.iter_mut().zip(c.axes()) {
            *travel = axis.travel.map(|end| {
                if end.abs() < 1e6 {
                    end
                } else {
                    ENDLESS.copysign(end)
                }
            });
        }
        Self { travel, state: 1 }
    }

    /// From 0 to 1.
    fn next(&mut self) -> f32 {
        self.state = self
            .state
            .wrapping_mul(1_664_525)
            .wrapping_add(1_013_904_223);
        (self.state >> 8) as f32 / (1 << 24) as f32
    }

    /// A random position in the travel.
    pub fn random(&mut self) -> [f32; 8] {
        let mut q = self.travel;
        core::array::from_fn(|k| {
            let [low, high] = q[k];
            q[k][0] = low + (high - low) * self.next();
            q[k][0]
        })
    }

    /// All axes move to and fro within half of their travel, in 1 s to 3 s each way; successive periods are 1 ms apart.
    pub fn smooth(&self, period: usize) -> [f32; 8] {
        core::array::from_fn(|k| {
            let [low, high] = self.travel[k];
            let way = 1000 + 317 * k;
            let phase = period % (2 * way);
            let there = if phase < way { phase } else { 2 * way - phase };
            let part = 0.25 + 0.5 * there as f32 / way as f32;
            low + (high - low) * part
        })
    }
}
