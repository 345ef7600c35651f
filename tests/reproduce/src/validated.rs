//! The document's validation (Figs. 5.6, 6.2, 6.5): a ball is probed while the axes are corrected, and the parameters
//! are identified again.

use super::embedded::Example;
use super::{Fixed, ReproduceError};
use nalgebra::Vector3;
use trueaxis_identify::formats::artefact::Artefact;
use trueaxis_identify::formats::probings::{Probing, Probings};
use trueaxis_identify::simulate::{Disturbances, compensated, corrections};
use trueaxis_identify::{
    Compensated, Identified, IdentifyOptions, Problem, compensability, identify,
};
use trueaxis_model::errors::{ErrorModel, Motion, Parameter, Situation, Switches};
use trueaxis_model::kinematics::{Kinematics, Policy};
use trueaxis_model::machine::{Machine, PerAxis};
use trueaxis_model::validate::{Runtime, Statistics};
use trueaxis_tables::compile::{self, Built};
use trueaxis_tables::schemes::{self, Scheme, poly25, trigo23};

/// Number of nodes along each axis at which polynomials and trigonometric functions are fitted (sections 5.9.1, 6.8).
const NODES: usize = 10;

pub fn poly25(objective: poly25::Objective) -> Scheme {
    Scheme::Poly25(poly25::Wanted {
        objective,
        nodes: NODES,
    })
}

pub fn trigo23(free: bool) -> Scheme {
    Scheme::Trigo23(trigo23::Wanted { free, nodes: NODES })
}

pub fn fik() -> Scheme {
    Scheme::Fik {
        adjustable: Vec::new(),
    }
}

/// The two policies under which `exact` is shown.
pub fn both() -> [Policy; 2] {
    [Policy::Orientation, Policy::default()]
}

/// Options of a compensation, verified at `positions` random positions.
pub fn options(
    scheme: Scheme,
    policy: Policy,
    points: Option<usize>,
    random: usize,
) -> compile::Options {
    compile::Options {
        scheme,
        tables: schemes::Options {
            policy,
            points,
            ..schemes::Options::default()
        },
        allow_large: true,
        random,
        ..compile::Options::default()
    }
}

/// The tables of a scheme, without verification.
pub fn built(
    machine: &Machine,
    errors: &ErrorModel,
    scheme: Scheme,
    policy: Policy,
    points: Option<usize>,
) -> Result<Built, ReproduceError> {
    let options = options(scheme, policy, points, 0);
    Ok(compile::build(machine, errors, &options, &())?)
}

/// Tolerance (mm) of `exact` for error motions: the document's coefficients are no more accurate.
const COARSE: f64 = 1e-3;

/// The tables of `exact`: to its default tolerance for constant errors, to 1 µm for polynomials.
pub fn exact(
    machine: &Machine,
    errors: &ErrorModel,
    policy: Policy,
) -> Result<Built, ReproduceError> {
    let mut options = options(Scheme::default(), policy, None, 0);
    if errors.motions.iter().flatten().any(Motion::holds) {
        options.tables.tolerance = COARSE;
    }
    Ok(compile::build(machine, errors, &options, &())?)
}

/// The correction of the axes while a machine is probed.
pub enum Corrector<'a> {
    /// No correction.
    Nothing,
    /// The kinematic correction for known errors: the document's K-B.
    Kinematic(Box<Kinematics<'a>>),
    /// Tables.
    Tables(Runtime<'a>),
}

impl<'a> Corrector<'a> {
    /// The tables of a blob.
    pub fn tables(built: &'a Built) -> Result<Self, ReproduceError> {
        Ok(Self::Tables(Runtime::load(&built.blob)?))
    }

    /// The kinematic correction as in the document.
    pub fn kinematic(machine: &'a Machine, known: &'a ErrorModel) -> Self {
        Self::Kinematic(Box::new(
            Kinematics::new(machine, known).with_policy(Policy::Orientation),
        ))
    }

    pub fn of(
        &self,
        kinematics: &Kinematics<'_>,
        rows: &[Probing],
    ) -> Result<Vec<PerAxis>, ReproduceError> {
        let machine = kinematics.machine;
        match self {
            Self::Nothing => Ok(vec![PerAxis::default(); rows.len()]),
            Self::Tables(runtime) => Ok(corrections(machine, runtime, rows)),
            Self::Kinematic(known) => (rows.iter())
                .map(|row| {
                    let q = machine.to_kinematic(&row.position);
                    let situation = Situation {
                        sign: row.direction,
                        ..Situation::default()
                    };
                    let dq = known.correction(&q, &situation, &Switches::ALL)?.dq;
                    Ok(machine.to_command(&dq))
                })
                .collect(),
        }
    }
}

/// Statistics of displacements (µm).
#[derive(Clone, Copy)]
pub struct Spread {
    /// Root mean square along x, y and z.
    pub rms: [f64; 3],
    /// Mean and largest length.
    pub mean: f64,
    pub max: f64,
}

impl Spread {
    pub fn of(errors: &[Vector3<f64>]) -> Self {
        let lengths = Statistics::of(errors.iter().map(Vector3::norm));
        Self {
            rms: [0, 1, 2].map(|k| Statistics::of(errors.iter().map(|e| e[k])).rms),
            mean: lengths.mean,
            max: lengths.max,
        }
    }

    /// Root mean square length: never less than the mean.
    pub fn rms_length(&self) -> f64 {
        self.rms.iter().map(|r| r * r).sum::<f64>().sqrt()
    }
}

/// That no mean length exceeds its root mean square.
pub fn consistent<'a>(all: impl Iterator<Item = &'a Spread>) -> Fixed {
    let least = all
        .map(|s| s.rms_length() - s.mean)
        .fold(f64::INFINITY, f64::min);
    Fixed {
        statement: "the RMS of a length is no less than its mean, of every quantity above"
            .to_owned(),
        found: format!("{least:.1} µm at least between them"),
        holds: least >= 0.0,
    }
}

