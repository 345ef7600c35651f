//! Limits how often the slots may be erased.

/// Maximum number of slot erases within an hour: a program that uploads endlessly then needs two weeks, not an
/// afternoon, for the 10 000 erases that flash endures.
pub const ERASES_PER_HOUR: usize = 30;
const HOUR: u32 = 3600;

/// Times of the last slot erases, s since start. Empty after every start.
#[derive(Clone, Debug)]
pub(super) struct Budget {
    times: heapless::Deque<u32, ERASES_PER_HOUR>,
}

impl Budget {
    pub const NEW: Self = Self {
        times: heapless::Deque::new(),
    };

    /// How long the next erase must wait, s; 0 if it need not wait.
    pub fn wait(&self, now: u32) -> u32 {
        let oldest = self.times.front().filter(|_| self.times.is_full());
        oldest.map_or(0, |&oldest| HOUR.saturating_sub(now.wrapping_sub(oldest)))
    }

    /// Records an erase of the slots.
    pub fn spend(&mut self, now: u32) {
        if self.times.is_full() {
            self.times.pop_front();
        }
        let kept = self.times.push_back(now);
        debug_assert!(kept.is_ok(), "there is room: the oldest has gone");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn within_any_hour_there_are_no_more_erases_than_allowed() {
        let mut budget = Budget::NEW;
        let mut times = std::vec::Vec::new();
        // As fast as possible, with occasional pauses, across the wrap.
        let mut now = u32::MAX - 5000;
        for number in 0..400_u32 {
            now = now.wrapping_add(number * 37 % 150);
            now = now.wrapping_add(budget.wait(now));
            assert_eq!(budget.wait(now), 0);
            budget.spend(now);
            times.push(now);
        }
        for window in times.windows(ERASES_PER_HOUR + 1) {
            let span = window[ERASES_PER_HOUR].wrapping_sub(window[0]);
            assert!(span >= HOUR, "{span} s");
        }
        // But no fewer: two thirds of an hour per thirty erases, so each thirty had to wait once, exact to the second.
        let full = |w: &&[u32]| w[ERASES_PER_HOUR].wrapping_sub(w[0]) == HOUR;
        assert!(times.windows(ERASES_PER_HOUR + 1).filter(full).count() >= 10);
    }

    #[test]
    fn what_is_left_of_an_hour_is_named() {
        let mut budget = Budget::NEW;
        for number in 0..ERASES_PER_HOUR {
            assert_eq!(budget.wait(100), 0, "{number}");
            budget.spend(number as u32);
        }
        assert_eq!(budget.wait(100), 3500);
        assert_eq!(budget.wait(3599), 1);
        assert_eq!(budget.wait(3600), 0);
        budget.spend(3600);
        assert_eq!(budget.wait(3600), 1);
    }
}
