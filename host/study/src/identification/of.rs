//! From what was found to its numbers and names.

use super::{
    BallRecord, BarRecord, ChangeRecord, CheckRecord, Compared, CycleRecord, DriftRecord,
    EstimateRecord, HeldOutRecord, Identification, LevelRecord, NoiseRecord, NotSeen,
    ObservedRecord, PartStated, PlaceRecord, Probed, PublishedRecord, ReadingRecord, RepeatsRecord,
    RowRecord, SetupPartRecord, SetupRecord, StatedOutlier, TemperaturesRecord, ThermalRecord,
};
use crate::StudyOutcome;
use nalgebra::Vector3;
use serde::{Serialize, Serializer};
use trueaxis_identify::formats::probings::Probing;
use trueaxis_identify::{
    BarCheck, Checked, Compensability, Compensated, Estimated, FoundDrift, FoundPart, HeldOut,
    Level, Missing, Outlier, Published, Stated, TrendAlong, Unseen, VarianceComponent,
};
use trueaxis_model::errors::Parameter;
use trueaxis_probing::plan::added;

/// Coverage factor of expanded uncertainties: 95 %.
const EXPANDED: f64 = 2.0;

fn um(mm: Vector3<f64>) -> [f64; 3] {
    (mm * 1e3).into()
}

fn names(all: &[Parameter]) -> Vec<String> {
    all.iter().map(Parameter::to_string).collect()
}

impl Identification {
    /// The numbers and names of an outcome.
    #[must_use]
    pub fn of(found: &StudyOutcome<'_>) -> Self {
        let identified = &found.identified;
        let name = |i: usize| identified.parameters[i].parameter.to_string();
        let correlated = found.correlated().into_iter();
        let covariance = identified.covariance.row_iter();
        let balls = found.honesty.balls.iter().zip(&identified.balls);
        let refuted = identified.components.iter().filter(|one| one.is_refuted);
        let held_out = found.held_out.as_ref();
        let rows = found.probings.rows.iter().zip(&identified.rows);
        Self {
            machine: found.machine.name.clone(),
            probings: found.probings.rows.len(),
            probed: Probed::of(found),
            balls: balls
                .map(|(ball, place)| BallRecord {
                    name: ball.name.clone(),
                    place_mm: (*place).into(),
                    probings: ball.rows,
                    left_um: ball.rms * 1e3,
                    most_um: ball.max * 1e3,
                })
                .collect(),
            stylus_mm: identified.stylus.into(),
            parameters: (identified.parameters.iter())
                .map(EstimateRecord::from)
                .collect(),
            correlations: correlated.map(|(i, j, r)| (name(i), name(j), r)).collect(),
            covariance: covariance
                .map(|row| row.iter().copied().collect())
                .collect(),
            bars: identified.bars.iter().map(BarRecord::from).collect(),
            observed: ObservedRecord::of(found),
            temperatures: TemperaturesRecord::of(found),
            compensated: found.compared.as_ref().map(Compared::from),
            unseen: (identified.unseen.iter())
                .map(|unseen| NotSeen::of(unseen, found))
                .collect(),
            noise_um: identified.noise * 1e3,
            noise_of_stated: identified.of_stated,
            misfit_um: found.not_known.misfit.map(|misfit| misfit * 1e3),
            misfit_urad: found.not_known.misfit_of_direction.map(|urad| urad * 1e6),
            refuted: refuted.map(|one| one.source.name().to_owned()).collect(),
            degrees_of_freedom: identified.freedom,
            condition: identified.condition,
            levels: found.levels.iter().map(LevelRecord::from).collect(),
            published: found.published.as_ref().map(PublishedRecord::from),
            held_out: held_out.ok().map(HeldOutRecord::from),
            not_held_out: held_out.err().map(ToString::to_string),
            left_um: um(found.honesty.coordinates),
            checks: found.honesty.checks.iter().map(CheckRecord::from).collect(),
            repeats: found.honesty.repeats.map(|repeats| RepeatsRecord {
                places: repeats.places,
                degrees_of_freedom: repeats.freedom,
                pooled_standard_deviation_um: repeats.deviation * 1e3,
                ratio: repeats.ratio,
                is_less: repeats.is_less,
            }),
            places: found.places.iter().map(PlaceRecord::from).collect(),
            outliers: (found.outliers.iter())
                .map(|one| StatedOutlier::of(one, &found.probings.rows))
                .collect(),
            rows: rows
                .enumerate()
                .map(|(number, (row, at))| RowRecord {
                    line: row.line,
                    run: row.run,
                    time_s: row.time,
                    temperature: row.temperature,
                    before_um: um(at.before),
                    after_um: um(at.after),
                    is_trusted: at.is_trusted && !found.is_outlier(number),
                })
                .collect(),
            warnings: found.warnings(),
        }
    }
}

