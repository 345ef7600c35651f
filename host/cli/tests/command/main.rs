//! The command `trueaxis`, as a user runs it.

mod bad_blobs;
mod bad_errors;
mod bad_machines;
mod bad_positions;
mod ballbar;
mod cec;
mod endless;
mod gcode;
mod hints;
mod identify;
mod large_files;
mod linuxcnc;
mod measured;
mod mistakes;
mod outside;
mod plan;
mod pose;
mod program;
mod report;
mod results;
mod schemes;
mod sets;
mod shown;
mod targets;
mod uncertainty;
mod writing;
