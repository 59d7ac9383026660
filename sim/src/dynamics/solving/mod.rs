//! A step: the impulses that meet all contacts, joints and equalities, and what the trees do by them.

pub mod solver;
mod step;
