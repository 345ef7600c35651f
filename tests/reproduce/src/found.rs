//! The recomputed results: figures beside those of the document, tables, pictures.

use serde::Serialize;
use serde::ser::{SerializeMap, Serializer};
use trueaxis_report::picture::{Bars, Chart, Drawing};

/// A figure, rounded as it is shown.
#[derive(Clone, Debug, PartialEq)]
pub enum Figure {
    /// A number with a fixed number of decimals: rounded, so that it is the same on every system.
    Number {
        /// Value of the number.
        value: f64,
        /// Number of decimals shown.
        decimals: usize,
    },
    /// A count, which is the same on every system.
    Count(u64),
    /// Words.
    Words(String),
    /// No figure.
    Nothing,
}

impl Figure {
    /// A number shown with `decimals` decimals.
    #[must_use]
    pub fn new(value: f64, decimals: usize) -> Self {
        Self::Number { value, decimals }
    }

    /// A count.
    #[must_use]
    pub fn count(count: usize) -> Self {
        Self::Count(count as u64)
    }

    /// The displayed text: `-` for no figure.
    #[must_use]
    pub fn text(&self) -> String {
        match self {
            // Avoids a negative zero.
            Self::Number { value, decimals } => {
                let text = format!("{value:.decimals$}");
                match text.trim_start_matches('-').parse() == Ok(0.0_f64) {
                    true => text.trim_start_matches('-').to_owned(),
                    false => text,
                }
            }
            Self::Count(count) => count.to_string(),
            Self::Words(words) => words.clone(),
            Self::Nothing => "-".to_owned(),
        }
    }
}

impl Serialize for Figure {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Number { .. } => match self.text().parse::<f64>() {
                Ok(value) => to.serialize_f64(value),
                Err(_) => to.serialize_none(),
            },
            Self::Count(count) => to.serialize_u64(*count),
            Self::Words(words) => to.serialize_str(words),
            Self::Nothing => to.serialize_none(),
        }
    }
}

/// What a displacement of the tip at probed balls is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Quantity {
    /// Neither: not such a displacement.
    #[serde(rename = "")]
    Other,
    /// The displacement by the errors of the machine.
    Raw,
    /// Like `Raw`, without the part that another place of the ball and of the stylus would explain.
    SetUpFree,
}

impl Quantity {
    /// The word that the page shows.
    #[must_use]
    pub fn word(self) -> &'static str {
        match self {
            Self::Other => "",
            Self::Raw => "raw",
            Self::SetUpFree => "set-up-free",
        }
    }
}

/// A figure of the document, and its recomputed value.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Compared {
    /// Name of the figure.
    pub what: String,
    /// Which displacement of the tip it is, if it is one.
    pub quantity: Quantity,
    /// The place in the document, if it is not that of the chapter.
    #[serde(skip_serializing_if = "str::is_empty")]
    pub source: &'static str,
    /// Unit, if it has one.
    pub unit: &'static str,
    /// Value in the document.
    pub document: Figure,
    /// Recomputed value, with the same scheme.
    pub ours: Figure,
    /// Value with the scheme `exact`, under the policy *orientation*.
    pub exact_orientation: Figure,
    /// Like `exact_orientation`, under the policy *direction*.
    pub exact_direction: Figure,
    /// Why the two differ, if they do.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub why: Option<&'static str>,
}

impl Compared {
    /// A figure that is independent of the scheme.
    #[must_use]
    pub fn plain(what: impl Into<String>, document: Figure, ours: Figure) -> Self {
        Self {
            what: what.into(),
            quantity: Quantity::Other,
            source: "",
            unit: "",
            document,
            ours,
            exact_orientation: Figure::Nothing,
            exact_direction: Figure::Nothing,
            why: None,
        }
    }

    /// Two numbers with as many decimals.
    #[must_use]
    pub fn numbers(what: impl Into<String>, [document, ours]: [f64; 2], decimals: usize) -> Self {
        Self::plain(
            what,
            Figure::new(document, decimals),
            Figure::new(ours, decimals),
        )
    }

