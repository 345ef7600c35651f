use trueaxis_host::*;
use trueaxis_host::schemes::exact::*;
fn main() {
    let a: Vec<String> = std::env::args().collect();
    let machine = machine::Machine::from_toml(&std::fs::read_to_string(&a[1]).unwrap()).unwrap();
    let errors = errors::ErrorModel::from_toml(&std::fs::read_to_string(&a[2]).unwrap(), &machine).unwrap();
    for minimize in [Minimize::Cost, Minimize::Tables] {
        let t = std::time::Instant::now();
        let o = Options { minimize, ..Default::default() };
        let e = compile(&machine, &errors, &o).unwrap();
        let dt = t.elapsed();
        let mut d = e.draft.clone();
        for x in &mut d.axes { x.value_bound = 100.0; }
        let blob = d.encode().unwrap();
        let rt = validate::Runtime::load(&blob).unwrap();
        println!("{minimize:?} tables {} terms {} samples {} bytes {} structure {:.3} pairs {} time {:?}", rt.compensation().tables(), d.terms.len(), rt.compensation().samples(), blob.len(), e.structure_error, e.pairs, dt);
        for b in &d.banks { println!("   bank input {} columns {} points {} {:?}", b.input, b.columns.len(), b.columns[0].len(), b.direction); }
        for r in [validate::Region::Travel, validate::Region::Inside, validate::Region::Outside] {
            let c = validate::random_commands(&machine, &errors, r, 5000, 7);
            let v = validate::verify(&machine, &errors, &rt, &[0.0;6], &c, || {}).unwrap();
            println!("{r:?} diff {:.4} um {:.4} urad  before {:.2} after {:.3} kin {:.3} at {:?}", v.difference_um, v.difference_urad, v.before.translation_um.max, v.after.translation_um.max, v.kinematic.translation_um.max, v.worst_at);
        }
    }
}
