use std::vec::Vec;

use super::lookup::Kind;
use super::*;
use crate::blob;
use crate::contents::Contents;
use crate::description::{
    ADJUSTABLE, AUXILIARIES, Bank, Direction, FACTORS, GRID_INPUTS, GRID_OUTPUTS, GridAxis,
    Interpolation, SampleFormat,
};
use crate::draft::{AlignedBlob, Draft};
use crate::room::Holds;
use crate::specimen::{adjustable, bank, bare, everything, term};

type Small = Holds<3, 8, 8, 16, 2>;

/// The guarantees, found once more from what the plan has become.
fn assert_guarantees(plan: &Plan<'_, Small>) {
    let (axes, tables) = (Small::AXES, Small::TABLES);
    let assert_span = |span: &Span, reads: u32| {
        assert!(usize::from(span.slot) < axes + AUXILIARIES, "1");
        assert!(span.last < 1 << 24 && span.after <= span.last, "2");
        let (limit, beyond) = if span.is_modulo() {
            (span.last + 1, 0)
        } else {
            (span.last + 2 - reads, span.last + 2 - reads)
        };
        assert_eq!(
            [span.limit, span.beyond],
            [limit as f32, beyond as f32],
            "2"
        );
    };
    let length = |integer: bool| {
        if integer {
            plan.shorts().map(<[i16]>::len)
        } else {
            plan.floats().map(<[f32]>::len)
        }
    };
    let (banks, [linear, other]) = plan.banks();
    assert!(linear <= other && other <= banks.len(), "10");
    let mut written = std::vec![false; tables];
    for (k, bank) in banks.iter().enumerate() {
        let kind = match k {
            _ if k < linear => Kind::Straight,
            _ if k < other => Kind::Linear,
            _ => Kind::Other,
        };
        assert_eq!(bank.kind, kind, "10");
        let reads = if bank.cubic { 4 } else { 2 };
        assert_span(&bank.span, reads);
        assert!(bank.span.last + 1 >= reads, "2");
        if bank.direction != Direction::Both {
            assert!(usize::from(bank.span.slot) < axes, "1");
        }
        let end = bank.first as usize + bank.span.points() as usize * usize::from(bank.tables);
        assert!(
            bank.tables >= 1 && end <= length(bank.integer).unwrap(),
            "3"
        );
        if bank.kind == Kind::Straight {
            assert!(
                bank.tables == 1 && bank.span.last == 1 && !bank.integer,
                "10"
            );
        }
        let first = usize::from(bank.table);
        for table in &mut written[first..first + usize::from(bank.tables)] {
            assert!(!core::mem::replace(table, true), "4");
        }
    }
    let written = written.iter().take_while(|written| **written).count();
    assert!(usize::from(plan.tables()) <= written, "4");
    assert!(plan.scales().len() >= written, "4");

    let mut rest = plan.terms();
    while let Some(first) = rest.first() {
        assert!(first.run >= 1 && usize::from(first.run) <= rest.len(), "6");
        let (run, others) = rest.split_at(usize::from(first.run));
        rest = others;
        for (k, term) in run.iter().enumerate() {
            let used = usize::from(term.count);
            assert!(used <= FACTORS && usize::from(term.output) < axes, "5");
            let (used, unused) = term.factors.split_at(used);
            assert!(used.iter().all(|&f| u16::from(f) < plan.tables()), "5");
            assert!(unused.iter().all(|&f| usize::from(f) == tables), "5");
            assert_eq!(term.output, first.output, "6");
            assert_eq!(term.place == FIXED, first.place == FIXED, "6");
            if first.place != FIXED {
                assert!(usize::from(first.place) + k < ADJUSTABLE, "5");
                assert_eq!(usize::from(term.place), usize::from(first.place) + k, "5");
            }
            assert!(first.most == PAIRED || term.count <= first.most, "6");
        }
    }
    for grid in plan.grids() {
        let width = usize::from(grid.width);
        assert!((1..=GRID_OUTPUTS).contains(&width), "7");
        assert!(grid.outputs.iter().all(|&o| usize::from(o) < axes), "7");
        let mut stride = width as u64;
        for k in (0..GRID_INPUTS).rev() {
            assert_span(&grid.spans[k], 2);
            assert_eq!(u64::from(grid.strides[k]), stride, "3");
            stride *= grid.spans[k].points();
        }
        let end = u64::from(grid.first) + stride;
        assert!(end <= length(grid.integer).unwrap() as u64, "3");
        if grid.plain {
            assert!(!grid.integer && width == PLAIN_WIDTH, "7");
            let plain = |s: &Span| s.last >= 1 && !s.is_modulo();
            assert!(grid.spans.iter().all(plain), "7");
        }
    }
    if plan.one_cell() {
        assert!(plan.terms().is_empty() && plan.grids().len() == 1, "7");
        assert!(plan.grids()[0].plain, "7");
    }
    let mut words = plan.pairs().iter();
    let (heads, [bare, singles]) = plan.heads();
    assert!(bare <= singles && singles <= heads.len(), "8");
    for (k, head) in heads.iter().enumerate() {
        let output = usize::from(head.output);
        assert!(output.is_multiple_of(4) && output / 4 < axes, "8");
        assert_eq!(
            [head.pairs > 0, head.singles > 0],
            [k < bare, k >= singles],
            "8"
        );
        // Places of tables, or of the 1 and the 0 behind all that there is room for.
        let named = |byte: u32, behind: usize| {
            let place = byte as usize / 4;
            byte.is_multiple_of(4)
                && (place < usize::from(plan.tables()) || place == tables + behind)
        };
        assert!(named(u32::from(head.first), 1), "8");
        for _ in 0..head.pairs {
            let word = *words.next().unwrap();
            assert!(named(word & 0xFFFF, 0) && named(word >> 16, 0), "8");
        }
        for _ in 0..head.singles {
            assert!(named(*words.next().unwrap(), 0), "8");
        }
    }
    assert!(words.next().is_none(), "8");
    if !plan.banks().0.is_empty() || !plan.grids().is_empty() {
        assert!(plan.floats().is_some() && plan.shorts().is_some(), "9");
    }
}

