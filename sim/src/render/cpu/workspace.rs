//! Shared buffers for drawing. They are megabytes that a renderer does not need between images, so the
//! renderers of a process share them. At most as many renderers draw at the same time as there are processor
//! cores.

use std::sync::{Condvar, LazyLock, Mutex, MutexGuard, PoisonError};
use std::thread;

use super::{Canvas, LitState};

/// Number of lit states kept for their renderers' next images. With fewer states, two renderers that
/// alternate would light their rooms anew each time. If more renderers draw at the same time, one state is
/// kept for each of them.
const WAITING_STATES: usize = 2;

/// Number of canvases kept for images: one for each robot of a task, and one for the third-person camera.
const WAITING_CANVASES: usize = 4;

/// Buffers that are not in use.
struct Shared {
    /// Number of renderers that draw.
    drawing: usize,
    /// Lit states with the number of their renderer, the latest last.
    states: Vec<(u64, LitState)>,
    canvases: Vec<Canvas>,
}

static SHARED: Mutex<Shared> = Mutex::new(Shared { drawing: 0, states: Vec::new(), canvases: Vec::new() });
/// Signals the end of a drawing.
static ENDED: Condvar = Condvar::new();

/// Buffers in use by one renderer. They are returned on drop, unless the drawing has panicked.
pub struct Workspace {
    renderer: u64,
    /// The renderer's last state, if no other renderer has taken it.
    pub state: LitState,
    /// One canvas for each image.
    pub canvases: Vec<Canvas>,
}

impl Workspace {
    /// Waits until the renderer may draw. `renderer` is a number unique in this process.
    pub fn take(renderer: u64, pictures: usize) -> Workspace {
        let most = processors();
        let mut shared = ENDED.wait_while(lock(), |shared| shared.drawing >= most);
        let shared = shared.as_mut().unwrap_or_else(|poisoned| poisoned.get_mut());
        shared.drawing += 1;
        let kept = shared.canvases.len().saturating_sub(pictures);
        let mut canvases = shared.canvases.split_off(kept);
        canvases.resize_with(pictures, Canvas::default);
        Workspace { renderer, state: shared.take_state(renderer), canvases }
    }

    /// Drops the state of a renderer that no longer exists.
    pub fn forget(renderer: u64) {
        lock().states.retain(|(lit_for, _)| *lit_for != renderer);
    }
}

impl Drop for Workspace {
    fn drop(&mut self) {
        let mut shared = lock();
        shared.drawing -= 1;
        if !thread::panicking() {
            shared.states.push((self.renderer, std::mem::take(&mut self.state)));
            if shared.states.len() > WAITING_STATES.max(processors()) {
                shared.states.remove(0);
            }
            shared.canvases.append(&mut self.canvases);
            shared.canvases.truncate(WAITING_CANVASES.max(processors()));
        }
        ENDED.notify_one();
    }
}

impl Shared {
    fn take_state(&mut self, renderer: u64) -> LitState {
        if let Some(own) = self.states.iter().position(|(lit_for, _)| *lit_for == renderer) {
            return self.states.remove(own).1;
        }
        if self.states.len() < WAITING_STATES {
            return LitState::default();
        }
        let (_, mut oldest) = self.states.remove(0);
        oldest.forget();
        oldest
    }
}

fn lock() -> MutexGuard<'static, Shared> {
    SHARED.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Returns the number of processors. It is queried once, since the system reads files for it.
fn processors() -> usize {
    static PROCESSORS: LazyLock<usize> =
        LazyLock::new(|| thread::available_parallelism().map_or(1, usize::from));
    *PROCESSORS
}

#[cfg(test)]
mod tests {
    use std::panic::catch_unwind;
    use std::sync::atomic::{AtomicUsize, Ordering};

    use super::*;

    #[test]
    fn no_more_draw_at_once_than_there_are_cores_and_a_panic_gives_its_place_back() {
        let (now, most) = (AtomicUsize::new(0), AtomicUsize::new(0));
        let draw = |renderer: u64| {
            let workspace = Workspace::take(renderer, 2);
            assert_eq!(workspace.canvases.len(), 2);
            most.fetch_max(now.fetch_add(1, Ordering::SeqCst) + 1, Ordering::SeqCst);
            thread::yield_now();
            now.fetch_sub(1, Ordering::SeqCst);
            assert!(!renderer.is_multiple_of(7), "this one panics");
        };
        let threads = 8 * processors();
        let panicked = thread::scope(|scope| {
            let one = |thread: usize| {
                let numbers = (0..50).map(move |round| (round * threads + thread) as u64 + (1 << 40));
                scope.spawn(move || {
                    numbers
                        .filter(|number| {
                            catch_unwind(std::panic::AssertUnwindSafe(|| draw(*number))).is_err()
                        })
                        .count()
                })
            };
            let threads: Vec<_> = (0..threads).map(one).collect();
            threads.into_iter().map(|thread| thread.join().unwrap()).sum::<usize>()
        });
        assert!(panicked > threads, "{panicked} panicked");
        assert!((1..=processors()).contains(&most.into_inner()));
        assert!(lock().states.len() <= WAITING_STATES.max(processors()));
    }
}
