//! The variables of the controller, and the tables that they belong to.

use std::fmt;

/// The family of a variable.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum VariableFamily {
    Table,
    Encoder,
}

/// The table of a variable.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum TableKey {
    /// A table by its index.
    Table(usize),
    /// The table of an encoder of an axis.
    Encoder { axis: usize, encoder: usize },
}

impl TableKey {
    fn family(self) -> VariableFamily {
        match self {
            Self::Table(_) => VariableFamily::Table,
            Self::Encoder { .. } => VariableFamily::Encoder,
        }
    }
}

impl fmt::Display for TableKey {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Table(number) => write!(f, "table {number}"),
            Self::Encoder { encoder, .. } => write!(f, "the compensation of encoder {encoder}"),
        }
    }
}

/// A variable of a table.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Setting {
    Value,
    Input,
    Output,
    Step,
    Min,
    Max,
    Modulo,
    Direction,
    Times,
    Weight,
    Enable,
}

const TABLE: VariableFamily = VariableFamily::Table;
const ENCODER: VariableFamily = VariableFamily::Encoder;
const NAMES: [(Setting, VariableFamily, &str); 17] = [
    (Setting::Value, TABLE, "$AN_CEC"),
    (Setting::Input, TABLE, "$AN_CEC_INPUT_AXIS"),
    (Setting::Output, TABLE, "$AN_CEC_OUTPUT_AXIS"),
    (Setting::Step, TABLE, "$AN_CEC_STEP"),
    (Setting::Min, TABLE, "$AN_CEC_MIN"),
    (Setting::Max, TABLE, "$AN_CEC_MAX"),
    (Setting::Modulo, TABLE, "$AN_CEC_IS_MODULO"),
    // In one place, the manual uses this name.
    (Setting::Modulo, TABLE, "$AA_CEC_COMP_IS_MODULO"),
    (Setting::Direction, TABLE, "$AN_CEC_DIRECTION"),
    (Setting::Times, TABLE, "$AN_CEC_MULT_BY_TABLE"),
    (Setting::Weight, TABLE, "$SN_CEC_TABLE_WEIGHT"),
    (Setting::Enable, TABLE, "$SN_CEC_TABLE_ENABLE"),
    (Setting::Value, ENCODER, "$AA_ENC_COMP"),
    (Setting::Step, ENCODER, "$AA_ENC_COMP_STEP"),
    (Setting::Min, ENCODER, "$AA_ENC_COMP_MIN"),
    (Setting::Max, ENCODER, "$AA_ENC_COMP_MAX"),
    (Setting::Modulo, ENCODER, "$AA_ENC_COMP_IS_MODULO"),
];

impl Setting {
    /// The setting with a name in capitals, and the family of the variable.
    pub fn of(name: &str) -> Option<(Self, VariableFamily)> {
        let found = NAMES.iter().find(|(_, _, known)| *known == name);
        found.map(|(setting, family, _)| (*setting, *family))
    }

    pub fn name(self, key: TableKey) -> &'static str {
        let is_it = |of: Self, family| of == self && family == key.family();
        let found = NAMES.iter().find(|(of, family, _)| is_it(*of, *family));
        found.map_or("", |(_, _, name)| name)
    }
}
