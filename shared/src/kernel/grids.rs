//! The grids, which are added to the sums of products.

use super::{Sample, all, any_interval, interval, line, steps};
use crate::access::{Cursor, at, at_mut};
use crate::inputs::Inputs;
use crate::plan::{GridLookup, PLAIN_WIDTH, Plan};
use crate::room::{Room, Row};

/// Adds all grids to their outputs.
#[inline(always)]
pub fn add_grids<C: Room>(
    plan: &Plan<'_, C>,
    inputs: &Inputs<C::Axes<f32>>,
    corrections: &mut C::Axes<f32>,
) {
    for grid in plan.grids() {
        let floats = Cursor::start_of(plan.floats());
        if !add_cell(grid, inputs, floats, corrections) {
            add_grid(plan, grid, inputs, corrections);
        }
    }
}

/// Adds a grid of the plain kind, see [`GridLookup`], where it can be read directly. Returns false and adds nothing at
/// and beyond the ends of an input, for NaN, and for a grid of another kind.
///
/// # Operations
/// As for [`add_grid`].
#[inline(never)]
fn add_cell<A: Row<f32>>(
    grid: &GridLookup,
    inputs: &Inputs<A>,
    samples: Cursor<'_, f32>,
    corrections: &mut A,
) -> bool {
    const WIDTH: usize = PLAIN_WIDTH;
    let mut start = grid.first as usize;
    macro_rules! along {
        ($k:literal) => {{
            let span = &grid.spans[$k];
            // SAFETY: guarantee 1.
            let x = unsafe { *at(all(inputs), usize::from(span.slot)) };
            let Some(steps) = steps(span, x) else {
                return false;
            };
            // SAFETY: the values come from `steps`.
            let (i, t) = unsafe { interval(steps) };
            start += i * grid.strides[$k] as usize;
            t
        }};
    }
    let t = [along!(0), along!(1), along!(2)];
    let (far, middle) = (grid.strides[0] as usize, grid.strides[1] as usize);
    // SAFETY: guarantees 2 and 3: each index is below `last`, so all eight nodes are in the grid, in pairs of
    // neighbours; guarantee 7.
    unsafe {
        let near = samples.skip(start);
        let far = near.skip(far);
        let [near_far, far_far] = [near.skip(middle), far.skip(middle)];
        // Written out, so that no optimisation level turns it into a loop.
        let [u, v, w] = t;
        macro_rules! output {
            ($k:literal) => {
                let a = line(near.at($k), near.at($k + WIDTH), w);
                let b = line(near_far.at($k), near_far.at($k + WIDTH), w);
                let c = line(far.at($k), far.at($k + WIDTH), w);
                let d = line(far_far.at($k), far_far.at($k + WIDTH), w);
                let value = line(line(a, b, v), line(c, d, v), u);
                *at_mut(corrections.as_mut(), usize::from(grid.outputs[$k])) += value;
            };
        }
        output!(0);
        output!(1);
        output!(2);
    }
    true
}

/// Adds a grid of any kind, at any position.
///
/// # Operations
/// a + (b − a)·t along the last input, then the middle, then the first: seven times per output.
///
/// # Memory
/// Eight nodes of `width` neighbouring samples.
///
/// # Timing
/// Independent of the position, except for wrapping.
#[cold]
#[inline(never)]
fn add_grid<C: Room>(
    plan: &Plan<'_, C>,
    grid: &GridLookup,
    inputs: &Inputs<C::Axes<f32>>,
    corrections: &mut C::Axes<f32>,
) {
    // SAFETY: guarantee 1.
    let x = grid
        .spans
        .map(|span| unsafe { *at(all(inputs), usize::from(span.slot)) });
    if grid.integer {
        add_nodes(grid, x, plan.shorts().unwrap_or_default(), corrections);
    } else {
        add_nodes(grid, x, plan.floats().unwrap_or_default(), corrections);
    }
}

fn add_nodes<S: Sample, A: Row<f32>>(
    grid: &GridLookup,
    x: [f32; 3],
    samples: &[S],
    corrections: &mut A,
) {
    let mut near = [0_usize; 3];
    let mut far = [0_usize; 3];
    let mut t = [0.0_f32; 3];
    for k in 0..3 {
        let (i, next, fraction) = any_interval(&grid.spans[k], x[k]);
        near[k] = i as usize * grid.strides[k] as usize;
        far[k] = next as usize * grid.strides[k] as usize;
        t[k] = fraction;
    }
    let width = usize::from(grid.width);
    let first = grid.first as usize;
    let node = |a: usize, b: usize, c: usize| {
        let start = first + a + b + c;
        debug_assert!(start + width <= samples.len());
        // SAFETY: guarantees 2 and 3: each index is at most `last`, so the node is in the grid.
        unsafe { Cursor::start(samples).skip(start) }
    };
    let nodes = [
        node(near[0], near[1], near[2]),
        node(near[0], near[1], far[2]),
        node(near[0], far[1], near[2]),
        node(near[0], far[1], far[2]),
        node(far[0], near[1], near[2]),
        node(far[0], near[1], far[2]),
        node(far[0], far[1], near[2]),
        node(far[0], far[1], far[2]),
    ];
    // Repeats the bound of guarantee 7 for the compiler.
    for k in 0..width.min(grid.outputs.len()) {
        // SAFETY: k < width, and each node has `width` samples of the section.
        let v = nodes.map(|node| unsafe { node.at(k) }.value());
        let face0 = line(line(v[0], v[1], t[2]), line(v[2], v[3], t[2]), t[1]);
        let face1 = line(line(v[4], v[5], t[2]), line(v[6], v[7], t[2]), t[1]);
        let value = S::scaled(line(face0, face1, t[0]), grid.scales[k]);
        let output = usize::from(grid.outputs[k]);
        debug_assert!(output < corrections.as_ref().len());
        // SAFETY: guarantee 7.
        unsafe { *at_mut(corrections.as_mut(), output) += value };
    }
}
