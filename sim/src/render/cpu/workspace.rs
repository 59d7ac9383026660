//! What drawing needs and no picture keeps: megabytes, of which a renderer that waits for its next picture needs none. So the renderers
//! of a process share them.

use std::sync::{Mutex, PoisonError};
use std::thread;

use super::{Canvas, LitState};

/// Lit states that wait for their renderers' next pictures. With fewer, renderers that draw by turns would light their rooms anew
/// each time; so many are there at least, and more only where more renderers draw at the same time.
const WAITING_STATES: usize = 2;

/// The lit states that nobody draws with, each with the number of the renderer that it was lit for, the latest last.
static STATES: Mutex<Vec<(u64, LitState)>> = Mutex::new(Vec::new());

/// The canvases that nobody draws on.
static CANVASES: Mutex<Vec<Canvas>> = Mutex::new(Vec::new());

/// Takes a state for the renderer of this number: the one that it drew with last, if that has not gone to another renderer.
pub fn take_state(renderer: u64) -> LitState {
    let mut states = STATES.lock().unwrap_or_else(PoisonError::into_inner);
    let own = states.iter().position(|(lit_for, _)| *lit_for == renderer);
    let free = (states.len() >= WAITING_STATES).then_some(0);
    match (own, free) {
        (Some(own), _) => states.remove(own).1,
        (None, Some(oldest)) => {
            let (_, mut state) = states.remove(oldest);
            state.forget();
            state
        }
        (None, None) => LitState::default(),
    }
}

/// Gives back the state that this renderer has drawn with.
pub fn give_state(renderer: u64, state: LitState) {
    let mut states = STATES.lock().unwrap_or_else(PoisonError::into_inner);
    states.push((renderer, state));
    if states.len() > WAITING_STATES.max(processors()) {
        states.remove(0);
    }
}

/// Lets go of what was lit for a renderer that is no more.
pub fn drop_state(renderer: u64) {
    STATES.lock().unwrap_or_else(PoisonError::into_inner).retain(|(lit_for, _)| *lit_for != renderer);
}

/// Takes a canvas for each of so many pictures.
pub fn take_canvases(count: usize) -> Vec<Canvas> {
    let mut canvases = CANVASES.lock().unwrap_or_else(PoisonError::into_inner);
    let kept = canvases.len().saturating_sub(count);
    let mut taken = canvases.split_off(kept);
    taken.resize_with(count, Canvas::default);
    taken
}

/// Gives back canvases.
pub fn give_canvases(given: Vec<Canvas>) {
    let mut canvases = CANVASES.lock().unwrap_or_else(PoisonError::into_inner);
    canvases.extend(given);
    canvases.truncate(processors().max(CANVASES_OF_A_STATE));
}

/// The robots of a task at most, or one fewer and the third person.
const CANVASES_OF_A_STATE: usize = 4;

fn processors() -> usize {
    thread::available_parallelism().map_or(1, usize::from)
}
