//! What a policy is told, under way and at the end.

mod assistance;
mod endings;
mod explained;
mod requests;
