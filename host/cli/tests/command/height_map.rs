//! Height maps and twist of printers, written and read.

use crate::program::{Folder, answer, done, example, refused, split};

const ERRORS: &str = "machine = \"Router\"\n[parameters]\nEZX2 = 4e-7\nEZY2 = -1e-7\n";

/// The map of a compensation is what a probe would find on a flat bed, so that `identify` finds the errors again.
#[test]
fn a_map_that_was_exported_is_identified_as_the_errors_that_it_corrects() {
    let folder = Folder::new();
    let machine = example("router/machine.toml");
    let (errors, trax) = (folder.file("errors.toml", ERRORS), folder.at("router.trax"));
    answer(
        0,
        &["compile", &machine, &errors, "-o", &trax, "--random", "500"],
    );
    let both = folder.at("both.cfg");
    let twice = format!("export klipper {trax} -o {both} --height-map {both}");
    refused(&split(&twice), &["would be written twice"]);
    let other = format!("{}/./both.cfg", folder.path().display());
    let twice = format!("export klipper {trax} -o {both} --height-map {other}");
    refused(&split(&twice), &["would be written twice"]);
    assert!(!std::path::Path::new(&both).exists());
    for (firmware, name) in [("klipper", "mesh.cfg"), ("reprapfirmware", "heightmap.csv")] {
        let (lines, map) = (folder.at("lines"), folder.at(name));
        let said = done(&format!(
            "export {firmware} {trax} -o {lines} --height-map {map} --random 2000"
        ));
        assert!(said.contains("Z "), "{said}");
        let bed = folder.at("bed.csv");
        let said = done(&format!(
            "import {firmware} {map} --machine {machine} -o {bed} --zero Z=-100"
        ));
        assert!(said.contains("441 displacements"), "{said}");
        let found = folder.at("found.toml");
        done(&format!(
            "identify {machine} --observations {bed} --model EZX2,EZY2 -o {found}"
        ));
        let found = std::fs::read_to_string(&found).unwrap();
        let value = |name: &str| -> f64 {
            let mut lines = found.lines().filter_map(|line| line.split_once(" = "));
            let value = lines.find(|(key, _)| *key == name).unwrap().1;
            value.split_whitespace().next().unwrap().parse().unwrap()
        };
        // Rounding to 0.1 µm and tables within 0.05 µm, over heights of 64 µm.
        assert!((value("EZX2") - 4e-7).abs() < 1e-9, "{found}");
        assert!((value("EZY2") + 1e-7).abs() < 1e-9, "{found}");
    }
}

#[test]
fn twist_is_written_and_read_again() {
    let folder = Folder::new();
    let machine = example("router/machine.toml");
    let text = "machine = \"Router\"\n[tabulated.EAX]\nat = [0.0, 400.0, 800.0]\nvalue = [-100.0, 0.0, 100.0]\nunit = \"urad\"\n";
    let (errors, to) = (folder.file("errors.toml", text), folder.at("twist.cfg"));
    let said = done(&format!(
        "export klipper-twist {machine} {errors} --probe 0,30 -o {to} --points 3"
    ));
    assert!(
        said.contains("wrong by up to ±3.00 µm, with these tables by ±0.0"),
        "{said}"
    );
    let again = folder.at("again.toml");
    let said = done(&format!(
        "import klipper-twist {to} --machine {machine} --probe 0,30 -o {again}"
    ));
    assert!(said.contains("EAX"), "{said}");
    refused(
        &split(&format!(
            "import klipper-twist {to} --machine {machine} --probe 0 -o {again}"
        )),
        &["--probe takes two numbers"],
    );
    refused(
        &split(&format!(
            "import klipper-twist {to} --machine {machine} --probe 30,0 -o {again}"
        )),
        &["X stood at -30.00 to 770.00 mm"],
    );
}

#[test]
fn a_map_that_is_not_one_is_refused_with_its_line() {
    let folder = Folder::new();
    let machine = example("router/machine.toml");
    let map = folder.file(
        "heightmap.csv",
        "RepRapFirmware height map file v2\nxmin,nothing\n",
    );
    let to = folder.at("bed.csv");
    let nothing = folder.file("nothing.csv", rrf(&["0,0", "0,0"]));
    refused(
        &split(&format!(
            "import reprapfirmware {nothing} --machine {machine} -o {to}"
        )),
        &["nothing.csv: no point of the map was probed"],
    );
    refused(
        &split(&format!(
            "import reprapfirmware {map} --machine {machine} -o {to}"
        )),
        &["heightmap.csv, line 2", "does not know these parameters"],
    );
    refused(
        &["import", "klipper", &map, "--machine", &machine, "-o", &to],
        &["no stored profile", "BED_MESH_PROFILE SAVE"],
    );
    let mesh = |max_x: &str, z: &str| {
        format!(
            "[bed_mesh a]\nversion = 1\npoints =\n  0.1, 0.2\n  0.1, {z}\nx_count = 2\ny_count = 2\n\
             min_x = 0\nmax_x = {max_x}\nmin_y = 0\nmax_y = 1200\n"
        )
    };
    for (max_x, z, options, says) in [
        (
            "800",
            "900000",
            "",
            "printer.cfg, line 5: 900000 mm is no height",
        ),
        (
            "8000",
            "0.1",
            "",
            "X stood at 0.00 to 8000.00 mm, and travels from 0 to 800",
        ),
        (
            "800",
            "0.1",
            "--probe=-20,0",
            "X stood at 20.00 to 820.00 mm",
        ),
        (
            "800",
            "0.1",
            "--zero Z=500",
            "Z stood at 500.00 mm, and travels from -150 to 0",
        ),
    ] {
        let map = folder.file("printer.cfg", mesh(max_x, z));
        let words = format!("import klipper {map} --machine {machine} -o {to} {options}");
        refused(&split(&words), &[says]);
    }
}

