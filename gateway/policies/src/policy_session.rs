//! A policy session: connections to the servers of one policy for one episode. The session observes, requests
//! actions and executes them until the episode is over.

use std::{
    panic::resume_unwind,
    thread::{self, ScopedJoinHandle},
    time::{Duration, Instant},
};

use tandem_episodes::players::{LocalEpisode, PlayerError};

use crate::{
    action::{Executor, RobotRows, chunks, executed_rows},
    client::{PolicyAddress, PolicyClient, PolicyProtocol},
    error::RemoteError,
    kept_client::KeptClient,
    map::{AnswerScope, PolicyMap},
    request::{ObservationHistory, PolicyObservation, TaskInstructions, request},
};

/// Time limit for the first answer, during which models are compiled. The episode's clock is not running yet.
const FIRST_ANSWER: Duration = Duration::from_secs(600);

/// Interval between attempts to connect to a server that is not listening yet.
const RETRY_INTERVAL: Duration = Duration::from_millis(500);

/// Connected servers of a policy. Each of them has answered once.
pub struct PolicySession<'a> {
    plan: QueryPlan<'a>,
    /// One client for all robots, or one for each robot.
    clients: Vec<KeptClient>,
    /// Maximum number of control steps per command.
    most_steps: usize,
}

impl<'a> PolicySession<'a> {
    /// Connects to the servers at `addresses` in parallel, and waits for servers that are not available yet.
    /// Probes each server with black images and zeros.
    ///
    /// # Errors
    ///
    /// Returns the errors of all servers that fail.
    pub fn open(
        protocol: PolicyProtocol,
        addresses: &[PolicyAddress],
        map: &'a PolicyMap,
        instructions: TaskInstructions,
        most_steps: u32,
    ) -> Result<PolicySession<'a>, Vec<RemoteError>> {
        let plan = QueryPlan { map, instructions };
        let deadline = Instant::now() + Duration::from_secs_f64(map.connect_s);
        let connect = |address: &PolicyAddress, robots: &[usize]| {
            let client = retry_until(deadline, |left| {
                let mut client = protocol.open(address, &plan.instructions.task, left, plan.within())?;
                plan.probe(&mut *client, robots)?;
                client.begin_trial(plan.within())?;
                Ok(client)
            });
            client.map(KeptClient::new)
        };
        let opened: Vec<Result<KeptClient, RemoteError>> = thread::scope(|scope| {
            let connect = &connect;
            let connecting = addresses.iter().zip(plan.queries());
            let connecting: Vec<_> =
                connecting.map(|(address, robots)| scope.spawn(move || connect(address, &robots))).collect();
            connecting.into_iter().map(joined).collect()
        });
        let (mut clients, mut failures) = (Vec::with_capacity(addresses.len()), Vec::new());
        for client in opened {
            match client {
                Ok(client) => clients.push(client),
                Err(failure) => failures.push(failure),
            }
        }
        match failures.is_empty() {
            true => Ok(PolicySession { plan, clients, most_steps: most_steps as usize }),
            false => Err(failures),
        }
    }

    /// Plays the episode with this number until it is over or a policy fails.
    pub fn play(&mut self, episode: &mut dyn LocalEpisode, number: u32) -> Result<(), PlayerError> {
        self.act(episode, number).map_err(|error| match error {
            // An answer that cannot be executed is also a failure of the server.
            PlayerError::Call { .. } => PlayerError::Failed(error.to_string()),
            error => error,
        })
    }

    fn act(&mut self, episode: &mut dyn LocalEpisode, number: u32) -> Result<(), PlayerError> {
        let mut history = ObservationHistory::begin(self.plan.map, episode, number)?;
        let held_rows = history.present().held_rows();
        let mut executor = Executor::new(self.plan.map, self.most_steps, history.present());
        let mut executed = 0;
        loop {
            executor.sense(history.present());
            let chunks = self.decide(&history.shown(), &held_rows);
            let chunks = chunks.map_err(|error| PlayerError::Failed(error.to_string()))?;
            let (begin, end) = (executed, executed + executed_rows(&chunks));
            for look_at in history.looks_between(begin, end) {
                executor.execute(episode, &chunks, executed - begin..look_at - begin)?;
                history.look(episode, look_at)?;
                executed = look_at;
            }
            executor.execute(episode, &chunks, executed - begin..end - begin)?;
            history.look(episode, end)?;
            executed = end;
        }
    }

    /// Requests the actions of all robots: sequentially from a shared server, in parallel from separate
    /// servers.
    fn decide(
        &mut self,
        shown: &[&PolicyObservation],
        held_rows: &[Vec<f64>],
    ) -> Result<Vec<RobotRows>, RemoteError> {
        let PolicySession { plan, clients, .. } = self;
        let queries = plan.queries();
        let ask = |client: &KeptClient, robots: &[usize]| {
            client.with(|client| plan.ask(client, shown, robots, held_rows, plan.within()))
        };
        let answers: Result<Vec<Vec<RobotRows>>, RemoteError> = match &clients[..] {
            [shared] => queries.iter().map(|robots| ask(shared, robots)).collect(),
            own => thread::scope(|scope| {
                let ask = &ask;
                let asked: Vec<_> = own
                    .iter()
                    .zip(&queries)
                    .map(|(client, robots)| scope.spawn(move || ask(client, robots)))
                    .collect();
                asked.into_iter().map(joined).collect()
            }),
        };
        Ok(answers?.into_iter().flatten().collect())
    }
}