impl From<&Estimated> for EstimateRecord {
    fn from(one: &Estimated) -> Self {
        Self {
            parameter: one.parameter.to_string(),
            value: one.value,
            standard_uncertainty: one.uncertainty,
            expanded_uncertainty: EXPANDED * one.uncertainty,
        }
    }
}

impl From<&BarCheck> for BarRecord {
    fn from(bar: &BarCheck) -> Self {
        Self {
            balls: bar.balls.clone(),
            length_mm: bar.length,
            standard_uncertainty_mm: bar.uncertainty,
            others_mm: bar.others.map(|others| others.length),
            others_standard_uncertainty_mm: bar.others.map(|others| others.uncertainty),
            normalised: bar.others.map(|others| others.normalised),
            is_doubtful: bar.is_doubtful(),
        }
    }
}

impl NotSeen {
    fn of(unseen: &Unseen, found: &StudyOutcome<'_>) -> Self {
        let with = unseen.with.iter();
        let balls = &found.probings.balls;
        Self {
            unknown: unseen.unknown.to_string(),
            sentence: unseen.sentence(),
            with: with.map(|(u, part)| (u.to_string(), *part)).collect(),
            add: added(found.machine, balls, unseen.unknown, &found.remedies),
        }
    }
}

impl From<&Level> for LevelRecord {
    fn from(level: &Level) -> Self {
        let fit = level.found.as_ref();
        let elsewhere = fit.ok().and_then(|fit| fit.elsewhere);
        Self {
            model: level.tried.to_string(),
            parameters: fit.ok().map(|fit| fit.parameters),
            unseen: fit.ok().map(|fit| fit.unseen),
            left_um: fit.ok().map(|fit| fit.left * 1e3),
            elsewhere_um: elsewhere.map(|off| off * 1e3),
            error: fit.err().map(ToString::to_string),
        }
    }
}

impl From<&Published> for PublishedRecord {
    fn from(published: &Published) -> Self {
        let fit = published.fit.as_ref();
        let elsewhere = fit.ok().and_then(|fit| fit.elsewhere);
        let reason = |why: Missing| match why {
            Missing::Confounded => "confounded",
            Missing::Idle => "idle",
            Missing::Constant => "constant",
            Missing::Degree => "degree",
            Missing::Form => "form",
        };
        let missing = published.missing.iter();
        Self {
            model: published.model.to_string(),
            coefficients: published.count,
            seen: fit.ok().map(|fit| fit.parameters),
            left_um: fit.ok().map(|fit| fit.left * 1e3),
            elsewhere_um: elsewhere.map(|off| off * 1e3),
            error: fit.err().map(ToString::to_string),
            kept: names(&published.kept),
            missing: missing
                .map(|(parameter, why)| (parameter.to_string(), reason(*why).to_owned()))
                .collect(),
            besides: names(&published.besides),
            is_same: published.is_same,
        }
    }
}

impl From<&HeldOut> for HeldOutRecord {
    fn from(held_out: &HeldOut) -> Self {
        let balls = held_out.balls.iter();
        Self {
            rms_um: held_out.rms * 1e3,
            balls: balls.map(|(name, rms)| (name.clone(), rms * 1e3)).collect(),
        }
    }
}

impl From<&Checked> for CheckRecord {
    fn from(checked: &Checked) -> Self {
        let (along, axis, run, over) = match checked.along {
            TrendAlong::Time(span) => ("time_s", None, None, Some(span)),
            TrendAlong::Order => ("order", None, None, None),
            TrendAlong::Temperature(span) => ("temperature_C", None, None, Some(span)),
            TrendAlong::Run(run) => ("run", None, Some(run), None),
            TrendAlong::Direction(axis) => ("direction", Some(axis), None, None),
        };
        Self {
            along: along.to_owned(),
            axis,
            run,
            over,
            change_um: checked.trend.map(|trend| um(trend.change)),
            standard_uncertainty_um: checked.trend.map(|trend| um(trend.uncertainty)),
            is_significant: checked.trend.is_some_and(|trend| trend.is_significant()),
        }
    }
}

impl From<&Stated> for PlaceRecord {
    fn from(one: &Stated) -> Self {
        Self {
            what: one.what.clone(),
            found_mm: one.found.into(),
            stated_mm: one.stated.map(Into::into),
        }
    }
}

impl StatedOutlier {
    fn of((outlier, sentence): &(Outlier, String), rows: &[Probing]) -> Self {
        Self {
            sentence: sentence.clone(),
            is_group: outlier.is_group(),
            lines: outlier.rows.iter().map(|i| rows[*i].line).collect(),
        }
    }
}

