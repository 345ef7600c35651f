//! What users open in a browser: reports, and the page with the command in it.

pub mod report;
pub mod web;
