//! OpenCNCPilot's `.hmap`: XML, an element `heightmap` with the range and the numbers of points, and one element `point` for
//! each that was probed.

use super::{SurfacePoint, gridded};
use crate::height_map::HeightMap;
use crate::sampled::Nodes;
use crate::text_lines::TextLine;
use roxmltree::{Document, Node};
use std::str::FromStr;
use trueaxis_model::source::FileError;

pub fn read(text: &str) -> Result<HeightMap, FileError> {
    let document = Document::parse(text).map_err(|error| {
        let row = error.pos().row as usize;
        let start: usize = text.split_inclusive('\n').take(row - 1).map(str::len).sum();
        let line = text[start..].lines().next().unwrap_or("");
        FileError::here(
            start..start + line.len(),
            format!("this is not a height map of OpenCNCPilot: {error}"),
            "give the .hmap file as OpenCNCPilot writes it",
        )
    })?;
    let root = document.root_element();
    if root.tag_name().name() != "heightmap" {
        return Err(place(text, root).bad(
            format!("`{}` is not a height map", root.tag_name().name()),
            "give the .hmap file as OpenCNCPilot writes it",
        ));
    }
    let [x, y] = [nodes(text, root, 'X'), nodes(text, root, 'Y')];
    let (x, y) = (x?, y?);
    let points = root.children().filter(|node| node.has_tag_name("point"));
    let points = points.map(|node| point(text, node, [x, y]));
    let points: Vec<SurfacePoint> = points.collect::<Result<_, _>>()?;
    let missing = x.count * y.count - points.len().min(x.count * y.count);
    if missing > 0 {
        return Err(place(text, root).bad(
            format!(
                "{missing} of {} × {} points were not probed",
                x.count, y.count
            ),
            "probe the whole map",
        ));
    }
    gridded(&points)
}

/// The places of points along X or Y.
fn nodes(text: &str, root: Node<'_, '_>, letter: char) -> Result<Nodes, FileError> {
    let [low, high] = ["Min", "Max"].map(|end| attribute(text, root, &format!("{end}{letter}")));
    let range: [f64; 2] = [low?, high?];
    let count: usize = attribute(text, root, &format!("Size{letter}"))?;
    if !(range[0] < range[1] && (2..=1000).contains(&count)) {
        return Err(place(text, root).bad(
            format!("{count} points from {} to {}", range[0], range[1]),
            "give a map with 2 to 1000 points along X and along Y",
        ));
    }
    Ok(Nodes::over(range, count))
}

/// An element `point`, whose attributes count the places.
fn point(text: &str, node: Node<'_, '_>, [x, y]: [Nodes; 2]) -> Result<SurfacePoint, FileError> {
    let indices: [usize; 2] = [attribute(text, node, "X")?, attribute(text, node, "Y")?];
    if indices[0] >= x.count || indices[1] >= y.count {
        return Err(place(text, node).bad(
            format!(
                "point {}, {} of {} × {}",
                indices[0], indices[1], x.count, y.count
            ),
            "count points from 0",
        ));
    }
    let line = place(text, node);
    let height = line.number(node.text().unwrap_or("").trim())?;
    let at = [x.at(indices[0]), y.at(indices[1]), height];
    Ok((at, line.span))
}

/// An element with its place.
fn place<'t>(text: &'t str, node: Node<'_, '_>) -> TextLine<'t> {
    let span = node.range();
    TextLine {
        text: text.get(span.clone()).unwrap_or(""),
        span,
    }
}

fn attribute<T: FromStr>(text: &str, node: Node<'_, '_>, name: &str) -> Result<T, FileError> {
    let found = node.attribute(name).unwrap_or("");
    found.trim().parse().map_err(|_| {
        place(text, node).bad(
            format!("{name} is `{found}`, no number"),
            "give the .hmap file as OpenCNCPilot writes it",
        )
    })
}
