use super::*;
use trueaxis_model::machine::Machine;

fn found(errors: &str, names: &[&str]) -> Vec<Option<Expected>> {
    let text = include_str!("../../../../../examples/mill-21/machine.toml");
    let machine = Machine::from_toml(text).unwrap();
    let text = format!("machine = \"{}\"\n{errors}", machine.name);
    let errors = ErrorModel::from_toml(&text, &machine).unwrap();
    let names: Vec<Quantity> = (names.iter())
        .map(|name| Quantity::parse(name, &machine).unwrap())
        .collect();
    expected(&Subject::new(&machine, &errors, None, 3), &names, 0.0).unwrap()
}

#[test]
fn a_squareness_is_expected_in_the_circle_as_far_as_it_is_known() {
    // G in XY is the squareness times the radius: 40 ± 2·4 µrad at 150 mm or another bar. 1000 draws know both ends
    // to 6 % of the standard uncertainty; 0.2 of it is three times that.
    let errors = "[parameters]\nEC0X = 40e-6\n[standard_uncertainty]\nEC0X = 4e-6\n";
    let all = found(errors, &["G XY", "H XY", "G YZ"]);
    let exact = found("[parameters]\nEC0X = 40e-6\n", &["G XY"])[0].unwrap();
    assert_eq!(exact.interval, None);
    let g = all[0].unwrap();
    let unit = exact.value / 40.0;
    assert!((g.value - exact.value).abs() < 0.2 * 4.0 * unit, "{g:?}");
    let [low, high] = g.interval.unwrap();
    assert!(
        (low - unit * (40.0 - 1.96 * 4.0)).abs() < 0.3 * 4.0 * unit,
        "{g:?}"
    );
    assert!(
        (high - unit * (40.0 + 1.96 * 4.0)).abs() < 0.3 * 4.0 * unit,
        "{g:?}"
    );
    for other in &all[1..] {
        assert!(other.unwrap().interval.unwrap()[1] < 1e-3, "{other:?}");
    }
}

#[test]
fn a_scale_is_expected_in_positioning_and_at_the_tip() {
    let errors = "[parameters]\nEXX1 = 20e-6\n[standard_uncertainty]\nEXX1 = 1e-6\n";
    let all = found(errors, &["E X", "B X", "tip mean"]);
    let e = all[0].unwrap();
    let [low, high] = e.interval.unwrap();
    // ± 1.96 standard uncertainties of 20: ± 9.8 %.
    assert!((high / e.value - 1.098).abs() < 0.015, "{e:?}");
    assert!((low / e.value - 0.902).abs() < 0.015, "{e:?}");
    assert!(all[1].unwrap().value.abs() < 1e-9);
    // At positions along X from its start, the error is the scale times the distance: evenly spread, with a standard
    // deviation of its mean over √3. Its mean over 1000 positions is known to 2/√3000 of itself.
    let tip = all[2].unwrap();
    let high = tip.interval.unwrap()[1] / tip.value;
    assert!(
        (high - 1.098 - 2.0 / 3000.0_f64.sqrt()).abs() < 0.015,
        "{tip:?}"
    );
}

#[test]
fn what_the_model_lacks_widens_intervals() {
    let errors = "[parameters]\nEXX1 = 20e-6\n[standard_uncertainty]\nEXX1 = 1e-6\n";
    let names = ["tip mean", "tip p95", "E X", "F XY", "direction mean"];
    let without = found(errors, &names);
    let with = found(
        &format!("{errors}[uncertainty]\nmisfit_um = 0.5\nmisfit_urad = 0.2\n"),
        &names,
    );
    for (k, by) in [0.866, 1.40, 2.505, 1.51, 0.283].into_iter().enumerate() {
        let [a, b] = [&without, &with].map(|all| all[k].unwrap().interval.unwrap());
        assert!((b[1] - a[1] - by).abs() < 1e-3, "{}: {a:?} {b:?}", names[k]);
        assert!(
            (b[0] - (a[0] - by).max(0.0)).abs() < 1e-3,
            "{}: {a:?} {b:?}",
            names[k]
        );
    }
}

#[test]
fn an_error_matters_where_it_moves_something() {
    let text = include_str!("../../../../../examples/kolibri/machine.toml");
    let machine = Machine::from_toml(text).unwrap();
    let errors = ErrorModel::perfect(&machine);
    let subject = Subject::new(&machine, &errors, None, 3);
    for (name, quantity, is) in [
        ("EX0C", "tip mean", true),
        ("EX0C", "direction p95", false),
        ("EX0C", "G XY", false),
        ("EX0C", "E X", false),
        ("EA0C", "direction mean", true),
        ("EC0X", "G XY", true),
        ("EC0X", "E X", false),
    ] {
        let parameter = Parameter::parse(name).unwrap();
        let quantity_ = Quantity::parse(quantity, &machine).unwrap();
        assert_eq!(
            matters(&subject, parameter, quantity_),
            is,
            "{name} {quantity}"
        );
    }
}

#[test]
fn intervals_contain_the_truth_where_the_noise_is_as_large_as_the_error() {
    let mut random = Pcg64Mcg::seed_from_u64(11);
    // What E, B and M of an axis are, without errors and with some as large as the noise, of twelve readings each.
    for (um, lost, truth) in [(0.0, 0.0, [0.0; 3]), (1.0, 2.0, [4.0, 2.0, 2.0])] {
        let mut contained = [0; 3];
        const FILES: usize = 20;
        for _ in 0..FILES {
            let mut values = |side: f64| -> Vec<String> {
                let mut value = |k: usize| {
                    let error =
                        um * if k.is_multiple_of(2) { 1.0 } else { -1.0 } + side * lost / 2.0;
                    format!("{}", 1e-3 * (error + 0.5 * normal(&mut random)))
                };
                (0..6).map(&mut value).collect()
            };
            let [positive, negative] = [values(1.0), values(-1.0)].map(|all| all.join(", "));
            let errors = format!(
                "[tabulated.EXX]\nat = [0.0, 100.0, 200.0, 300.0, 400.0, 500.0]\n\
                 positive = [{positive}]\nnegative = [{negative}]\nstandard_uncertainty = 0.0005\n"
            );
            let all = found(&errors, &["E X", "B X", "M X"]);
            for ((contained, found), truth) in contained.iter_mut().zip(all).zip(truth) {
                let [low, high] = found.unwrap().interval.unwrap();
                *contained += usize::from(low <= truth && truth <= high);
            }
        }
        // The probability that fewer than 17 of 20 contain it is 2 % at 95 %; the intervals are wider than needed.
        assert!(contained.iter().all(|n| *n >= 17), "{um}: {contained:?}");
    }
}

#[test]
fn values_of_a_table_scatter_independently() {
    let errors =
        "[tabulated.EXX]\nat = [0.0, 500.0]\nvalue = [0.0, 0.0]\nstandard_uncertainty = 0.001\n";
    let all = found(errors, &["E X"]);
    let e = all[0].unwrap();
    // |difference of two values| of 1 µm: 95 % of a half-normal distribution with σ = √2, known to 5 % from 1000 draws; the
    // ends of the travel are those of the table.
    assert!(e.value.abs() < 1e-9, "{e:?}");
    let [low, high] = e.interval.unwrap();
    assert_eq!(low, 0.0);
    assert!(
        (high - 1.96 * std::f64::consts::SQRT_2).abs() < 0.3,
        "{e:?}"
    );
}
