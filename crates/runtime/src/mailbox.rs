//! A few words that processes leave one another on the board, at any time and without waiting.
//!
//! They are sealed by their checksum: who reads while another writes, or after one that was killed as it wrote, or
//! what two have written at once, finds no seal that fits, and has read nothing. Neither side ever waits.

use core::sync::atomic::{AtomicU64, Ordering};
use xxhash_rust::xxh3::xxh3_64;

/// How often a reader looks again who has met a writer.
const ATTEMPTS: usize = 3;

/// Holds `N` words, or none.
#[repr(C, align(64))]
pub(crate) struct Mailbox<const N: usize> {
    words: [AtomicU64; N],
    /// 0 as long as nothing was ever written: all of shared memory begins so.
    seal: AtomicU64,
}

impl<const N: usize> Mailbox<N> {
    /// Puts these in place of what was there.
    pub(crate) fn write(&self, words: &[u64; N]) {
        for (slot, word) in self.words.iter().zip(words) {
            slot.store(*word, Ordering::Relaxed);
        }
        self.seal.store(seal_of(words), Ordering::Release);
    }

    /// What was written last; `None` if nothing was, or nothing whole can be read.
    pub(crate) fn read(&self) -> Option<[u64; N]> {
        for _ in 0..ATTEMPTS {
            let seal = self.seal.load(Ordering::Acquire);
            if seal == 0 {
                return None;
            }
            let words = core::array::from_fn(|index| self.words[index].load(Ordering::Acquire));
            if seal_of(&words) == seal {
                return Some(words);
            }
        }
        None
    }
}

fn seal_of<const N: usize>(words: &[u64; N]) -> u64 {
    xxh3_64(bytemuck::cast_slice(words)).max(1)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn empty() -> Mailbox<3> {
        Mailbox { words: [0; 3].map(AtomicU64::new), seal: AtomicU64::new(0) }
    }

    #[test]
    fn what_was_written_is_read_again_and_again() {
        let mailbox = empty();
        assert_eq!(mailbox.read(), None);
        for words in [[0; 3], [1, 2, 3]] {
            mailbox.write(&words);
            assert_eq!([mailbox.read(), mailbox.read()], [Some(words); 2]);
        }
    }

    #[test]
    fn half_of_a_message_is_none() {
        let mailbox = empty();
        mailbox.write(&[1, 2, 3]);
        mailbox.words[1].store(7, Ordering::Relaxed);
        assert_eq!(mailbox.read(), None);
        mailbox.write(&[1, 7, 3]);
        assert_eq!(mailbox.read(), Some([1, 7, 3]));
    }

    #[test]
    fn nobody_who_reads_while_another_writes_reads_a_mixture() {
        let mailbox = empty();
        std::thread::scope(|scope| {
            scope.spawn(|| (1..=100_000_u64).for_each(|n| mailbox.write(&[n, 2 * n, 3 * n])));
            loop {
                let Some([n, twice, thrice]) = mailbox.read() else { continue };
                assert_eq!([twice, thrice], [2 * n, 3 * n]);
                if n == 100_000 {
                    break;
                }
            }
        });
    }
}
