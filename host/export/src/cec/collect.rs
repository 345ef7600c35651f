//! Collects all tables of one output axis.

use super::function::{AxisFunction, Origin};
use super::spacing::Spacing;
use super::{CecTable, FactorTables, TravelDirection};
use std::collections::BTreeMap;

/// A term in a form that the controller supports.
#[derive(Clone, Debug)]
pub enum Normal {
    Constant(f64),
    /// A function, its weight, and whether the weight can be set at run time.
    Plain(AxisFunction, f64, bool),
    Product(AxisFunction, AxisFunction, f64),
}

/// A table in the making, with values in f64.
#[derive(Clone, Debug)]
struct DraftTable {
    input: usize,
    spacing: Spacing,
    travel: TravelDirection,
    values: Vec<f64>,
    /// Its weight can be set on the controller, so it stays a table of its own. As compiled, the weight is 1: a controller
    /// that loses it must not add larger values.
    adjustable: bool,
}

/// A factor, and everything that it is multiplied by.
struct FactorGroup {
    named: AxisFunction,
    by: Vec<DraftTable>,
}

impl FactorGroup {
    /// Largest magnitude of everything that the factor is multiplied by.
    fn peak(&self) -> f64 {
        self.by.iter().map(DraftTable::peak).fold(0.0, f64::max)
    }

    /// The smallest limit that both can keep, however magnitude is shifted between them; 0 if the product is always
    /// 0.
    ///
    /// With p the product of both peaks: L² = p, or L·(L − 1) = p if 1 is subtracted from the other one.
    fn least_limit(&self, tables: FactorTables) -> f64 {
        let product = self.named.peak() * self.peak();
        match tables {
            _ if product == 0.0 => 0.0,
            FactorTables::NotAdded => product.sqrt(),
            FactorTables::Added => 0.5 + (0.25 + product).sqrt(),
        }
    }
}

/// Everything that corrects one axis.
#[derive(Debug, Default)]
pub struct Output {
    constant: f64,
    plain: Vec<DraftTable>,
    products: Vec<(AxisFunction, AxisFunction, f64)>,
}

/// Limits of factors.
#[derive(Clone, Copy, Debug)]
pub struct Factors {
    pub tables: FactorTables,
    /// Largest magnitude of a factor.
    pub limit: f64,
}

impl DraftTable {
    fn new(function: &AxisFunction, weight: f64) -> Self {
        Self {
            input: function.input,
            spacing: function.spacing,
            travel: function.travel,
            values: function.values.iter().map(|v| v * weight).collect(),
            adjustable: false,
        }
    }

    fn peak(&self) -> f64 {
        self.values.iter().fold(0.0, |peak, v| v.abs().max(peak))
    }

    fn table(&self, output: usize, times: Option<usize>) -> CecTable {
        CecTable {
            input: self.input,
            output,
            spacing: self.spacing,
            values: self.values.iter().map(|v| *v as f32).collect(),
            travel: self.travel,
            weight: 1.0,
            times,
        }
    }
}

/// Adds a column to one with the same points, or appends it.
fn add(columns: &mut Vec<DraftTable>, column: DraftTable) {
    let is_same = |c: &&mut DraftTable| {
        let same = (c.input, c.spacing, c.travel) == (column.input, column.spacing, column.travel);
        same && !c.adjustable && !column.adjustable
    };
    match columns.iter_mut().find(is_same) {
        Some(known) => {
            for (a, b) in known.values.iter_mut().zip(&column.values) {
                *a += b;
            }
        }
        None => columns.push(column),
    }
}

impl Output {
    pub fn take(&mut self, term: Normal) {
        match term {
            Normal::Constant(value) => self.constant += value,
            Normal::Plain(function, weight, true) => self.plain.push(DraftTable {
                adjustable: true,
                ..DraftTable::new(&function, weight)
            }),
            Normal::Plain(function, weight, false) => {
                add(&mut self.plain, DraftTable::new(&function, weight));
            }
            Normal::Product(one, other, weight) => self.products.push((one, other, weight)),
        }
    }

    /// The smallest limit that all factors of the axis can keep (mm, deg).
    pub(crate) fn least_limit(&self, tables: FactorTables) -> f64 {
        let groups = self.groups();
        let limits = groups.iter().map(|group| group.least_limit(tables));
        limits.fold(0.0, f64::max)
    }

