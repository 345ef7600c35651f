//! Compares balls and stylus as found with their stated positions.

use crate::mistakes::{Mistake, places};
use crate::{Identified, Problem};
use nalgebra::Vector3;
use std::fmt::Write;

/// Found and stated position of something (mm).
#[derive(Clone, Debug, PartialEq)]
pub struct Stated {
    /// `ball 1`, or `stylus`.
    pub what: String,
    /// The position found: a ball in the workpiece frame, the stylus in the spindle frame.
    pub found: Vector3<f64>,
    /// The position in the artefact or the machine file; `None` if neither states it.
    pub stated: Option<Vector3<f64>>,
}

/// Distances (mm) from a stated position above this are mistakes: balls are placed to a few millimetres, and a
/// stylus is measured more accurately. A mirrored axis, exchanged balls or another tool give larger distances.
pub const PLACES: f64 = 5.0;

impl Stated {
    /// Distance from the stated position (mm).
    #[must_use]
    pub fn distance(&self) -> Option<f64> {
        self.stated.map(|stated| (self.found - stated).norm())
    }

    /// True if it cannot be the stated one.
    #[must_use]
    pub fn is_far(&self) -> bool {
        self.distance().is_some_and(|distance| distance > PLACES)
    }
}

/// Every ball, then the stylus.
#[must_use]
pub fn stated(problem: &Problem<'_>, identified: &Identified) -> Vec<Stated> {
    let balls = problem.balls.iter().zip(&identified.balls);
    let balls = balls.zip(problem.stated_balls());
    let mut all: Vec<Stated> = balls
        .map(|((name, found), stated)| Stated {
            what: format!("ball {name}"),
            found: *found,
            stated: *stated,
        })
        .collect();
    // Without probings, the stylus is not found.
    if !problem.places.is_empty() {
        all.push(Stated {
            what: "stylus".to_owned(),
            found: identified.stylus,
            stated: Some(problem.stated_stylus()),
        });
    }
    all
}

/// What is not at its stated place, with a possible explanation; `None` if everything is.
#[must_use]
pub fn misplaced(problem: &Problem<'_>, all: &[Stated]) -> Option<Mistake> {
    let far: Vec<&Stated> = all.iter().filter(|one| one.is_far()).collect();
    if far.is_empty() {
        return None;
    }
    let mut what = String::new();
    for one in &far {
        let (Some(stated), Some(distance)) = (one.stated, one.distance()) else {
            continue;
        };
        let separator = if what.is_empty() { "" } else { "; " };
        let _ = write!(
            what,
            "{separator}{} was found at {} mm, {distance:.1} mm from the stated {}",
            one.what,
            rounded(&one.found),
            rounded(&stated)
        );
    }
    let explained = places(problem);
    if let Some(mistake) = &explained {
        let _ = write!(what, "; {}", mistake.what);
    }
    let remedy = match (&explained, far.iter().all(|one| one.what == "stylus")) {
        (Some(mistake), _) => &mistake.remedy,
        (None, true) => {
            "correct tip_mm of [stylus] in the artefact, or of [tool] in the machine file"
        }
        (None, false) => {
            "correct nominal_mm in the artefact, or origins and signs of axes in the machine file"
        }
    };
    Some(Mistake {
        remedy: format!("{remedy}; if they are right as found, say --accept-places"),
        what,
    })
}

fn rounded(place: &Vector3<f64>) -> String {
    // Avoids -0.0.
    let v = place.map(|v| (v * 10.0).round() / 10.0 + 0.0);
    format!("[{:.1}, {:.1}, {:.1}]", v.x, v.y, v.z)
}
