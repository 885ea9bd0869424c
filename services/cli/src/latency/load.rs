//! Something else for the machine to do.

use core::sync::atomic::{AtomicBool, Ordering};
use std::hint::black_box;
use std::sync::Arc;
use std::thread::JoinHandle;

/// What each thread goes through, again and again: more than caches hold.
const WORDS: usize = 4 << 20;

/// Threads that compute and use up the memory's bandwidth, at ordinary priority.
pub struct Load {
    is_over: Arc<AtomicBool>,
    threads: Vec<JoinHandle<()>>,
}

impl Load {
    /// So many of them.
    pub fn start(threads: usize) -> Self {
        let is_over = Arc::new(AtomicBool::new(false));
        let disturb = |_| {
            let is_over = Arc::clone(&is_over);
            std::thread::spawn(move || disturb(&is_over))
        };
        Self { threads: (0..threads).map(disturb).collect(), is_over }
    }
}

impl Drop for Load {
    fn drop(&mut self) {
        self.is_over.store(true, Ordering::Relaxed);
        for thread in self.threads.drain(..) {
            let _ = thread.join();
        }
    }
}

fn disturb(is_over: &AtomicBool) {
    let mut words = vec![1_u64; WORDS];
    while !is_over.load(Ordering::Relaxed) {
        for (index, word) in words.iter_mut().enumerate() {
            *word = word.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(index as u64);
        }
        black_box(&words);
    }
}