    /// The tables of the axis, appended to the existing ones; `travel` is that of the axis (mm, deg). The limit of
    /// factors is at least [`least_limit`](Self::least_limit).
    pub fn tables(
        mut self,
        output: usize,
        travel: [f64; 2],
        factors: Factors,
        tables: &mut Vec<CecTable>,
    ) {
        let mut products = Vec::new();
        for group in self.groups() {
            products.extend(self.scaled(group, factors));
        }
        self.settle_constant(output, travel);
        self.plain.retain(|c| c.peak() != 0.0);
        tables.extend(self.plain.iter().map(|column| column.table(output, None)));
        for (named, by) in products {
            let place = tables.len();
            tables.push(named.table(output, None));
            tables.extend(by.iter().map(|column| column.table(output, Some(place))));
        }
    }

    /// Products grouped by the factor that they share.
    fn groups(&self) -> Vec<FactorGroup> {
        let mut uses: BTreeMap<Origin, usize> = BTreeMap::new();
        for (one, other, _) in &self.products {
            for function in [one, other] {
                *uses.entry(function.origin.clone()).or_default() += 1;
            }
        }
        let mut groups: Vec<FactorGroup> = Vec::new();
        for (one, other, weight) in &self.products {
            let of = |f: &AxisFunction| (uses[&f.origin], std::cmp::Reverse(f.spacing.points));
            // Whether a factor counts against its own direction is not documented: it holds in both, if one of them does.
            let is_one_way = |f: &AxisFunction| f.travel != TravelDirection::Both;
            let turned = match is_one_way(one) == is_one_way(other) {
                true => of(other) > of(one),
                false => is_one_way(one),
            };
            let (named, by) = if turned { (other, one) } else { (one, other) };
            let column = DraftTable::new(by, *weight);
            match groups
                .iter_mut()
                .find(|g| g.named.origin == named.origin && g.named.spacing == named.spacing)
            {
                Some(group) => add(&mut group.by, column),
                None => groups.push(FactorGroup {
                    named: named.clone(),
                    by: vec![column],
                }),
            }
        }
        groups
    }

    /// Scales a product: the factor in mm or degrees, and what it is multiplied by at most 1, or larger if only that
    /// keeps the factor within its limit. `None` if the product is zero.
    fn scaled(
        &mut self,
        mut group: FactorGroup,
        Factors { tables, limit }: Factors,
    ) -> Option<(DraftTable, Vec<DraftTable>)> {
        group.by.retain(|column| column.peak() > 0.0);
        let (own, peak) = (group.named.peak(), group.peak());
        if peak == 0.0 || own == 0.0 {
            return None;
        }
        let most = match tables {
            FactorTables::Added => limit - 1.0,
            FactorTables::NotAdded => limit,
        };
        // A power of two changes no digits. If that makes the factor too large, use the smallest scale that does
        // not.
        let usual = libm::exp2(libm::log2(peak / most.min(1.0)).ceil());
        let scale = if own * usual <= limit {
            usual
        } else {
            peak / most
        };
        let named = DraftTable::new(&group.named, scale);
        for column in &mut group.by {
            column.values.iter_mut().for_each(|v| *v /= scale);
        }
        if tables == FactorTables::Added {
            // f·(g − 1) + f = f·g. If g holds for one direction only, −f subtracts it.
            let mut columns = group.by.iter_mut();
            match columns.find(|c| c.travel == TravelDirection::Both) {
                Some(column) => column.values.iter_mut().for_each(|v| *v -= 1.0),
                None => {
                    let mut off = named.clone();
                    off.values.iter_mut().for_each(|v| *v = -*v);
                    add(&mut self.plain, off);
                }
            }
        }
        Some((named, group.by))
    }

    /// Adds the constant to a table that holds in both directions, or makes one.
    fn settle_constant(&mut self, output: usize, travel: [f64; 2]) {
        if self.constant == 0.0 {
            return;
        }
        let holds = |c: &&mut DraftTable| c.travel == TravelDirection::Both && !c.adjustable;
        match self.plain.iter_mut().find(holds) {
            Some(column) => column.values.iter_mut().for_each(|v| *v += self.constant),
            None => self.plain.push(DraftTable {
                input: output,
                spacing: Spacing {
                    start: travel[0] as f32,
                    step: (travel[1] - travel[0]) as f32,
                    points: 2,
                    modulo: false,
                },
                travel: TravelDirection::Both,
                values: vec![self.constant; 2],
                adjustable: false,
            }),
        }
    }
}
