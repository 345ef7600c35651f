//! Options for random positions.

use clap::Args;

#[derive(Args, Clone, Copy)]
pub struct RandomOptions {
    /// Number of random positions in each region of the verification
    #[arg(long, value_name = "N", default_value_t = 20_000, value_parser = clap::value_parser!(u32).range(1..=10_000_000))]
    pub random: u32,
    /// Seed of the random positions
    #[arg(long, value_name = "S", default_value_t = 1)]
    pub seed: u64,
}
