//! Replacing a file as a whole: it is either the old or the new one.
//!
//! The new content goes into a *partial* file beside the old one, of a name that follows from that
//! of the file, and then takes its place by renaming. Who writes holds a lock on the partial file,
//! which the system lets go when the program ends, however that happens. So a partial file without
//! a lock is one that a program has left behind which was ended in the middle: the next one that
//! writes there, or was about to, removes it.

use std::ffi::{OsStr, OsString};
use std::fs::{File, OpenOptions};
use std::io::{Error, ErrorKind, Read, Result, Seek, Write};
use std::path::{Path, PathBuf};

/// Longest part of the file's own name in that of its partial file: file systems allow 255 bytes.
/// Two files that share a partial file wait for each other, no more.
const LONGEST: usize = 200;

/// Puts `bytes` in the place of the file, or leaves the old one as it was.
///
/// # Errors
/// Those of the file system; also if the file does not read back as it was written.
pub fn replace(path: &Path, bytes: &[u8]) -> Result<()> {
    replace_by(path, |file| file.write_all(bytes), |_| Ok(()))
}

/// The same with what `write` writes, which need not be in memory as a whole, once `accept` has read it and accepts it.
/// What goes into a device or a pipe cannot be read, and is not asked about.
///
/// # Errors
/// Those of `write` and of `accept`, too.
pub fn replace_by(
    path: &Path,
    write: impl FnOnce(&mut Sink<'_>) -> Result<()>,
    accept: impl FnOnce(&File) -> Result<()>,
) -> Result<()> {
    match std::fs::metadata(path) {
        Ok(found) if found.is_dir() => return Err(ErrorKind::IsADirectory.into()),
        // A device or a pipe cannot be replaced, and has no old content to lose.
        Ok(found) if !found.is_file() => {
            let file = OpenOptions::new().write(true).open(path)?;
            return write(&mut Sink::new(&file));
        }
        _ => {}
    }
    let path = real(path);
    let partial = Partial::begin(&path)?;
    let done = partial
        .fill(write, &path)
        .and_then(|()| (&partial.file).rewind())
        .and_then(|()| accept(&partial.file))
        .and_then(|()| std::fs::rename(&partial.path, &path));
    if done.is_err() {
        // Still ours: the lock is held.
        let _ = std::fs::remove_file(&partial.path);
        return done;
    }
    // The new name is safe from a power cut once the folder is; not every system can do that.
    if let Ok(folder) = File::open(folder(&path)) {
        let _ = folder.sync_all();
    }
    Ok(())
}

/// Removes what a program left behind that was ended while it wrote this file.
pub fn tidy(path: &Path) {
    // Whatever is in the way is told by the one who writes.
    let _ = remove_abandoned(&partial_path(&real(path)), OnLock::Leave);
}

/// Through a symbolic link the file that it names is replaced, not the link.
fn real(path: &Path) -> PathBuf {
    path.canonicalize().unwrap_or_else(|_| path.to_owned())
}

fn folder(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    }
}

/// `.NAME.trueaxis-partial` beside the file.
fn partial_path(path: &Path) -> PathBuf {
    let whole = path.file_name().unwrap_or(OsStr::new("output"));
    let mut name = OsString::from(".");
    if whole.len() <= LONGEST {
        name.push(whole);
    } else {
        let text = whole.to_string_lossy();
        let end = (0..=LONGEST).rev().find(|end| text.is_char_boundary(*end));
        name.push(&text[..end.unwrap_or(0)]);
    }
    name.push(".trueaxis-partial");
    folder(path).join(name)
}

/// Of what is written and of what is read back, in whatever pieces; sixteen tables are far faster than one.
static CRC: crc::Crc<u64, crc::Table<16>> = crc::Crc::<u64, crc::Table<16>>::new(&crc::CRC_64_XZ);
type Sum = crc::Digest<'static, u64, crc::Table<16>>;

/// Where the new content goes, which remembers what that was.
pub struct Sink<'a> {
    file: &'a File,
    sum: Sum,
}

impl<'a> Sink<'a> {
    fn new(file: &'a File) -> Self {
        Self {
            file,
            sum: CRC.digest(),
        }
    }
}

impl Write for Sink<'_> {
    fn write(&mut self, bytes: &[u8]) -> Result<usize> {
        let written = self.file.write(bytes)?;
        self.sum.update(&bytes[..written]);
        Ok(written)
    }

    fn flush(&mut self) -> Result<()> {
        self.file.flush()
    }
}

/// A partial file that nobody else writes into or removes.
struct Partial {
    path: PathBuf,
    file: File,
}

impl Partial {
    /// Waits for whoever writes the same file, and begins a new one.
    fn begin(path: &Path) -> Result<Self> {
        let path = partial_path(path);
        loop {
            let new = OpenOptions::new()
                .read(true)
                .write(true)
                .create_new(true)
                .open(&path);
            match new {
                Ok(file) => {
                    lock(&file)?;
                    // Before that it was free to be taken for abandoned.
                    if is_at(&file, &path)? {
                        return Ok(Self { path, file });
                    }
                }
                Err(error) if error.kind() == ErrorKind::AlreadyExists => {
                    remove_abandoned(&path, OnLock::Wait)?;
                }
                Err(error) => return Err(error),
            }
        }
    }

