//! Cases of several robots that carry, hold or bring something together.

pub(crate) mod carrying;
pub(crate) mod holding;
pub(crate) mod placing;
