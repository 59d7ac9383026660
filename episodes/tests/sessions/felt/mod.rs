//! What robots feel and see, what they tell of it, and what is done by what policies are told alone: grips, and loads that are carried.

mod carries;
mod feel;
mod grips;
mod hands;
mod pinches;
mod surfaces;
