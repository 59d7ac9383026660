//! Friction of colliders, and of a pair of them, as MJCF has it.

use serde::{Deserialize, Serialize};

/// Which of the three coefficients act: MJCF's `condim` 1, 3, 4 and 6.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub enum Directions {
    None,
    Slide,
    SlideSpin,
    SlideSpinRoll,
}

impl Directions {
    /// From MJCF's `condim`; `None` for a number it does not have.
    pub(crate) fn from_condim(condim: u32) -> Option<Directions> {
        match condim {
            1 => Some(Directions::None),
            3 => Some(Directions::Slide),
            4 => Some(Directions::SlideSpin),
            6 => Some(Directions::SlideSpinRoll),
            _ => None,
        }
    }
}

/// Friction of a collider.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Friction {
    pub directions: Directions,
    /// Friction force per normal force.
    pub slide: f64,
    /// Moment about the normal per normal force.
    pub spin_m: f64,
    /// Moment about a tangent per normal force.
    pub roll_m: f64,
    pub priority: i32,
}

impl Friction {
    /// What acts between two colliders: the values of the one with the higher priority, else the larger of each.
    /// Source: MuJoCo, "Contact parameters" in the chapter on modelling.
    pub fn between(a: &Friction, b: &Friction) -> Friction {
        match a.priority.cmp(&b.priority) {
            std::cmp::Ordering::Greater => *a,
            std::cmp::Ordering::Less => *b,
            std::cmp::Ordering::Equal => Friction {
                directions: a.directions.max(b.directions),
                slide: a.slide.max(b.slide),
                spin_m: a.spin_m.max(b.spin_m),
                roll_m: a.roll_m.max(b.roll_m),
                priority: a.priority,
            },
        }
    }

    /// Coefficients of the lanes of a contact (see `contact`); 0 where none acts.
    pub(in crate::dynamics) fn lanes(&self) -> [f64; 6] {
        let [slide, spin, roll] = match self.directions {
            Directions::None => [0.0; 3],
            Directions::Slide => [self.slide, 0.0, 0.0],
            Directions::SlideSpin => [self.slide, self.spin_m, 0.0],
            Directions::SlideSpinRoll => [self.slide, self.spin_m, self.roll_m],
        };
        [1.0, slide, slide, spin, roll, roll]
    }
}
