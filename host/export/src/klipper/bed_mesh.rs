//! `[bed_mesh NAME]` of Klipper: a stored profile.
//!
//! Klipper reads profiles with `version = 1`, resamples their points by `algo` (`direct`: not at all), and interpolates
//! linearly between them; outside, the edge holds. A row of `points` goes along X. What `SAVE_CONFIG` writes begins with
//! `#*#`. Source: `bed_mesh.py` of Klipper.

use super::config::{ConfigEntry, ConfigSection, sections};
use crate::height_map::{HeightMap, check_height, rows};
use crate::sampled::{Nodes, SampledGrid};
use crate::text_lines::TextLine;
use trueaxis_model::source::FileError;

/// Writes a profile for `printer.cfg` or a file that it includes.
#[must_use]
pub fn print(map: &HeightMap, profile: &str) -> String {
    let [x, y] = [0, 1].map(|axis| map.grid.nodes[axis]);
    let mut text = format!("[bed_mesh {profile}]\nversion = 1\npoints =\n");
    for row in rows(&map.grid, 6) {
        text += &format!("  {row}\n");
    }
    text + &format!(
        "min_x = {:.6}\nmax_x = {:.6}\nmin_y = {:.6}\nmax_y = {:.6}\nx_count = {}\ny_count = {}\n\
         mesh_x_pps = 0\nmesh_y_pps = 0\nalgo = direct\ntension = 0.2\n",
        x.start,
        x.at(x.count - 1),
        y.start,
        y.at(y.count - 1),
        x.count,
        y.count
    )
}

/// Reads a profile, of this name or the only one.
///
/// # Errors
/// [`FileError`]: no such profile, several without a name given, a version that Klipper does not use, a value that it
/// would not read.
pub fn read(text: &str, profile: Option<&str>) -> Result<HeightMap, FileError> {
    let sections = sections(text);
    let section = profile_section(&sections, profile)?;
    let version = section.option("version")?;
    if version.value != "1" {
        return Err(version.line.bad(
            format!(
                "version {}: Klipper uses profiles of version 1 only",
                version.value
            ),
            "probe the bed again with this version of Klipper",
        ));
    }
    let nodes = [
        nodes(section, "min_x", "max_x", "x_count")?,
        nodes(section, "min_y", "max_y", "y_count")?,
    ];
    Ok(HeightMap::new(SampledGrid {
        values: values(section.option("points")?, &nodes)?,
        nodes: nodes.to_vec(),
    }))
}

/// The values at the points, row by row.
fn values(points: &ConfigEntry<'_>, nodes: &[Nodes; 2]) -> Result<Vec<[f64; 1]>, FileError> {
    let mut values = Vec::new();
    let rows: Vec<&TextLine<'_>> = points
        .more
        .iter()
        .filter(|l| !l.text.trim().is_empty())
        .collect();
    for line in &rows {
        let row = line.numbers()?;
        row.iter()
            .try_for_each(|height| check_height(line, *height))?;
        if row.len() != nodes[0].count {
            return Err(line.bad(
                format!("{} points, where x_count is {}", row.len(), nodes[0].count),
                "give the profile as Klipper stores it",
            ));
        }
        values.extend(row.into_iter().map(|value| [value]));
    }
    if rows.len() != nodes[1].count {
        return Err(points.line.bad(
            format!(
                "{} rows of points, where y_count is {}",
                rows.len(),
                nodes[1].count
            ),
            "give the profile as Klipper stores it",
        ));
    }
    Ok(values)
}

/// The profile of this name, or the only one.
fn profile_section<'a, 't>(
    sections: &'a [ConfigSection<'t>],
    profile: Option<&str>,
) -> Result<&'a ConfigSection<'t>, FileError> {
    let name = |section: &ConfigSection<'_>| section.name["bed_mesh ".len()..].trim().to_owned();
    let profiles: Vec<&ConfigSection<'_>> = (sections.iter())
        .filter(|section| section.name.starts_with("bed_mesh "))
        .collect();
    let names: Vec<String> = profiles.iter().map(|section| name(section)).collect();
    let names = names.join(", ");
    match (profile, &profiles[..]) {
        (_, []) => Err(FileError::whole(
            "there is no stored profile [bed_mesh NAME]",
            "probe the bed, store it with BED_MESH_PROFILE SAVE=name and SAVE_CONFIG, and give printer.cfg",
        )),
        (Some(wanted), all) => {
            let found = all.iter().find(|section| name(section) == wanted);
            found.copied().ok_or_else(|| {
                FileError::whole(
                    format!("there is no profile `{wanted}`"),
                    format!("the file has {names}"),
                )
            })
        }
        (None, [one]) => Ok(one),
        (None, _) => Err(FileError::whole(
            "there are several profiles",
            format!("name one with --profile: {names}"),
        )),
    }
}

/// The positions of points along X or Y.
fn nodes(
    section: &ConfigSection<'_>,
    low: &str,
    high: &str,
    count: &str,
) -> Result<Nodes, FileError> {
    let [low, high] = [section.option(low)?, section.option(high)?];
    let range = [low.line.number(low.value)?, high.line.number(high.value)?];
    if range[0] >= range[1] {
        return Err(high.line.bad(
            "the end is not after the start",
            "write the larger number here",
        ));
    }
    let count = section.option(count)?;
    Ok(Nodes::over(range, count.line.count(count.value)?))
}

/// The correction of Z at X and Y (mm), as Klipper computes it from a profile with `algo = direct`.
#[must_use]
pub fn correction(map: &HeightMap, position: [f64; 2]) -> f64 {
    map.grid.at(&position)[0]
}

#[cfg(test)]
mod tests;
#[cfg(test)]
pub(crate) use tests::by_klipper;
