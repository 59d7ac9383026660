//! The socket for teleoperation: the page sends setpoints for its robot, and receives every control step.

use std::{io, sync::Arc, time::Duration};

use axum::{
    Extension,
    extract::{Request, State},
    http::{HeaderMap, HeaderValue, StatusCode, header},
    response::{IntoResponse, Response},
};
use serde::Deserialize;
use serde_json::{Map, Value, json};
use tandem_episodes::live::{LiveEvent, LiveScene, LiveStep};
use tandem_tools_spec::{Disclosure, JointChunk, JointDrives, LookReply, ToolReply};
use tokio::{
    sync::{
        broadcast::error::{RecvError, TryRecvError},
        mpsc,
    },
    time::{MissedTickBehavior, interval},
};

use super::socket::{PageReader, PageSender, PageSocket, upgrade};
use crate::{
    hosting::{Answer, Caller, Driver, DriverRequest, HostingError, LiveWatch, Setpoint},
    http::{app::AppState, problem::ApiError},
};

/// Path of the socket.
pub const DRIVE: &str = "/operate/drive";

/// Path that sets the cookie for the socket.
pub const ENTER: &str = "/operate/enter";

/// Prefix of the names of cookies with operators' tokens; the robot's name follows.
const COOKIE: &str = "tandem_operator_";

/// Interval between updates of the list of robots for which the page's robot waits.
const STATUS_INTERVAL: Duration = Duration::from_millis(250);

/// Number of answers for the page's own robot per full report, which gives five reports a second.
const ANSWERS_PER_REPORT: usize = 10;

/// Robots that a request for the socket may drive. The token of each robot's operator is in a cookie.
#[derive(Debug, Clone)]
pub struct DrivenRobots(pub Vec<String>);

/// A message of a page, with exactly one of three kinds of setpoint.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Word {
    /// An entry of `move_wrists`, without the robot's name.
    #[serde(rename = "move")]
    wrist_move: Option<Map<String, Value>>,
    /// A row of `send_joint_chunk`.
    row: Option<Vec<f64>>,
    /// A row of `send_joint_drives`.
    #[serde(rename = "drives")]
    drive_row: Option<Vec<f64>>,
    /// True to receive the robot's state after each of its commands.
    #[serde(default)]
    states: bool,
    /// True while simulated time may advance.
    go: bool,
    /// Number of control steps to advance, for single stepping.
    #[serde(default)]
    steps: u32,
}

/// Token that a request sends to be set as a cookie. The gate removes the token from all other requests.
#[derive(Clone)]
pub struct GivenToken(pub String);

/// Sets the cookie that opens the socket for an operator, because browsers cannot send other headers with
/// a socket request.
///
/// Scripts cannot read the cookie, and pages of other sites cannot make the browser send it.
pub async fn enter(
    State(app): State<AppState>,
    Extension(caller): Extension<Caller>,
    Extension(GivenToken(token)): Extension<GivenToken>,
) -> Result<Response, ApiError> {
    let robot = caller.robot().ok_or(HostingError::NeedsOperator)?;
    let secure = if app.settings.certificate.is_some() { "; Secure" } else { "" };
    let cookie = format!("{COOKIE}{robot}={token}; Path={DRIVE}; HttpOnly; SameSite=Strict{secure}");
    let cookie: HeaderValue = cookie.parse().map_err(|_| ApiError::NoToken)?;
    Ok((StatusCode::NO_CONTENT, [(header::SET_COOKIE, cookie)]).into_response())
}

/// Returns the caller of a request for the socket, and all robots that it may drive.
///
/// These are the operators of `robots=A,C` in the query whose tokens are in the cookies. They must belong
/// to one episode.
pub async fn drivers(app: &AppState, query: &str, headers: &HeaderMap) -> Option<(Caller, DrivenRobots)> {
    let wanted = query.strip_prefix("robots=")?;
    let lines = headers.get_all(header::COOKIE).into_iter().filter_map(|line| line.to_str().ok());
    let cookies: Vec<(&str, &str)> =
        lines.flat_map(|line| line.split(';')).filter_map(|pair| pair.trim().split_once('=')).collect();
    let mut callers = Vec::new();
    for robot in wanted.split(',') {
        callers.push(driver_of(app, robot, &cookies).await?);
    }
    let first = callers.first()?.clone();
    let same = |caller: &Caller| match (caller, &first) {
        (Caller::Operator { episode, .. }, Caller::Operator { episode: other, .. }) => episode == other,
        _ => false,
    };
    callers
        .iter()
        .all(same)
        .then(|| (first.clone(), DrivenRobots(wanted.split(',').map(str::to_owned).collect())))
}

