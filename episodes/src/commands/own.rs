//! What an operator of one robot may call: to look through that robot and to command it, and nothing of its partners'.

use tandem_tools_spec::{ActCall, LookCall, Observe, ToolCall};

use crate::EpisodeError;

/// The call as the operator of `robot` may make it: where it names no robot, it is about the operator's own.
pub fn own(call: ToolCall, robot: &str) -> Result<ToolCall, EpisodeError> {
    if let ToolCall::Look(LookCall::Observe(Observe { robots: None, short })) = call {
        return Ok(Observe { robots: Some(vec![robot.into()]), short }.into());
    }
    match named(&call).into_iter().find(|name| *name != robot) {
        Some(name) => Err(EpisodeError::ForeignRobot { name: name.into(), own: robot.into() }),
        None => Ok(call),
    }
}

/// The robots that a call names.
fn named(call: &ToolCall) -> Vec<&str> {
    match call {
        ToolCall::Look(LookCall::Observe(args)) => args.robots.iter().flatten().map(String::as_str).collect(),
        ToolCall::Look(LookCall::GetRobotState(args)) => vec![&args.robot],
        ToolCall::Look(LookCall::QueryDepth(args)) => vec![&args.robot],
        ToolCall::Look(LookCall::CheckReach(args)) => vec![&args.robot],
        ToolCall::Act(ActCall::MoveWrists(args)) => {
            args.robots.iter().map(|entry| entry.robot.as_str()).collect()
        }
        ToolCall::Act(ActCall::Walk(args)) => args.robots.iter().map(|entry| entry.robot.as_str()).collect(),
        ToolCall::Act(ActCall::SendJointChunk(args)) => {
            args.robots.iter().map(|chunk| chunk.robot.as_str()).collect()
        }
        ToolCall::Act(ActCall::Wait(_)) | ToolCall::Manage(_) => Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    use tandem_tools_spec::{GetStatus, Wait};

    use super::*;

    /// Every example of the contract that names a robot names A.
    #[test]
    fn operators_call_for_their_own_robots() {
        for call in ToolCall::examples() {
            assert_eq!(own(call.clone(), "A").unwrap(), call);
            let foreign = own(call.clone(), "B");
            match named(&call).is_empty() {
                true => assert_eq!(foreign.unwrap(), call),
                false => {
                    let text = foreign.unwrap_err().to_string();
                    assert!(text.contains("\"A\"") && text.contains("yours is \"B\""), "{text}");
                }
            }
        }
        assert!(named(&Wait { steps: 1 }.into()).is_empty() && named(&GetStatus {}.into()).is_empty());
        let all = own(Observe { robots: None, short: None }.into(), "B").unwrap();
        assert_eq!(all, Observe { robots: Some(vec!["B".into()]), short: None }.into());
    }
}
