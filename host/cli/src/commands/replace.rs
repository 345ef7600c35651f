//! Replaces a file as a whole: readers see either the old or the new content.
//!
//! The new content goes into a *partial* file beside the old one, with a name derived from it, which is then
//! renamed. The writer holds a lock on the partial file, and the system releases it whenever the program ends. A
//! partial file without a lock was therefore left behind by a program that was killed; the next program that writes
//! the same file removes it.

use std::ffi::{OsStr, OsString};
use std::fs::{File, OpenOptions};
use std::io::{Error, ErrorKind, Read, Result, Seek, Write};
use std::path::{Path, PathBuf};

/// Longest part of the file name that is kept in the name of its partial file: file systems allow 255 bytes. If two
/// files share a partial file, their writers merely wait for each other.
const LONGEST: usize = 200;

/// Replaces the content of a file with `bytes`, or leaves the old content in place.
///
/// # Errors
/// Those of the file system, and content that does not read back as written.
pub fn replace(path: &Path, bytes: &[u8]) -> Result<()> {
    replace_by(path, |file| file.write_all(bytes), |_| Ok(()))
}

/// Like `replace`, for content produced by `write`, which need not fit into memory. The new file takes its place once
/// `accept` has read and accepted it. `accept` is not called for a device or a pipe, which cannot be read back.
///
/// # Errors
/// Also those of `write` and `accept`.
pub fn replace_by(
    path: &Path,
    write: impl FnOnce(&mut NewContent<'_>) -> Result<()>,
    accept: impl FnOnce(&File) -> Result<()>,
) -> Result<()> {
    match std::fs::metadata(path) {
        Ok(found) if found.is_dir() => return Err(ErrorKind::IsADirectory.into()),
        // A device or a pipe cannot be replaced, and has no old content to lose.
        Ok(found) if !found.is_file() => {
            let file = OpenOptions::new().write(true).open(path)?;
            return write(&mut NewContent::new(&file));
        }
        // A link to a file that is not there yet is no error, a circle of links is.
        Err(error) if error.kind() != ErrorKind::NotFound => return Err(error),
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
        // Still ours, because we hold the lock.
        let _ = std::fs::remove_file(&partial.path);
        return done;
    }
    // The new name survives a power cut once the folder is synced; not every system can do that.
    if let Ok(folder) = File::open(folder(&path)) {
        let _ = folder.sync_all();
    }
    Ok(())
}

/// Removes the partial file of a program that was killed while writing this file.
pub fn tidy(path: &Path) {
    // Any obstacle will be reported when the file is written.
    let _ = remove_abandoned(&partial_path(&real(path)), |file| Ok(file.try_lock()?));
}

/// Longest chain of symbolic links that is followed, as on Linux.
const LINKS: usize = 40;

/// Resolves symbolic links, so that the file they name is replaced and not the link. That file need not exist yet.
fn real(path: &Path) -> PathBuf {
    let mut path = path.to_owned();
    for _ in 0..LINKS {
        match std::fs::read_link(&path) {
            Ok(to) => path = folder(&path).join(to),
            Err(_) => break,
        }
    }
    path.canonicalize().unwrap_or(path)
}

/// True if both paths are of one file, which would be written at the same time; devices take what they get.
pub fn is_same(a: &Path, b: &Path) -> bool {
    let partial = |path: &Path| {
        let path = real(path);
        let is_file = std::fs::metadata(&path).map_or(true, |found| found.is_file());
        let partial = partial_path(&path);
        let folder = folder(&partial).canonicalize().ok();
        let whole = folder.zip(partial.file_name());
        is_file.then(|| whole.map_or(partial.clone(), |(folder, name)| folder.join(name)))
    };
    partial(a).is_some_and(|a| partial(b) == Some(a))
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

/// Checksum of what is written and of what is read back. Sixteen tables are far faster than one.
static CRC: crc::Crc<u64, crc::Table<16>> = crc::Crc::<u64, crc::Table<16>>::new(&crc::CRC_64_XZ);
type ContentChecksum = crc::Digest<'static, u64, crc::Table<16>>;

/// Destination of the new content; keeps a checksum of it.
pub struct NewContent<'a> {
    file: &'a File,
    sum: ContentChecksum,
}

impl<'a> NewContent<'a> {
    fn new(file: &'a File) -> Self {
        Self {
            file,
            sum: CRC.digest(),
        }
    }
}

impl Write for NewContent<'_> {
    fn write(&mut self, bytes: &[u8]) -> Result<usize> {
        let written = self.file.write(bytes)?;
        self.sum.update(&bytes[..written]);
        Ok(written)
    }

    fn flush(&mut self) -> Result<()> {
        self.file.flush()
    }
}

