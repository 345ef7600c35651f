use std::vec::Vec;

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

/// Checks the guarantees independently on the finished plan.
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
    let assert_direct = |span: &Span, plain: bool| {
        let direct = if plain && !span.is_modulo() {
            span.last as f32
        } else {
            0.0
        };
        assert_eq!(span.direct, direct, "2");
    };
    let floats = plan.floats().map(<[f32]>::len);
    let length = |integer: bool| {
        if integer {
            plan.shorts().map(<[i16]>::len)
        } else {
            floats
        }
    };
    let mut next_table = 0;
    for bank in plan.banks() {
        let reads = if bank.cubic { 4 } else { 2 };
        assert_span(&bank.span, reads);
        assert!(bank.span.last + 1 >= reads, "2");
        if bank.direction != Direction::Both {
            assert!(usize::from(bank.span.slot) < axes, "1");
        }
        let plain = !bank.cubic && !bank.integer && bank.direction == Direction::Both;
        assert_direct(&bank.span, plain);
        let end = bank.first as usize + bank.span.points() as usize * usize::from(bank.tables);
        assert!(
            bank.tables >= 1 && end <= length(bank.integer).unwrap(),
            "3"
        );
        if bank.straight {
            assert!(bank.tables == 1 && bank.span.direct == 1.0, "2");
            let samples = &plan.floats().unwrap()[bank.first as usize..];
            assert_eq!(bank.line, [samples[0], samples[1] - samples[0]]);
        }
        assert_eq!(bank.table, next_table, "4");
        next_table += bank.tables;
    }
    assert!(usize::from(next_table) <= tables, "4");
    assert!(plan.tables() <= next_table, "4");
    assert!(plan.scales().len() >= usize::from(next_table), "4");

    for term in plan.terms() {
        let used = usize::from(term.count);
        assert!(used <= FACTORS && usize::from(term.output) < axes, "5");
        let used = &term.factors[..used];
        assert!(used.iter().all(|&f| u16::from(f) < plan.tables()), "5");
        assert!(
            term.place == FIXED || usize::from(term.place) < ADJUSTABLE,
            "5"
        );
    }
    let (mut before, mut next) = (0, plan.others());
    while next != 0 {
        assert!(
            next > before && usize::from(next) <= plan.terms().len(),
            "6"
        );
        before = next;
        next = plan.terms()[usize::from(next) - 1].next;
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
        let plain = !grid.integer && width == PLAIN_WIDTH && grid.spans[0].last >= 1;
        for span in &grid.spans {
            assert_direct(span, plain);
        }
    }
    let sums = plan.sums();
    assert!(sums.is_empty() == plan.terms().is_empty(), "8");
    assert!(sums.len() <= axes, "8");
    // Indices of tables, or of the 1 and the 0 after the table capacity.
    let named = |byte: u32, after: usize| {
        let place = byte as usize / 4;
        byte.is_multiple_of(4) && (place < usize::from(plan.tables()) || place == tables + after)
    };
    assert!(sums.iter().all(|sum| named(sum.first.into(), 1)), "8");
    let products = sums.iter().map(|sum| usize::from(sum.products)).sum();
    assert_eq!(plan.products().len(), products, "8");
    for product in plan.products() {
        assert!(named(product & 0xFFFF, 0) && named(product >> 16, 0), "8");
    }
    if !plan.banks().is_empty() || !plan.grids().is_empty() {
        assert!(plan.floats().is_some() && plan.shorts().is_some(), "9");
    }
}

fn assert_empty(plan: &Plan<'_, Small>) {
    assert!(plan.banks().is_empty() && plan.grids().is_empty() && plan.terms().is_empty());
    assert!(plan.sums().is_empty() && plan.products().is_empty() && plan.scales().is_empty());
    assert!(plan.floats().is_none() && plan.shorts().is_none());
    assert!(plan.tables() == 0 && plan.others() == 0);
    assert_eq!(plan.weights(), &Weights::empty());
}

fn fill<'a>(plan: &mut Plan<'a, Small>, blob: &'a [u8]) -> Result<(), LoadError> {
    let mut contents = Contents::EMPTY;
    plan.fill(blob, |filling| blob::read(blob, filling, &mut contents))
}

/// Drafts that contain everything a plan can have.
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

/// Adds items wherever possible and ignores all errors.
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
                // Left unfinished, then with more tables than fit.
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
                // More than fit.
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
                    filled += usize::from(!plan.banks().is_empty());
                }
                Err(_) => assert_empty(&plan),
            }
        }
    }
    assert!(filled > 100, "{filled}");
}

/// First value and number of products of each sum, and the products, by table indices; then the other terms.
type Divided = (Vec<[u16; 2]>, Vec<[u32; 2]>, Vec<u16>);

fn divided(draft: &Draft) -> Divided {
    let blob = draft.encode().unwrap();
    let mut plan = Plan::EMPTY;
    fill(&mut plan, &blob).unwrap();
    assert_guarantees(&plan);
    let sums = plan.sums().iter();
    let sums = sums.map(|sum| [sum.first / 4, sum.products]);
    let products = plan.products().iter();
    let products = products.map(|product| [(product & 0xFFFF) / 4, (product >> 16) / 4]);
    let mut others = Vec::new();
    let mut next = plan.others();
    while next != 0 {
        others.push(next - 1);
        next = plan.terms()[usize::from(next) - 1].next;
    }
    (sums.collect(), products.collect(), others)
}

#[test]
fn a_sum_is_the_leading_terms_of_weight_1_and_up_to_two_factors() {
    // They follow the capacity for tables.
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
        // The terms that end the sum, and terms that would belong to it if they came before these.
        adjustable(2, 1.0, [0.0, 1.0], &[0]),
        term(0, 2.0, &[0]),
        term(1, 1.0, &[0, 1, 2]),
        term(0, 1.0, &[1]),
        term(1, 1.0, &[1]),
        term(2, 1.0, &[1]),
    ];
    let sums = [[0, 2], [zero, 2], [2, 1]];
    let products = [[1, 2], [2, one], [1, 0], [2, one], [1, one]];
    let others = [7, 8, 9, 10, 11, 12];
    assert_eq!(
        divided(&draft),
        (sums.into(), products.into(), others.into())
    );
    // A single value, none, and a constant.
    draft.terms = std::vec![term(2, 1.0, &[]), term(0, 1.0, &[1])];
    let sums = [[1, 0], [zero, 0], [zero, 1]];
    let expected = (sums.into(), [[one, one]].into(), [].into());
    assert_eq!(divided(&draft), expected);
    draft.terms.clear();
    assert_eq!(divided(&draft), Default::default());
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
    // The samples that were claimed do not exist.
    assert!(matches!(result, Err(LoadError::SectionLength { .. })));
    assert_empty(&plan);
}
