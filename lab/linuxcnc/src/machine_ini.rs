//! Machines of which nothing but the motion controller is simulated.

/// What is alike in INI files of machines with one joint for each letter of `axes`.
pub struct MachineIni<'n> {
    pub name: &'n str,
    /// Drives the machine, in place of a screen.
    pub script: &'n str,
    pub halfiles: &'n str,
    pub axes: &'n str,
    /// Largest velocity of a path, mm/s.
    pub velocity: u32,
}

impl MachineIni<'_> {
    /// All sections but those of axes and joints.
    pub fn text(&self) -> String {
        let Self {
            name,
            script,
            halfiles,
            axes,
            velocity,
        } = self;
        format!(
            "[EMC]\nVERSION = 1.1\nMACHINE = {name}\n[DISPLAY]\nDISPLAY = /tmp/{script}.py\n\
             [TASK]\nTASK = milltask\nCYCLE_TIME = 0.010\n[RS274NGC]\nPARAMETER_FILE = {script}.var\n\
             [EMCMOT]\nEMCMOT = motmod\nCOMM_TIMEOUT = 1.0\nSERVO_PERIOD = 1000000\n\
             [HAL]\nHALFILE = {halfiles}\n\
             [TRAJ]\nCOORDINATES = {axes}\nLINEAR_UNITS = mm\nANGULAR_UNITS = degree\n\
             DEFAULT_LINEAR_VELOCITY = 50\nMAX_LINEAR_VELOCITY = {velocity}\n\
             [EMCIO]\nEMCIO = io\nCYCLE_TIME = 0.100\nTOOL_TABLE = /tmp/tool.tbl\n\
             [KINS]\nKINEMATICS = trivkins coordinates={axes}\nJOINTS = {}\n",
            axes.len()
        )
    }
}

/// Lines of HAL for drives that are where they are commanded to be.
pub fn connections(joints: usize) -> String {
    let mut hal = String::from(
        "loadrt [KINS]KINEMATICS\n\
         loadrt [EMCMOT]EMCMOT servo_period_nsec=[EMCMOT]SERVO_PERIOD num_joints=[KINS]JOINTS\n\
         addf motion-command-handler servo-thread\naddf motion-controller servo-thread\n\
         net enabled iocontrol.0.user-enable-out => iocontrol.0.emc-enable-in\n",
    );
    for joint in 0..joints {
        hal += &format!(
            "net drive-{joint} joint.{joint}.motor-pos-cmd => joint.{joint}.motor-pos-fb\n"
        );
    }
    hal
}
