//! A machine on its way through the steps of a plan.

use super::candidates::Setup;
use super::scene::{Scene, Way};
use super::step::ProbingStep;
use trueaxis_model::machine::PerAxis;

/// A machine on its way through steps.
#[derive(Clone, Debug)]
pub(super) struct Course<'a> {
    setup: &'a Setup<'a>,
    scene: Scene<'a>,
    /// Where each axis is (mm, deg), if that is known.
    at: Vec<Option<f64>>,
}

impl<'a> Course<'a> {
    /// Somewhere.
    pub fn new(setup: &'a Setup<'a>) -> Self {
        Self {
            setup,
            scene: Scene::new(setup.machine, setup.artefact, &setup.probe, 0.0),
            at: vec![None; setup.machine.axes.len()],
        }
    }

    /// Makes a step; returns what meets on it in words, if that is to be known of the way of a ball.
    pub fn go(&mut self, step: &ProbingStep, ball: Option<&str>) -> Option<String> {
        let Setup {
            machine,
            artefact,
            probe,
            ..
        } = self.setup;
        let (to, way) = match step {
            ProbingStep::Row(_) => return None,
            ProbingStep::Orient(angle) => {
                self.scene = Scene::new(machine, artefact, probe, *angle);
                let here = self.position()?;
                let turning = Scene::turning(machine, artefact, probe);
                return turning.meeting(ball?, Way::Far, &here, &here);
            }
            ProbingStep::Rapid(to) => (to, Way::Far),
            ProbingStep::Near(to) => (to, Way::Near),
            ProbingStep::Touch { end, .. } => (end, Way::Touch),
        };
        let (from, before) = (self.position(), self.at.clone());
        for (axis, position) in to {
            self.at[*axis] = Some(*position);
        }
        let end = self.position();
        // After a touch the stylus goes back the same way.
        if way == Way::Touch {
            self.at = before;
        }
        self.scene.meeting(ball?, way, &from?, &end?)
    }

    /// Makes several steps.
    pub fn follow(&mut self, steps: &[ProbingStep]) {
        for step in steps {
            self.go(step, None);
        }
    }

    fn position(&self) -> Option<PerAxis> {
        let mut position = PerAxis::default();
        for (position, at) in position.iter_mut().zip(&self.at) {
            *position = (*at)?;
        }
        Some(position)
    }

    /// True if nothing meets on these steps, which belong to a ball.
    pub fn is_clear(&self, steps: &[ProbingStep], ball: &str) -> bool {
        let mut course = self.clone();
        steps
            .iter()
            .all(|step| course.go(step, Some(ball)).is_none())
    }
}
