//! One part of the correction, sampled over its nodes.

use super::nodes::lagrange;
use super::variables::{MAX_VARIABLES, VariableValues};
use trueaxis_model::machine::PerAxis;

/// One part of the correction: what the switches in `on` add together, beyond the contributions of their proper
/// subsets.
#[derive(Clone, Debug)]
pub struct Component {
    /// Bit set of the switched variables (by index).
    pub on: u32,
    /// The rich variables, and their node positions here.
    pub rich: Vec<(usize, Vec<f64>)>,
    /// Which of the rich variables have their motions on.
    pub moving: Vec<bool>,
    /// Products of the other positions (and tool length) that it contains: of degree zero, one, and two where a
    /// motion bends. There, an angular motion shifted by its own axis' correction, which depends on the levers, acts
    /// on the levers again.
    pub monomials: Vec<Vec<usize>>,
    /// Odd variables: the part is proportional to each of them.
    pub odd: Vec<usize>,
    /// True if it is what the odd part leaves, proportional to the square of the only odd variable (second order).
    pub even: bool,
    /// Coefficients, mm and rad per output: monomial slowest, then the rich nodes in order.
    pub values: Vec<PerAxis>,
}

/// Levers that are not at 0, with their ξ.
pub type Levers = Vec<(usize, f64)>;

impl Component {
    /// Points and weights whose sum is the coefficient of a monomial. These are exact finite differences, because no
    /// monomial is of degree three.
    pub fn stencil(&self, monomial: usize) -> Vec<(Levers, f64)> {
        let quadratic = self.monomials.last().is_some_and(|m| m.len() == 2);
        match self.monomials[monomial][..] {
            [v] if quadratic => vec![(vec![(v, 1.0)], 0.5), (vec![(v, -1.0)], -0.5)],
            [v] => vec![(vec![(v, 1.0)], 1.0), (vec![], -1.0)],
            [v, w] if v == w => vec![
                (vec![(v, 1.0)], 0.5),
                (vec![(v, -1.0)], 0.5),
                (vec![], -1.0),
            ],
            [v, w] => vec![
                (vec![(v, 1.0), (w, 1.0)], 1.0),
                (vec![(v, 1.0)], -1.0),
                (vec![(w, 1.0)], -1.0),
                (vec![], 1.0),
            ],
            _ => vec![(vec![], 1.0)],
        }
    }

    /// The place of a rich node (affine and odd variables 0).
    pub fn place(&self, mut node: usize) -> VariableValues {
        let mut place = [0.0; MAX_VARIABLES];
        for (v, positions) in self.rich.iter().rev() {
            place[*v] = positions[node % positions.len()];
            node /= positions.len();
        }
        place
    }

    /// The nodes of this grid from which a node of a finer grid is interpolated, with their weights. The finer grid
    /// has more positions along some variables.
    pub fn around(&self, fine: &Self, node: usize) -> Vec<(usize, f64)> {
        let mut around = vec![(0, 1.0)];
        let mut rest = node;
        let mut stride = 1;
        for ((_, few), (_, all)) in self.rich.iter().zip(&fine.rich).rev() {
            let index = rest % all.len();
            rest /= all.len();
            let parts = if few.len() == all.len() {
                vec![(index, 1.0)]
            } else {
                lagrange(few, all[index])
            };
            around = around
                .iter()
                .flat_map(|(n, w)| parts.iter().map(move |(i, p)| (n + i * stride, w * p)))
                .collect();
            stride *= few.len();
        }
        around
    }

    /// Number of rich nodes.
    pub fn nodes(&self) -> usize {
        self.rich.iter().map(|(_, p)| p.len()).product()
    }

    /// Distance in the node index between neighbours of the `k`-th rich variable.
    pub fn stride(&self, k: usize) -> usize {
        self.rich[k + 1..].iter().map(|(_, p)| p.len()).product()
    }
}
