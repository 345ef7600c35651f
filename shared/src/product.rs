//! What a term adds to its output: weight · factor · factor …, from left to right, then one addition. The
//! order is part of the format. The kernel writes it out once more for the terms that it adds first, of weight 1
//! and two factors.

/// `total` and the term.
#[inline(always)]
pub(crate) fn add(total: f32, weight: f32, factors: impl IntoIterator<Item = f32>) -> f32 {
    add_seen(total, weight, factors, |_| {})
}

/// `total` and the term; `seen` is shown the weight and every product on the way.
#[inline(always)]
pub(crate) fn add_seen(
    total: f32,
    weight: f32,
    factors: impl IntoIterator<Item = f32>,
    mut seen: impl FnMut(f32),
) -> f32 {
    let mut product = weight;
    seen(product);
    for factor in factors {
        product *= factor;
        seen(product);
    }
    total + product
}
