//! Real inputs from which the fuzz targets start.

use programs::files;
use programs::process::root;
use std::path::Path;

/// Adds an input to the corpus once for each mode, after the byte that selects it.
fn put(corpus: &Path, name: &str, modes: &[u8], contents: &[u8]) -> Result<(), String> {
    for mode in modes {
        let path = corpus.join(format!("{name}-{mode}"));
        files::write(&path, [&[*mode], contents].concat())?;
    }
    Ok(())
}

/// Adds a conversation to the corpus that reaches a change of compensation: see the target.
pub fn link(corpus: &Path) -> Result<(), String> {
    // Three flags for the blob, the slot and force, and the request.
    let step = |request: u8| [1, 1, 1, request];
    let mut bytes = Vec::new();
    bytes.extend(step(0));
    bytes.extend(step(4));
    bytes.push(40);
    for request in [0, 1, 2, 3, 5, 6, 7] {
        bytes.extend(step(request));
    }
    bytes.extend(0..40);
    put(corpus, "change", &[2, 3], &bytes)
}

/// Adds programs with words of every kind to the corpus, in several dialects.
pub fn gcode(corpus: &Path) -> Result<(), String> {
    // Zero is in the middle of the travel.
    let programs = [
        "G21 G90 G17\nG0 X10. Y-20. Z30. A5. C10.\nG1 X20. F600.\nA10. C-20.\nG93 G1 X15. C5. F10.\nG94 F100.\nM30\n",
        "G20 G91 G18\nG55 G1 X.5 Z.25 F10.\nG2 X.2 Z.2 I.1 K.1\nG3 X.1 R.5 Y.1\nG90 G17 G2 I1.\nG92 X0. Y0.\nX.1\n\
         G92.1\nM2\n",
        "%\nG21 G90 G98 F200.\nG43 H1\nG81 X10. Y10. Z1. R5.\nX20.\nG83 X30. Z0. R4. Q1.\nG99 G82 X5. Z2. R3. P.1\n\
         G80\nM30\n%\n",
        "G21 G90 G10 L2 P1 X5. R3.\nG53 G0 Z-10.\nG28\n/M8\nG10 L20 P2 X0. Y1. Z0.\nG43 H2 G0 Z5.\nG49 G1 X2. F50.\n\
         G95 F.1\nG1 X0.\n",
        "G21 G90\nM428\nG0 X3. Y0. Z2. A0. C0.\nG1 A-3. C9. F20.\nG93 G1 X2. A-20. C30. F6.\nG94 G1 X1. F500.\n\
         M429\nG1 A1. F90.\n",
        "G71 G90 G17\nT=\"A\" M6\nG0 X1 Y=2 Z3 D1\nG1 X5 F90\nG3 X7 Y4 CR=2\nG4 F1\nG0 SUPA Z0 D0\nM30\n",
        "G21 G90 G17\nG0 X1. Y1. Z1.\nM98 P2\nG0 G43.4 H1 X2. Y2. Z4.\nG1 X3. F90.\nM30\nO2\nG91 G1 X1. F80.\nG90 \
         M99\n",
        "G21 G90 G17 F90.\nG41 D1 G1 X5.\nG3 X7. Y2. J2.\nG40 G0 Y0.\nG91 G2 I-3. P2\nG19 G3 J1. X2.\nG90.1 G17 G2 \
         X0. Y0. I3. J3.\n",
    ];
    let printer = "G21\nG90\nM82\nG92 E0\nG1 X10 Y-20 Z30 F600\nG1 X20 E.5\nG2 X30 Y-10 I5 J5 E.9\nG1 E.1\nM83\n\
                   G91\nN5 M104 S200\nG1 X-9 E.3\nG28 X\nG90\nG92 X3\nG0 X5\n";
    put(corpus, "printer", &[24, 52, 80], printer.as_bytes())?;
    for (number, program) in programs.iter().enumerate() {
        // All dialects, plus those of LinuxCNC with other reversal methods.
        let name = format!("program-{number}");
        let modes = [0, 4, 8, 12, 16, 20, 24, 28, 56];
        put(corpus, &name, &modes, program.as_bytes())?;
    }
    Ok(())
}

