//! A machine with three axes that is simulated by nothing but its drives, with the component.

use super::bench::LinuxCncBench;
use super::machine_ini::{MachineIni, connections};
use programs::files;

/// The machine in the folder `name`, driven by `NAME.py`.
pub struct ThreeAxes {
    pub name: &'static str,
    /// The play on X and Y that LinuxCNC makes up, mm.
    pub play: f64,
    /// Where it is homed, where it stands; in the middle of its travels otherwise.
    pub home: Option<f64>,
}

impl ThreeAxes {
    /// Writes the configuration, and in `new` what `trueaxis linuxcnc setup` makes of it.
    pub fn set_up(&self, bench: &LinuxCncBench) -> Result<(), String> {
        let name = self.name;
        files::folder(bench.file(name))?;
        for file in [&format!("{name}.py"), "tool.tbl"] {
            bench.copy(&format!("firmware/linuxcnc/tests/{file}"), file)?;
        }
        let ini = &format!("{name}/machine.ini");
        bench.write(&format!("{name}/machine.hal"), connections(3))?;
        bench.write(ini, self.ini("machine.hal"))?;
        let (new, trax) = (
            format!("{name}/new"),
            format!("/tmp/{name}/new/machine.trax"),
        );
        let setup = ["linuxcnc", "setup", ini, "-o", &new, "--file", &trax];
        bench.trueaxis(&setup).map(drop)
    }

    /// Runs it with the component and further lines of HAL; returns what is said.
    pub fn run(&self, bench: &LinuxCncBench, hal: &str) -> Result<String, String> {
        let name = self.name;
        let halfiles = "machine.hal\nHALFILE = new/trueaxis.hal\nHALFILE = further.hal";
        bench.write(&format!("{name}/further.hal"), hal)?;
        bench.write(&format!("{name}/machine.ini"), self.ini(halfiles))?;
        bench.open_to_all(name)?;
        bench.inside(&["linuxcnc", &format!("/tmp/{name}/machine.ini")])
    }

    fn ini(&self, halfiles: &str) -> String {
        let mut text = MachineIni {
            name: self.name,
            script: self.name,
            halfiles,
            axes: "XYZ",
            velocity: 150,
        }
        .text();
        for (joint, (axis, low, high, backlash)) in [
            ("X", 0.0, 200.0, self.play),
            ("Y", 0.0, 150.0, self.play),
            ("Z", -150.0, 0.0, 0.0),
        ]
        .into_iter()
        .enumerate()
        {
            let limits = format!(
                "MIN_LIMIT = {low}\nMAX_LIMIT = {high}\nMAX_VELOCITY = 150\nMAX_ACCELERATION = 1000\n"
            );
            let home = self.home.unwrap_or(0.5 * (low + high));
            text += &format!(
                "[AXIS_{axis}]\n{limits}[JOINT_{joint}]\nTYPE = LINEAR\n{limits}BACKLASH = {backlash}\n\
                 FERROR = 1\nMIN_FERROR = 1\nHOME = {home}\nHOME_OFFSET = {home}\n\
                 HOME_SEARCH_VEL = 0\nHOME_SEQUENCE = 0\n"
            );
        }
        text
    }
}
