//! Cases of several robots that carry, hold or bring an object together.

pub(crate) mod carrying;
pub(crate) mod holding;
pub(crate) mod placing;
