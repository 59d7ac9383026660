//! Who calls.

/// Who calls, as its token says.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Caller {
    /// Who may use the server: starts episodes, and drives those that one policy directs.
    Host,
    /// The operator of one robot.
    Operator {
        /// The episode.
        episode: String,
        /// The robot, as "A".
        robot: String,
    },
}
