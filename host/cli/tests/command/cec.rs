//! `export cec` and `import cec`: their output, and what they refuse.

use crate::program::{Folder, answer, blob, done, example, plain, refused, split, trueaxis};

const AXES: &str = "X=AX1,Y=AX2,Z=AX3,A=AX4,C=AX5";

fn json(text: &str) -> serde_json::Value {
    serde_json::from_str(text).unwrap()
}

fn export<'a>(blob: &'a str, factor_tables: &'a str, out: &'a str) -> Vec<&'a str> {
    vec![
        "export",
        "cec",
        blob,
        "--axes",
        AXES,
        "--factor-tables",
        factor_tables,
        "-o",
        out,
    ]
}

fn import<'a>(
    file: &'a str,
    machine: &'a str,
    factor_tables: &'a str,
    out: &'a str,
) -> Vec<&'a str> {
    let mut arguments = vec!["import", "cec", file, "--machine", machine, "--axes", AXES];
    arguments.extend(["--factor-tables", factor_tables, "-o", out]);
    arguments
}

#[test]
fn thirteen_errors_of_the_huron_take_at_most_23_tables_under_both_readings() {
    let folder = Folder::new();
    let machine = example("huron-k2x8/machine.toml");
    let errors = example("huron-k2x8/errors-13.toml");
    for policy in ["direction", "orientation"] {
        let huron = folder.at("huron.trax");
        done(&format!(
            "compile {machine} {errors} --policy {policy} -o {huron}"
        ));
        for factor_tables in ["added", "not-added"] {
            let cec = folder.at("cec.mpf");
            let mut arguments = export(&huron, factor_tables, &cec);
            arguments.push("--json");
            let told = json(&answer(0, &arguments));
            let tables = told["tables"].as_u64().unwrap();
            // One output per table: at most F0 and three products for each linear axis, and one table for each
            // rotary one.
            assert!(tables <= 23, "{policy} {factor_tables}: {tables}");
            for axis in told["verification"]["axes"].as_array().unwrap() {
                // 0.05 µm or µrad; f32 rounding is a thousandth of that.
                assert!(axis["difference"].as_f64().unwrap() < 0.05, "{axis}");
            }
            let text = std::fs::read_to_string(&cec).unwrap();
            for axis in told["verification"]["axes"].as_array().unwrap() {
                let at = "XYZAC".find(axis["axis"].as_str().unwrap()).unwrap();
                let said = format!(
                    "; AX{}: MD32710 $MA_CEC_ENABLE 1; MD32720 $MA_CEC_MAX_SUM at least ",
                    at + 1
                );
                let rest = text
                    .split_once(&said)
                    .map(|(_, rest)| rest)
                    .unwrap_or("0 mm");
                let (limit, rest) = rest.split_once(' ').unwrap();
                let limit: f64 = limit.parse().unwrap();
                let factor = if rest.starts_with("deg") {
                    1e6_f64.to_radians()
                } else {
                    1e3
                };
                // The difference of the file from the compensation.
                let [largest, off] =
                    ["largest", "difference"].map(|key| axis[key].as_f64().unwrap());
                let largest = largest - off;
                assert!(limit * factor >= largest, "{axis}: {limit}");
            }
            // Every axis with tables.
            let count = |what: &str| text.matches(what).count();
            assert_eq!(
                count("; MD32720 $MA_CEC_MAX_SUM at least "),
                count(": MD32730 $MA_CEC_MAX_VELO at least ")
            );
            assert!(text.contains("; leave SD41310 $SN_CEC_TABLE_WEIGHT of all tables"));
            assert!(told["largest_factor"].as_f64().unwrap() <= 2.0);
            let [again, twice] = ["again.trax", "twice.mpf"].map(|name| folder.at(name));
            // The policy is not in the file.
            let mut arguments = import(&cec, &machine, factor_tables, &again);
            arguments.extend(["--policy", policy]);
            answer(0, &arguments);
            answer(0, &export(&again, factor_tables, &twice));
            let [first, second] = [&cec, &twice].map(|path| std::fs::read_to_string(path).unwrap());
            assert!(
                first == second,
                "{policy} {factor_tables}: not the same file again"
            );
            // The imported compensation meets the tolerance for which it was compiled.
            answer(
                0,
                &["verify", &machine, &errors, &again, "--random", "2000"],
            );
        }
    }
}