    /// Writes all of it to the disk, with the permissions of the file it will replace, and reads
    /// it back.
    fn fill(&self, write: impl FnOnce(&mut Sink<'_>) -> Result<()>, old: &Path) -> Result<()> {
        let mut file = &self.file;
        let mut sink = Sink::new(file);
        write(&mut sink)?;
        let written = sink.sum.finalize();
        if let Ok(old) = std::fs::metadata(old) {
            file.set_permissions(old.permissions())?;
        }
        file.sync_all()?;
        file.rewind()?;
        let mut sum = CRC.digest();
        let mut piece = vec![0; 1 << 16];
        loop {
            match file.read(&mut piece)? {
                0 => break,
                read => sum.update(&piece[..read]),
            }
        }
        if sum.finalize() != written {
            return Err(Error::other(
                "the file does not read back as it was written",
            ));
        }
        Ok(())
    }
}

/// What to do about a partial file that somebody is writing.
#[derive(Clone, Copy, PartialEq, Eq)]
enum OnLock {
    Wait,
    Leave,
}

/// Removes a partial file once nobody writes it any more.
fn remove_abandoned(path: &Path, on_lock: OnLock) -> Result<()> {
    let found = match std::fs::symlink_metadata(path) {
        Ok(found) => found,
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(()),
        Err(error) => return Err(error),
    };
    if !found.is_file() {
        let name = path.display();
        return Err(Error::other(format!("{name} is in the way and no file")));
    }
    let file = match File::open(path) {
        Ok(file) => file,
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(()),
        Err(error) => return Err(error),
    };
    match on_lock {
        OnLock::Wait => lock(&file)?,
        OnLock::Leave => {
            if file.try_lock().is_err() {
                return Ok(());
            }
        }
    }
    // Whoever wrote it may have finished meanwhile: then it has another name now.
    if is_at(&file, path)? {
        std::fs::remove_file(path)?;
    }
    Ok(())
}

/// Waits for the lock. Where the file system knows none, two programs that write the same file at
/// the same time are not kept apart.
fn lock(file: &File) -> Result<()> {
    match file.lock() {
        Err(error) if error.kind() == ErrorKind::Unsupported => Ok(()),
        done => done,
    }
}

/// Whether the open file is the one of this name.
#[cfg(unix)]
fn is_at(file: &File, path: &Path) -> Result<bool> {
    use std::os::unix::fs::MetadataExt;
    let open = file.metadata()?;
    match std::fs::symlink_metadata(path) {
        Ok(named) => Ok((named.dev(), named.ino()) == (open.dev(), open.ino())),
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(false),
        Err(error) => Err(error),
    }
}

/// Whether there is a file of this name; that it is the open one is more than the standard library
/// can tell here.
#[cfg(not(unix))]
fn is_at(_: &File, path: &Path) -> Result<bool> {
    path.try_exists()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let entries = std::fs::read_dir(folder).unwrap();
        let mut names: Vec<String> = entries
            .map(|e| e.unwrap().file_name().into_string().unwrap())
            .collect();
        names.sort();
        names
    }

    #[test]
    fn many_that_write_at_once_leave_one_whole_file_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("huron.trax");
        std::thread::scope(|scope| {
            for writer in 0..8_u8 {
                let path = &path;
                scope.spawn(move || {
                    for length in 0..20 {
                        replace(path, &vec![writer; 5000 + 1000 * length]).unwrap();
                        tidy(path);
                    }
                });
            }
        });
        let last = std::fs::read(&path).unwrap();
        assert!(last.len() == 24_000 && last.iter().all(|byte| *byte == last[0]));
        assert_eq!(names(folder.path()), ["huron.trax"]);
    }

    #[test]
    fn what_is_being_written_is_not_tidied_away() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("huron.trax");
        let partial = Partial::begin(&path).unwrap();
        tidy(&path);
        assert_eq!(names(folder.path()), [".huron.trax.trueaxis-partial"]);
        drop(partial);
        tidy(&path);
        assert_eq!(names(folder.path()), [""; 0]);
    }

    #[test]
    fn a_name_of_any_length_and_script_can_be_written() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["ä".repeat(127), "x".repeat(255), "y".to_owned()] {
            let path = folder.path().join(name);
            replace(&path, b"content").unwrap();
            assert_eq!(std::fs::read(&path).unwrap(), b"content");
        }
        assert_eq!(names(folder.path()).len(), 3);
    }

    #[test]
    #[cfg(unix)]
    fn a_link_in_the_way_is_neither_followed_nor_removed() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("huron.trax");
        let other = folder.path().join("other");
        std::fs::write(&other, "mine").unwrap();
        std::os::unix::fs::symlink(&other, partial_path(&path)).unwrap();
        let error = replace(&path, b"content").unwrap_err();
        assert!(error.to_string().contains("is in the way"), "{error}");
        assert_eq!(std::fs::read(&other).unwrap(), b"mine");
        assert!(!path.exists());
    }
}
