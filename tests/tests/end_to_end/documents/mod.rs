//! Tests of README and the book in `docs/`: commands run or are at least accepted, request bodies are
//! accepted, links are valid, and tables match the code.
//!
//! The fence of every code block declares its check:
//!
//! | fence | check |
//! |---|---|
//! | `sh,run` | all such blocks of a page are run as one script, with a server of their own |
//! | `sh,check` | the command line accepts every `tandem`; files, packages and tests in other commands exist |
//! | `json` | parses; `json,tool=NAME` and `json,start` are sent to a server, which reads `json,instructions` |
//! | `toml,map`, `toml,settings` | is read as a policy map, or as settings |
//! | `toml,task`, `toml,robot` | equals a file in `gateway/examples`, which is read as a task or a robot |
//! | `python` | compiles; `python,run` is run if its packages are installed |
//! | `xml` | parses; `xml,scene` equals the scene of a test |
//! | `yaml` | the command line accepts its `args` |
//! | `text` | none: it is no command |

mod blocks;
mod bodies;
mod command_lines;
mod links;
mod masses;
mod pages;
#[cfg(unix)]
mod scripts;
mod tables;