/// The magnitude of an adjustable weight is in the values: with the weight that a controller begins with, which is also that
/// of one that has lost its settings, a table adds no more than the error. And every table reaches its last point.
#[test]
fn adjustable_errors_are_as_large_in_the_tables_as_they_are() {
    let folder = Folder::new();
    let [machine, errors] =
        ["machine", "errors-13"].map(|n| example(&format!("huron-k2x8/{n}.toml")));
    let [fik, cec] = ["fik.trax", "fik.mpf"].map(|n| folder.at(n));
    done(&format!(
        "compile {machine} {errors} --scheme fik --adjust EZ0S,EYY1,EXX1 -o {fik}"
    ));
    answer(0, &export(&fik, "not-added", &cec));
    let text = std::fs::read_to_string(&cec).unwrap();
    let numbers = |name: &str| -> Vec<f64> {
        let lines = text.lines().filter(|line| line.starts_with(name));
        lines
            .map(|line| line.split_once('=').unwrap().1.parse().unwrap())
            .collect()
    };
    // Factors are at most 1, and no error is as large.
    assert!(numbers("$AN_CEC[").iter().all(|value| value.abs() <= 1.0));
    let weights = numbers("$SN_CEC_TABLE_WEIGHT[");
    assert_eq!(weights, vec![1.0; text.matches("\n; table ").count()]);
    let [min, max, step] = ["MIN", "MAX", "STEP"].map(|name| numbers(&format!("$AN_CEC_{name}[")));
    let counts = text.lines().filter_map(|line| line.strip_suffix(" values"));
    let counts = counts.filter_map(|line| line.rsplit(' ').next()?.parse::<f64>().ok());
    for (k, count) in counts.enumerate() {
        assert_eq!(
            ((max[k] - min[k]) / step[k]).trunc(),
            count - 1.0,
            "table {k}"
        );
    }
}

#[test]
fn limits_in_the_file_are_read_and_tables_beyond_them_warned_of() {
    let folder = Folder::new();
    let [machine, errors] =
        ["machine", "errors-13"].map(|n| example(&format!("huron-k2x8/{n}.toml")));
    let [huron, cec, with, again] =
        ["huron.trax", "cec.mpf", "limited.mpf", "again.trax"].map(|n| folder.at(n));
    let compile = ["compile", &machine, &errors, "-o", &huron, "--json"];
    let compiled = json(&answer(0, &compile));
    answer(0, &export(&huron, "added", &cec));
    let text = std::fs::read_to_string(&cec).unwrap();
    // X reaches 0.0639 mm, and the rate of its correction up to `rate` mm/min.
    let mut axes = compiled["axes"].as_array().unwrap().iter();
    let x = axes.find(|axis| axis["axis"] == "X").unwrap();
    let rate = 60.0 * x["rate_bound"].as_f64().unwrap();
    let said = "; AX1: MD32730 $MA_CEC_MAX_VELO at least ";
    let (_, said) = text.split_once(said).unwrap();
    let (said, rest) = said.split_once(' ').unwrap();
    let said: f64 = said.parse().unwrap();
    // Rounded up to a tenth.
    assert!(said >= rate - 1e-9 && said < rate + 0.1, "{said} {rate}");
    assert!(rest.starts_with("mm/min, as a percentage of MD32000"));
    let read = |limits: &str| {
        let body = text.replace("M17", &format!("{limits}\nM17"));
        assert_ne!(body, text);
        std::fs::write(&with, body).unwrap();
        let output = trueaxis(&import(&with, &machine, "added", &again));
        assert_eq!(output.status.code(), Some(0));
        plain(&output.stderr)
    };
    let enough = "$MA_CEC_MAX_SUM[AX1]=0.1 $MA_CEC_MAX_VELO[AX1]=1";
    assert!(!read(enough).contains("MD327"));
    let sum = "MD32720 stops the correction of X at 0.0500 mm, and its tables reach 0.0639 mm";
    let velocity = "MD32730 stops the correction of X at 0.0500 mm/s";
    for (limit, warning) in [
        ("$MA_CEC_MAX_SUM[AX1]=0.05", sum),
        // A hundredth of a per cent of the maximum speed.
        ("$MA_CEC_MAX_VELO[AX1]=0.01", velocity),
    ] {
        let said = read(limit);
        assert!(said.contains(warning), "{said}");
    }
}

