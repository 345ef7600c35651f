//! Programs that nobody wrote, corrected and read anew: within the tolerance, with their times, and without the mistakes
//! that a writer might make.

mod drawn;
mod mutations;
mod random;
mod random_cycles;
mod random_tips;
