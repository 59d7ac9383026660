//! Placeholder while the walking skeleton is under construction.
