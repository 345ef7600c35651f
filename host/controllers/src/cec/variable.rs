//! The variables of the controller, and the tables that they belong to.

/// The family of a variable.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum VariableFamily {
    Table,
    Encoder,
}

/// The table of a variable.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum VariableKey {
    /// A table by its index.
    Table(usize),
    /// The table of an encoder of an axis.
    Encoder { axis: usize, encoder: usize },
}

/// A variable of the compensation.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum KnownVariable {
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

impl KnownVariable {
    /// The variable with a name in capitals.
    pub fn of(name: &str) -> Option<(VariableFamily, Self)> {
        let known = match name {
            "AN_CEC" | "AA_ENC_COMP" => Self::Value,
            "AN_CEC_INPUT_AXIS" => Self::Input,
            "AN_CEC_OUTPUT_AXIS" => Self::Output,
            "AN_CEC_STEP" | "AA_ENC_COMP_STEP" => Self::Step,
            "AN_CEC_MIN" | "AA_ENC_COMP_MIN" => Self::Min,
            "AN_CEC_MAX" | "AA_ENC_COMP_MAX" => Self::Max,
            // In one place, the manual uses the second name.
            "AN_CEC_IS_MODULO" | "AA_CEC_COMP_IS_MODULO" | "AA_ENC_COMP_IS_MODULO" => Self::Modulo,
            "AN_CEC_DIRECTION" => Self::Direction,
            "AN_CEC_MULT_BY_TABLE" => Self::Times,
            "SN_CEC_TABLE_WEIGHT" => Self::Weight,
            "SN_CEC_TABLE_ENABLE" => Self::Enable,
            _ => return None,
        };
        let kind = match name.starts_with("AA_ENC") {
            true => VariableFamily::Encoder,
            false => VariableFamily::Table,
        };
        Some((kind, known))
    }

    pub fn name(self, key: VariableKey) -> &'static str {
        match (self, key) {
            (Self::Value, VariableKey::Table(_)) => "$AN_CEC",
            (Self::Value, VariableKey::Encoder { .. }) => "$AA_ENC_COMP",
            (Self::Input, _) => "$AN_CEC_INPUT_AXIS",
            (Self::Output, _) => "$AN_CEC_OUTPUT_AXIS",
            (Self::Step, VariableKey::Table(_)) => "$AN_CEC_STEP",
            (Self::Step, VariableKey::Encoder { .. }) => "$AA_ENC_COMP_STEP",
            (Self::Min, VariableKey::Table(_)) => "$AN_CEC_MIN",
            (Self::Min, VariableKey::Encoder { .. }) => "$AA_ENC_COMP_MIN",
            (Self::Max, VariableKey::Table(_)) => "$AN_CEC_MAX",
            (Self::Max, VariableKey::Encoder { .. }) => "$AA_ENC_COMP_MAX",
            (Self::Modulo, VariableKey::Table(_)) => "$AN_CEC_IS_MODULO",
            (Self::Modulo, VariableKey::Encoder { .. }) => "$AA_ENC_COMP_IS_MODULO",
            (Self::Direction, _) => "$AN_CEC_DIRECTION",
            (Self::Times, _) => "$AN_CEC_MULT_BY_TABLE",
            (Self::Weight, _) => "$SN_CEC_TABLE_WEIGHT",
            (Self::Enable, _) => "$SN_CEC_TABLE_ENABLE",
        }
    }
}

impl VariableKey {
    /// Name in messages.
    pub fn said(self) -> String {
        match self {
            Self::Table(number) => format!("table {number}"),
            Self::Encoder { encoder, .. } => format!("the compensation of encoder {encoder}"),
        }
    }
}