/// A height map of RepRapFirmware over 50 … 250 and 20 … 120 mm, of these rows.
fn rrf(rows: &[&str]) -> String {
    let columns = rows[0].split(',').count();
    format!(
        "RepRapFirmware height map file v2\naxis0,axis1,min0,max0,min1,max1,radius,spacing0,spacing1,num0,num1\n\
         X,Y,50,250,20,120,-1,{},100,{columns},{}\n{}\n",
        200 / (columns - 1),
        rows.len(),
        rows.join("\n")
    )
}

/// The rows of a file of observations, without heading.
fn rows_of(path: &str) -> Vec<String> {
    let text = std::fs::read_to_string(path).unwrap();
    let rows = text.lines().filter(|line| line.starts_with("displacement"));
    rows.map(str::to_owned).collect()
}

/// G31 X40 Y-5: the axes stood 40 mm before the places of the map along X and 5 mm after them along Y, and the point that
/// touched is beside the nozzle by that. Z stood at zero but for the height.
#[test]
fn the_axes_stood_at_the_places_of_a_map_minus_the_offset_of_the_probe() {
    let folder = Folder::new();
    let machine = example("router/machine.toml");
    let map = folder.file("heightmap.csv", rrf(&["0.100,-0.200", "0,0.300"]));
    let to = folder.at("bed.csv");
    let import = format!("import reprapfirmware {map} --machine {machine} -o {to} --zero Z=-100");
    let said = done(&import);
    assert!(
        said.contains("no probe is given (--probe X,Y): the nozzle counts as the probe"),
        "{said}"
    );
    assert!(
        said.contains("left out, as they were not probed: 1"),
        "{said}"
    );
    let expected = |x: [f64; 2], y: [f64; 2]| {
        [(y[0], x[0], -100), (y[0], x[1], 200), (y[1], x[1], -300)]
            .map(|(y, x, um)| format!("displacement,bed,{y},{x},-100,tool +Z,{um}"))
    };
    assert_eq!(rows_of(&to), expected([50.0, 250.0], [20.0, 120.0]));
    let said = done(&format!("{import} --probe 40,-5"));
    assert!(said.contains("40 and -5 mm beside the nozzle"), "{said}");
    assert!(said.contains("import klipper-twist"), "{said}");
    assert_eq!(rows_of(&to), expected([10.0, 210.0], [25.0, 125.0]));
    let text = std::fs::read_to_string(&to).unwrap();
    assert!(text.contains("# tool_mm = [40.0, -5.0, -60.0]"), "{text}");
    // A value that begins with a minus may follow a space.
    done(&format!("{import} --probe -24,-13"));
}

/// A profile over X and Y with this height at each point, and what stands before it.
fn profile(
    before: &str,
    count: usize,
    [low, high]: [f64; 2],
    height: impl Fn(f64, f64) -> f64,
) -> String {
    let at = |k: usize| low + (high - low) * k as f64 / (count - 1) as f64;
    let row = |y: usize| {
        let heights = (0..count).map(|x| format!("{:.6}", height(at(x), at(y))));
        format!("  {}\n", heights.collect::<Vec<_>>().join(", "))
    };
    format!(
        "{before}[bed_mesh default]\nversion = 1\npoints =\n{}x_count = {count}\ny_count = {count}\nmin_x = {low}\n\
         max_x = {high}\nmin_y = {low}\nmax_y = {high}\n",
        (0..count).map(row).collect::<String>()
    )
}

/// The value of a parameter that was identified on a printer whose Z begins at 0, as `skew` writes it.
#[track_caller]
fn identified(folder: &Folder, printer_cfg: &str, more: &str) -> [f64; 2] {
    let (machine, to) = (folder.at("machine.toml"), folder.at("bed_of_printer.csv"));
    folder.answer("skew --xy 141.42136,141.42136,100 --travel 300,300,250 --machine %machine.toml --errors %skew.toml");
    let map = folder.file("printer.cfg", printer_cfg);
    done(&format!("import klipper {map} --machine {machine} -o {to}"));
    let found = folder.at("found.toml");
    let said = done(&format!(
        "identify {machine} {to} --model EZX2,EZY2 -o {found}{more}"
    ));
    assert!(said.contains("  bed_of_printer place in z "), "{said}");
    let text = std::fs::read_to_string(&found).unwrap();
    ["EZX2", "EZY2"].map(|name| {
        let mut lines = text.lines().filter_map(|line| line.split_once(" = "));
        let value = lines.find(|(key, _)| *key == name).unwrap().1;
        value.split_whitespace().next().unwrap().parse().unwrap()
    })
}