fn assert_empty(plan: &Plan<'_, Small>) {
    assert!(plan.banks().0.is_empty() && plan.grids().is_empty() && plan.terms().is_empty());
    assert!(plan.heads().0.is_empty() && plan.pairs().is_empty() && plan.scales().is_empty());
    assert!(plan.floats().is_none() && plan.shorts().is_none());
    assert!(plan.tables() == 0 && !plan.one_cell() && !plan.has_runs());
    assert_eq!(plan.weights(), &Weights::empty());
}

fn fill<'a>(plan: &mut Plan<'a, Small>, blob: &'a [u8]) -> Result<(), LoadError> {
    let mut contents = Contents::EMPTY;
    plan.fill(blob, |filling| blob::read(blob, filling, &mut contents))
}

/// Drafts with everything that a plan can have.
fn drafts() -> Vec<Draft> {
    let mut drafts = Vec::from([everything(), bare()]);
    let mut cell = everything();
    cell.terms.clear();
    cell.grids.truncate(1);
    cell.grids[0].axes[2].modulo = false;
    let mut line = cell.clone();
    line.grids[0].axes.truncate(1);
    line.grids[0].values.truncate(6);
    let mut integers = cell.clone();
    integers.grids[0].format = SampleFormat::I16;
    drafts.extend([cell, line, integers]);
    let mut singles = bare();
    singles
        .banks
        .push(bank(0, 0.0, 1.0, std::vec![std::vec![0.0, 1.0]; 3]));
    singles.terms = [0, 1, 2, 0].map(|table| term(1, 1.0, &[table])).into();
    drafts.push(singles);
    drafts
}

#[test]
fn a_plan_that_was_filled_keeps_every_guarantee() {
    for draft in drafts() {
        let blob = draft.encode().unwrap();
        let mut plan = Plan::EMPTY;
        fill(&mut plan, &blob).unwrap();
        assert_guarantees(&plan);
        assert_eq!(plan.heads().0.len(), draft.axes.len());
        assert_eq!(plan.terms().len(), draft.terms.len());
        assert_eq!(plan.grids().len(), draft.grids.len());
    }
}