/// Returns the result of a thread. If the thread has panicked, resumes its panic.
fn joined<T>(thread: ScopedJoinHandle<T>) -> T {
    thread.join().unwrap_or_else(|panic| resume_unwind(panic))
}

/// Requests of the map and the robots that each request is for.
struct QueryPlan<'a> {
    map: &'a PolicyMap,
    instructions: TaskInstructions,
}

impl QueryPlan<'_> {
    /// Returns the time limit for an answer.
    fn within(&self) -> Duration {
        Duration::from_secs_f64(self.map.reply_s)
    }

    /// Returns the robot indices of each request.
    fn queries(&self) -> Vec<Vec<usize>> {
        self.map.queries(self.instructions.robots.len())
    }

    /// Checks that a server's answer fits the map.
    fn probe(&self, client: &mut dyn PolicyClient, robots: &[usize]) -> Result<(), RemoteError> {
        let observation = PolicyObservation::blank(self.instructions.robots.len());
        let shown = vec![&observation; self.map.history.map_or(1, |history| history.length)];
        self.ask(client, &shown, robots, &observation.held_rows(), FIRST_ANSWER).map(drop)
    }

    fn ask(
        &self,
        client: &mut dyn PolicyClient,
        shown: &[&PolicyObservation],
        robots: &[usize],
        held_rows: &[Vec<f64>],
        within: Duration,
    ) -> Result<Vec<RobotRows>, RemoteError> {
        let robot = match (self.map.answer, robots) {
            (AnswerScope::One, [robot]) => Some(*robot),
            _ => None,
        };
        let reply = client.ask(&request(self.map, &self.instructions, shown, robot), within)?;
        let Some(present) = shown.last() else { return Ok(Vec::new()) };
        chunks(self.map, &self.instructions, &reply, robots, held_rows, present)
    }
}

/// Retries while no server listens, until the deadline. Each attempt gets the remaining time.
fn retry_until<T>(
    deadline: Instant,
    mut attempt: impl FnMut(Duration) -> Result<T, RemoteError>,
) -> Result<T, RemoteError> {
    loop {
        let left = deadline.saturating_duration_since(Instant::now());
        match attempt(left.max(RETRY_INTERVAL)) {
            Err(RemoteError::Unreachable { .. }) if Instant::now() + RETRY_INTERVAL < deadline => {
                thread::sleep(RETRY_INTERVAL)
            }
            outcome => return outcome,
        }
    }
}
