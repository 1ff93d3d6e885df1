//! Threads that share the work of a step.
//!
//! The one thing to know: what is near in memory goes to the same thread in each pass and each step, as long as that
//! thread is there, because a thousand rings move faster than their numbers from one core's cache to another's. And a
//! thread that sleeps takes tens of microseconds to wake up, so while a step is at hand all threads stay awake.

use rayon::prelude::*;
use rayon::{ThreadPool, Yield};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};

/// So often a thread looks for work before it lets others have the processor.
const LOOKS: u32 = 64;

/// Does some work in a pool whose threads stay awake for what is shared in it; here and alone without a pool.
pub(crate) fn in_pool<T: Send>(pool: Option<&ThreadPool>, work: impl FnOnce() -> T + Send) -> T {
    let Some(pool) = pool else { return work() };
    pool.install(|| {
        let over = AtomicBool::new(false);
        let own = rayon::current_thread_index();
        rayon::scope(|scope| {
            for _ in 1..pool.current_num_threads() {
                scope.spawn(|_| stay_awake(&over, own));
            }
            let _end = SetOnDrop(&over);
            work()
        })
    })
}

/// Also when the work panics nobody waits for ever.
struct SetOnDrop<'a>(&'a AtomicBool);

impl Drop for SetOnDrop<'_> {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Release);
    }
}

/// Works on what there is to share until it is over. The thread that has the work itself may pick this up while it
/// waits for a part of it, and must not stay here.
fn stay_awake(over: &AtomicBool, own: Option<usize>) {
    if rayon::current_thread_index() == own {
        return;
    }
    let mut looks = 0;
    while !over.load(Ordering::Acquire) {
        if rayon::yield_now() == Some(Yield::Executed) {
            looks = 0;
        } else if looks < LOOKS {
            looks += 1;
            std::hint::spin_loop();
        } else {
            std::thread::yield_now();
        }
    }
}

/// Does the same with each of some items, in any order, on all threads where there are some: each thread begins with its
/// own share of the items, a run of neighbours, and goes on with what others have left.
pub(crate) fn share<T: Send>(
    pool: Option<&ThreadPool>,
    items: impl Iterator<Item = T>,
    work: impl Fn(T) + Sync,
) {
    let Some(pool) = pool else { return items.for_each(work) };
    let items: Vec<Mutex<Option<T>>> = items.map(|item| Mutex::new(Some(item))).collect();
    let (threads, count) = (pool.current_num_threads(), items.len());
    pool.install(|| {
        (0..threads).into_par_iter().with_max_len(1).for_each(|_| {
            let first = rayon::current_thread_index().unwrap_or(0) * count / threads;
            let (before, from_first) = items.split_at(first);
            for item in from_first.iter().chain(before) {
                // Who panics with an item has taken it out before.
                if let Some(item) = item.lock().ok().and_then(|mut item| item.take()) {
                    work(item);
                }
            }
        });
    });
}

#[cfg(test)]
mod tests {
    use super::{in_pool, share};
    use std::sync::atomic::{AtomicU32, Ordering};

    fn pool(threads: usize) -> Option<rayon::ThreadPool> {
        (threads > 1).then(|| rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap())
    }

    #[test]
    fn each_item_has_its_turn_once() {
        for (threads, count) in [(1, 5), (2, 0), (2, 1), (2, 7), (3, 2), (3, 100)] {
            let pool = pool(threads);
            let mut turns = vec![0; count];
            in_pool(pool.as_ref(), || {
                for _ in 0..50 {
                    share(pool.as_ref(), turns.iter_mut(), |turn| *turn += 1);
                }
            });
            assert!(turns.iter().all(|&turn| turn == 50), "{threads} threads, {count} items: {turns:?}");
        }
    }

    /// Nobody waits for ever, and the pool can be used again.
    #[test]
    fn a_panic_comes_through() {
        let pool = pool(2);
        let done = AtomicU32::new(0);
        for _ in 0..20 {
            let panicked = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| {
                in_pool(pool.as_ref(), || share(pool.as_ref(), 0..8, |item| assert_ne!(item, 3, "as asked")));
            }));
            assert!(panicked.is_err());
            in_pool(pool.as_ref(), || {
                share(pool.as_ref(), 0..8, |_| {
                    done.fetch_add(1, Ordering::Relaxed);
                });
            });
        }
        assert_eq!(done.load(Ordering::Relaxed), 160);
    }
}