#[test]
fn a_plan_that_is_not_filled_to_the_end_is_empty() {
    let good = everything().encode().unwrap();
    let cut: Vec<_> = (crate::format::HEADER..good.len())
        .map(|length| AlignedBlob::from_bytes(&good[..length]))
        .collect();
    let mut plan = Plan::EMPTY;
    for blob in &cut {
        fill(&mut plan, &good).unwrap();
        assert!(fill(&mut plan, blob).is_err());
        assert_empty(&plan);
    }
    fill(&mut plan, &good).unwrap();
    let panicking = std::panic::AssertUnwindSafe(|| {
        let _ = plan.fill(&good, |filling| {
            filling.axes(2).unwrap();
            panic!("a reader that does not come to its end");
        });
    });
    assert!(std::panic::catch_unwind(panicking).is_err());
    assert_empty(&plan);
}

/// What it puts in wherever it can, whatever is answered.
fn careless(filling: &mut Filling<'_, '_, Small>, order: u32) {
    let line = |input, points, tables, first| Bank {
        input,
        start: 0.0,
        step: 1.0,
        points,
        modulo: false,
        direction: Direction::Both,
        interpolation: Interpolation::Linear,
        format: SampleFormat::F32,
        tables,
        first,
    };
    let axis = |input| GridAxis {
        input,
        start: 0.0,
        step: 1.0,
        points: 2,
        modulo: false,
    };
    let mut digits = order;
    for _ in 0..9 {
        let step = digits % 10;
        digits /= 10;
        match step {
            0 => filling.samples([16, 0]),
            1 => filling.samples([8, 0]),
            2 => {
                let _ = filling.axes(3);
                let _ = filling.auxiliaries(1);
            }
            3 => {
                let _ = filling.axes(1);
            }
            4 => {
                // Left unfinished, then of more tables than there is room for.
                let _ = filling.bank(0, &line(0, 2, 3, 0));
                if let Ok(open) = filling.bank(1, &line(0, 2, 200, 0)) {
                    let _ = open.end();
                }
            }
            5 => {
                if let Ok(mut open) = filling.bank(0, &line(3, 4, 2, 0)) {
                    open.scale(2.0);
                    let _ = open.end();
                }
            }
            6 => {
                let _ = filling.end_banks();
            }
            9 => {
                // More than there is room for.
                let _ = filling.axes(9);
                if let Ok(open) = filling.term(0, 8, 1.0, None) {
                    open.end();
                }
            }
            7 => {
                let _ = filling.term(0, 2, 1.0, Some([0.0, 1.0]));
                for place in 0..ADJUSTABLE as u16 {
                    let _ = filling.term(place, 0, 0.5, Some([0.0, 1.0]));
                    if let Ok(mut open) = filling.term(place, 0, 0.5, Some([0.0, 1.0])) {
                        for table in 0..=FACTORS as u8 {
                            let _ = open.factor(table % 2);
                        }
                        open.end();
                    }
                }
            }
            _ => {
                if let Ok(mut open) = filling.grid(0, 2) {
                    for input in [0, 1, 2, 9] {
                        let _ = open.input(&axis(input));
                    }
                    for output in 0..9 {
                        let _ = open.output(output);
                    }
                    let _ = open.format(SampleFormat::I16, 9);
                    let _ = open.format(SampleFormat::F32, 0);
                    open.scale(77, 1.0);
                    let _ = open.end(8);
                }
            }
        }
    }
}

#[test]
fn no_way_of_filling_a_plan_breaks_a_guarantee() {
    // A description of 32 bytes and 16, 8 or no samples.
    let blobs = [64, 32, 0].map(|samples| AlignedBlob::from_bytes(&std::vec![0; 32 + samples]));
    let mut filled = 0;
    let mut random = 1_u32;
    for _ in 0..200_000 {
        random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        let order = random >> 3;
        for blob in &blobs {
            let mut plan = Plan::EMPTY;
            let result = plan.fill(blob, |filling| {
                careless(filling, order);
                Ok(32)
            });
            match result {
                Ok(()) => {
                    assert_guarantees(&plan);
                    filled += usize::from(!plan.banks().0.is_empty());
                }
                Err(_) => assert_empty(&plan),
            }
        }
    }
    assert!(filled > 100, "{filled}");
}

