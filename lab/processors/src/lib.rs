//! Other processors than this computer's: compilers for them, QEMU in their place, what their programs consist of, and
//! the firmware of the boards.

pub mod cross;
pub mod elf;
pub mod figures;
pub mod hil;
pub mod qemu;