/// Heights below 0 are no positions of Z below its travel.
#[test]
fn a_bed_of_which_a_part_is_below_zero_is_identified() {
    let folder = Folder::new();
    let text = profile("[probe]\nx_offset: 0\n", 5, [50.0, 250.0], |x, y| {
        -4e-6 * (x - 150.0).powi(2) + 2e-6 * (y - 150.0).powi(2)
    });
    // Heights are rounded to 1 nm, over the squares of 100 mm.
    let [x, y] = identified(&folder, &text, "");
    assert!(
        (x - 4e-6).abs() < 1e-10 && (y + 2e-6).abs() < 1e-10,
        "{x} {y}"
    );
    folder.refused(
        "identify %machine.toml %bed_of_printer.csv",
        &["shows only how X and Y bend"],
    );
}

/// The corners of a round bed repeat the outermost point of their row that was probed.
#[test]
fn what_klipper_fills_in_around_a_round_bed_does_not_count() {
    let folder = Folder::new();
    let round = "[probe]\nx_offset: 0\n[bed_mesh]\nmesh_radius: 100\nmesh_origin: 150, 150\n";
    let text = profile(round, 5, [50.0, 250.0], |x, y| {
        // Steps of 50 mm: 1, 3, 5, 3 and 1 points.
        let most = (100.0 - (y - 150.0_f64).abs()).max(0.0);
        -4e-6 * (x - 150.0).clamp(-most, most).powi(2) + 2e-6 * (y - 150.0).powi(2)
    });
    let [x, y] = identified(&folder, &text, "");
    // As above.
    assert!(
        (x - 4e-6).abs() < 1e-10 && (y + 2e-6).abs() < 1e-10,
        "{x} {y}"
    );
}

/// X rolls by a(x) = −1.4e-6 x + 1e-8 x² and is straight; the probe is 40 mm before the nozzle: it goes up by −40 a(x).
#[test]
fn a_roll_that_is_known_is_not_taken_for_straightness() {
    let folder = Folder::new();
    let text = profile("[probe]\n  y_offset: -40\n", 5, [50.0, 250.0], |x, _| {
        40.0 * (-1.4e-6 * x + 1e-8 * x * x)
    });
    // As above; without the roll, the bow is −40 × 1e-8.
    assert!((identified(&Folder::new(), &text, "")[0] + 4e-7).abs() < 1e-10);
    let roll = folder.file(
        "roll.toml",
        "machine = \"Printer\"\n[parameters]\nEAX1 = -1.4e-6\nEAX2 = 1e-8\n",
    );
    let [x, _] = identified(&Folder::new(), &text, &format!(" --update {roll}"));
    assert!(x.abs() < 1e-10, "{x}");
    // Klipper has corrected the readings: they are those of the nozzle at the places of the map.
    let twist = "[axis_twist_compensation]\nz_compensations = 0.1, -0.1\ncompensation_start_x = 0\ncompensation_end_x = 9\n";
    let flat = profile(
        &format!("[probe]\ny_offset: -40\nx_offset: 9\n{twist}"),
        5,
        [50.0, 250.0],
        |x, _| -4e-6 * x * x,
    );
    let [x, _] = identified(&folder, &flat, &format!(" --update {roll}"));
    assert!((x - 4e-6).abs() < 1e-10, "{x}");
    let rows = rows_of(&folder.at("bed_of_printer.csv"));
    assert!(
        rows[0].starts_with("displacement,bed_of_printer,90,50,0,"),
        "{}",
        rows[0]
    );
}

#[test]
fn a_table_of_twist_that_no_roll_explains_is_named() {
    let folder = Folder::new();
    let tables = "[probe]\nx_offset: 0\ny_offset: 30\n[axis_twist_compensation]\nz_compensations: 0.01, -0.01\n\
                  compensation_start_x: 0\ncompensation_end_x: 800\nzy_compensations: 0.01, -0.01\n\
                  compensation_start_y: 100\ncompensation_end_y: 800\n";
    folder.file("printer.cfg", tables);
    let said = folder
        .answer("import klipper-twist %printer.cfg --machine @router/machine.toml -o %roll.toml");
    assert!(
        said.contains("roll.toml: EAX\nleft out zy_compensations: a roll of Y does not"),
        "{said}"
    );
    folder.file("printer.cfg", tables.replace("_start_x: 0", "_start_x: -9"));
    folder.refused(
        "import klipper-twist %printer.cfg --machine @router/machine.toml -o %roll.toml",
        &["X stood at -9.00 to 800.00 mm"],
    );
}