/// Adds tables of every kind to the corpus, read in several ways.
pub fn cec(corpus: &Path) -> Result<(), String> {
    let table = |number: usize, values: &[&str], set: &str| {
        let each = values.iter().enumerate();
        let each = each.map(|(k, value)| format!("$AN_CEC[{number},{k}]={value}\n"));
        let set = set.split_whitespace().map(|s| {
            let (name, value) = s.split_once('=').unwrap_or((s, ""));
            format!("$AN_CEC_{name}[{number}]={value}\n")
        });
        each.chain(set).collect::<String>()
    };
    let plain = "INPUT_AXIS=AX2 OUTPUT_AXIS=AX1 STEP=60 MIN=-120 MAX=0 IS_MODULO=0 DIRECTION=0 MULT_BY_TABLE=0";
    let turn = "INPUT_AXIS=C1 OUTPUT_AXIS=AX1 STEP=120 MIN=0 MAX=360 IS_MODULO=1 DIRECTION=0 MULT_BY_TABLE=1";
    let one_way =
        "INPUT_AXIS=(AX1) OUTPUT_AXIS=AX1 STEP=300 MIN=-300 MAX=300 IS_MODULO=-1 DIRECTION=1";
    let values = ["0.004", "0.002", "-0.001"];
    let product = table(0, &values, plain) + &table(1, &["0.5", "1", "-1", "0.5"], turn);
    let encoder = "$AA_ENC_COMP[0,0,AX1]=0.01\n$AA_ENC_COMP[0,1,AX1]=0.02\n$AA_ENC_COMP_STEP[0,AX1]=10\n\
                   $AA_ENC_COMP_MIN[0,AX1]=0\n$AA_ENC_COMP_MAX[0,AX1]=10\n$AA_ENC_COMP_IS_MODULO[0,AX1]=0\n";
    let files = [
        format!("%_N_NC_CEC_INI\nMETRIC\nCHANDATA(1)\n{product}M17\n"),
        format!(
            "INCH\n{}M30\n",
            table(7, &values, one_way).replace(',', ".")
        ),
        format!("METRIC ; both\n{encoder}{}", table(2, &values, plain)),
        format!(
            "METRIC\n{}$SN_CEC_TABLE_WEIGHT[1]=0.5\n",
            table(1, &values, one_way)
        ),
    ];
    for (number, file) in files.iter().enumerate() {
        let (name, modes) = (format!("tables-{number}"), [0, 1, 8, 17]);
        put(corpus, &name, &modes, file.as_bytes())?;
    }
    Ok(())
}

/// Adds measurements, and small files of other controllers, to the corpus. Their first byte is the number of their
/// reader.
pub fn readers(corpus: &Path) -> Result<(), String> {
    let example = |name: &str| files::read_text(&root().join("examples").join(name));
    let mesh = "[bed_mesh default]\nversion = 1\npoints =\n\t0.1, 0.2, 0.1\n\t0, 0, 0\n\t0.1, 0, -0.1\nx_count = 3\n\
                y_count = 3\nmesh_x_pps = 0\nmesh_y_pps = 0\nalgo = lagrange\ntension = 0.2\nmin_x = 0\nmax_x = 200\n\
                min_y = 0\nmax_y = 200\n";
    let map = "RepRapFirmware height map file v2, mean error 0.0\n\
               xmin,xmax,ymin,ymax,radius,xspacing,yspacing,xnum,ynum\n0,100,0,100,-1,100,100,2,2\n0.1,0\n0,0.2\n";
    let twist = "[axis_twist_compensation]\nz_compensations = 0.1, 0, -0.1\ncompensation_start_x = 10\n\
                 compensation_end_x = 190\n";
    let isg = "x\texx\teyx\n0\t0\t0\n100\t0.001\t0.002\n#\nc0w\n1e-5\n";
    let etalon = "EXX {\n0 0\n100 0.001\n}\nC0Y 1e-5\n";
    let run = "# axis = \"X\"\n# reads = \"tool +X\"\n# unit = \"um\"\ntarget,+1,-1\n0,0.2,-3.9\n200,3.1,-1.2\n";
    let radii = "angle_deg,radius_um\n0,1\n90,-1\n180,0\n270,2\n";
    let all = [
        (0, mesh.to_owned()),
        (1, map.to_owned()),
        (2, twist.to_owned()),
        (3, isg.to_owned()),
        (4, etalon.to_owned()),
        (5, example("kolibri/observations.csv")?),
        (6, example("kolibri/validation.csv")?),
        (7, run.to_owned()),
        (8, radii.to_owned()),
        (9, example("mill-warming/temperatures.csv")?),
        (10, example("thermal-drift/spindle.csv")?),
    ];
    for (reader, text) in all {
        // The beginning of a long file is one, too.
        let lines: String = text.split_inclusive('\n').take(20).collect();
        put(
            corpus,
            &format!("reader-{reader}"),
            &[reader],
            lines.as_bytes(),
        )?;
    }
    Ok(())
}

/// Adds the golden blobs to the corpus.
pub fn golden(corpus: &Path) -> Result<(), String> {
    for path in files::list(&root().join("tests/golden/v1"), "trax")? {
        let stem = path.file_stem().unwrap_or_default().to_string_lossy();
        let blob = files::read(&path)?;
        put(corpus, &format!("golden-{stem}"), &[0, 1], &blob)?;
    }
    Ok(())
}
