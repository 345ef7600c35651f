//! What is counted on a Cortex-M4F, and the most that each may be.

/// Calls that are counted: key, most instructions (0: no limit), title.
const CALLS: &str = "\
evaluate_huron13              390 evaluate: 13 errors, five axes
evaluate_huron13_5_axes         0   with capacities for five axes
evaluate_huron13_direction    390   for the direction of the tool
evaluate_kolibri10_direction    0   the same, 10 errors of the Kolibri
servo_update_huron13          675 servo update: the same
servo_update_huron13_5_axes     0   with capacities for five axes
servo_long_huron13              0 servo update in a ramp
servo_long_huron13_5_axes       0   with capacities for five axes
servo_fade_huron13              0 servo update in a cross-fade
servo_fade_huron13_5_axes       0   with capacities for five axes
servo_thermal_none              0 servo update: one axis, three tables
servo_thermal_2                 0   two of them over temperatures
servo_thermal_2_lag             0   with a lag each
grid25_3out                   205 evaluate: grid 25×25×25, three outputs
document_40_tables            700 evaluate: layout of 40 tables
fik_huron13                   800   by the scheme fik, 13 errors
fik_huron13_5_weights           0   with five weights that can be set
linear_1_table                  0 evaluate: a bank of one linear table
linear_9_tables                 0   of nine
cubic_1_table                   0 evaluate: a bank of one cubic table
cubic_9_tables                  0   of nine
generated_huron13               0 generated: 13 errors, five axes
generated_huron13_direction   200   for the direction of the tool
generated_kolibri10_direction 350   the same, 10 errors of the Kolibri
generated_document_40_tables  350   layout of 40 tables
rival_closed_form_libm          0 instead: closed form, libm
rival_closed_form_micromath     0 instead: closed form, micromath
rival_htm_nalgebra              0 instead: matrices, nalgebra f32
rival_exact_correction          0 instead: reference correction, f64, libm";

/// The rows of this table: key, title, most instructions.
pub fn calls() -> impl Iterator<Item = (&'static str, &'static str, u64)> {
    CALLS.lines().filter_map(|line| {
        let (key, rest) = line.split_once(' ')?;
        let (most, title) = rest.trim_start().split_once(' ')?;
        Some((key, title, most.parse().ok()?))
    })
}

/// The figure that the rivals are compared with.
pub const OURS: &str = "evaluate_huron13";
/// Maximum instructions of any update of a kind.
pub const MOST: [(&str, u64); 2] = [("servo_long_huron13", 1250), ("servo_fade_huron13", 2280)];
/// Instructions of an update for each of two lags: key, and the updates with and without them.
pub const LAG: (&str, [&str; 2]) = ("servo_lag", ["servo_thermal_2_lag", "servo_thermal_2"]);
/// Maximum of it.
pub const LAG_MOST: u64 = 60;
/// Maximum stack of any of our calls, bytes.
pub const STACK: u64 = 1024;
/// Maximum size of the code that runs in the servo loop, bytes.
pub const CODE: u64 = 16 * 1024;
/// Maximum flash including loading, bytes.
pub const FLASH: u64 = 34 * 1024;
/// Maximum flash of the whole firmware for the STM32F405, without tables, bytes: code and initial values.
pub const IMAGE: u64 = 72 * 1024;

/// All limits: the key of a figure, and the most that it may be (0: no limit).
pub fn limits() -> Vec<(String, u64)> {
    let typical = calls().map(|(key, _, budget)| (key.to_owned(), budget));
    let most = MOST.map(|(key, budget)| (format!("{key}_max"), budget));
    let stacks = calls().map(|(key, ..)| (format!("stack_{key}"), STACK));
    let code = [
        (LAG.0, LAG_MOST),
        ("code_servo_update", CODE),
        ("code_runtime", FLASH),
        ("image_stm32f405", IMAGE),
    ];
    let code = code.map(|(key, budget)| (key.to_owned(), budget));
    typical.chain(most).chain(stacks).chain(code).collect()
}