/// Returns the operator of `robot` that owns the token in its cookie. Browsers send one cookie per robot; a
/// second cookie is ignored.
async fn driver_of(app: &AppState, robot: &str, cookies: &[(&str, &str)]) -> Option<Caller> {
    let (_, token) = cookies.iter().find(|(name, _)| name.strip_prefix(COOKIE) == Some(robot))?;
    app.table.operator_anywhere(token).await.filter(|caller| caller.robot() == Some(robot))
}

/// Serves the socket.
pub async fn drive(
    State(app): State<AppState>,
    Extension(caller): Extension<Caller>,
    robots: Option<Extension<DrivenRobots>>,
    request: Request,
) -> Result<Response, ApiError> {
    let Extension(DrivenRobots(robots)) = robots.ok_or(HostingError::NeedsOperator)?;
    let operator = app.table.own_robot(&caller).await?;
    let robot = operator.robot().to_owned();
    let (watch, every_step) = operator.episode.watch_driving(&robot).await?;
    let (driver, answers) = Driver::take(&operator, &robots)?;
    app.textures.add(watch.view.scene.textures());
    let disclosure = app.settings.disclosure;
    upgrade(request, move |PageSocket { mut sender, mut reader }| async move {
        let _every_step = every_step;
        let driver = Arc::new(driver);
        let page = DriversPage { robot, disclosure, driver: driver.clone() };
        tokio::select! {
            told = page.tell(&mut sender, watch, answers) => {
                told?;
                sender.close().await
            }
            heard = hear(&mut reader, &page.robot, &driver) => heard,
        }
    })
}

/// Handles the messages of a page until it disconnects. An unreadable message ends the connection.
async fn hear(reader: &mut PageReader, robot: &str, driver: &Driver) -> io::Result<()> {
    while let Some(text) = reader.text().await? {
        let Word { wrist_move, row, drive_row, states, go, steps } = serde_json::from_str(&text)?;
        let setpoint = setpoint(robot, wrist_move, row, drive_row)?;
        driver.say(&DriverRequest { setpoint, tells_state: states, go, steps });
    }
    Ok(())
}

/// Reads the setpoint of a message for the robot called `robot`.
///
/// # Errors
///
/// Fails if there is no setpoint or more than one, or if the tool of its kind does not accept it.
fn setpoint(
    robot: &str,
    wrist_move: Option<Map<String, Value>>,
    row: Option<Vec<f64>>,
    drive_row: Option<Vec<f64>>,
) -> io::Result<Setpoint> {
    let setpoint = match (wrist_move, row, drive_row) {
        (Some(mut entry), None, None) => {
            entry.insert("robot".into(), robot.into());
            Setpoint::Wrists(serde_json::from_value(Value::Object(entry))?)
        }
        (None, Some(row), None) => Setpoint::Joints(JointChunk { robot: robot.into(), rows: vec![row] }),
        (None, None, Some(row)) => Setpoint::Drives(JointDrives { robot: robot.into(), rows: vec![row] }),
        _ => return Err(io::Error::other("a message has one of move, row and drives")),
    };
    match setpoint.clone().call().validate() {
        Ok(()) => Ok(setpoint),
        Err(error) => Err(io::Error::other(error)),
    }
}

/// Sending side of the connection to a page that drives.
struct DriversPage {
    robot: String,
    disclosure: Disclosure,
    driver: Arc<Driver>,
}