/// Output, first value, pairs and single values of each head, as numbers of tables; the words.
fn put_aside(draft: &Draft) -> (Vec<[u16; 4]>, Vec<[u32; 2]>) {
    let blob = draft.encode().unwrap();
    let mut plan = Plan::EMPTY;
    fill(&mut plan, &blob).unwrap();
    assert_guarantees(&plan);
    let heads = plan.heads().0.iter();
    let heads = heads.map(|head| [head.output / 4, head.first / 4, head.pairs, head.singles]);
    let words = plan.pairs().iter().map(|word| [word & 0xFFFF, word >> 16]);
    (
        heads.collect(),
        words.map(|[a, b]| [a / 4, b / 4]).collect(),
    )
}

#[test]
fn what_is_added_first_are_the_leading_terms_of_weight_1_and_up_to_two_factors() {
    // Behind the tables there is room for.
    let (one, zero) = (8, 9);
    let mut draft = bare();
    draft
        .banks
        .push(bank(0, 0.0, 1.0, std::vec![std::vec![0.0, 1.0]; 3]));
    draft.terms = std::vec![
        term(2, 1.0, &[2]),
        term(0, 1.0, &[0]),
        term(1, 1.0, &[1, 0]),
        term(0, 1.0, &[1, 2]),
        term(2, 1.0, &[1]),
        term(0, 1.0, &[2]),
        term(1, 1.0, &[2]),
        // What ends them, and what would count if it stood in front of that.
        adjustable(2, 1.0, [0.0, 1.0], &[0]),
        term(0, 2.0, &[0]),
        term(1, 1.0, &[0, 1, 2]),
        term(0, 1.0, &[1]),
        term(1, 1.0, &[1]),
        term(2, 1.0, &[1]),
    ];
    let heads = [[0, 0, 2, 0], [1, zero, 2, 0], [2, 2, 0, 1]];
    let words = [[1, 2], [2, one], [1, 0], [2, one], [1, 0]];
    assert_eq!(put_aside(&draft), (heads.into(), words.into()));
    // A single value, none, and a constant.
    draft.terms = std::vec![term(2, 1.0, &[]), term(0, 1.0, &[1])];
    let heads = [[2, zero, 1, 0], [0, 1, 0, 0], [1, zero, 0, 0]];
    assert_eq!(put_aside(&draft), (heads.into(), [[one, one]].into()));
}

#[test]
fn what_is_put_in_beyond_its_number_is_refused_with_the_number_there_would_be() {
    let blob = AlignedBlob::from_bytes(&[0; 32]);
    let mut plan = Plan::<Small>::EMPTY;
    let axis = GridAxis {
        input: 0,
        start: 0.0,
        step: 1.0,
        points: 2,
        modulo: false,
    };
    let line = Bank {
        input: 0,
        start: 0.0,
        step: 1.0,
        points: 2,
        modulo: false,
        direction: Direction::Both,
        interpolation: Interpolation::Linear,
        format: SampleFormat::F32,
        tables: 1,
        first: 0,
    };
    let result = plan.fill(&blob, |filling| {
        filling.axes(3)?;
        filling.samples([2, 0]);
        filling.bank(0, &line)?.end()?;
        filling.end_banks()?;
        let mut term = filling.term(4, 0, 1.0, None)?;
        for _ in 0..FACTORS {
            term.factor(0)?;
        }
        let found = FACTORS as u32 + 1;
        let refused = LoadError::TooManyFactors { term: 4, found };
        assert_eq!(term.factor(0), Err(refused));
        let inputs = |found| LoadError::GridInputs { grid: 1, found };
        let mut grid = filling.grid(1, 2)?;
        grid.input(&axis)?;
        grid.input(&axis)?;
        assert_eq!(grid.input(&axis).err(), Some(inputs(3)));
        let mut grid = filling.grid(1, 3)?;
        grid.input(&axis)?;
        grid.input(&axis)?;
        assert_eq!(grid.end(0), Err(inputs(2)));
        Ok(32)
    });
    // The samples that were taken are not there.
    assert!(matches!(result, Err(LoadError::SectionLength { .. })));
    assert_empty(&plan);
}
