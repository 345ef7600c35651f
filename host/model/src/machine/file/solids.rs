//! `[[solid]]` of `machine.toml`.

use super::{Axis, finite, frame};
use crate::machine::{Carrier, Solid, SolidShape};
use crate::source::{Exactly, FileError};
use serde::Deserialize;
use toml::Spanned;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SolidEntry {
    name: Spanned<String>,
    carried_by: Spanned<String>,
    shape: Spanned<String>,
    size_mm: Option<Spanned<Exactly<3>>>,
    diameter_mm: Option<Spanned<f64>>,
    length_mm: Option<Spanned<f64>>,
    origin_mm: Option<Spanned<Exactly<3>>>,
    orientation_deg: Option<Spanned<Exactly<3>>>,
}

/// Largest size of anything on a machine (mm).
const LARGEST: f64 = 1e5;

/// The solids of a machine with these axes.
pub(super) fn read(entries: &[SolidEntry], axes: &[Axis]) -> Result<Vec<Solid>, FileError> {
    let mut solids: Vec<Solid> = Vec::new();
    for entry in entries {
        let name = entry.name.get_ref();
        if name.is_empty() || solids.iter().any(|solid| solid.name == *name) {
            return Err(FileError::here(
                entry.name.span(),
                format!("there is another solid `{name}`, or this one has no name"),
                "give every solid a name of its own: messages use it",
            ));
        }
        solids.push(Solid {
            name: name.clone(),
            carrier: carrier(&entry.carried_by, axes)?,
            shape: entry.shape()?,
            place: frame(&entry.origin_mm, &entry.orientation_deg)?,
        });
    }
    Ok(solids)
}

fn carrier(carried_by: &Spanned<String>, axes: &[Axis]) -> Result<Carrier, FileError> {
    let name = carried_by.get_ref().as_str();
    Ok(match name {
        "foundation" => Carrier::Foundation,
        "spindle" => Carrier::Spindle,
        "workpiece" => Carrier::Workpiece,
        _ => {
            let axis = axes.iter().position(|axis| axis.letter.to_string() == name);
            Carrier::Axis(axis.ok_or_else(|| {
                FileError::here(
                    carried_by.span(),
                    format!("the machine has no `{name}` that carries anything"),
                    "write the letter of an axis, \"spindle\", \"workpiece\" or \"foundation\"",
                )
            })?)
        }
    })
}

impl SolidEntry {
    /// Checks that a shape has those of `size_mm`, `diameter_mm` and `length_mm` that it needs.
    fn has_keys(&self, shape: &str, keys: [bool; 3]) -> Result<(), FileError> {
        let given = [
            self.size_mm.as_ref().map(Spanned::span),
            self.diameter_mm.as_ref().map(Spanned::span),
            self.length_mm.as_ref().map(Spanned::span),
        ];
        let names = ["size_mm", "diameter_mm", "length_mm"];
        for ((wanted, given), key) in keys.into_iter().zip(given).zip(names) {
            match given {
                None if wanted => {
                    return Err(FileError::here(
                        self.shape.span(),
                        format!("the size of this {shape} is missing"),
                        format!("add {key}, in mm"),
                    ));
                }
                Some(place) if !wanted => {
                    return Err(FileError::here(
                        place,
                        format!("a {shape} has no {key}"),
                        "remove it: a box has size_mm, a sphere diameter_mm, a cylinder and a capsule diameter_mm and length_mm",
                    ));
                }
                _ => {}
            }
        }
        Ok(())
    }

    fn shape(&self) -> Result<SolidShape, FileError> {
        let shape = self.shape.get_ref().as_str();
        let keys = match shape {
            "box" => [true, false, false],
            "cylinder" | "capsule" => [false, true, true],
            "sphere" => [false, true, false],
            _ => {
                return Err(FileError::here(
                    self.shape.span(),
                    format!("`{shape}` is not a shape"),
                    "write \"box\", \"cylinder\", \"sphere\" or \"capsule\"",
                ));
            }
        };
        self.has_keys(shape, keys)?;
        let half = |value: &Option<Spanned<f64>>| match value {
            Some(value) => positive(value).map(|value| value / 2.0),
            None => Ok(0.0),
        };
        let (radius, half) = (half(&self.diameter_mm)?, half(&self.length_mm)?);
        Ok(match (&self.size_mm, shape) {
            (Some(size), _) => {
                let sizes = finite(size)?;
                if sizes.iter().any(|s| !(*s > 0.0 && *s < LARGEST)) {
                    return Err(not_a_size(size.span()));
                }
                SolidShape::Box(sizes.map(|s| s / 2.0))
            }
            (None, "sphere") => SolidShape::Sphere { radius },
            (None, "cylinder") => SolidShape::Cylinder { radius, half },
            (None, _) => SolidShape::Capsule { radius, half },
        })
    }
}

fn positive(value: &Spanned<f64>) -> Result<f64, FileError> {
    let size = *value.get_ref();
    match size > 0.0 && size < LARGEST {
        true => Ok(size),
        false => Err(not_a_size(value.span())),
    }
}

fn not_a_size(span: std::ops::Range<usize>) -> FileError {
    FileError::here(
        span,
        "this is not the size of a part of a machine",
        "write mm, more than 0",
    )
}
