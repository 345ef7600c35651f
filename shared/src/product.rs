//! The contribution of a term to its output: weight · factor · factor …, from left to right, then one addition. The
//! order is part of the format. The kernel repeats this code for the terms that it adds first, those with weight 1 and
//! up to two factors.

/// Adds the term to `total`.
#[inline(always)]
pub(crate) fn add(total: f32, weight: f32, factors: impl IntoIterator<Item = f32>) -> f32 {
    add_seen(total, weight, factors, |_| {})
}

/// Adds the term to `total`; `seen` receives the weight and every intermediate product.
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
