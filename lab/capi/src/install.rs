//! The C library, installed below a prefix.

use super::build::{self, BuildCapacities};
use programs::process::root;
use programs::{VERSION, files};
use std::fs;
use std::os::unix::fs::symlink;
use std::path::Path;

/// What the linker looks for, and what programs request.
const LINKED: &str = "libtrueaxis.so";
const REQUESTED: &str = "libtrueaxis.so.0";

/// Builds the library with these capacities; writes libraries, header and pkg-config file below a prefix.
///
/// # Errors
/// If something does not build or cannot be written.
pub fn below(prefix: &Path, capacities: &BuildCapacities) -> Result<(), String> {
    let prefix = std::path::absolute(prefix).map_err(|e| format!("{}: {e}", prefix.display()))?;
    let libraries = build::libraries(capacities)?;
    let lib = prefix.join("lib");
    let include = files::folder(prefix.join("include"))?;
    let pkgconfig = files::folder(lib.join("pkgconfig"))?;
    let shared = format!("{LINKED}.{VERSION}");
    for (built, name) in [("a", "libtrueaxis.a"), ("so", &shared)] {
        let built = libraries.join("libtrueaxis_capi").with_extension(built);
        files::copy(&built, &lib.join(name))?;
    }
    for (name, to) in [(REQUESTED, &*shared), (LINKED, REQUESTED)] {
        let path = lib.join(name);
        let _ = fs::remove_file(&path);
        symlink(to, &path).map_err(|e| format!("{}: {e}", path.display()))?;
    }
    let committed = root().join("firmware/capi/trueaxis.h");
    let header = capacities.header(&files::read_text(&committed)?)?;
    files::write(&include.join("trueaxis.h"), header)?;
    // Wherever it is unpacked.
    let text = format!(
        "prefix=${{pcfiledir}}/../..\nlibdir=${{prefix}}/lib\nincludedir=${{prefix}}/include\n\n\
         Name: trueaxis\nDescription: Volumetric compensation of machine tools at servo rate\n\
         Version: {VERSION}\nLibs: -L${{libdir}} -ltrueaxis\nLibs.private: -lpthread -ldl -lm\n\
         Cflags: -I${{includedir}}\n",
    );
    files::write(&pkgconfig.join("trueaxis.pc"), text)?;
    println!("installed below {}", prefix.display());
    Ok(())
}