/// A partial file that no other program writes or removes.
struct Partial {
    path: PathBuf,
    file: File,
}

impl Partial {
    /// Waits for other writers of the same file, then creates a new partial file.
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
                    // Until it was locked, others could take it for abandoned.
                    if is_at(&file, &path)? {
                        return Ok(Self { path, file });
                    }
                }
                Err(error) if error.kind() == ErrorKind::AlreadyExists => {
                    match remove_abandoned(&path, lock) {
                        Err(error) if error.kind() == ErrorKind::NotFound => {}
                        done => done?,
                    }
                }
                Err(error) => return Err(error),
            }
        }
    }

    /// Writes everything to disk, with the permissions of the file to be replaced, and reads it back.
    fn fill(
        &self,
        write: impl FnOnce(&mut NewContent<'_>) -> Result<()>,
        old: &Path,
    ) -> Result<()> {
        let mut file = &self.file;
        let mut sink = NewContent::new(file);
        write(&mut sink)?;
        let written = sink.sum.finalize();
        if let Ok(old) = std::fs::metadata(old) {
            match file.set_permissions(old.permissions()) {
                // A browser has none.
                Err(error) if error.kind() == ErrorKind::Unsupported => {}
                done => done?,
            }
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

/// Removes a partial file that `lock` shows to be written no longer.
fn remove_abandoned(path: &Path, lock: impl FnOnce(&File) -> Result<()>) -> Result<()> {
    if !std::fs::symlink_metadata(path)?.is_file() {
        let name = path.display();
        return Err(Error::other(format!("{name} is in the way and no file")));
    }
    let file = File::open(path)?;
    lock(&file)?;
    // Its writer may have finished in the meantime; then it has another name now.
    if is_at(&file, path)? {
        std::fs::remove_file(path)?;
    }
    Ok(())
}

/// Waits for the lock. On a file system without locks, two programs that write the same file at the same time are
/// not kept apart.
fn lock(file: &File) -> Result<()> {
    match file.lock() {
        Err(error) if error.kind() == ErrorKind::Unsupported => Ok(()),
        done => done,
    }
}

/// Whether the open file is the one with this name.
#[cfg(not(target_family = "wasm"))]
fn is_at(file: &File, path: &Path) -> Result<bool> {
    let open = same_file::Handle::from_file(file.try_clone()?)?;
    match same_file::Handle::from_path(path) {
        Ok(named) => Ok(named == open),
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(false),
        Err(error) => Err(error),
    }
}

/// In a browser there is nobody else.
#[cfg(target_family = "wasm")]
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
    fn a_circle_of_links_is_refused_and_stays() {
        let folder = tempfile::tempdir().unwrap();
        let [a, b] = ["a", "b"].map(|name| folder.path().join(name));
        std::os::unix::fs::symlink("b", &a).unwrap();
        std::os::unix::fs::symlink("a", &b).unwrap();
        assert!(replace(&a, b"new").is_err());
        assert!(a.is_symlink() && b.is_symlink());
    }

    #[test]
    #[cfg(unix)]
    fn a_link_is_followed_to_a_file_that_is_there_or_not() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::create_dir(folder.path().join("there")).unwrap();
        let link = folder.path().join("link");
        std::os::unix::fs::symlink("there/huron.trax", &link).unwrap();
        for content in ["first", "second"] {
            replace(&link, content.as_bytes()).unwrap();
            assert!(link.is_symlink());
            let found = std::fs::read_to_string(folder.path().join("there/huron.trax"));
            assert_eq!(found.unwrap(), content);
        }
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
