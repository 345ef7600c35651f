//! Text output of `trueaxis identify`.

use super::super::measured::motions;
use super::super::quantity::{EXPANDED, count, shown};
use super::super::unidentifiable;
use super::compensability::compensability;
use super::listed::published;
use super::observed;
use super::thermal;
use trueaxis_identify::{Identified, Level, RowResult};
use trueaxis_study::{Probed, StudyOutcome};

/// Largest number of rows listed.
const NAMED: usize = 10;

/// The text output; only if it is verbose, everything that the result was checked with.
pub fn screen(found: &StudyOutcome<'_>, is_verbose: bool) -> String {
    let StudyOutcome {
        machine,
        probings: measured,
        identified,
        ..
    } = found;
    let mut text = format!(
        "{}: {} parameters from {}\n\n",
        machine.name,
        identified.parameters.len(),
        observed::counts(found)
    );
    parameters(&mut text, identified);
    if let Some(kept) = &found.kept {
        text += "\nkept as tables\n";
        motions(&mut text, found.machine, found.runs, kept);
    }
    thermal::lines(&mut text, found);
    compensability(&mut text, found.compared.as_ref());
    if !measured.rows.is_empty() {
        left(&mut text, identified);
        misfit(&mut text, found);
    }
    observed::noise(&mut text, found);
    between(&mut text, found);
    if measured.rows.is_empty() {
        misfit(&mut text, found);
    } else if is_verbose {
        places(&mut text, found);
        by_ball(&mut text, found);
        checks(&mut text, found);
    }
    senses(&mut text, found);
    observed::setups(&mut text, found);
    if is_verbose {
        bars(&mut text, identified);
        correlations(&mut text, found);
    }
    unidentifiable::lines(
        &mut text,
        "in these probings",
        machine,
        &measured.balls,
        &identified.unseen,
        &found.remedies,
    );
    if is_verbose && !measured.rows.is_empty() {
        levels(&mut text, &found.levels);
    }
    if is_verbose {
        published(&mut text, found.published.as_ref());
    }
    text
}

fn parameters(text: &mut String, identified: &Identified) {
    *text += "parameter        value   standard   expanded (k = 2)\n";
    for e in &identified.parameters {
        let p = e.parameter;
        let (show, unit) = shown(p);
        *text += &format!(
            "  {:<8}{:>12}{:>11}{:>11} {unit}\n",
            p.to_string(),
            show(e.value),
            show(e.uncertainty),
            show(EXPANDED * e.uncertainty)
        );
    }
}

fn left(text: &mut String, identified: &Identified) {
    let distances = |of: fn(&RowResult) -> f64| {
        let all = identified.rows.iter().map(of);
        let most = all.clone().fold(0.0, f64::max);
        (
            all.sum::<f64>() / identified.rows.len() as f64 * 1e3,
            most * 1e3,
        )
    };
    let (mean, most) = distances(|row| row.before.norm());
    let (rest, worst) = distances(|row| row.after.norm());
    *text += "\nfrom tip to ball (µm)      mean    maximum\n";
    *text += &format!("  nominal machine      {mean:>8.2}{most:>11.2}\n");
    *text += &format!("  unexplained          {rest:>8.2}{worst:>11.2}\n");
    *text += &format!(
        "noise of a coordinate {:.2} µm, from {} degrees of freedom; condition {:.0}\n",
        identified.noise * 1e3,
        identified.freedom,
        identified.condition
    );
    if let Some(factor) = identified.of_stated {
        let rest_on = match identified.components.len() == 1 && identified.components[0].is_refuted
        {
            true => "more than chance explains: uncertainties rest on the residuals",
            false => "which uncertainties rest on",
        };
        *text += &format!("that is {factor:.2} times what the file states, {rest_on}\n");
    }
}

/// Errors that no measured position shows.
fn between(text: &mut String, found: &StudyOutcome<'_>) {
    for what in Probed::of(found).iter().flat_map(Probed::blind_to) {
        *text += &format!("{what}\n");
    }
}

/// How far errors that the model lacks move the tip.
fn misfit(text: &mut String, found: &StudyOutcome<'_>) {
    let Some(misfit) = found.not_known.misfit else {
        return;
    };
    let is_noise_known = found.identified.of_stated.is_some() || found.honesty.repeats.is_some();
    *text += &format!(
        "errors that the model lacks: up to {:.2} µm of each coordinate (rms) where it was measured{}\n",
        misfit * 1e3,
        match is_noise_known {
            true => "",
            false => "; all noise counts as such without sigma_um or places probed twice",
        }
    );
}