/// A probed machine, and the parameters to identify.
pub struct Validation<'a> {
    pub machine: &'a Machine,
    pub artefact: Artefact,
    pub strategy: Probings,
    pub parameters: Vec<Parameter>,
}

impl<'a> Validation<'a> {
    /// The strategy of an example, with the parameters of an error model.
    pub fn new(
        example: &'a Example,
        strategy: super::embedded::Strategy,
        parameters: &ErrorModel,
    ) -> Result<Self, ReproduceError> {
        Ok(Self {
            machine: &example.machine,
            artefact: example.artefact()?,
            strategy: example.strategy(strategy)?,
            parameters: parameters.parameters.keys().copied().collect(),
        })
    }

    /// The readings on a machine with these errors.
    pub fn probed(
        &self,
        actual: &ErrorModel,
        corrector: &Corrector<'_>,
        disturbances: &Disturbances,
    ) -> Result<Probings, ReproduceError> {
        let kinematics = Kinematics::new(self.machine, actual);
        compensated(
            &kinematics,
            &self.artefact,
            &self.strategy,
            disturbances,
            |rows| corrector.of(&kinematics, rows),
        )
    }

    /// The parameters identified on a machine with these errors.
    pub fn identified(
        &self,
        actual: &ErrorModel,
        corrector: &Corrector<'_>,
        disturbances: &Disturbances,
    ) -> Result<Identified, ReproduceError> {
        Ok(self.both(actual, corrector, disturbances)?.1)
    }

    fn both(
        &self,
        actual: &ErrorModel,
        corrector: &Corrector<'_>,
        disturbances: &Disturbances,
    ) -> Result<(Problem<'_>, Identified), ReproduceError> {
        let measured = self.probed(actual, corrector, disturbances)?;
        let base = ErrorModel::perfect(self.machine);
        let (artefact, parameters) = (&self.artefact, &self.parameters);
        let problem = Problem::new(self.machine, &measured, artefact, parameters, &base);
        let identified = identify(&problem, IdentifyOptions::default())?;
        Ok((problem, identified))
    }

    /// The volumetric error (µm) at each probed position, in the tool frame: by the errors of the machine alone, with
    /// a correction.
    pub fn raw(
        &self,
        actual: &ErrorModel,
        corrector: &Corrector<'_>,
    ) -> Result<Vec<Vector3<f64>>, ReproduceError> {
        let kinematics = Kinematics::new(self.machine, actual);
        let rows = self
            .probed(actual, &Corrector::Nothing, &Disturbances::default())?
            .rows;
        let corrections = corrector.of(&kinematics, &rows)?;
        let errors = rows.iter().zip(&corrections).map(|(row, correction)| {
            let situation = Situation {
                sign: row.direction,
                ..Situation::default()
            };
            let q = self.machine.to_kinematic(&row.position);
            let dq = self.machine.to_kinematic(correction);
            1e3 * kinematics.volumetric_error(&q, &dq, &situation).t
        });
        Ok(errors.collect())
    }

    /// The distance from tip to ball (µm) at each probing, in the tool frame, with ball and stylus where they explain
    /// most of it.
    pub fn set_up_free(
        &self,
        actual: &ErrorModel,
        corrector: &Corrector<'_>,
        disturbances: &Disturbances,
    ) -> Result<Spread, ReproduceError> {
        let identified = self.identified(actual, corrector, disturbances)?;
        let perfect = ErrorModel::perfect(self.machine);
        let nominal = Kinematics::new(self.machine, &perfect);
        let rows = identified.rows.iter().zip(&self.strategy.rows);
        // Only rotary positions determine the orientation of the tool.
        let errors: Vec<Vector3<f64>> = rows
            .map(|(row, probing)| {
                let q = self.machine.to_kinematic(&probing.position);
                nominal.nominal(&q, None).r.transpose() * row.before * 1e3
            })
            .collect();
        Ok(Spread::of(&errors))
    }

    /// The effective parameters with a correction, compared with those `before` it (Eq. 38), and how far all of them
    /// move the tip at the probings.
    pub fn left(
        &self,
        actual: &ErrorModel,
        corrector: &Corrector<'_>,
        disturbances: &Disturbances,
        before: &ErrorModel,
    ) -> Result<Compensated, ReproduceError> {
        let (problem, identified) = self.both(actual, corrector, disturbances)?;
        let mut before = before.clone();
        before.standard_uncertainty.clear();
        Ok(compensability(&problem, &identified, &before))
    }
}