#[test]
fn the_trigonometric_scheme_is_exported_at_the_default_limits() {
    let folder = Folder::new();
    let [machine, errors] =
        ["machine", "errors-13"].map(|n| example(&format!("huron-k2x8/{n}.toml")));
    let (trax, cec) = (folder.at("trigo.trax"), folder.at("cec.mpf"));
    for scheme in ["trigo23", "trigo23:free"] {
        let line = format!("compile {machine} {errors} --scheme {scheme} -o {trax}");
        let compile = split(&line);
        answer(0, &compile);
        for factor_tables in ["added", "not-added"] {
            let mut arguments = export(&trax, factor_tables, &cec);
            arguments.push("--json");
            let told = json(&answer(0, &arguments));
            assert_eq!(told["tables"], 23);
            // The default of --factor-limit.
            assert!(told["largest_factor"].as_f64().unwrap() <= 2.0);
            for axis in told["verification"]["axes"].as_array().unwrap() {
                // Products in another order: f32 rounding of a tenth of a millimetre.
                assert!(axis["difference"].as_f64().unwrap() < 1e-3, "{axis}");
            }
        }
    }
}

#[test]
fn reading_it_the_wrong_way_is_what_the_export_has_foretold() {
    let folder = Folder::new();
    let cec = folder.at("cec.mpf");
    let printed = answer(0, &export(&blob("huron"), "not-added", &cec));
    assert!(
        printed.contains("on the other kind of controller"),
        "{printed}"
    );
    let machine = example("huron-k2x8/machine.toml");
    let position = folder.file("p.csv", "Y,A,C,X,Z\n350,120,0,350,350\n");
    let mut found = Vec::new();
    for factor_tables in ["added", "not-added"] {
        let again = folder.at("again.trax");
        answer(0, &import(&cec, &machine, factor_tables, &again));
        let text = answer(0, &["eval", &again, "--positions", &position]);
        let line = text.lines().nth(1).unwrap();
        let dy = line.split(',').next().unwrap();
        found.push(dy.parse::<f64>().unwrap());
    }
    assert!((found[0] - found[1]).abs() > 0.01, "{found:?}");
}

#[test]
fn the_probe_needs_no_compensation() {
    let folder = Folder::new();
    let probe = folder.at("probe.mpf");
    let printed = answer(0, &["export", "cec", "--probe", "AX1", "-o", &probe]);
    assert!(
        printed.contains("0.005 --factor-tables not-added, 0.010 --factor-tables added"),
        "{printed}"
    );
    let text = std::fs::read_to_string(&probe).unwrap();
    for line in [
        "$AN_CEC[0,0]=0.005",
        "$AN_CEC[1,0]=1",
        "$AN_CEC_MULT_BY_TABLE[0]=0",
        "$AN_CEC_MULT_BY_TABLE[1]=1",
    ] {
        assert!(text.lines().any(|l| l == line), "{line} is not in {text}");
    }
    refused(
        &["export", "cec", "--probe", "1X", "-o", &probe],
        &["`1X` is not a name of an axis"],
    );
}

#[test]
fn the_reading_has_no_default() {
    let folder = Folder::new();
    let cec = folder.at("cec.mpf");
    let output = trueaxis(&["export", "cec", &blob("huron"), "--axes", AXES, "-o", &cec]);
    assert_eq!(output.status.code(), Some(2));
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(said.contains("--factor-tables <FACTOR_TABLES>"), "{said}");
    assert!(folder.names().is_empty());
}

