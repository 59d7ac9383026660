//! Episodes in scenes and with robots of files.

mod robots;
mod scenes;
