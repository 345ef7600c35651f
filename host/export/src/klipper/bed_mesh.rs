//! `[bed_mesh NAME]` of Klipper: a stored profile.
//!
//! Klipper reads profiles with `version = 1`, resamples their points by `algo` (`direct`: not at all), and interpolates
//! linearly between them; outside, the edge holds. A row of `points` goes along X. `[bed_mesh]` says which of them were
//! probed. Source: `bed_mesh.py` of Klipper.

use super::config::{ConfigEntry, ConfigSection, sections};
use crate::height_map::{HeightMap, check_height, rows};
use crate::sampled::{Nodes, SampledGrid};
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
    if version.value() != "1" {
        return Err(version.line.bad(
            format!(
                "version {}: Klipper uses profiles of version 1 only",
                version.value()
            ),
            "probe the bed again with this version of Klipper",
        ));
    }
    let nodes = [
        nodes(section, "min_x", "max_x", "x_count")?,
        nodes(section, "min_y", "max_y", "y_count")?,
    ];
    let mut map = HeightMap::new(SampledGrid {
        values: values(section.option("points")?, &nodes)?,
        nodes: nodes.to_vec(),
    });
    map.probed = probed(&sections, &nodes)?;
    Ok(map)
}

/// Which points were probed. The others have the height of a neighbour, at the corners of a round bed, or the mean of
/// neighbours, in a faulty region.
fn probed(sections: &[ConfigSection<'_>], nodes: &[Nodes; 2]) -> Result<Vec<bool>, FileError> {
    let [x, y] = *nodes;
    let Some(bed) = sections.iter().find(|section| section.name == "bed_mesh") else {
        return match sections.iter().find(|section| section.is_include()) {
            None => Ok(vec![true; x.count * y.count]),
            Some(include) => Err(include.line.bad(
                "[bed_mesh] may be in the file that is included here, which is not read: it says which points were probed",
                "copy the section [bed_mesh] from there into this file",
            )),
        };
    };
    let regions = faulty_regions(bed)?;
    let mut probed = match bed.given("mesh_radius") {
        None => vec![true; x.count * y.count],
        Some(radius) => probed_within(radius, bed.given("mesh_origin"), nodes)?,
    };
    for (k, probed) in probed.iter_mut().enumerate() {
        let at = [x.at(k % x.count), y.at(k / x.count)];
        let is_in = |region: &[[f64; 2]; 2]| {
            (0..2).all(|k| (region[0][k] - FAULTY..=region[1][k] + FAULTY).contains(&at[k]))
        };
        *probed &= !regions.iter().any(is_in);
    }
    Ok(probed)
}

/// Points this close (mm) to a faulty region are in it.
const FAULTY: f64 = 1e-5;

/// The lower and upper corners of faulty regions.
fn faulty_regions(bed: &ConfigSection<'_>) -> Result<Vec<[[f64; 2]; 2]>, FileError> {
    let mut regions = Vec::new();
    while let Some(corner) = bed.given(&format!("faulty_region_{}_min", regions.len() + 1)) {
        let a = corner.pair()?;
        let other = format!("faulty_region_{}_max", regions.len() + 1);
        let b = bed.option(&other)?.pair()?;
        regions.push([f64::min, f64::max].map(|end| [end(a[0], b[0]), end(a[1], b[1])]));
    }
    Ok(regions)
}

/// The points within the radius of a round bed, computed as in `generate_points`: rounding decides which points on the circle
/// are among them.
fn probed_within(
    radius: &ConfigEntry<'_>,
    origin: Option<&ConfigEntry<'_>>,
    [x, y]: &[Nodes; 2],
) -> Result<Vec<bool>, FileError> {
    /// Klipper rounds the radius (mm) to as much.
    const ROUNDED: f64 = 0.1;
    let line = &radius.line;
    let radius = (radius.number()? * 10.0).floor() / 10.0;
    let origin = origin.map_or(Ok([0.0; 2]), ConfigEntry::pair)?;
    let step = (2.0 * radius / (x.count - 1) as f64 * 100.0).floor() / 100.0;
    let end = (x.count / 2) as f64 * step;
    let is_end = |found: f64, expected: f64| (found - expected).abs() < ROUNDED;
    let is_this_bed = [x, y].into_iter().zip(origin).all(|(nodes, middle)| {
        nodes.count == x.count
            && is_end(nodes.start, middle - end)
            && is_end(nodes.at(nodes.count - 1), middle + end)
    });
    if !is_this_bed {
        return Err(line.bad(
            "the profile was probed with another mesh_radius, mesh_origin or round_probe_count",
            "probe the bed again, or write the values with which it was probed",
        ));
    }
    let mut probed = Vec::new();
    let mut from_middle = -end;
    for row in 0..y.count {
        // Every second row was probed backwards.
        probed.extend((0..x.count).map(|column| {
            let along = match row % 2 {
                0 => -end + column as f64 * step,
                _ => end - (x.count - 1 - column) as f64 * step,
            };
            (along * along + from_middle * from_middle).sqrt() <= radius
        }));
        from_middle += step;
    }
    Ok(probed)
}

/// The values at the points, row by row.
fn values(points: &ConfigEntry<'_>, nodes: &[Nodes; 2]) -> Result<Vec<[f64; 1]>, FileError> {
    let mut values = Vec::new();
    for line in &points.lines {
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
    if points.lines.len() != nodes[1].count {
        return Err(points.line.bad(
            format!(
                "{} rows of points, where y_count is {}",
                points.lines.len(),
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
    let range = [low.number()?, high.number()?];
    if range[0] >= range[1] {
        return Err(high.line.bad(
            "the end is not after the start",
            "write the larger number here",
        ));
    }
    let count = section.option(count)?;
    Ok(Nodes::over(range, count.line.count(&count.value())?))
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
