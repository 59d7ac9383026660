//! The owner of a collider, encoded in its tag.

/// Owner of a collider. Colliders without an owner belong to the room.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Owner {
    Link { robot: usize, link: usize },
    Object(usize),
}

impl Owner {
    /// Returns the tag of a collider. Indices count from 1, so that 0 is the room's.
    pub fn tag(self) -> u128 {
        match self {
            Owner::Link { robot, link } => ((robot as u128 + 1) << 32) | (link as u128 + 1),
            Owner::Object(object) => (object as u128 + 1) << 64,
        }
    }

    pub fn of_tag(tag: u128) -> Option<Owner> {
        let [link, robot, object] = [0, 32, 64].map(|shift| (tag >> shift) as u32 as usize);
        match (robot.checked_sub(1), link.checked_sub(1), object.checked_sub(1)) {
            (Some(robot), Some(link), None) => Some(Owner::Link { robot, link }),
            (None, None, Some(object)) => Some(Owner::Object(object)),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Owner;

    #[test]
    fn a_tag_tells_its_owner() {
        for owner in [Owner::Link { robot: 0, link: 0 }, Owner::Link { robot: 2, link: 43 }, Owner::Object(0)]
        {
            assert_eq!(Owner::of_tag(owner.tag()), Some(owner));
        }
        assert_eq!(Owner::of_tag(0), None, "the room");
    }
}
