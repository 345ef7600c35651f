//! The built-in targets equal the capacities of the controllers.

use trueaxis::{Compensation, Largest, Room};
use trueaxis_tables::target::Target;
use trueaxis_tests::read;

/// The text after `before` in a file.
fn behind(file: &str, before: &str) -> String {
    let text = read(file);
    let rest = text.split_once(before).map(|(_, rest)| rest.to_owned());
    rest.unwrap_or_else(|| panic!("{file} has no `{before}`"))
}

/// The number after `before` in a file.
fn number(file: &str, before: &str) -> usize {
    let rest = behind(file, before);
    let digits: String = rest.chars().take_while(char::is_ascii_digit).collect();
    digits.parse().unwrap()
}

#[test]
fn the_boards_are_built_with_the_capacities_of_the_reference_target() {
    let target = Target::stm32f405();
    let capacities = format!(
        "capacities!(axes: AXES, banks: {}, tables: {}, terms: {}, grids: {})",
        target.banks, target.tables, target.terms, target.grids
    );
    for board in ["stm32f405", "stm32h743"] {
        let file = format!("firmware/boards/{board}/src/lib.rs");
        assert_eq!(number(&file, "pub const AXES: usize = "), target.axes);
        assert!(read(&file).contains(&capacities), "{board}");
    }
    let slot = 1024 * number("memory.x", "SLOT_A : ORIGIN = 0x08080000, LENGTH = ");
    let layout = ["pub const TRAILER", "const RESERVED", "pub const CHOICE"];
    let [trailer, reserved, choice] =
        layout.map(|item| number("firmware/src/slots/layout.rs", &format!("{item}: usize = ")));
    assert_eq!(target.bytes, Some(slot - trailer - reserved * choice));
    let other = "firmware/boards/stm32h743/stm32h743.x";
    let other = 1024 * number(other, "SLOT_A : ORIGIN = 0x08100000, LENGTH = ");
    assert_eq!(other, slot, "so that a blob for one fits the other");
    // The manual states the same.
    let row = format!(
        "| {} | {} | {} | {} | {} | 261 760 |",
        target.axes, target.banks, target.tables, target.terms, target.grids
    );
    assert!(read("docs/src/targets.md").contains(&row), "{row}");
}

/// Capacities of a compensation.
fn capacities<C: Room>(_: &Compensation<'_, C>) -> [usize; 5] {
    [C::AXES, C::BANKS, C::TABLES, C::TERMS, C::GRIDS]
}

#[test]
fn the_desktop_holds_as_much_as_a_blob_can() {
    let Target {
        axes,
        banks,
        tables,
        terms,
        grids,
        ..
    } = Target::desktop();
    let largest = Box::new(Largest::empty());
    assert_eq!([axes, banks, tables, terms, grids], capacities(&largest));
    let row = format!("| {axes} | {banks} | {tables} | {terms} | {grids} | no limit |");
    assert!(read("docs/src/targets.md").contains(&row), "{row}");
}
