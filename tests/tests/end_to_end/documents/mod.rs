//! Tests of README and the book in `docs/`: commands run or are at least accepted, request bodies are
//! accepted, links are valid, and tables match the code.
//!
//! The fence of every code block declares its check:
//!
//! | fence | what happens |
//! |---|---|
//! | `sh,run` | all such blocks of a page are one script, run beside a server of its own |
//! | `sh,check` | the command line accepts every `tandem`, and files, packages and tests that other commands name are there |
//! | `json` | parses; `json,tool=NAME` and `json,start` are sent to a server, `json,instructions` is read by one |
//! | `toml,map`, `toml,settings` | read as a policy map, as settings |
//! | `toml,task`, `toml,robot` | a file of `gateway/examples/tasks`, of `robots` there, which is read as a task, as a robot |
//! | `python` | compiles; `python,run` is run where its packages are installed |
//! | `xml` | parses; `xml,scene` is the scene that a test plays in |
//! | `yaml` | its `args` are accepted by the command line |
//! | `text` | nothing: it is no command |

mod blocks;
mod bodies;
mod command_lines;
mod links;
mod masses;
mod pages;
#[cfg(unix)]
mod scripts;
mod tables;
