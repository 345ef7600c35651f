//! Temperatures: from a log to terms with lags, and to corrections over time.

use crate::program::{Folder, answer, done, examples, json, plain, refused, refuses, run};

const MODEL: &str = "EXX1,EYY1,EZZ1,EC0Y,EA0Z,EB0Z,EX0S,EY0S,EZ0S";

/// Identifies and compiles the example; what `identify` said.
fn compiled(folder: &Folder) -> String {
    let [machine, points, log] = examples(
        "mill-warming",
        ["machine.toml", "points.csv", "temperatures.csv"],
    );
    let (errors, blob) = (folder.at("errors.toml"), folder.at("mill.trax"));
    let page = folder.at("page.html");
    let arguments = [
        "identify",
        &machine,
        "--observations",
        &points,
        "--temperatures",
        &log,
        "--model",
        MODEL,
        "-o",
        &errors,
        "--report",
        &page,
    ];
    let said = plain(answer(0, &arguments).as_bytes());
    done(&format!("compile {machine} {errors} -o {blob}"));
    said
}

#[test]
fn terms_with_lags_are_identified_compiled_and_follow_over_time() {
    let folder = Folder::new();
    let said = compiled(&folder);
    let [machine] = examples("mill-warming", ["machine.toml"]);
    let explained = done(&format!("explain {machine} {}", folder.at("errors.toml")));
    // A spindle that grows by 3.4 µm moves the tool as far.
    let grows = "per K of bearing: 1 K warmer, the tool is off by 3.42 µm along −Z everywhere";
    assert!(explained.contains(grows), "{explained}");
    for part in [
        "4 cycles each predicted by the others",
        "per K of bearing",
        ", lag ",
        "another cycle stays within",
    ] {
        assert!(said.contains(part), "`{part}` is not in\n{said}");
    }
    let page = std::fs::read_to_string(folder.at("page.html")).unwrap();
    for part in [
        "288 observations with 1 set-up.",
        "Warm-ups predicted from the others are off by",
        "<td class=\"text\">bearing</td>",
    ] {
        assert!(page.contains(part), "{part}");
    }
    let blob = folder.at("mill.trax");
    let inspected = json(&format!("inspect {blob}"));
    let inputs = inspected["auxiliaries"].as_array().unwrap();
    let lag = inputs
        .iter()
        .find_map(|input| input["lag_s"].as_f64())
        .unwrap();
    assert!(lag > 1.0, "{inspected}");
    // The corrections follow a step of all sensors, and arrive where they are without time.
    let mut sensors: Vec<&str> = inputs.iter().filter_map(|i| i["name"].as_str()).collect();
    sensors.sort_unstable();
    sensors.dedup();
    let row = |kelvin: &str| vec![kelvin; sensors.len()].join(",");
    let header = format!("X,Y,Z,time_s,{}", sensors.join(","));
    let rows = [(0, "0"), (1, "0.2"), (2000, "0.2"), (400_000, "0.2")];
    let rows = rows.map(|(time, kelvin)| format!("0,0,-100,{time},{}\n", row(kelvin)));
    let path = folder.file("path.csv", format!("{header}\n{}", rows.concat()));
    let found = done(&format!("eval {blob} --positions {path}"));
    let z: Vec<f64> = (found.lines().skip(1))
        .map(|line| line.split(',').nth(2).unwrap().parse().unwrap())
        .collect();
    let missing = |k: usize| (z[k] - z[3]).abs();
    assert!(z[0] != z[1], "{z:?}");
    assert!(missing(1) > missing(2) && missing(2) > 0.0, "{z:?}");
    // Beyond the range of the tables.
    let far = format!(
        "X,Y,Z,time_s,{}\n0,0,-100,0,{}\n",
        sensors.join(","),
        row("90")
    );
    let far = folder.file("far.csv", &far);
    let out = run(&format!("eval {blob} --positions {far}"));
    let said = plain(&out.stderr);
    assert!(said.contains("is beyond its range of"), "{said}");
    // Neither a column of its own nor time and sensor.
    let short = folder.file("short.csv", "X,Y,Z\n0,0,-100\n");
    refuses(
        &format!("eval {blob} --positions {short}"),
        &["is missing", "or time_s and"],
    );
}

#[test]
fn temperatures_may_stand_beside_the_readings() {
    let folder = Folder::new();
    let [machine, points, log] = examples(
        "mill-warming",
        ["machine.toml", "points.csv", "temperatures.csv"],
    );
    let log = std::fs::read_to_string(log).unwrap();
    let at = |time: &str| {
        let mut rows = log.lines();
        rows.find(|row| row.split(',').next() == Some(time))
    };
    let text = std::fs::read_to_string(points).unwrap();
    let joined = text.lines().map(|line| {
        let (row, time) = line.rsplit_once(',').unwrap();
        format!("{row},{}\n", at(time).unwrap())
    });
    let points = folder.file("points.csv", joined.collect::<String>());
    let mut arguments = vec!["identify", &machine, "--observations", &points];
    arguments.extend(["--temperatures", &points, "--model", MODEL]);
    arguments.extend(["--thermal", "EZ0S"]);
    let said = plain(answer(0, &arguments).as_bytes());
    assert!(
        said.contains("4 cycles each predicted") && said.contains("per K of bearing"),
        "{said}"
    );
    let text = std::fs::read_to_string(&points).unwrap();
    let hot = folder.file("hot.csv", text.replacen(",20.98,", ",2098,", 1));
    let arguments = ["identify", &machine, "--observations", &hot];
    refused(
        &arguments,
        &["hot.csv", "line 2", "(bearing_C): 2098 °C", "in °C"],
    );
}

#[test]
fn temperatures_that_do_not_belong_to_the_rows_are_refused() {
    let folder = Folder::new();
    let [machine, points] = examples("mill-warming", ["machine.toml", "points.csv"]);
    let refuses = |log: &str, more: &[&str], words: &[&str]| {
        let log = folder.file("log.csv", log);
        let mut arguments = vec!["identify", &machine, "--observations", &points];
        arguments.extend(["--temperatures", &log, "--model", MODEL]);
        arguments.extend(more);
        refused(&arguments, words);
    };
    refuses(
        "time_s,bed_C\n0,20\n60,20\n",
        &[],
        &[
            "of which the temperatures say nothing",
            "time_s by the clock",
        ],
    );
    refuses(
        "time_s,bed_C\n0,20\n40000,20\n",
        &[],
        &["only one cycle", "column `cycle`"],
    );
    refuses(
        "time_s,bed\n0,20\n",
        &[],
        &["`bed` is not a known column", "NAME_C"],
    );
    refuses(
        "time_s,cycle,bed_C\n0,1,20\n14000,2,20\n40000,2,20\n",
        &["--thermal", "EQQ"],
        &["--thermal: `EQQ` is neither a model nor an error parameter"],
    );
    refuses(
        "time_s,cycle,bed_C\n0,1,20\n14000,2,20\n40000,2,20\n",
        &["--thermal", "EXXb"],
        &["no parameter is looked for that can change with temperature"],
    );
}
