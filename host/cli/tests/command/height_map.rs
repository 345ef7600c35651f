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