#[test]
fn what_the_controller_cannot_hold_is_refused_and_nothing_written() {
    let folder = Folder::new();
    let cec = folder.at("cec.mpf");
    let huron = blob("huron");
    let refuses = |more: &[&str], parts: &[&str]| {
        let mut arguments = export(&huron, "added", &cec);
        arguments.extend(more);
        refused(&arguments, parts);
    };
    refuses(
        &["--tables", "12"],
        &["takes 20 tables, and there are 12", "--tolerance"],
    );
    refuses(&["--controller", "828d"], &["there are 8 from number 0"]);
    let other = example("mill-21/machine.toml");
    refuses(&["--machine", &other], &["this is `Mill with 21 errors`"]);
    refuses(&["--first", "50"], &["there are 12 from number 50"]);
    refuses(
        &["--factor-limit", "1"],
        &[
            "factor tables of at most 1",
            "give --factor-limit 1.",
            "or more",
        ],
    );
    refuses(
        &["--tool-length", "100"],
        &["not an input", "length_range_mm"],
    );
    let mut arguments = export(&huron, "added", &cec);
    arguments[4] = "X=AX1,Y=AX2";
    refused(&arguments, &["--axes: axis A has no name"]);
    arguments[4] = "X=AX1,B=AX2";
    refused(&arguments, &["--axes: the machine has no axis `B`"]);
    assert!(folder.names().is_empty());
}

#[test]
fn tables_of_a_tool_length_name_the_one_that_they_hold_for() {
    let folder = Folder::new();
    let cec = folder.at("cec.mpf");
    let length = blob("length");
    let mut arguments = export(&length, "not-added", &cec);
    let printed = answer(0, &arguments);
    assert!(printed.contains("for one tool length: 130 mm"), "{printed}");
    assert!(
        printed.contains("per mm that the tool is longer"),
        "{printed}"
    );
    arguments.extend(["--tool-length", "100"]);
    answer(0, &arguments);
    let text = std::fs::read_to_string(&cec).unwrap();
    assert!(text.contains("; for one tool length: 100 mm\n"), "{text}");
}

#[test]
fn a_file_that_is_not_understood_is_refused_at_its_line_and_leaves_nothing() {
    let folder = Folder::new();
    let machine = example("huron-k2x8/machine.toml");
    let out = folder.at("out.trax");
    let file = |text: &str| folder.file("cec.mpf", text);
    for (text, parts) in [
        (
            "METRIC\n$AN_CEC[0,0]=1\n",
            vec!["cec.mpf, line 2", "has no $AN_CEC_INPUT_AXIS"],
        ),
        ("METRIC\nG0 X0\n", vec!["cec.mpf, line 2", "not understood"]),
        ("", vec!["cec.mpf: there is no table in the file"]),
        (
            "$AN_CEC[0,0]=0.1\n$AN_CEC_INPUT_AXIS[0]=AX9\n",
            vec!["line 2", "`AX9` is not in the map", "--axes"],
        ),
    ] {
        refused(&import(&file(text), &machine, "added", &out), &parts);
    }
    let path = file("METRIC\n");
    std::fs::write(&path, b"METRIC\n\xff\n").unwrap();
    refused(
        &import(&path, &machine, "added", &out),
        &["line 2", "not UTF-8 text"],
    );
    // A slip in the unit: 5 mm instead of 5 µm.
    let large = "METRIC\n$AN_CEC[0,0]=5\n$AN_CEC[0,1]=5\n$AN_CEC_INPUT_AXIS[0]=AX1\n$AN_CEC_OUTPUT_AXIS[0]=AX1\n\
                 $AN_CEC_STEP[0]=700\n$AN_CEC_MIN[0]=-350\n$AN_CEC_MAX[0]=350\n";
    refused(
        &import(&file(large), &machine, "added", &out),
        &["the correction of X reaches 5.000 mm", "--allow-large"],
    );
    assert_eq!(folder.names(), ["cec.mpf"]);
}
