//! Policies at their servers, while they play one episode: look, ask, execute, until the episode is over.

use std::{
    panic::resume_unwind,
    thread::{self, ScopedJoinHandle},
    time::{Duration, Instant},
};

use tandem_episodes::players::{PlayerError, ThirdPersonEpisode};
use tandem_tools_spec::{JointChunk, SendJointChunk, StopReason, ToolReply};

use super::{
    answer, columns,
    error::RemoteError,
    link::{Link, Protocol},
    map::{Answer, PolicyMap},
    request::{Cast, request},
    sight::Sight,
};

/// How long the first answer may take: models are compiled then. No clock of an episode runs yet.
const FIRST_ANSWER: Duration = Duration::from_secs(600);

/// How soon to try again where nobody listens yet.
const AGAIN: Duration = Duration::from_millis(500);

/// Connected policies that have answered once.
pub struct Mind<'a> {
    asker: Asker<'a>,
    /// One for all robots, or one for each.
    links: Vec<Box<dyn Link>>,
    /// The most steps of one command.
    most_steps: usize,
}

impl<'a> Mind<'a> {
    /// Connects to the servers at `urls`, waiting for those that are not there yet, and tries each with black pictures and zeros.
    pub fn open(
        protocol: Protocol,
        urls: &[String],
        map: &'a PolicyMap,
        cast: Cast,
        most_steps: u32,
    ) -> Result<Mind<'a>, RemoteError> {
        let asker = Asker { map, cast };
        let deadline = Instant::now() + Duration::from_secs_f64(map.connect_s);
        let mut links = Vec::with_capacity(urls.len());
        for (url, robots) in urls.iter().zip(asker.askings()) {
            links.push(patiently(deadline, || {
                let mut link = protocol.open(url, asker.within())?;
                asker.probe(&mut *link, &robots)?;
                Ok(link)
            })?);
        }
        Ok(Mind { asker, links, most_steps: most_steps as usize })
    }

    /// Plays until the episode is over, or a policy fails.
    pub fn play(&mut self, episode: &mut dyn ThirdPersonEpisode) -> Result<(), PlayerError> {
        let mut held: Option<Vec<Vec<f64>>> = None;
        loop {
            let sight = Sight::take(episode, self.asker.map.shows_third_person())?;
            let held_rows = held.get_or_insert_with(|| held_rows(&sight));
            let chunks = self.decide(&sight, held_rows);
            let chunks = chunks.map_err(|error| PlayerError::GaveUp(error.to_string()))?;
            execute(episode, &chunks, self.most_steps)?;
        }
    }

    /// Asks for every robot: a shared policy once after the other, policies of their own at the same time.
    fn decide(&mut self, sight: &Sight, held_rows: &[Vec<f64>]) -> Result<Vec<JointChunk>, RemoteError> {
        let Mind { asker, links, .. } = self;
        let askings = asker.askings();
        let ask =
            |link: &mut dyn Link, robots: &[usize]| asker.ask(link, sight, robots, held_rows, asker.within());
        let answers: Result<Vec<Vec<JointChunk>>, RemoteError> = match &mut links[..] {
            [shared] => askings.iter().map(|robots| ask(&mut **shared, robots)).collect(),
            own => thread::scope(|scope| {
                let ask = &ask;
                let asking = own.iter_mut().zip(&askings);
                let asked: Vec<_> =
                    asking.map(|(link, robots)| scope.spawn(move || ask(&mut **link, robots))).collect();
                let answer =
                    |asked: ScopedJoinHandle<_>| asked.join().unwrap_or_else(|panic| resume_unwind(panic));
                asked.into_iter().map(answer).collect()
            }),
        };
        Ok(answers?.into_iter().flatten().collect())
    }
}

/// Asks as a map says.
struct Asker<'a> {
    map: &'a PolicyMap,
    cast: Cast,
}

impl Asker<'_> {
    /// How long an answer may take.
    fn within(&self) -> Duration {
        Duration::from_secs_f64(self.map.reply_s)
    }

    /// The robots of each request.
    fn askings(&self) -> Vec<Vec<usize>> {
        let robots = 0..self.cast.names.len();
        match self.map.answer {
            Answer::One => robots.map(|robot| vec![robot]).collect(),
            Answer::All => vec![robots.collect()],
        }
    }

    /// Whether a server answers what its map says.
    fn probe(&self, link: &mut dyn Link, robots: &[usize]) -> Result<(), RemoteError> {
        let sight = Sight::blank(self.cast.names.len());
        self.ask(link, &sight, robots, &held_rows(&sight), FIRST_ANSWER).map(drop)
    }

    fn ask(
        &self,
        link: &mut dyn Link,
        sight: &Sight,
        robots: &[usize],
        held_rows: &[Vec<f64>],
        within: Duration,
    ) -> Result<Vec<JointChunk>, RemoteError> {
        let robot = match (self.map.answer, robots) {
            (Answer::One, [robot]) => Some(*robot),
            _ => None,
        };
        let told = link.ask(&request(self.map, &self.cast, sight, robot), within)?;
        answer::chunks(self.map, &self.cast, &told, robots, held_rows)
    }
}

/// What keeps every robot as it is.
fn held_rows(sight: &Sight) -> Vec<Vec<f64>> {
    sight.robots.iter().map(|seen| columns::holding(&seen.felt_values)).collect()
}

/// Tries again until the deadline while nobody listens.
fn patiently<T>(
    deadline: Instant,
    mut attempt: impl FnMut() -> Result<T, RemoteError>,
) -> Result<T, RemoteError> {
    loop {
        match attempt() {
            Err(RemoteError::Unreachable { .. }) if Instant::now() + AGAIN < deadline => thread::sleep(AGAIN),
            outcome => return outcome,
        }
    }
}

/// Sends the rows of all robots, in as many commands as the protocol asks for; no more rows than every robot has.
fn execute(
    episode: &mut dyn ThirdPersonEpisode,
    chunks: &[JointChunk],
    most_steps: usize,
) -> Result<(), PlayerError> {
    let rows = chunks.iter().map(|chunk| chunk.rows.len()).min().unwrap_or_default();
    for from in (0..rows).step_by(most_steps.max(1)) {
        let to = rows.min(from + most_steps);
        let part = |chunk: &JointChunk| JointChunk {
            robot: chunk.robot.clone(),
            rows: chunk.rows[from..to].to_vec(),
        };
        let command = SendJointChunk { robots: chunks.iter().map(part).collect() };
        if let ToolReply::Act(reply) = episode.call(command.into())?
            && reply.stop_reason != StopReason::StepsDone
        {
            return Err(PlayerError::EpisodeOver);
        }
    }
    Ok(())
}
