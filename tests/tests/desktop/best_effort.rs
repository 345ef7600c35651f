//! Best effort, on the examples. On random machines: `cargo xtask random-machines --best-effort 30`.

use trueaxis_tests::{best_effort, errors, machine, usual_or_all};

#[test]
fn a_finer_tolerance_leaves_no_more_than_a_coarser_one() {
    let mut missed = 0;
    let examples = [
        ("kolibri", "errors-10"),
        ("router", "errors-10"),
        ("mill-21", "errors-21"),
        ("fork-head", "errors-13"),
        ("table-head", "errors-13"),
    ];
    for (folder, errors_file) in &examples[..usual_or_all(2, examples.len())] {
        let machine = machine(&format!("examples/{folder}/machine.toml"));
        let errors = errors(&format!("examples/{folder}/{errors_file}.toml"), &machine);
        missed += u32::from(best_effort::is_finer_missed(folder, &machine, &errors));
    }
    assert!(missed >= usual_or_all(1, 3), "{missed}");
}
