//! Tuning constants of the scheme, each with its reason.
//!
//! None of them decides whether a result is right; that is measured with the tables as the runtime evaluates them.
//! They decide how quickly a good result is found.

/// Share of the tolerance that a structure may leave out at first, in each output (twice the root of the sum of
/// squares, because peaks rarely coincide).
pub(crate) const FIRST_SHARE: f64 = 0.25;
/// Like `FIRST_SHARE`, if the tip and the direction are measured, where deviations of related axes partly cancel.
pub(crate) const FIRST_TOOL_SHARE: f64 = 1.1;
/// A structure that leaves more than this fraction of the tolerance leaves little for interpolation. One made for
/// this fraction of its share may then be cheaper.
pub(crate) const STARVING: f64 = 0.5;
pub(crate) const CLOSER: f64 = 0.9;
/// Share that a basis may leave out, as a fraction of that: every function is combined with many others.
pub(crate) const BASIS_SHARE: f64 = 0.1;
/// Maximum number of attempts, if more is needed than the target holds. Each next attempt leaves out as much as the
/// last one had to, so that the capacity goes to what matters: the 84 coefficients of the HU40 then keep three quarters of
/// the error.
pub(crate) const FULL_ATTEMPTS: usize = 3;
/// An error of more than this many times what was left out has another cause: joint effects.
pub(crate) const CUT: f64 = 2.0;
/// A structure with an error of more than this many tolerances is not worth points if joint effects can improve it.
pub const HOPELESS: f64 = 3.0;
/// Shares tried then, with joint effects of motions included. These cost many tables, so no more of them than
/// needed.
pub(crate) const SHARES: [f64; 8] = [1.5, 1.0, 0.85, 0.7, 0.4, 0.25, 0.12, 0.06];
/// Number of positions at which a structure is tried, half of them in corners; a single one decides little.
pub(crate) const TRIALS: usize = 160;
/// A result is good if the tables, measured at [`JUDGED`] positions, stay within this share of the tolerance; other
/// positions may be a little worse.
pub(crate) const GOOD: f64 = 0.95;
/// Number of random positions at which tables are measured, and number of refinements of the points.
pub(crate) const JUDGED: usize = 3000;
pub(crate) const REFINEMENTS: usize = 4;
/// Number of random positions at which a good draft is confirmed, and number of the worst failing ones that are
/// measured from then on.
pub(crate) const CONFIRMED: usize = 8000;
pub(crate) const MOST_MISSED: usize = 1000;
/// Number of the worst of these positions from which worse corners are searched, number of rounds over the inputs,
/// and positions of rotary axes in the range that are tried, because sines may be largest anywhere.
pub(crate) const CLIMBS: usize = 24;
pub(crate) const CLIMB_ROUNDS: usize = 4;
pub(crate) const CLIMB_PARTS: [f64; 7] = [0.0, 1.0, 0.5, 0.25, 0.75, 0.125, 0.875];

/// Interpolation may use at least this share of the tolerance, and this fraction of what the structure leaves.
pub(crate) const LEAST_POINT_SHARE: f64 = 0.4;
/// Interpolation is not the cause if its share is less than this fraction of the error.
pub(crate) const BLAMELESS: f64 = 0.4;
/// If the tip and the direction are measured: smallest factor by which the share grows when fewer points are tried;
/// initial factor of the share of each table; fraction of the tolerance below which fewer points are tried; fraction
/// they aim for; and number of such trials.
pub(crate) const LEAST_COARSER: f64 = 2.0;
pub(crate) const TOOL_SHARE: f64 = 8.0;
pub(crate) const TOO_GOOD: f64 = 0.85;
pub(crate) const JUST_GOOD: f64 = 0.9;
pub(crate) const COARSENINGS: usize = 5;
/// A draft that passes at [`JUDGED`] positions and fails when confirmed fails by little: the share of interpolation
/// is multiplied by this.
pub(crate) const LITTLE_LESS: f64 = 0.7;
/// How often points are halved if the target cannot hold them.
pub(crate) const ROOM_STEPS: usize = 6;
/// Tables do no harm if no axis deviates by more than this fraction of the limit; other positions may be a little
/// worse.
pub(crate) const HARMLESS: f64 = 0.9;
/// If the tolerance is missed, drafts for these fractions of it are tried: more tables and less left out, although
/// the trials did not require it.
pub(crate) const FINER: [f64; 2] = [0.3, 0.1];
/// If it is still missed, drafts for these multiples of it are tried too.
pub(crate) const COARSER: [f64; 16] = [
    2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0, 1e3, 2e3, 5e3, 1e4, 2e4, 5e4, 1e5, 2e5,
];

