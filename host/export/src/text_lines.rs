//! Lines of a text with their places, and numbers in them.

use std::ops::Range;
use trueaxis_model::source::FileError;

/// A line without its end.
#[derive(Clone, Debug)]
pub struct TextLine<'t> {
    /// Text.
    pub text: &'t str,
    /// Place.
    pub span: Range<usize>,
}

impl TextLine<'_> {
    /// An error about it.
    pub fn bad(&self, message: impl Into<String>, remedy: &str) -> FileError {
        FileError::here(self.span.clone(), message, remedy)
    }

    /// Numbers between commas.
    ///
    /// # Errors
    /// [`FileError`] for a word that is not a finite number of a plausible size.
    pub fn numbers(&self) -> Result<Vec<f64>, FileError> {
        let words = self.text.split(',').map(str::trim);
        words.map(|word| self.number(word)).collect()
    }

    /// A word of this line as a number.
    ///
    /// # Errors
    /// [`FileError`]
    pub fn number(&self, word: &str) -> Result<f64, FileError> {
        let number = word.parse::<f64>().ok().filter(|v| v.abs() <= 1e6);
        number.ok_or_else(|| {
            self.bad(
                format!("`{word}` is not a number"),
                "write millimetres with a decimal point, separated as the control does",
            )
        })
    }

    /// A word of this line as a number of points along an axis.
    ///
    /// # Errors
    /// [`FileError`]
    pub fn count(&self, word: &str) -> Result<usize, FileError> {
        let count = word.parse().ok().filter(|n| (2..=1000).contains(n));
        count.ok_or_else(|| {
            self.bad(
                format!("`{word}` is not a number of points along an axis"),
                "write 2 to 1000",
            )
        })
    }
}

/// All lines of a text.
pub fn lines(text: &str) -> Vec<TextLine<'_>> {
    // Editors of Windows begin a file with a mark of its encoding.
    let mut start = text.len() - text.trim_start_matches('\u{feff}').len();
    let text = &text[start..];
    let lines = text.split_inclusive('\n').map(|whole| {
        let line = whole.trim_end();
        let span = start..start + line.len();
        start += whole.len();
        TextLine { text: line, span }
    });
    lines.collect()
}

#[cfg(test)]
mod tests {
    use crate::isg::IsgParameters;
    use crate::klipper::{bed_mesh, twist};
    use crate::reprapfirmware;
    use proptest::prelude::*;

    /// A small file of each kind.
    const FILES: [&str; 5] = [
        "RepRapFirmware height map file v2\naxis0,axis1,min0,max0,min1,max1,radius,spacing0,spacing1,num0,num1\n\
         X,Y,0.00,20.00,0.00,10.00,-1.00,10.00,10.00,3,2\n  0.010,      0, -0.020\n  0.030,  0.040,  0.000\n",
        "#*# [bed_mesh cold]\n#*# version = 1\n#*# points =\n#*# \t  0.01, -0.02\n#*# \t  0.03, 0.0\n#*# x_count = 2\n\
         #*# y_count = 2\n#*# min_x = 5.0\n#*# max_x = 25.0\n#*# min_y = 0.0\n#*# max_y = 40.0\n",
        "[axis_twist_compensation]\nz_compensations = -0.01, 0.01\ncompensation_start_x = 20.0\ncompensation_end_x = 200.0\n",
        "// locations\nC0Y\t0.1\n#\nX EXX EYX\n0 0.1 0.2\n1 0.3 0.4 // end\n",
        "[C0Y]\nVALUE = 0.1\n[EXX]\nGridpoints = {\n0 0.1\n1 0.2\n}\n",
    ];

    #[test]
    fn a_mark_of_the_encoding_is_no_part_of_the_first_line() {
        let text = format!("\u{feff}{}", FILES[0]);
        assert!(reprapfirmware::read(&text).is_ok());
        assert_eq!(super::lines(&text)[0].span.start, 3);
    }

    proptest! {
        /// A changed file is read or refused at a place that it has, by each reader.
        #[test]
        fn a_changed_file_is_read_or_refused_at_its_place(
            file in 0..FILES.len(), at in any::<prop::sample::Index>(), cut in 0..9_usize,
            with in "[ -~\\n\u{e4}]{0,4}",
        ) {
            let text = FILES[file];
            let start = at.index(text.len());
            let text = format!("{}{with}{}", &text[..start], &text[(start + cut).min(text.len())..]);
            let errors = [
                reprapfirmware::read(&text).err(),
                bed_mesh::read(&text, None).err(),
                twist::read(&text).err(),
                IsgParameters::read_csv(&text).err(),
                IsgParameters::read_etalon(&text).err(),
            ];
            for error in errors.into_iter().flatten() {
                let span = error.span.unwrap_or(0..0);
                prop_assert!(text.get(span).is_some());
                prop_assert!(!error.remedy.is_empty());
            }
        }
    }
}
