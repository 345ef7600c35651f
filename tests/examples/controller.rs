//! The runtime in a controller: load, enable, update in every servo period.

use trueaxis::{Compensation, Conditions, Holds, Inputs, Servo};

/// Room for five axes and the tables of this machine.
type Tables<'a> = Compensation<'a, Holds<5, 8, 32, 64, 1>>;

fn main() {
    // In flash the blob lies at a multiple of 32; `load_slot` ignores what follows it.
    let blob = trueaxis_tests::golden::blob("huron-13");
    let mut tables = Tables::empty();
    if let Err(error) = tables.load_slot(&blob) {
        println!("not corrected: {error}");
        return;
    }
    let mut servo = Servo::new(&tables);
    servo.enable();

    // One second at 1 kHz. The commands are those before any correction, in the blob's order:
    // Y, A, C, X, Z; mm and degrees.
    let referenced = 0b1_1111;
    for period in 0..1000_u16 {
        let y = f32::from(period) * 0.1;
        let commands = Inputs::at([y, 30.0, 45.0, -50.0, -120.0]);
        let correction = servo.update(&commands, referenced, 0.001);
        let to_drives: [f32; 5] = std::array::from_fn(|i| commands.axes[i] + correction.dq[i]);
        if correction.status.is(Conditions::BAD_INPUT) {
            println!("held: an input is not a number");
        }
        if period % 250 == 249 {
            println!("s = {:.3}, Y {y:.1} to {:.4}", servo.factor(), to_drives[0]);
        }
    }
}
