//! The built-in targets hold what the controllers hold.

use trueaxis::{Compensation, Largest, Room};
use trueaxis_host::target::Target;
use trueaxis_tests::read;

/// The number after `before` in a file.
fn number(file: &str, before: &str) -> usize {
    let text = read(file);
    let (_, rest) = text
        .split_once(before)
        .unwrap_or_else(|| panic!("{file} has no `{before}`"));
    let digits: String = rest.chars().take_while(char::is_ascii_digit).collect();
    digits.parse().unwrap()
}

#[test]
fn the_reference_board_is_built_with_the_capacities_of_its_target() {
    let board = |name: &str| {
        let before = format!("pub const {name}: usize = ");
        number("firmware/boards/stm32f405/src/lib.rs", &before)
    };
    let target = Target::stm32f405();
    assert_eq!(target.axes, board("AXES"));
    assert_eq!(target.banks, board("BANKS"));
    assert_eq!(target.tables, board("TABLES"));
    assert_eq!(target.terms, board("TERMS"));
    assert_eq!(target.grids, board("GRIDS"));
    let slot = 1024 * number("memory.x", "SLOT_A : ORIGIN = 0x08080000, LENGTH = ");
    let trailer = number(
        "firmware/src/slots/layout.rs",
        "pub const TRAILER: usize = ",
    );
    let choices = ["RESERVED", "CHOICE"].map(|name| {
        let item = format!("pub const {name}: usize = ");
        number("firmware/src/slots/choices.rs", &item)
    });
    let [reserved, choice] = choices;
    assert_eq!(target.bytes, Some(slot - trailer - reserved * choice));
    // The manual says so too.
    let row = format!(
        "| {} | {} | {} | {} | {} | 261 760 |",
        target.axes, target.banks, target.tables, target.terms, target.grids
    );
    assert!(read("docs/src/commands.md").contains(&row), "{row}");
}

/// What a compensation has room for.
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
    assert!(read("docs/src/commands.md").contains(&row), "{row}");
}
