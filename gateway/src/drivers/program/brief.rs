//! What a program reads on its standard input: the task and how to act, in words that a language model can be given as they are.

use tandem_tools_spec::{Brief, StartReply};

/// What it is called beside the episode.
pub const FILE: &str = "brief.txt";

/// The words for the episode `start`, on the server at `url`.
pub fn brief(start: &StartReply, url: &str) -> String {
    let StartReply { episode_id: id, briefing } = start;
    let names: Vec<&str> = briefing.robots.iter().map(|robot| robot.robot.as_str()).collect();
    let mut paragraphs = vec![
        format!(
            "You direct the humanoid robots {} in the episode {id:?} on a Tandem server. The episode has begun; you need no other.",
            names.join(", ")
        ),
        format!("Task: {}", briefing.instruction),
    ];
    let parts = briefing.instructions.iter();
    paragraphs.extend(parts.map(|part| format!("Robot {}: {}", part.robot, part.instruction)));
    paragraphs.push(format!(
        "Tools: over MCP at {url}/mcp, each with the argument episode_id {id:?}; or by HTTP, POST {url}/v1/episodes/{id}/tools/NAME \
         with JSON. GET {url}/v1/episodes/{id}/tools describes each of them and the JSON that it takes."
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
