//! The numbers that the scheme was tuned with, each with its reason.
//!
//! None of them decides whether a result is right: that is measured, with the tables as the runtime
//! evaluates them. They decide how soon a good one is found.

/// What may be left out at first, as a share of the tolerance in each output (root of the sum of
/// squares, twice: peaks rarely meet).
pub(crate) const FIRST_SHARE: f64 = 0.25;
/// The same where the tip and the direction are measured, of which axes that belong together leave less
/// than each of them seems to.
pub(crate) const FIRST_TOOL_SHARE: f64 = 1.1;
/// A structure that leaves more than this part of the tolerance leaves little to interpolation; then one that
/// is made for this part of its share may be cheaper.
pub(crate) const STARVING: f64 = 0.5;
pub(crate) const CLOSER: f64 = 0.9;
/// What is left out of a basis, as a part of that: every function meets many others.
pub(crate) const BASIS_SHARE: f64 = 0.1;
/// Where more is needed than the target holds, that much is left out the next time, and the room goes
/// to what counts; so often at most.
pub(crate) const FULL_ATTEMPTS: usize = 3;
/// An error larger than this many times what was left out has another reason: joint effects.
pub(crate) const CUT: f64 = 2.0;
/// A structure worse than this many tolerances is not worth points if joint effects can better it.
pub const HOPELESS: f64 = 3.0;
/// What may be left out then, with joint effects of motions taken in: these cost many tables, so
/// no more of them than needed.
pub(crate) const SHARES: [f64; 8] = [1.5, 1.0, 0.85, 0.7, 0.4, 0.25, 0.12, 0.06];
/// Places at which a structure is tried, half of them corners: one of them decides little.
pub(crate) const TRIALS: usize = 160;
/// A result is good if the tables, measured at the positions of [`JUDGED`], stay within this share
/// of the tolerance: other positions may be a little worse.
pub(crate) const GOOD: f64 = 0.95;
/// Random positions at which tables are measured, and how often points are made finer for it.
pub(crate) const JUDGED: usize = 3000;
pub(crate) const REFINEMENTS: usize = 4;
/// Random positions at which what is good is confirmed; so many of those where it is not, the worst,
/// are measured from then on.
pub(crate) const CONFIRMED: usize = 8000;
pub(crate) const MOST_MISSED: usize = 1000;
/// From so many of the worst of these positions corners are looked for that are worse still, at most
/// so often around; of rotary axes, whose sines are largest anywhere, also at these parts of the range.
pub(crate) const CLIMBS: usize = 24;
pub(crate) const CLIMB_ROUNDS: usize = 4;
pub(crate) const CLIMB_PARTS: [f64; 7] = [0.0, 1.0, 0.5, 0.25, 0.75, 0.125, 0.875];

/// Interpolation may take at least this share of the tolerance, and this part of what the structure
/// leaves.
pub(crate) const LEAST_POINT_SHARE: f64 = 0.4;
/// Interpolation is not to blame if it may do less than this part of what is wrong.
pub(crate) const BLAMELESS: f64 = 0.4;
/// Where the tip and the direction are measured: how much more interpolation of each table by itself may
/// do at first; below which part of the tolerance fewer points are tried, for which part of it, and so
/// often at most, interpolation doing so many times more at least.
pub(crate) const LEAST_COARSER: f64 = 2.0;
pub(crate) const TOOL_SHARE: f64 = 8.0;
pub(crate) const TOO_GOOD: f64 = 0.85;
pub(crate) const JUST_GOOD: f64 = 0.9;
pub(crate) const COARSENINGS: usize = 5;
/// What holds at the positions of [`JUDGED`] and fails where it is confirmed fails by little: interpolation
/// may do this part of what it did.
pub(crate) const LITTLE_LESS: f64 = 0.7;
/// How often points are halved if the target cannot hold them.
pub(crate) const ROOM_STEPS: usize = 6;
/// Tables do no harm if they deviate on no axis by more than this part of what is allowed: other
/// positions may be a little worse.
pub(crate) const HARMLESS: f64 = 0.9;
/// Where the tolerance is missed, what is made for these parts of it is tried: more tables, fewer left
/// out, though trials did not ask for it.
pub(crate) const FINER: [f64; 2] = [0.3, 0.1];
/// Where it is missed still, what is made for these multiples of it is tried too.
pub(crate) const COARSER: [f64; 16] = [
    2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0, 1e3, 2e3, 5e3, 1e4, 2e4, 5e4, 1e5, 2e5,
];

