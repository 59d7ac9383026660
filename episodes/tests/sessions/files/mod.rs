//! Episodes in scenes and with robots of files.

mod phases;
mod robots;
mod scenes;
