//! What the short way looks at of every axis, before and after the evaluation: masks, bit 0 is the first axis.

#[cfg(all(target_arch = "arm", target_abi = "eabihf"))]
mod cortex_m;

use super::lane::Lane;

/// Follows the axes that move on in their direction; the others.
#[inline(always)]
pub(super) fn turning(lanes: &mut [Lane], positions: &[f32]) -> u32 {
    #[cfg(all(target_arch = "arm", target_abi = "eabihf"))]
    {
        if lanes.len() > positions.len() {
            return all();
        }
        // SAFETY: just compared.
        if unsafe { cortex_m::all_move_on(lanes, positions) } {
            return 0;
        }
    }
    let mut turning = 0;
    for (k, (lane, &q)) in lanes.iter_mut().zip(positions).enumerate() {
        let along = q * lane.sense;
        // Not-a-number fails the comparisons.
        if along >= lane.front && along <= lane.end {
            lane.front = along;
        } else {
            turning |= 1 << k;
        }
    }
    turning
}

/// The axes whose corrections a rail may limit: the `last` ones, and those of this period.
#[inline(always)]
pub(super) fn limited(lanes: &[Lane], last: &[f32], corrections: &[f32]) -> u32 {
    #[cfg(all(target_arch = "arm", target_abi = "eabihf"))]
    {
        if lanes.len() > last.len().min(corrections.len()) {
            return all();
        }
        // SAFETY: just compared.
        if unsafe { cortex_m::all_are_free(lanes, last, corrections) } {
            return 0;
        }
    }
    let mut limited = 0;
    let values = last.iter().zip(corrections);
    for (k, (lane, (&last, &dq))) in lanes.iter().zip(values).enumerate() {
        let free = dq.abs() <= lane.free;
        if !(free && (dq - last).abs() <= lane.most) {
            limited |= 1 << k;
        }
    }
    limited
}

/// All axes: nothing is steady. It does not come to that, for there are as many values as there can be axes.
#[cfg(all(target_arch = "arm", target_abi = "eabihf"))]
#[cold]
fn all() -> u32 {
    !0
}
