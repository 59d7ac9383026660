//! The list of tools. The line of a tool determines its call, its reply, and how both are parsed.

use serde::Serialize;
use serde_json::Value;

use crate::error::SpecError;
use crate::parts::{Assistance, CommandReply, PlanReply, Wording};
use crate::schema::{ToolSpec, TypedTools, TypedToolsCollector};
use crate::tool::{Tool, parse_args};
use crate::tools::*;

/// Generates all code that depends on the set of tools. A tool is one line with the type of its arguments, in
/// the group of its kind:
///
/// ```text
/// /// A question about the state of things.
/// Look(LookCall) -> each LookReply {
///     QueryDepth,
/// }
/// ```
///
/// The line adds `query_depth` to the names and the specifications. It adds the variants
/// `LookCall::QueryDepth` with the arguments, and `LookReply::QueryDepth` with the tool's `Tool::Reply`. It
/// adds a `From<QueryDepth>` for `ToolCall`, and match arms that parse, name and check calls, return their
/// robots and steps, and parse replies. Code that answers `LookCall`s does not compile until it handles the
/// tool.
///
/// In a group with `-> each R`, `R` is generated here and every tool has a separate reply. With `-> all R`,
/// every tool of the group replies with the existing type `R`. A group `for operators` is offered only in
/// episodes whose operators may talk. Tools in `without_episode` have no call on an episode.
macro_rules! tools {
    (
        without_episode { $($free:ident,)* }
        $(
            $(#[$doc:meta])*
            $group:ident($call:ident) -> $whose:ident $reply:ident $(for $audience:ident)? { $($tool:ident,)* }
        )*
    ) => {
        /// Returns the tools that every language model is offered, in order, with the texts that the model
        /// reads.
        pub fn tool_specs(wording: impl Into<Wording>) -> Vec<ToolSpec> {
            let wording = wording.into();
            let specs = operator_tool_specs(wording).into_iter();
            specs.filter(|spec| !spec.for_operators).collect()
        }

        /// Returns the tools of an operator that may talk: the tools of every policy, and the tools for
        /// talking.
        pub fn operator_tool_specs(wording: impl Into<Wording>) -> Vec<ToolSpec> {
            let wording = wording.into();
            let specs = every_tool_spec(wording).into_iter().filter(|spec| !spec.for_programs);
            specs.filter(|spec| !spec.full_only || wording.assistance == Assistance::Full).collect()
        }

        /// Returns every tool.
        pub(crate) fn every_tool_spec(wording: Wording) -> Vec<ToolSpec> {
            vec![
                $( ToolSpec::without_episode::<$free>(wording), )*
                $( $( ToolSpec::on_episode::<$tool>(wording, $call::FOR_OPERATORS), )* )*
            ]
        }

        /// Returns every tool, with its arguments and its reply as named types.
        pub fn typed_tools() -> TypedTools {
            let mut tools = TypedToolsCollector::new();
            $( tools.add::<$free>(false, false); )*
            $( $( tools.add::<$tool>(true, $call::FOR_OPERATORS); )* )*
            tools.add_type::<Briefing>();
            tools.finish()
        }

        /// The names of the tools that act on an episode.
        pub const EPISODE_TOOLS: &[&str] = &[$( $( $tool::NAME, )* )*];

        $(
            $(#[$doc])*
            #[derive(Debug, Clone, PartialEq, Serialize)]
            #[serde(untagged)]
            #[allow(missing_docs, reason = "each variant is the tool of its name, described on its type")]
            pub enum $call {
                $( $tool($tool), )*
            }

            impl $call {
                /// The names of this group's tools.
                pub const TOOLS: &[&str] = &[$( $tool::NAME, )*];
                /// True if these tools are offered only to operators that may talk.
                pub const FOR_OPERATORS: bool = tools!(@for_operators $($audience)?);

                /// Returns the tool's name.
                pub fn name(&self) -> &'static str {
                    match self {
                        $( $call::$tool(_) => $tool::NAME, )*
                    }
                }

                /// Returns the robots that the arguments name.
                pub fn robots(&self) -> Vec<&str> {
                    match self {
                        $( $call::$tool(args) => args.robots(), )*
                    }
                }

                /// Returns the number of requested control steps of 20 ms; 0 if the call is not a command.
                pub fn steps(&self) -> u32 {
                    match self {
                        $( $call::$tool(args) => args.steps(), )*
                    }
                }
            }

            tools!(@replies $whose $reply $call { $($tool)* });
        )*

        /// A call on an episode, parsed and checked as far as possible without a world. It serializes to its
        /// arguments.
        #[derive(Debug, Clone, PartialEq, Serialize)]
        #[serde(untagged)]
        pub enum ToolCall {
            $( $(#[$doc])* $group($call), )*
        }

        /// The reply to a [`ToolCall`].
        #[derive(Debug, Clone, PartialEq, Serialize)]
        #[serde(untagged)]
        #[allow(clippy::large_enum_variant, reason = "one reply at a time is on its way")]
        pub enum ToolReply {
            $( #[doc = concat!("To a [`", stringify!($call), "`].")] $group($reply), )*
        }

        $( $(
            impl From<$tool> for ToolCall {
                fn from(args: $tool) -> ToolCall {
                    ToolCall::$group($call::$tool(args))
                }
            }
        )* )*

        impl ToolCall {
            /// Returns a valid call of every tool.
            pub fn examples() -> Vec<ToolCall> {
                vec![$( $( $tool::example().into(), )* )*]
            }

            /// Parses the call of tool `name` with arguments `args`, without `episode_id`.
            pub fn parse(name: &str, args: Value) -> Result<ToolCall, SpecError> {
                match name {
                    $( $( $tool::NAME => parse_args::<$tool>(args).map(ToolCall::from), )* )*
                    _ => {
                        let groups = [$( ($call::FOR_OPERATORS, $call::TOOLS), )*];
                        let offered = groups.into_iter().filter(|(for_operators, _)| !for_operators);
                        let have = offered.flat_map(|(_, tools)| tools).copied().collect();
                        Err(SpecError::UnknownTool { name: name.into(), have })
                    }
                }
            }

            /// Returns the tool's name.
            pub fn name(&self) -> &'static str {
                match self {
                    $( ToolCall::$group(call) => call.name(), )*
                }
            }

            /// Returns the robots that the arguments name.
            pub fn robots(&self) -> Vec<&str> {
                match self {
                    $( ToolCall::$group(call) => call.robots(), )*
                }
            }

            /// Returns the number of requested control steps of 20 ms; 0 if the call is not a command.
            pub fn steps(&self) -> u32 {
                match self {
                    $( ToolCall::$group(call) => call.steps(), )*
                }
            }

            /// Checks a call that was built in Rust. [`ToolCall::parse`] has already checked calls from JSON.
            pub fn validate(&self) -> Result<(), SpecError> {
                let checked = match self {
                    $( $( ToolCall::$group($call::$tool(args)) => args.validate(), )* )*
                };
                checked.map_err(|reason| SpecError::Invalid { tool: self.name(), reason })
            }

            /// Parses the reply to this call, for clients written in Rust.
            pub fn parse_reply(&self, reply: Value) -> Result<ToolReply, serde_json::Error> {
                match self {
                    $( $(
                        ToolCall::$group($call::$tool(_)) => {
                            let reply: <$tool as Tool>::Reply = serde_json::from_value(reply)?;
                            Ok(ToolReply::$group(tools!(@reply $whose $reply $tool reply)))
                        }
                    )* )*
                }
            }
        }
    };

    (@replies each $reply:ident $call:ident { $($tool:ident)* }) => {
        #[doc = concat!("The reply to a [`", stringify!($call), "`].")]
        #[derive(Debug, Clone, PartialEq, Serialize)]
        #[serde(untagged)]
        #[allow(missing_docs, reason = "each variant is the reply to the tool of its name")]
        #[allow(clippy::large_enum_variant, reason = "one reply at a time is on its way")]
        pub enum $reply {
            $( $tool(<$tool as Tool>::Reply), )*
        }
    };
    (@replies all $reply:ident $call:ident { $($tool:ident)* }) => {};

    (@for_operators) => { false };
    (@for_operators operators) => { true };

    (@reply each $group_reply:ident $tool:ident $reply:ident) => { $group_reply::$tool($reply) };
    (@reply all $group_reply:ident $tool:ident $reply:ident) => { $reply };
}

tools! {
    without_episode {
        ListTasks,
        StartEpisode,
    }

    /// A question about the state of the world. It changes nothing and costs no steps.
    Look(LookCall) -> each LookReply {
        Observe,
        GetRobotState,
        QueryDepth,
        CheckReach,
    }

    /// A command to the robots. It advances physics by its steps.
    Act(ActCall) -> all CommandReply {
        MoveWrists,
        Walk,
        SendJointChunk,
        SendJointDrives,
        Wait,
    }

    /// Several commands in one call.
    Plan(PlanCall) -> all PlanReply {
        SendPlan,
        WalkTo,
    }

    /// A call about the episode as a whole, which is also answered after the episode's end.
    Manage(ManageCall) -> each ManageReply {
        GetStatus,
        Finish,
    }

    /// A message from one operator to the other operators.
    Talk(TalkCall) -> each TalkReply for operators {
        Say,
    }
}

#[cfg(test)]
mod tests;