impl ObservedRecord {
    fn of(found: &StudyOutcome<'_>) -> Option<Self> {
        let (all, identified) = (&found.observations, &found.identified);
        if all.rows.is_empty() && identified.drift.is_empty() {
            return None;
        }
        let setups = identified.setups.iter().map(|setup| SetupRecord {
            name: setup.name.clone(),
            kind: setup.kind.name().to_owned(),
            parts: setup.parts.iter().map(SetupPartRecord::from).collect(),
        });
        let rows = all.rows.iter().zip(&identified.observed);
        let rows = rows.map(|(row, at)| {
            let setup = &all.setups[row.setup];
            let dimension = setup.kind.dimension();
            let left = |mm: &[f64]| mm[..dimension].iter().map(|v| v * 1e3).collect();
            ReadingRecord {
                file: all.files[row.file].clone(),
                line: row.line,
                setup: setup.name.clone(),
                kind: setup.kind.name().to_owned(),
                before: left(at.before.as_slice()),
                after: left(at.after.as_slice()),
                is_trusted: at.is_trusted,
            }
        });
        Some(Self {
            noise: (identified.components.iter())
                .map(NoiseRecord::from)
                .collect(),
            setups: setups.collect(),
            drift: identified.drift.iter().map(DriftRecord::from).collect(),
            rows: rows.collect(),
        })
    }
}

impl From<&VarianceComponent> for NoiseRecord {
    fn from(one: &VarianceComponent) -> Self {
        Self {
            source: one.source.name().to_owned(),
            rows: one.rows,
            noise: one.noise * 1e3,
            unit: one.source.unit().to_owned(),
            of_stated: one.of_stated,
            degrees_of_freedom: one.freedom,
            is_misstated: one.is_misstated(),
        }
    }
}

impl From<&FoundPart> for SetupPartRecord {
    fn from(part: &FoundPart) -> Self {
        Self {
            what: part.what.clone(),
            value: part.value,
            standard_uncertainty: part.uncertainty,
            stated: part.prior.map(|prior| PartStated {
                value: prior.value,
                standard_uncertainty: prior.sigma,
                z: prior.z,
            }),
        }
    }
}

impl From<&FoundDrift> for DriftRecord {
    fn from(drift: &FoundDrift) -> Self {
        Self {
            setup: drift.setup.clone(),
            component: ["x", "y", "z", "a", "b", "c"][drift.component].to_owned(),
            value: drift.value,
            standard_uncertainty: drift.uncertainty,
            over_s: drift.seconds,
            time_constant_s: drift.lag,
            sentence: drift.to_string(),
        }
    }
}

impl TemperaturesRecord {
    fn of(found: &StudyOutcome<'_>) -> Option<Self> {
        let warmed = found.warmed.as_ref()?;
        let terms = found.identified.thermal.iter().map(|change| {
            let input = &warmed.model.inputs[change.input];
            ThermalRecord {
                parameter: change.parameter.to_string(),
                sensor: input.sensor.clone(),
                lag_s: input.lag,
                lag_standard_uncertainty_s: warmed.lag_uncertainty[change.input]
                    .map(|u| u * input.lag),
                reference_celsius: input.reference_celsius,
                per_kelvin: change.per_kelvin,
                standard_uncertainty: change.uncertainty,
            }
        });
        let cycles = warmed.cycles.iter().map(|cycle| CycleRecord {
            equations: cycle.rows,
            without_um: cycle.without * 1e3,
            with_um: cycle.with * 1e3,
        });
        Some(Self {
            terms: terms.collect(),
            left_out_without_um: warmed.left_out[0] * 1e3,
            left_out_with_um: warmed.left_out[1] * 1e3,
            coverage_95_um: warmed.band * 1e3,
            cycles: cycles.collect(),
            dropped: warmed.dropped.clone(),
        })
    }
}

impl From<&Compensated> for Compared {
    fn from(compared: &Compensated) -> Self {
        let um = |k: usize| compared.tip.map(|of| of[k] * 1e3);
        Self {
            parameters: compared.parameters.iter().map(ChangeRecord::from).collect(),
            mean_um: um(0),
            largest_um: um(1),
        }
    }
}

impl From<&Compensability> for ChangeRecord {
    fn from(one: &Compensability) -> Self {
        Self {
            parameter: one.parameter.to_string(),
            before: one.before[0],
            before_standard_uncertainty: one.before[1],
            after: one.after.map(|after| after[0]),
            after_standard_uncertainty: one.after.map(|after| after[1]),
            compensability: one.part().map(|part| part[0]),
            compensability_standard_uncertainty: one.part().map(|part| part[1]),
            is_small_before: one.is_small(),
            effect_um: one.effect.map(|effect| effect * 1e3),
        }
    }
}

impl Serialize for StudyOutcome<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        Identification::of(self).serialize(serializer)
    }
}
