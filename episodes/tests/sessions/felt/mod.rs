//! Tests of the robots' sensing and its reports, and of manipulation by a policy's information alone:
//! grips and carried loads.

mod carries;
mod feel;
mod grips;
mod hands;
mod pinches;
mod surfaces;