    /// With its unit.
    #[must_use]
    pub fn in_unit(mut self, unit: &'static str) -> Self {
        self.unit = unit;
        self
    }

    /// As a displacement of the tip in µm.
    #[must_use]
    pub fn of(mut self, quantity: Quantity) -> Self {
        self.quantity = quantity;
        self.in_unit("µm")
    }

    /// With its place in the document.
    #[must_use]
    pub fn from(mut self, source: &'static str) -> Self {
        self.source = source;
        self
    }

    /// With the results of `exact` under *orientation* and *direction*.
    #[must_use]
    pub fn beside(mut self, [orientation, direction]: [Figure; 2]) -> Self {
        (self.exact_orientation, self.exact_direction) = (orientation, direction);
        self
    }

    /// With the reason for a difference.
    #[must_use]
    pub fn because(mut self, why: &'static str) -> Self {
        self.why = Some(why);
        self
    }
}

/// A statement of the document, and whether it holds.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Fixed {
    /// The statement.
    pub statement: String,
    /// The value found.
    pub found: String,
    /// Whether it holds.
    pub holds: bool,
}

/// A table of related figures.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    /// Title, including the unit.
    pub title: String,
    /// Meaning of the rows.
    pub of: &'static str,
    /// Titles of the columns.
    pub columns: Vec<String>,
    /// Name and figures of each row.
    pub rows: Vec<(String, Vec<Figure>)>,
}

/// A row with its column names.
struct ByColumn<'a>(&'a [String], &'a str, &'a [Figure]);

impl Serialize for ByColumn<'_> {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        let mut map = to.serialize_map(Some(self.0.len() + 1))?;
        map.serialize_entry("of", self.1)?;
        for (column, figure) in self.0.iter().zip(self.2) {
            map.serialize_entry(column, figure)?;
        }
        map.end()
    }
}

impl Serialize for Table {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        let rows = self.rows.iter();
        let rows: Vec<ByColumn<'_>> = rows
            .map(|(name, figures)| ByColumn(&self.columns, name, figures))
            .collect();
        let mut map = to.serialize_map(Some(2))?;
        map.serialize_entry("title", &self.title)?;
        map.serialize_entry("rows", &rows)?;
        map.end()
    }
}

/// A picture: a recomputed figure of the document.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Picture {
    /// Name of its file, without `.svg`.
    pub name: &'static str,
    /// Subject of the picture.
    pub title: String,
    /// The drawing.
    #[serde(skip)]
    pub drawn: Drawn,
}

/// The content of a picture.
#[derive(Clone, Debug, PartialEq)]
pub enum Drawn {
    /// Curves or points over an axis.
    Chart(Chart),
    /// A bar for each name.
    Bars(Bars),
}

impl Picture {
    /// The picture as a file.
    #[must_use]
    pub fn svg(&self) -> String {
        match &self.drawn {
            Drawn::Chart(chart) => chart.draw().file(),
            Drawn::Bars(bars) => bars.draw().file(),
        }
    }
}

/// A chapter or section of the document.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Chapter {
    /// Title of the part of the document.
    pub title: &'static str,
    /// Where the document has the figures that name no other place.
    pub source: &'static str,
    /// How it was recomputed.
    pub how: &'static str,
    /// The document's figures and ours.
    pub compared: Vec<Compared>,
    /// More figures.
    pub tables: Vec<Table>,
    /// Statements that our computation meets or fails.
    pub fixed: Vec<Fixed>,
    /// Pictures of the chapter or section.
    pub pictures: Vec<Picture>,
}

/// A result that cannot be recomputed.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct NotReproduced {
    /// The part of the document.
    pub what: &'static str,
    /// The data that would be needed.
    pub needed: &'static str,
}

/// All results.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Reproduced {
    /// Recomputed results.
    pub chapters: Vec<Chapter>,
    /// Results that cannot be recomputed.
    pub not_reproduced: Vec<NotReproduced>,
}

impl Reproduced {
    /// The statements that our computation must meet.
    pub fn fixed(&self) -> impl Iterator<Item = &Fixed> {
        self.chapters.iter().flat_map(|chapter| &chapter.fixed)
    }
}