impl DriversPage {
    /// Sends the scene and then all events, until the episode ends or another page takes over.
    async fn tell(
        &self,
        sender: &mut PageSender,
        watch: LiveWatch,
        mut answers: mpsc::Receiver<Result<Answer, HostingError>>,
    ) -> io::Result<()> {
        let LiveWatch { view, mut events } = watch;
        let scene = view.scene;
        let more = json!({ "robot": self.robot, "frames": 1 });
        sender.bytes(scene.message(more, &view.now.frame(&scene))).await?;
        let mut statuses = interval(STATUS_INTERVAL);
        statuses.set_missed_tick_behavior(MissedTickBehavior::Skip);
        let (mut waited_for, mut own_answers) = (Vec::new(), OwnAnswers::default());
        loop {
            tokio::select! {
                event = events.recv() => match event {
                    Ok(LiveEvent::Step(step)) => self.newest(sender, &scene, step, &mut events).await?,
                    Ok(event) => self.event(sender, &scene, event).await?,
                    Err(RecvError::Lagged(_)) => {}
                    Err(RecvError::Closed) => return Ok(()),
                },
                answer = answers.recv() => match answer {
                    Some(answer) => self.answer(sender, answer, &mut own_answers).await?,
                    // Another page drives.
                    None => return sender.text(json!({ "kind": "replaced" }).to_string()).await,
                },
                _ = statuses.tick() => {
                    let waits_for = self.driver.waits_for();
                    if waits_for != waited_for {
                        sender.text(json!({ "kind": "waits", "for": waits_for }).to_string()).await?;
                        waited_for = waits_for;
                    }
                }
            }
        }
    }

    /// Sends the newest of the pending steps and all other events, so that a slow page skips steps.
    async fn newest(
        &self,
        sender: &mut PageSender,
        scene: &LiveScene,
        mut step: Arc<LiveStep>,
        events: &mut tokio::sync::broadcast::Receiver<LiveEvent>,
    ) -> io::Result<()> {
        let mut others = Vec::new();
        loop {
            match events.try_recv() {
                Ok(LiveEvent::Step(newer)) => step = newer,
                Ok(other) => others.push(other),
                Err(TryRecvError::Lagged(_)) => {}
                // The loop in `tell` notices a closed channel.
                Err(TryRecvError::Empty | TryRecvError::Closed) => break,
            }
        }
        sender.bytes(step.frame(scene).to_vec()).await?;
        for other in others {
            self.event(sender, scene, other).await?;
        }
        Ok(())
    }

    async fn event(&self, sender: &mut PageSender, scene: &LiveScene, event: LiveEvent) -> io::Result<()> {
        match event {
            LiveEvent::Step(step) => sender.bytes(step.frame(scene).to_vec()).await,
            LiveEvent::Ended(result) => {
                let result = (*result).clone().disclosed(self.disclosure);
                sender.text(json!({ "kind": "ended", "result": result }).to_string()).await
            }
            // The page gets the outcome of its own commands in the answers.
            LiveEvent::Entry(_) | LiveEvent::Phase(_) | LiveEvent::NextPhase(_) => Ok(()),
        }
    }

    /// Sends the answer to a command. The full report is sent at intervals, and whenever a partner speaks
    /// or is away.
    async fn answer(
        &self,
        sender: &mut PageSender,
        answer: Result<Answer, HostingError>,
        own_answers: &mut OwnAnswers,
    ) -> io::Result<()> {
        let text = match answer {
            Ok(Answer { reply: ToolReply::Look(LookReply::GetRobotState(state)), .. }) => {
                json!({ "kind": "state", "state": state })
            }
            Ok(answer) => {
                let own = matches!(&answer.reply, ToolReply::Act(reply) if reply.robots.iter().any(|report| report.robot == self.robot));
                if !own_answers.is_reported(own) && answer.heard.is_empty() {
                    return Ok(());
                }
                json!({ "kind": "report", "report": answer })
            }
            Err(refused) => json!({ "kind": "refused", "detail": ApiError::from(refused).body().detail }),
        };
        sender.text(text.to_string()).await
    }
}

/// Number of answers for the page's own robot. Answers for the other robots it drives are not counted.
#[derive(Debug, Default)]
struct OwnAnswers(usize);

impl OwnAnswers {
    /// Returns true if the page gets the full report with the next answer.
    fn is_reported(&mut self, own: bool) -> bool {
        self.0 += usize::from(own);
        own && self.0 % ANSWERS_PER_REPORT == 1
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_page_is_told_of_its_own_robot_in_whatever_order_answers_come() {
        for order in [[true, false], [false, true]] {
            let mut answers = OwnAnswers::default();
            let reported = order
                .into_iter()
                .cycle()
                .take(6 * ANSWERS_PER_REPORT)
                .filter(|own| answers.is_reported(*own));
            assert_eq!(reported.collect::<Vec<bool>>(), [true; 3], "{order:?}");
        }
    }
}
