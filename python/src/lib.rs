//! The module for Python. It converts; everything else is the library's.

mod compensation;
mod error;
mod errors;
mod interrupt;
mod machine;
mod measurements;
mod rows;

use pyo3::prelude::*;

#[pymodule]
fn _native(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("Error", module.py().get_type::<error::Error>())?;
    let warning = module.py().get_type::<error::TrueaxisWarning>();
    module.add("TrueaxisWarning", warning)?;
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add_class::<machine::Machine>()?;
    module.add_class::<errors::Errors>()?;
    module.add_class::<compensation::Compensation>()?;
    module.add_class::<measurements::Probings>()?;
    module.add_class::<measurements::Found>()?;
    module.add_function(wrap_pyfunction!(measurements::simulated, module)?)?;
    module.add_function(wrap_pyfunction!(measurements::identified, module)?)?;
    module.add_function(wrap_pyfunction!(machine::pose, module)?)?;
    module.add_function(wrap_pyfunction!(errors::correct, module)?)?;
    module.add_function(wrap_pyfunction!(compensation::compile, module)?)?;
    Ok(())
}
