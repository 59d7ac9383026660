//! How surfaces rub on each other: MJCF's three coefficients and the rule by which those of two geoms become one.

/// Friction of one geom as its file states it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surface {
    pub coefficients: Friction,
    pub contact: ContactKind,
    /// The geom with the larger one decides alone.
    pub priority: i32,
}

/// Coulomb's coefficient of sliding; largest moment per normal force about the normal, and about the tangents.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Friction {
    pub slide: f32,
    pub spin_m: f32,
    pub roll_m: f32,
}

/// What a contact resists; each kind also what those before it resist. MJCF's `condim` 1, 3, 4 and 6.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum ContactKind {
    Normal,
    Sliding,
    Spinning,
    Rolling,
}

impl ContactKind {
    pub(super) fn from_condim(condim: u32) -> Option<ContactKind> {
        match condim {
            1 => Some(ContactKind::Normal),
            3 => Some(ContactKind::Sliding),
            4 => Some(ContactKind::Spinning),
            6 => Some(ContactKind::Rolling),
            _ => None,
        }
    }
}

impl Surface {
    /// What holds between two geoms: all of the one with the larger priority, else the larger of each number. What the
    /// kind of contact leaves out is 0.
    /// Source: MuJoCo, "Contact parameters" in the chapter on modelling.
    pub fn against(&self, other: &Surface) -> Friction {
        let (a, b) = (&self.coefficients, &other.coefficients);
        let (friction, contact) = match self.priority.cmp(&other.priority) {
            std::cmp::Ordering::Greater => (*a, self.contact),
            std::cmp::Ordering::Less => (*b, other.contact),
            std::cmp::Ordering::Equal => {
                let larger = Friction {
                    slide: a.slide.max(b.slide),
                    spin_m: a.spin_m.max(b.spin_m),
                    roll_m: a.roll_m.max(b.roll_m),
                };
                (larger, self.contact.max(other.contact))
            }
        };
        let unless_below =
            |least: ContactKind, coefficient: f32| if contact < least { 0.0 } else { coefficient };
        Friction {
            slide: unless_below(ContactKind::Sliding, friction.slide),
            spin_m: unless_below(ContactKind::Spinning, friction.spin_m),
            roll_m: unless_below(ContactKind::Rolling, friction.roll_m),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::ContactKind::{Normal, Rolling, Sliding, Spinning};
    use super::*;

    fn surface(slide: f32, spin_m: f32, roll_m: f32, contact: ContactKind, priority: i32) -> Surface {
        Surface { coefficients: Friction { slide, spin_m, roll_m }, contact, priority }
    }

    fn check(a: Surface, b: Surface, expected: [f32; 3]) {
        let [slide, spin_m, roll_m] = expected;
        assert_eq!(a.against(&b), Friction { slide, spin_m, roll_m }, "{a:?} against {b:?}");
        assert_eq!(a.against(&b), b.against(&a), "the order of two geoms does not matter");
    }

    #[test]
    fn the_larger_numbers_count() {
        let wood = surface(0.4, 0.005, 0.0001, Sliding, 0);
        check(wood, surface(0.8, 0.001, 0.0, Sliding, 0), [0.8, 0.0, 0.0]);
        check(wood, surface(0.3, 0.01, 0.002, Rolling, 0), [0.4, 0.01, 0.002]);
        check(wood, surface(0.3, 0.01, 0.002, Spinning, 0), [0.4, 0.01, 0.0]);
    }

    #[test]
    fn priority_decides_alone() {
        let sole = surface(0.6, 0.005, 0.0001, Sliding, 1);
        check(sole, surface(1.0, 0.01, 0.002, Rolling, 0), [0.6, 0.0, 0.0]);
        check(sole, surface(1.0, 0.01, 0.002, Normal, 2), [0.0, 0.0, 0.0]);
    }

    #[test]
    fn only_the_four_kinds_of_contact_are_read() {
        let read = [0, 1, 2, 3, 4, 5, 6, 7].map(ContactKind::from_condim);
        assert_eq!(
            read,
            [None, Some(Normal), None, Some(Sliding), Some(Spinning), None, Some(Rolling), None]
        );
    }
}
