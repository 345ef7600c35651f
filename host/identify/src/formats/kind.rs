//! Which kind of measurement a file holds, by its header.

use trueaxis_model::source::FileError;

/// The kinds of files with measurements.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FileKind {
    /// Probings of balls ([`probings`](super::probings)).
    Probings,
    /// Runs of a laser, straightedge, level, calibrator or square ([`runs`](trueaxis_direct::formats::runs)).
    Runs,
    /// Readings of a ball-bar ([`radii`](trueaxis_direct::formats::radii)).
    Ballbar,
    /// Observations of instruments ([`observations`](super::observations)).
    Observations,
}

const KINDS: &str = "the header of probings has `ball` (ball,X,Y,Z,A,C), that of runs begins with `target` or `line` (target,+1,-1), that of a ball-bar is angle,ccw,cw or X,Y,Z,radial, and that of other observations has `kind` (kind,setup,X,Y,Z,length_mm)";

/// Recognises a file by the names of its columns.
///
/// # Errors
/// [`FileError`]: a header of none of these kinds.
pub fn kind(text: &str) -> Result<FileKind, FileError> {
    let header = header(text);
    let has = |name: &str| (header.iter()).any(|column| column.eq_ignore_ascii_case(name));
    match header.first().copied().unwrap_or_default() {
        "target" | "line" => Ok(FileKind::Runs),
        "angle" => Ok(FileKind::Ballbar),
        _ if has("radial") => Ok(FileKind::Ballbar),
        _ if has("ball") => Ok(FileKind::Probings),
        _ if has("kind") => Ok(FileKind::Observations),
        _ => Err(FileError::whole(
            match header.is_empty() {
                true => "the file is empty".to_owned(),
                false => format!("`{}` is not the header of a measurement", header.join(",")),
            },
            KINDS,
        )),
    }
}

/// The names of the columns, whatever separates them. The reader of each kind refuses separators other than commas.
fn header(text: &str) -> Vec<&str> {
    let lines = text.trim_start_matches('\u{feff}').lines().map(str::trim);
    let mut lines = lines.filter(|line| !line.is_empty() && !line.starts_with('#'));
    let columns = lines
        .next()
        .into_iter()
        .flat_map(|line| line.split([',', ';', '\t']));
    columns.map(|name| name.trim().trim_matches('"')).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_recognised_by_its_header() {
        for (text, expected) in [
            ("ball,X,Y,Z\n1,0,0,0\n", FileKind::Probings),
            ("X,Y,Z,ball\n", FileKind::Probings),
            ("# axis = \"X\"\ntarget,+1,-1\n", FileKind::Runs),
            ("\u{feff}# x\n\nline,target,+1\n", FileKind::Runs),
            ("# radius_mm = 100\nangle,ccw,cw\n", FileKind::Ballbar),
            ("X,Y,Z,radial\n", FileKind::Ballbar),
            ("kind,X,Y,Z,length_mm\n", FileKind::Observations),
            ("ball;X;Y;Z\n", FileKind::Probings),
        ] {
            assert_eq!(kind(text), Ok(expected), "{text}");
        }
        for text in ["", "# axis = \"X\"\n", "X,Y,Z\n0,0,0\n"] {
            let error = kind(text).unwrap_err();
            for part in ["ball", "target", "radial", "kind"] {
                assert!(error.remedy.contains(part), "{}", error.remedy);
            }
        }
    }
}
