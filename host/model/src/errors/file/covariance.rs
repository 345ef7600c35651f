//! `[uncertainty]`.

use super::{ErrorsFile, beside};
use crate::errors::ErrorModel;
use crate::errors::covariance;
use crate::source::FileError;
use toml::Spanned;

/// Standard uncertainties are written with four digits.
const ROUNDED: f64 = 1e-3;
/// The most (µm) that thermal changes may leave: more than any of them explains.
const MOST_THERMAL: f64 = 1e4;

impl ErrorModel {
    /// Reads the covariance file, if one is named.
    pub(super) fn read_covariance(
        &mut self,
        file: &ErrorsFile,
        read: &dyn Fn(&str) -> Result<String, String>,
    ) -> Result<(), FileError> {
        let Some(entry) = &file.uncertainty else {
            return Ok(());
        };
        if let Some(left) = &entry.thermal_um {
            self.thermal_left = Some(thermal_left(left)? * 1e-3);
        }
        let um = misfit(
            &entry.misfit_um,
            "misfit_um",
            "in µm how far errors that the model lacks move a coordinate of the tip",
        )?;
        let urad = misfit(
            &entry.misfit_urad,
            "misfit_urad",
            "in µrad how far errors that the model lacks turn the tool about one axis",
        )?;
        self.misfit = um.map(|um| um * 1e-3);
        self.misfit_of_direction = urad.map(|urad| urad * 1e-6);
        match &entry.covariance {
            Some(name) => self.read_correlations(name, read),
            None => Ok(()),
        }
    }

    fn read_correlations(
        &mut self,
        name: &Spanned<String>,
        read: &dyn Fn(&str) -> Result<String, String>,
    ) -> Result<(), FileError> {
        let text = beside(name, read)?;
        let within = |error: FileError| error.within(name.get_ref(), &text);
        let (found, places) = covariance::read(&text).map_err(within)?;
        let uncertainties = found.standard_uncertainties();
        for ((parameter, place), u) in found.parameters.iter().zip(places).zip(uncertainties) {
            if !self.parameters.contains_key(parameter) {
                return Err(within(FileError::at(
                    place,
                    format!("{parameter} has no value under [parameters]"),
                    "this parameter",
                    "give the covariances of the parameters that the error file has: both files are written by one run of identify",
                )));
            }
            let stated = *self.standard_uncertainty.entry(*parameter).or_insert(u);
            if (stated - u).abs() > ROUNDED * stated.max(u) {
                return Err(within(FileError::at(
                    place,
                    format!(
                        "the standard uncertainty of {parameter} is {u:.3e} here, and {stated:.3e} under [standard_uncertainty]"
                    ),
                    "the root of its variance",
                    "use the two files that one run of identify has written, or correct one of the two",
                )));
            }
        }
        self.correlated = Some(found);
        Ok(())
    }
}

/// What thermal changes leave (µm).
fn thermal_left(left: &Spanned<f64>) -> Result<f64, FileError> {
    let um = *left.get_ref();
    if !(0.0..=MOST_THERMAL).contains(&um) {
        return Err(FileError::here(
            left.span(),
            format!("thermal_um is not a number from 0 to {MOST_THERMAL}"),
            "write in µm the error beside the thermal changes, as identify does, or leave it out",
        ));
    }
    Ok(um)
}

/// A misfit, if it is given; `what` is its meaning.
fn misfit(entry: &Option<Spanned<f64>>, name: &str, what: &str) -> Result<Option<f64>, FileError> {
    let Some(misfit) = entry else { return Ok(None) };
    let value = *misfit.get_ref();
    if !value.is_finite() || value < 0.0 {
        return Err(FileError::here(
            misfit.span(),
            format!("{name} is negative or not a number"),
            format!("write {what} (rms), as identify does, or leave it out"),
        ));
    }
    Ok(Some(value))
}
