//! What robots feel, what they tell of it, and grips that are carried out by what policies are told.

mod feel;
mod grips;
mod hands;
