//! Canned cycles from their words, and those that stay from the line before.

use super::{Asked, bits, whole};
use crate::axes::{self, COUNT};
use crate::cycle::{Cycle, Frame, Sticky, Wait};
use crate::fault::Fault;
use crate::modal::{Distance, FeedMode, Retract};
use crate::rate::Rate;
use crate::state::State;
use crate::words::Word;

/// Most pecks of a line: a hundred holes of a hundred pecks.
const MOST_PECKS: f64 = 10_000.0;
/// A hole is deeper (mm), or it is none: words have four decimals.
const SHALLOWEST: f64 = 5e-4;

impl State {
    /// G73, G74, G81 to G86, G89.
    pub(super) fn canned(&mut self, asked: &Asked<'_>, code: u16) -> Result<Cycle, Fault> {
        let block = asked.block;
        let plane = self.plane(asked)?.axes();
        self.allows_cycle(asked, plane)?;
        let n = plane[2];
        let relative = self.needs_distance(block)? == Distance::Incremental;
        let from = self.position.at;
        let retract = self.needs_retract(block)?;
        let frame = self.frame_of_series(asked, n, relative, retract)?;
        let mut sticky = self.sticky(asked, code, frame, relative)?;
        self.keep_levels(asked, &mut sticky);
        let rate = self.rate_of_cycle(asked)?;
        let repeat = repeats(asked)?;
        let first = self.target(asked, asked.free & !(1 << n), false)?.at;
        let by = match relative {
            true => std::array::from_fn(|i| first[i] - from[i]),
            false => [0.0; COUNT],
        };
        let [r, bottom] = self.levels(&sticky);
        let cycle = Cycle {
            code,
            axes: plane,
            from,
            first,
            by,
            repeat,
            r,
            bottom,
            initial: sticky.initial,
            retract,
            q: sticky.q,
            p: sticky.p,
            rate,
            feeds_to_clear: asked.rules.dialect.table().g89_feeds_to_level,
        };
        check_depth(asked, &cycle)?;
        self.cycle = Some(sticky);
        Ok(cycle)
    }

    /// What a cycle in this plane does not stand beside, or cannot do without.
    fn allows_cycle(&self, asked: &Asked<'_>, plane: [usize; 3]) -> Result<(), Fault> {
        let block = asked.block;
        if self.tip {
            return Err(block.fault("a cycle under tool-centre-point control", "write it out"));
        }
        if self.cutter && asked.rules.dialect.table().cycles_need_g40 {
            return Err(block.fault(
                "a cycle under G41 or G42, which LinuxCNC refuses",
                "write G40 before it",
            ));
        }
        if let Some(axis) = self.position.missing(asked.rules.axes) {
            return Err(self.missing(asked, axis));
        }
        if let Some(axis) = bits(asked.free).find(|axis| !plane.contains(axis)) {
            let word = asked.word(axes::LETTERS[axis]);
            return Err(Fault::new(
                word.map_or(0..block.end, Word::span),
                "an axis outside the plane in a cycle",
                "write a line before",
            ));
        }
        Ok(())
    }

    /// R and the bottom, as positions of the machine.
    fn levels(&self, sticky: &Sticky) -> [f64; 2] {
        if sticky.relative {
            let r = sticky.initial + sticky.r;
            return [r, r + sticky.depth];
        }
        let level = |word: f64| self.offsets.machine_axis(sticky.frame.normal, word);
        [level(sticky.r), level(sticky.depth)]
    }

    /// What numbers of the series mean, which do not change their meaning within it.
    fn frame_of_series(
        &self,
        asked: &Asked<'_>,
        normal: usize,
        relative: bool,
        retract: Retract,
    ) -> Result<Frame, Fault> {
        let span = asked.block.axis_span();
        let now = Frame {
            normal,
            units: self.needs_units(span.clone())?,
            zero: self.offsets.machine_axis(normal, 0.0),
        };
        let Some(series) = self.cycle.map(|c| c.frame) else {
            return Ok(now);
        };
        let same_numbers = series.normal == now.normal && series.units == now.units;
        let has_level = relative || retract == Retract::Initial;
        // Offsets are sums of decimal numbers.
        let same_zero = (series.zero - now.zero).abs() < 1e-9;
        if same_numbers && (same_zero || !has_level) {
            return Ok(series);
        }
        Err(Fault::new(
            span,
            "a series of cycles that goes on with another plane, unit or offset: to which level it returns \
             differs from controller to controller",
            "write G80 in a line before it, and the cycle with all its words",
        ))
    }

    fn rate_of_cycle(&self, asked: &Asked<'_>) -> Result<Rate, Fault> {
        match (self.feed.filter(|f| *f > 0.0), self.feed_mode) {
            (Some(f), FeedMode::PerMinute) => Ok(Rate::PerMinute(f)),
            (Some(f), FeedMode::PerRevolution) => Ok(Rate::PerRevolution(f)),
            (None, _) | (_, FeedMode::InverseTime) => Err(asked.fault(
                "a cycle without a feed per minute or revolution",
                "write F before it",
            )),
        }
    }

