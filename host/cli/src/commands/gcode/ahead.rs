//! A file that is written while what follows is computed.

use std::io::{ErrorKind, Result, Write};
use std::sync::mpsc::{SyncSender, sync_channel};

/// Pieces that wait, at most: the disk may be slower for a while.
const WAITING: usize = 8;

/// Takes pieces for a file that another thread writes.
pub struct Ahead(SyncSender<Vec<u8>>);

impl Write for Ahead {
    fn write(&mut self, bytes: &[u8]) -> Result<usize> {
        // It has gone where something could not be written, and tells what.
        let sent = self.0.send(bytes.to_vec());
        sent.map_err(|_| ErrorKind::BrokenPipe)?;
        Ok(bytes.len())
    }

    fn flush(&mut self) -> Result<()> {
        Ok(())
    }
}

/// Fills a file with what `fill` writes; what that returns, and whether all of it is written.
pub fn ahead<T>(
    file: &mut (impl Write + Send),
    fill: impl FnOnce(&mut Ahead) -> T,
) -> (T, Result<()>) {
    std::thread::scope(|scope| {
        let (pieces, waiting) = sync_channel::<Vec<u8>>(WAITING);
        let writing = scope.spawn(move || waiting.iter().try_for_each(|p| file.write_all(&p)));
        let filled = fill(&mut Ahead(pieces));
        let written = writing.join();
        let written = written.unwrap_or_else(|panic| std::panic::resume_unwind(panic));
        (filled, written)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Has room for so many bytes.
    struct Full(usize);

    impl Write for Full {
        fn write(&mut self, bytes: &[u8]) -> Result<usize> {
            match self.0.checked_sub(bytes.len()) {
                Some(left) => self.0 = left,
                None => return Err(ErrorKind::StorageFull.into()),
            }
            Ok(bytes.len())
        }

        fn flush(&mut self) -> Result<()> {
            Ok(())
        }
    }

    #[test]
    fn all_pieces_arrive_in_their_order() {
        let mut file = Vec::new();
        let (last, written) = ahead(&mut file, |file| {
            let mut pieces = (0..100_u8).map(|k| file.write_all(&[k; 1000]));
            pieces.all(|written| written.is_ok())
        });
        assert!(last && written.is_ok());
        let expected: Vec<u8> = (0..100_u8).flat_map(|k| [k; 1000]).collect();
        assert_eq!(file, expected);
    }

    #[test]
    fn a_full_disk_is_told_and_stops_what_fills_it() {
        let (stopped, written) = ahead(&mut Full(5000), |file| {
            (0..10_000).any(|_| file.write_all(&[0; 1000]).is_err())
        });
        assert!(stopped);
        assert_eq!(written.unwrap_err().kind(), ErrorKind::StorageFull);
    }
}
