//! What a program reads on its standard input: the task and how to act, in words that a language model can be given as they are.

use tandem_tools_spec::{Brief, Driving, StartReply};

/// What it is called beside the episode.
pub const FILE: &str = "brief.txt";

/// The words for the episode `start`, on the server at `url`: for who directs all robots, or for who directs `robot` alone.
pub fn brief(start: &StartReply, url: &str, robot: Option<&str>, driving: &Driving) -> String {
    let StartReply { episode_id: id, briefing, .. } = start;
    let mut paragraphs = vec![whom(start, robot), format!("Task: {}", briefing.instruction)];
    let parts = briefing.instructions.iter().filter(|part| robot.is_none_or(|robot| part.robot == robot));
    paragraphs.extend(parts.map(|part| format!("Robot {}: {}", part.robot, part.instruction)));
    paragraphs.extend(robot.map(|_| partners(driving)));
    paragraphs.push(format!(
        "Tools: over MCP at {url}/mcp, each with the argument episode_id {id:?}; or by HTTP, POST {url}/v1/episodes/{id}/tools/NAME \
         with JSON. GET {url}/v1/episodes/{id}/tools describes each of them and the JSON that it takes. Every request has the header \
         Authorization: Bearer TOKEN, with the token in the environment's TANDEM_TOKEN."
    ));
    let budget = &briefing.status.budget;
    let clock = match budget.wall_clock_left_s {
        Some(left_s) => format!("{left_s:.0} seconds to think between calls"),
        None => "as much time to think as you like".into(),
    };
    paragraphs.push(format!(
        "Budget: {} control steps of 20 ms, at most {} in one command; {clock}. Call finish when the task is done, or cannot be done.",
        budget.steps_left, budget.steps_per_command
    ));
    let Brief { frames, partners, odometry, camera, hands, grasping } = &briefing.brief;
    paragraphs.extend([frames, partners, odometry, camera, hands].into_iter().chain(grasping).cloned());
    paragraphs.join("\n\n") + "\n"
}

/// Whom the reader directs.
fn whom(start: &StartReply, robot: Option<&str>) -> String {
    let StartReply { episode_id: id, briefing, .. } = start;
    let names = briefing.robots.iter().map(|robot| robot.robot.as_str());
    let (directed, others): (Vec<&str>, Vec<&str>) =
        names.partition(|name| robot.is_none_or(|robot| robot == *name));
    let whom = match robot {
        None => format!("humanoid robots {}", directed.join(", ")),
        Some(robot) => format!("humanoid robot {robot}"),
    };
    let others = match others.is_empty() {
        true => String::new(),
        false => {
            format!(" Others direct {}, one each; you see and command your own alone.", others.join(", "))
        }
    };
    format!(
        "You direct the {whom} in the episode {id:?} on a Tandem server. The episode has begun; you need no other.{others}"
    )
}

/// How those get on who direct a robot each.
fn partners(driving: &Driving) -> String {
    let talk = match driving.talk {
        Some(true) => " You may talk to the others with the tool say; what they say comes with your replies.",
        _ => "",
    };
    format!(
        "A command is executed when every robot has one, and the shortest ends them all; a robot whose director keeps silent for {} \
         seconds holds still meanwhile.{talk}",
        driving.patience_s()
    )
}
