//! Tests across host crates, in one program.

mod best_effort;
mod claims;
mod clearance;
mod direct;
mod eq42;
mod explain;
mod golden;
mod golden_blobs;
mod identify;
mod identify_auto;
mod identify_checks;
mod identify_machines;
mod interpn_oracle;
mod linearised;
mod linuxcnc;
mod measured_examples;
mod measurement;
mod observations;
mod plan;
mod policies;
mod schemes;
mod shown_output;
mod singular_path;
mod targets;
mod thermal;
mod zero_at;