fn by_ball(text: &mut String, found: &StudyOutcome<'_>) {
    *text += "\nball   probings   residual (µm, rms)   maximum   predicted without it\n";
    for ball in &found.honesty.balls {
        let predicted = found.held_out.as_ref().ok();
        let predicted = predicted.and_then(|p| p.balls.iter().find(|(name, _)| *name == ball.name));
        let predicted = predicted.map_or("-".to_owned(), |(_, rms)| format!("{:.2}", rms * 1e3));
        *text += &format!(
            "  {:<7}{:>6}{:>21.2}{:>10.2}{predicted:>23}\n",
            ball.name,
            ball.rows,
            ball.rms * 1e3,
            ball.max * 1e3
        );
    }
    *text += &match &found.held_out {
        Ok(held_out) if held_out.balls.is_empty() => format!(
            "every fourth row is predicted without these to {:.2} µm: there are too few balls to leave one out\n",
            held_out.rms * 1e3
        ),
        Ok(held_out) => format!(
            "balls are predicted without them to {:.2} µm (rms)\n",
            held_out.rms * 1e3
        ),
        Err(error) => format!("balls cannot be predicted without them: {error}\n"),
    };
}

/// Balls and stylus, found and as stated.
fn places(text: &mut String, found: &StudyOutcome<'_>) {
    *text += &format!(
        "\n{:<10}{:>11}{:>11}{:>11}   stated (mm)                        apart\n",
        "found (mm)", "x", "y", "z"
    );
    for one in &found.places {
        // Avoids -0.000.
        let [x, y, z]: [f64; 3] = one.found.map(|v| (v * 1e3).round() / 1e3 + 0.0).into();
        *text += &format!("  {:<8}{x:>11.3}{y:>11.3}{z:>11.3}", one.what);
        *text += &match (one.stated, one.distance()) {
            (Some(stated), Some(apart)) => format!(
                "{:>11.3}{:>11.3}{:>11.3}{apart:>9.3}\n",
                stated.x, stated.y, stated.z
            ),
            _ => "          -\n".to_owned(),
        };
    }
}

/// Axes whose sense the probings do not show.
fn senses(text: &mut String, found: &StudyOutcome<'_>) {
    if let Some(axes) = &found.unseen_senses {
        *text += &format!(
            "these rows would fit as well if {axes} counted the other way: nothing here shows it without nominal_mm of a ball in the artefact\n"
        );
    }
}

fn checks(text: &mut String, found: &StudyOutcome<'_>) {
    let left = found.honesty.coordinates * 1e3;
    *text += &format!(
        "\nresiduals in the workpiece frame (µm)       {:>14}{:>16}{:>16}\n",
        "x", "y", "z"
    );
    *text += &format!(
        "  {:<42}{:>14.2}{:>16.2}{:>16.2}\n",
        "rms", left.x, left.y, left.z
    );
    for checked in &found.honesty.checks {
        let name = format!("{} (k = 2)", checked.along);
        *text += &match checked.trend {
            Some(trend) => {
                let each = (trend.change * 1e3).zip_map(&(trend.uncertainty * 1e3), |c, u| {
                    format!("{c:.2} ± {:.2}", EXPANDED * u)
                });
                format!("  {name:<42}{:>14}{:>16}{:>16}\n", each.x, each.y, each.z)
            }
            None => format!("  {name:<42} cannot be distinguished from the balls and parameters\n"),
        };
    }
    if let Some(repeats) = found.honesty.repeats {
        *text += &format!(
            "{} probed again repeat to {:.2} µm (pooled standard deviation of a coordinate, {} degrees of freedom); the residual is {:.2} times that\n",
            count(repeats.places, "place"),
            repeats.deviation * 1e3,
            repeats.freedom,
            repeats.ratio
        );
    }
}

fn bars(text: &mut String, identified: &Identified) {
    for bar in &identified.bars {
        *text += &match bar.others {
            Some(others) => format!(
                "the bar from {} to {}, {:.4} mm, is {:.4} ± {:.4} mm (k = 2) by the machine and the other bars\n",
                bar.balls[0],
                bar.balls[1],
                bar.length,
                others.length,
                EXPANDED * others.uncertainty
            ),
            None => format!(
                "scales rest on the length of the bar from {} to {} alone: nothing here would show an error of it\n",
                bar.balls[0], bar.balls[1]
            ),
        };
    }
}

fn correlations(text: &mut String, found: &StudyOutcome<'_>) {
    let close = found.correlated();
    if close.is_empty() {
        return;
    }
    *text += "\ncorrelations above 0.9\n";
    for (i, j, r) in close.iter().take(NAMED) {
        let [a, b] = [i, j].map(|k| found.identified.parameters[*k].parameter);
        *text += &format!("  {a} and {b}: {r:.3}\n");
    }
    more(text, close.len());
}

fn levels(text: &mut String, levels: &[Level]) {
    if levels.is_empty() {
        return;
    }
    *text += "\nmodel                    parameters   residual (µm)   elsewhere (µm)\n";
    for level in levels {
        let tried = level.tried.to_string();
        *text += &match &level.found {
            Ok(fit) => {
                let elsewhere = fit
                    .elsewhere
                    .map_or("-".to_owned(), |off| format!("{:.2}", off * 1e3));
                let (parameters, left) = (fit.parameters, fit.left * 1e3);
                format!("{tried:<22}{parameters:>13}{left:>16.2}{elsewhere:>17}\n")
            }
            Err(error) => format!("{tried:<22}   {error}\n"),
        };
    }
}

fn more(text: &mut String, count: usize) {
    if count > NAMED {
        *text += &format!("  and {} more\n", count - NAMED);
    }
}