/// Joint effects of two motions that stay below this together (in units of the tolerance; root of
/// the sum of squares, twice: peaks rarely meet) are left out.
pub(crate) const PAIRS_SHOW: f64 = 0.3;
/// Random places at which joint effects are looked for.
pub(crate) const PAIR_PLACES: usize = 24;
/// Nodes of joint effects, each as often as there are subsets of its switches: half a minute's work on
/// one core, and two minutes' where nothing would come near without them. Weaker effects are left out.
pub const MOST_WORK: usize = 600_000;
pub(crate) const MOST_WORK_IF_HOPELESS: usize = 4 * MOST_WORK;
/// Nodes of each axis whose motions are on together with another's: what several motions add
/// together is small.
pub(crate) const JOINT_NODES: usize = 13;
/// Nodes of a component beyond which variables get fewer, and the fewest: a second's work on one
/// core.
pub(crate) const MOST_NODES: usize = 30_000;
pub(crate) const LEAST_NODES: usize = 7;

/// Singular values below this part of the largest are rounding: samples are good to 1e-10 of what
/// they show.
pub const ROUNDING: f64 = 1e-12;
/// Of a function, at least this part must be no sum of others that are used with it: coefficients
/// grow by its inverse.
pub const APART: f64 = 1e-4;
/// A column is a good pivot if its square is at least this part of the largest: functions are told half as
/// well from it, and the exact corrections of columns that share them are worth that.
pub(crate) const GOOD_PIVOT: f64 = 0.25;
/// Where some functions leave less than this part of the squares that others leave, the samples are made of
/// them: a tenth of the size.
pub(crate) const MUCH_LESS: f64 = 0.01;
/// Products that contribute less than this (in units of the tolerance) are dropped: a thousand of
/// them would not add up to a tenth.
pub const NOISE: f64 = 1e-4;

/// Products that are looked at, the largest first: what can be held is a fiftieth of them, and sums
/// of products are as many again along each variable.
pub(crate) const MOST_ENTRIES: usize = 200_000;

/// Bytes of samples that one of these instructions is worth: a slot of 256 kB for the 4000 instructions
/// that a controller has for it at most, in a tenth of a period of 4 kHz.
pub(crate) const BYTES_PER_INSTRUCTION: f64 = 64.0;

/// A kink counts as on a point if it is off by less than this part of a step: what is cut off there
/// is as small a part of what interpolation may do.
pub(crate) const GRID_SLACK: f64 = 1e-3;
/// Intervals of a bent table.
pub(crate) const LEAST_INTERVALS: usize = 4;
pub(crate) const MOST_INTERVALS: usize = 8192;
/// Intervals per damping (rad) on which peaks are seen, the fewest on a range, and the most.
pub(crate) const SEEN_PER_PEAK: f64 = 5.0;
pub(crate) const LEAST_SEEN: usize = 64;
pub(crate) const MOST_SEEN: usize = 2048;
/// Where polynomials through every other sample err by less than so many tolerances, those through all of
/// them, which err some 4000 times less, stand for the exact correction: eight times that would be 2 % of
/// the tolerance.
pub(crate) const MOST_OF_HALF: f64 = 10.0;
/// A finer grid that leaves more than this part of the error is not worth its points.
pub(crate) const STUCK: f64 = 0.8;

/// How often weights are fitted, each time with the positions at which they failed before, and at how
/// many positions for each weight of an output, so that what is fitted there holds elsewhere.
pub(crate) const FITS: usize = 8;
pub(crate) const FIT_SAMPLES: usize = 12;
/// What leaves more tolerances than this after a fit is fitted no more: eight rounds halve it.
pub(crate) const OUT_OF_REACH: f64 = 30.0;
/// How often positions get other weight, the steps of the first solution, and what is added to the
/// squares of the products, which are 1: enough to keep what samples do not tell.
pub(crate) const FIT_ROUNDS: usize = 8;
pub(crate) const FIT_STEPS: usize = 30;
pub(crate) const FIT_RIDGE: f64 = 1e-3;
