use super::super::specimen::{errors, with_rotary};
use super::super::structure::Term;
use super::super::variables::{Generator, variables};
use super::*;
use trueaxis::FACTORS;
use trueaxis_model::kinematics::Kinematics;
use trueaxis_model::machine::PerAxis;

/// X, Y, Z and C of a machine, with all products of their generators up to the second degree.
fn specimen() -> (Vec<Variable>, Vec<Basis>) {
    let machine = with_rotary(&[('C', [-100.0, 100.0])]);
    let errors = errors(&machine, "");
    let variables = variables(&Kinematics::new(&machine, &errors), 1e-6);
    let basis = |v: &Variable| match v.is_rich() {
        true => Basis::of_generators(v, 2, &v.many()),
        false => Basis::of_lever(v),
    };
    let bases = variables.iter().map(basis).collect();
    (variables, bases)
}

fn number_of(basis: &Basis, product: &[Generator]) -> usize {
    basis.products.iter().position(|p| p == product).unwrap()
}

/// Tables of variables, and terms of outputs with a weight and tables; their sums at some positions.
#[derive(Clone, Default)]
struct Made(Structure);

impl Made {
    fn table(&mut self, variable: usize, coefficients: Vec<f64>) -> (usize, Function) {
        self.0.merged.push(Merged {
            variable,
            coefficients,
        });
        (variable, Function::Merged(self.0.merged.len() - 1))
    }

    fn term(&mut self, output: usize, weight: f64, factors: &[(usize, Function)]) {
        self.0.terms.push(Term {
            output,
            weight,
            factors: factors.to_vec(),
        });
    }
}

fn value(structure: &Structure, variables: &[Variable], at: &[f64], output: usize) -> f64 {
    let function = |&(v, f): &(usize, Function)| match f {
        Function::Generator(g) => g.value(&variables[v], at[v]),
        Function::Merged(id) => {
            let basis = Basis::of_generators(&variables[v], 2, &[at[v]]);
            basis.at_nodes(&structure.merged[id].coefficients)[0]
        }
        Function::Numeric(_) | Function::Sign => panic!("there are none"),
    };
    let terms = structure.terms.iter().filter(|t| t.output == output);
    terms
        .map(|t| t.weight * t.factors.iter().map(function).product::<f64>())
        .sum()
}

/// Folds a structure. Also returns the largest change at the corners and in the middle of two variables.
fn folded(made: &Made, may_lose: f64, along: [usize; 2]) -> (Structure, f64) {
    let (variables, bases) = specimen();
    let mut structure = made.0.clone();
    // The limit is compared with twice the root.
    let mut spare = Spare::new(PerAxis::default(), 2.0 * may_lose);
    structure.fold(&variables, &bases, &mut spare);
    let mut most: f64 = 0.0;
    for place in 0..9 {
        let mut at = [0.0; 4];
        for (v, step) in along.into_iter().zip([place % 3, place / 3]) {
            let [low, high] = variables[v].calibrated;
            at[v] = low + (high - low) * step as f64 / 2.0;
        }
        for output in 0..2 {
            let [before, after] = [&made.0, &structure].map(|s| value(s, &variables, &at, output));
            most = most.max((after - before).abs());
        }
    }
    (structure, most)
}

const X: usize = 0;
const Y: usize = 1;
const C: usize = 3;
const ALONG_X: (usize, Function) = (X, Function::Generator(Generator::Coordinate));

#[test]
fn terms_that_differ_along_one_variable_become_one() {
    let mut made = Made::default();
    // y + 0.5, and −2 times that, except for 0.01.
    let one = made.table(Y, vec![0.5, 1.0, 0.0]);
    let other = made.table(Y, vec![-1.01, -2.0, 0.0]);
    made.term(0, 3.0, &[ALONG_X, one]);
    made.term(0, 1.0, &[other]);
    let (structure, change) = folded(&made, 0.02, [X, Y]);
    assert_eq!((structure.terms.len(), structure.count()), (1, 2));
    assert!((1e-6..0.02).contains(&change), "{change}");
    // A change beyond the spare tolerance is not made.
    let (structure, change) = folded(&made, 0.002, [X, Y]);
    assert_eq!((structure.terms.len(), change), (2, 0.0));
}

#[test]
fn three_terms_become_one_in_two_rounds() {
    let mut made = Made::default();
    for (constant, slope) in [(0.5, 1.0), (0.25, -0.5), (1.0, 0.125)] {
        let table = made.table(Y, vec![constant, slope, 0.0]);
        made.term(0, 1.0, &[ALONG_X, table]);
    }
    let (structure, change) = folded(&made, 1e-6, [X, Y]);
    assert_eq!((structure.terms.len(), structure.count()), (1, 2));
    assert!(change < 1e-12, "{change}");
}

#[test]
fn terms_of_other_outputs_and_along_two_variables_stay() {
    let mut made = Made::default();
    let one = made.table(Y, vec![0.5, 1.0, 0.0]);
    made.term(0, 3.0, &[ALONG_X, one]);
    made.term(1, 3.0, &[one]);
    made.term(0, 1.0, &[(Y, Function::Generator(Generator::Coordinate))]);
    let (structure, change) = folded(&made, 0.1, [X, Y]);
    assert_eq!((structure.terms.len(), change), (3, 0.0));
}

#[test]
fn tables_that_are_multiples_of_each_other_become_one() {
    let mut made = Made::default();
    let one = made.table(Y, vec![0.5, 1.0, 0.3]);
    let other = made.table(Y, vec![-1.0, -2.0, -0.601]);
    made.term(0, 1.0, &[one]);
    made.term(1, 1.0, &[other]);
    let (structure, change) = folded(&made, 0.01, [X, Y]);
    assert_eq!((structure.terms.len(), structure.count()), (2, 1));
    assert!((1e-6..0.01).contains(&change), "{change}");
    assert_eq!(folded(&made, 0.0001, [X, Y]).0.count(), 2);
}

#[test]
fn a_sum_that_is_a_product_of_too_many_tables_is_not_made() {
    use Generator::{Coordinate, Cosine, Sine};
    let (_, bases) = specimen();
    let [single, double] = [vec![Sine], vec![Sine, Cosine]].map(|p| number_of(&bases[C], &p));
    let (mut one, mut other) = (vec![0.0; bases[C].len()], vec![0.0; bases[C].len()]);
    (one[single], one[double], other[single]) = (0.7, 0.5, -0.7);
    for count in [FACTORS - 1, FACTORS] {
        let mut made = Made::default();
        let [one, other] = [&one, &other].map(|c| made.table(C, c.clone()));
        for own in [one, other] {
            let levers = [X, X, Y, Y, 2].map(|v| (v, Function::Generator(Coordinate)));
            let factors = [&levers[..count - 1], &[own]].concat();
            made.term(0, 1.0, &factors);
        }
        let (structure, change) = folded(&made, 1e-6, [X, C]);
        assert_eq!(structure.terms.len(), if count < FACTORS { 1 } else { 2 });
        assert!(structure.terms.iter().all(|t| t.factors.len() <= FACTORS));
        assert!(change < 1e-9, "{change}");
    }
}
