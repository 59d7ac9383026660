//! Rows of an image on several threads.

use std::panic::resume_unwind;
use std::sync::{Mutex, PoisonError};
use std::thread;

/// Calls `draw` with the index and the values of each row of `width` values, on `threads` threads. Each
/// thread takes the next row that is left, so `draw` must not depend on the order.
pub fn for_each_row<T: Send>(
    values: &mut [T],
    width: usize,
    threads: usize,
    draw: impl Fn(usize, &mut [T]) + Sync,
) {
    let rows = Mutex::new(values.chunks_mut(width).enumerate());
    let work = || {
        loop {
            let next = rows.lock().unwrap_or_else(PoisonError::into_inner).next();
            let Some((number, row)) = next else { break };
            draw(number, row);
        }
    };
    thread::scope(|scope| {
        let others: Vec<_> = (1..threads).map(|_| scope.spawn(work)).collect();
        work();
        for other in others {
            other.join().unwrap_or_else(|panic| resume_unwind(panic));
        }
    });
}
