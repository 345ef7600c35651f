//! What instruments will read, to predict what that identifies.

use trueaxis_identify::formats::observations::Observations;
use trueaxis_identify::instrument::{InitialSample, Kind};
use trueaxis_identify::simulate::{OfObservations, observations};
use trueaxis_model::errors::ErrorModel;
use trueaxis_model::kinematics::Kinematics;
use trueaxis_model::machine::Machine;

/// Nothing says where an instrument stands that reads lengths.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error(
    "the set-up `{setup}` reads lengths, and neither place_mm nor readings say from which centre"
)]
pub struct NoPlace {
    /// Name of the set-up.
    pub setup: String,
}

/// What instruments read on the assumed machine at the positions of a plan, for
/// [`Setup::observations`](super::Setup::observations). Instruments stand where the plan says, or else where its readings
/// show. `sigma` is the standard uncertainty (mm; angles over [`LEVER`](trueaxis_identify::instrument::LEVER)) of rows
/// that state none.
///
/// # Errors
/// [`NoPlace`].
pub fn expected(
    machine: &Machine,
    plan: &Observations,
    assumed: &ErrorModel,
    sigma: f64,
) -> Result<Observations, NoPlace> {
    let mut plan = plan.clone();
    let commanded = plan.commanded(machine);
    for (number, setup) in plan.setups.iter_mut().enumerate() {
        if setup.kind != Kind::Length || setup.given.place.is_some() {
            continue;
        }
        let rows = plan.rows.iter().zip(&commanded);
        let samples: Vec<InitialSample> = (rows.filter(|(row, _)| row.setup == number))
            .map(|(row, commanded)| InitialSample {
                commanded: *commanded,
                read: row.value,
            })
            .collect();
        if samples.iter().any(|sample| sample.read.x == 0.0) {
            let setup = setup.name.clone();
            return Err(NoPlace { setup });
        }
        let start = setup.kind.start(&setup.given, &samples);
        setup.given.place = Some(start.place);
        setup.given.length = Some(start.length);
    }
    for row in &mut plan.rows {
        row.sigma = row.sigma.or(Some(sigma));
    }
    let kinematics = Kinematics::new(machine, assumed);
    Ok(observations(&kinematics, &plan, &OfObservations::default()))
}
