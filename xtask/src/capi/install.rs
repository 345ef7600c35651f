//! `cargo xtask install --prefix DIR [--axes N] …`.

use super::build::{self, BuildCapacities};
use crate::files;
use crate::process::root;
use std::fs;
use std::os::unix::fs::symlink;

/// Names of the shared library: the linker name, the name that programs request, and the file.
const SHARED: [&str; 3] = [
    "libtrueaxis.so",
    "libtrueaxis.so.0",
    concat!("libtrueaxis.so.", env!("CARGO_PKG_VERSION")),
];

/// # Errors
/// If something does not build or cannot be written.
pub fn execute(options: &[&str]) -> Result<(), String> {
    let (prefix, capacities) = read(options)?;
    let prefix = std::path::absolute(prefix).map_err(|e| format!("{prefix}: {e}"))?;
    let libraries = build::libraries(&capacities)?;
    let lib = prefix.join("lib");
    let include = files::folder(prefix.join("include"))?;
    let pkgconfig = files::folder(lib.join("pkgconfig"))?;
    let [linked, asked, file] = SHARED;
    for (built, name) in [("a", "libtrueaxis.a"), ("so", file)] {
        let built = libraries.join("libtrueaxis_capi").with_extension(built);
        files::copy(&built, &lib.join(name))?;
    }
    for (name, to) in [(asked, file), (linked, asked)] {
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
         Version: {}\nLibs: -L${{libdir}} -ltrueaxis\nLibs.private: -lpthread -ldl -lm\n\
         Cflags: -I${{includedir}}\n",
        env!("CARGO_PKG_VERSION"),
    );
    files::write(&pkgconfig.join("trueaxis.pc"), text)?;
    println!("installed below {}", prefix.display());
    Ok(())
}

/// Reads the destination and the capacities.
fn read<'o>(options: &[&'o str]) -> Result<(&'o str, BuildCapacities), String> {
    let (mut prefix, mut capacities) = (None, BuildCapacities::USUAL);
    for pair in options.chunks(2) {
        match pair {
            ["--prefix", folder] => prefix = Some(*folder),
            [option, number] => capacities.set(option, number)?,
            _ => return Err(format!("{} takes a value", pair.concat())),
        }
    }
    let prefix = prefix.ok_or(
        "install takes --prefix DIR: libraries go to DIR/lib, the header to DIR/include; and \
         how much the library is to hold: --axes, --banks, --tables, --terms, --grids",
    )?;
    Ok((prefix, capacities))
}
