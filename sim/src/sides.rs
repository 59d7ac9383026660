//! Left and right: the side of an arm, hand, leg or foot, and pairs of values by side.

use std::ops::{Index, IndexMut};

use serde::{Deserialize, Serialize};

/// Side of a hand, arm, leg or foot.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub enum Side {
    Left,
    Right,
}

impl Side {
    pub const BOTH: [Side; 2] = [Side::Left, Side::Right];

    pub fn index(self) -> usize {
        self as usize
    }

    pub fn other(self) -> Side {
        match self {
            Side::Left => Side::Right,
            Side::Right => Side::Left,
        }
    }

    /// Returns the prefix of link, joint and site names.
    pub fn name(self) -> &'static str {
        match self {
            Side::Left => "left",
            Side::Right => "right",
        }
    }

    /// Returns the sign of y on this side: 1 left, -1 right. It mirrors lateral components of vectors, and
    /// roll and yaw of joints.
    pub fn sign(self) -> f32 {
        match self {
            Side::Left => 1.0,
            Side::Right => -1.0,
        }
    }
}

/// A pair with one value for each side: `feet[Side::Left]`. It is serialised and hashed as the left value,
/// then the right value.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Sides<T> {
    pub left: T,
    pub right: T,
}

impl<T> Sides<T> {
    /// Creates both values, the left one first.
    pub fn from_fn(mut make: impl FnMut(Side) -> T) -> Sides<T> {
        Sides { left: make(Side::Left), right: make(Side::Right) }
    }

    pub fn map<U>(self, mut change: impl FnMut(T) -> U) -> Sides<U> {
        Sides { left: change(self.left), right: change(self.right) }
    }

    pub fn each_ref(&self) -> Sides<&T> {
        Sides { left: &self.left, right: &self.right }
    }

    /// Returns each value with its side: left, then right.
    pub fn by_side(self) -> impl Iterator<Item = (Side, T)> {
        Side::BOTH.into_iter().zip(self)
    }

    /// Returns left, then right.
    pub fn iter(&self) -> impl Iterator<Item = &T> {
        [&self.left, &self.right].into_iter()
    }

    pub fn iter_mut(&mut self) -> impl Iterator<Item = &mut T> {
        [&mut self.left, &mut self.right].into_iter()
    }
}

impl<T: Copy> Sides<T> {
    pub const fn both(value: T) -> Sides<T> {
        Sides { left: value, right: value }
    }
}

impl<T> Index<Side> for Sides<T> {
    type Output = T;

    fn index(&self, side: Side) -> &T {
        match side {
            Side::Left => &self.left,
            Side::Right => &self.right,
        }
    }
}

impl<T> IndexMut<Side> for Sides<T> {
    fn index_mut(&mut self, side: Side) -> &mut T {
        match side {
            Side::Left => &mut self.left,
            Side::Right => &mut self.right,
        }
    }
}

/// Left, then right.
impl<T> IntoIterator for Sides<T> {
    type Item = T;
    type IntoIter = std::array::IntoIter<T, 2>;

    fn into_iter(self) -> Self::IntoIter {
        [self.left, self.right].into_iter()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The state hash contains controllers' memories, which used to be arrays.
    #[test]
    fn written_as_the_array_of_left_and_right() {
        let sides = Sides { left: (1.5_f32, Some(7_u32)), right: (-2.0, None) };
        let bytes = postcard::to_stdvec(&sides).unwrap();
        assert_eq!(bytes, postcard::to_stdvec(&[sides.left, sides.right]).unwrap());
        assert_eq!(postcard::from_bytes::<Sides<(f32, Option<u32>)>>(&bytes).unwrap(), sides);
    }

    #[test]
    fn sides_are_found_by_name_and_in_order() {
        let mut names = Sides::from_fn(Side::name);
        assert_eq!((names[Side::Left], names[Side::Right]), ("left", "right"));
        assert_eq!(names.into_iter().collect::<Vec<_>>(), ["left", "right"]);
        assert!(names.by_side().all(|(side, name)| name == side.name()));
        names[Side::Right] = "other";
        assert_eq!(names.map(str::len), Sides { left: 4, right: 5 });
        assert_eq!(Side::BOTH.map(Side::other), [Side::Right, Side::Left]);
    }
}