/// Joint effects of two motions are left out while their total stays below this (in units of the tolerance; twice
/// the root of the sum of squares, because peaks rarely coincide).
pub(crate) const PAIRS_SHOW: f64 = 0.3;
/// Number of random positions at which joint effects are searched.
pub(crate) const PAIR_PLACES: usize = 24;
/// Most nodes of joint effects, each counted once for every subset of its switches: half a minute on one core, and
/// two minutes if nothing would come close without them. Weaker effects are left out.
pub const MOST_WORK: usize = 600_000;
pub(crate) const MOST_WORK_IF_HOPELESS: usize = 4 * MOST_WORK;
/// Nodes of each axis whose motions are on together with another's; joint effects of several motions are small.
pub(crate) const JOINT_NODES: usize = 13;
/// Most nodes of a component before variables get fewer, and the fewest per variable: a second on one core.
pub(crate) const MOST_NODES: usize = 30_000;
pub(crate) const LEAST_NODES: usize = 7;

/// Singular values below this fraction of the largest are rounding; samples are accurate to 1e-10 of their values.
pub const ROUNDING: f64 = 1e-12;
/// The fraction of a function that must be independent of the others used with it; coefficients grow by its inverse.
pub const APART: f64 = 1e-4;
/// A column is a good pivot if its square is at least this fraction of the largest. Functions are resolved half as
/// well by it, in exchange for exact corrections that are shared between columns.
pub(crate) const GOOD_PIVOT: f64 = 0.25;
/// Functions that leave less than this fraction of the squares that others leave are the right ones: the residual is
/// a tenth of the size.
pub(crate) const MUCH_LESS: f64 = 0.01;
/// Products that contribute less than this (in units of the tolerance) are dropped; a thousand of them would not add
/// up to a tenth.
pub const NOISE: f64 = 1e-4;

/// Number of products considered, the largest first. A target can hold a fiftieth of them; sums of products along
/// each variable come on top.
pub(crate) const MOST_ENTRIES: usize = 200_000;

/// Bytes of samples that cost as much as one instruction: a slot of 256 kB for at most 4000 instructions, which a
/// controller can spend in a tenth of a 4 kHz period.
pub(crate) const BYTES_PER_INSTRUCTION: f64 = 64.0;

/// A kink counts as on a point if it is off by less than this fraction of a step; the resulting error is an equally
/// small fraction of that permitted for interpolation.
pub(crate) const GRID_SLACK: f64 = 1e-3;
/// Limits on the number of intervals of a bent table.
pub(crate) const LEAST_INTERVALS: usize = 4;
pub(crate) const MOST_INTERVALS: usize = 8192;
/// For sampling peaks: intervals per damping (rad), and the smallest and largest number of intervals over a range.
pub(crate) const SEEN_PER_PEAK: f64 = 5.0;
pub(crate) const LEAST_SEEN: usize = 64;
pub(crate) const MOST_SEEN: usize = 2048;
/// If polynomials through every other sample err by less than this many tolerances, polynomials through all samples,
/// with an error about 4000 times smaller, replace the exact correction. Eight times that would be 2 % of the
/// tolerance.
pub(crate) const MOST_OF_HALF: f64 = 10.0;
/// A finer grid that leaves more than this fraction of the error is not worth its points.
pub(crate) const STUCK: f64 = 0.8;

/// How often weights are fitted, each time including the positions that failed before, and number of positions per
/// weight of an output, enough for the fit to hold elsewhere.
pub(crate) const FITS: usize = 8;
pub(crate) const FIT_SAMPLES: usize = 12;
/// A draft that leaves more tolerances than this after a fit is not fitted again; eight rounds halve the error.
pub(crate) const OUT_OF_REACH: f64 = 30.0;
/// If the structure that fits into a full target leaves more tolerances than this, the tolerance is out of reach: no
/// fit has more than halved an error.
pub(crate) const MOST_FITTED: f64 = 2.0;
/// Like `MOST_FITTED`, before the structure for a tolerance is known, from the error that a finer one leaves. Functions chosen for
/// a coarser tolerance may halve it.
pub(crate) const FAR_OUT_OF_REACH: f64 = 2.0 * MOST_FITTED;
/// A draft that leaves more tolerances than this at the worst positions found also misses the tolerance at random
/// ones: there the largest error is 0.82 to 0.88 of it.
pub(crate) const NEARLY_MET: f64 = 1.25;
/// Adding up and pruning about halve the number of terms, so this many times what the target holds may be chosen
/// first.
pub(crate) const BEFORE_FOLDING: usize = 2;
/// Rounds of reweighting, steps of the first solution, and the ridge added to the squares of the products, which are
/// 1; it is large enough to fix weights that the samples do not determine.
pub(crate) const FIT_ROUNDS: usize = 8;
pub(crate) const FIT_STEPS: usize = 30;
pub(crate) const FIT_RIDGE: f64 = 1e-3;
