//! Tests of the information given to a policy, during an episode and at its end.

mod assistance;
mod endings;
mod explained;
mod requests;
mod shown;