    /// Fanuc's R and depth of a line before are levels, which stay where they are if G90 becomes G91, or the reverse.
    fn keep_levels(&self, asked: &Asked<'_>, sticky: &mut Sticky) {
        let Some(before) = self.cycle.filter(|c| c.code == sticky.code) else {
            return;
        };
        if before.relative == sticky.relative || !asked.rules.dialect.table().keeps_levels {
            return;
        }
        // An increment of R counts from the level before the series, one of the depth from R.
        let height = |relative: bool, from: f64, word: f64| match relative {
            true => from + word,
            false => sticky.frame.zero + word,
        };
        let word = |from: f64, height: f64| match sticky.relative {
            true => height - from,
            false => height - sticky.frame.zero,
        };
        let r_before = height(before.relative, before.initial, before.r);
        let mut r = sticky.r;
        if asked.word(b'R').is_none() {
            r = word(sticky.initial, r_before);
        }
        if asked.word(axes::LETTERS[sticky.frame.normal]).is_none() {
            let depth = height(before.relative, r_before, before.depth);
            sticky.depth = word(height(sticky.relative, sticky.initial, r), depth);
        }
        sticky.r = r;
    }

    /// The words of a cycle: those of the line, otherwise those of the line before in its series.
    fn sticky(
        &self,
        asked: &Asked<'_>,
        code: u16,
        frame: Frame,
        relative: bool,
    ) -> Result<Sticky, Fault> {
        let normal = frame.normal;
        let before = self.cycle.filter(|c| c.code == code);
        let initial = self.cycle.map_or(self.position.at[normal], |c| c.initial);
        let length = |letter: u8, before: Option<f64>| match asked.word(letter) {
            Some(word) => self.length_of(asked, word).map(Some),
            None => Ok(before),
        };
        let r = length(b'R', before.map(|c| c.r))?.ok_or_else(|| lacking(asked, "R"))?;
        let letter = axes::LETTERS[normal];
        let depth = length(letter, before.map(|c| c.depth))?
            .ok_or_else(|| lacking(asked, &format!("{}, its depth", char::from(letter))))?;
        let q = length(b'Q', before.and_then(|c| c.q))?;
        if matches!(code, 730 | 830) && q.is_none_or(|q| q <= 0.0) {
            return Err(lacking(asked, "Q, the depth of a peck, which is positive"));
        }
        let p = wait_at_bottom(asked, code, before.and_then(|c| c.p))?;
        Ok(Sticky {
            code,
            initial,
            frame,
            relative,
            r,
            depth,
            q,
            p,
        })
    }
}

/// P of the line, otherwise of the line before, if the cycle has one.
fn wait_at_bottom(
    asked: &Asked<'_>,
    code: u16,
    before: Option<Wait>,
) -> Result<Option<Wait>, Fault> {
    let p = asked.word(b'P').map(|w| Wait {
        value: w.value,
        point: w.point,
    });
    let p = p.or(before);
    // Fanuc's G86 has no P.
    let waits = matches!(code, 820 | 890) || code == 860 && asked.rules.dialect.table().g86_waits;
    match waits && p.is_none() {
        true => Err(lacking(asked, "P, the time at the bottom")),
        false => Ok(p),
    }
}

fn lacking(asked: &Asked<'_>, what: &str) -> Fault {
    asked.fault(format!("a cycle without {what}"), format!("write {what}"))
}

/// A hole goes down, and in a limited number of pecks.
fn check_depth(asked: &Asked<'_>, cycle: &Cycle) -> Result<(), Fault> {
    let span = asked.block.axis_span();
    let depth = cycle.r - cycle.bottom;
    if cycle.bottom > cycle.r {
        return Err(Fault::new(
            span,
            "a cycle whose depth is above R",
            "check R and the depth",
        ));
    }
    if depth < SHALLOWEST {
        return Err(Fault::new(
            span,
            "a hole of less than half a micrometre",
            "check R and the depth: they are the same, or a hole apart",
        ));
    }
    let pecks = match (cycle.code, cycle.q) {
        (730 | 830, Some(q)) => (depth / q).ceil(),
        _ => 1.0,
    };
    if pecks * f64::from(cycle.repeat) > MOST_PECKS {
        return Err(Fault::new(
            asked.word(b'Q').map_or(span, Word::span),
            format!("a cycle of more than {MOST_PECKS} pecks in one line"),
            "check Q: it is the depth of a peck",
        ));
    }
    Ok(())
}

/// How often a cycle is done: L, or Fanuc's K.
fn repeats(asked: &Asked<'_>) -> Result<u32, Fault> {
    let word = match (asked.word(b'L'), asked.word(b'K')) {
        (None, None) => return Ok(1),
        (Some(_), Some(word)) => {
            return Err(word.fault(
                "a second word in the line of how often a cycle is done",
                "write K or L",
            ));
        }
        (None, Some(word)) if word.point => {
            return Err(word.fault("a cycle with a K that is a length",
                "write the cycle with one depth of its pecks, Q; how often it is done is a K without point",
            ));
        }
        (Some(word), None) | (None, Some(word)) => word,
    };
    match whole(word)? {
        times @ 1..=10_000 => Ok(times),
        _ => Err(word.fault(
            "a cycle that is done never or too often",
            "write it with its first hole, or leave the line out",
        )),
    }
}
