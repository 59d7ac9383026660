//! People as a policy: they drive the robots of one episode after another in browsers, on a separate server.
//!
//! They mark every episode as good or bad, and bad ones are moved to a separate folder.

use std::{
    fs, io,
    net::{IpAddr, SocketAddr, UdpSocket},
    path::{Path, PathBuf},
    sync::Arc,
    thread,
    time::Duration,
};

use serde_json::json;
use tandem_episodes::{EpisodeSpec, RunFolder};
use tandem_evaluation::{
    policies::{EpisodeOutput, PlayError, PlayOutcome, Policy},
    results::PolicyCard,
};
use tandem_tools_spec::{Driving, Operators};

use super::{lost, own_result, remove_old_result};
use crate::{
    hosting::{CollectedEpisode, Collection, Guests, HostingError, Purpose},
    http::{Server, operator_link},
    settings::Settings,
    token::Token,
};

/// Interval between checks for the end of an episode.
const POLL_INTERVAL: Duration = Duration::from_millis(100);

/// Maximum time that the other robots wait for an absent person.
const PATIENCE_S: f64 = 600.0;

/// Marker file in the folder of an episode that everybody marked good, for `tandem export lerobot
/// --only-good`.
const GOOD_FILE: &str = "good";
/// File in the folder of a bad episode. It names the people who marked the episode as bad.
const BAD_FILE: &str = "bad";

/// People who drive the robots of a collection.
#[derive(Debug)]
pub struct People {
    server: Server,
    collection: Arc<Collection>,
    /// Episodes to play, by task and seed.
    planned: Vec<(String, u32)>,
    /// Folder of the episodes that were marked bad.
    aside: PathBuf,
    base_url: String,
    host_token: String,
}

impl People {
    /// Starts a server with an operator for each of `robots`, for the `planned` episodes. Episodes that are
    /// marked bad are moved to `aside`.
    pub fn start(
        settings: Settings,
        robots: &[&str],
        planned: Vec<(String, u32)>,
        aside: PathBuf,
    ) -> Result<People, PlayError> {
        let (token, host_token) = Token::random().map_err(HostingError::from)?;
        let collection = Collection::new(robots, planned.len()).map_err(HostingError::from)?;
        let collection = Arc::new(collection);
        let settings = Arc::new(Settings { token: Some(token), ..settings });
        let scheme = if settings.certificate.is_some() { "https" } else { "http" };
        let name = settings.allowed_hosts.first().cloned();
        let guests = Guests { purpose: Purpose::Collection(collection.clone()), ..Guests::default() };
        let server = Server::start_for(settings, guests);
        let server = server.map_err(|error| lost("no server", error))?;
        let base_url = base_url(scheme, server.address(), name.as_deref());
        Ok(People { server, collection, planned, aside, base_url, host_token })
    }

    /// Returns a link for each person, with the robot that the person drives.
    pub fn links(&self) -> Vec<(&str, String)> {
        let links = self.collection.operators();
        let link = |robot, token| operator_link(&self.base_url, Some(robot), token);
        links.map(|seat| (seat.robot.as_str(), link(&seat.robot, &seat.token))).collect()
    }

    /// Returns the link of a page with all links, for the user who runs the collection.
    pub fn overview_link(&self) -> String {
        operator_link(&self.base_url, None, &self.host_token)
    }

    /// Returns the link for watchers.
    pub fn watch_link(&self) -> &str {
        self.server.watch_link()
    }

    /// Announces the end of the collection, and returns after the pages have had time to fetch it.
    pub fn dismiss(self) {
        self.collection.end();
        thread::sleep(Duration::from_secs(3));
        self.server.stop();
    }

    /// Moves an episode that the people of the robots `by` marked bad, and returns the reason as an
    /// error.
    fn put_aside(&self, folder: &Path, by: &[&str]) -> Result<PlayError, PlayError> {
        let failed = |error| lost("an episode that was marked bad cannot be put aside", error);
        fs::create_dir_all(&self.aside).map_err(failed)?;
        let name = folder.file_name().unwrap_or_default().to_string_lossy();
        let mut names = (1..).map(|number| match number {
            1 => name.to_string(),
            number => format!("{name}-{number}"),
        });
        let free = names.find_map(|name| Some(self.aside.join(name)).filter(|path| !path.exists()));
        let place = free.ok_or_else(|| failed(io::ErrorKind::AlreadyExists.into()))?;
        fs::rename(folder, &place).map_err(failed)?;
        let said = format!("marked bad by {}", by.join(" and "));
        fs::write(place.join(BAD_FILE), format!("{said}\n")).map_err(failed)?;
        Ok(PlayError::NotReady(format!(
            "{said}, and put into {}; the same command asks for it again",
            place.display()
        )))
    }
}

impl Policy for People {
    fn card(&self) -> PolicyCard {
        let robots: Vec<&str> = self.collection.operators().map(|seat| seat.robot.as_str()).collect();
        PolicyCard { settings: Some(json!({ "robots": robots })), ..PolicyCard::from("people") }
    }

    fn play_episode(&self, spec: &EpisodeSpec, output: EpisodeOutput) -> Result<PlayOutcome, PlayError> {
        let folder = output.folder;
        // Files of an interrupted run do not belong to this episode.
        for file in [tandem_episodes::RESULT_FILE, GOOD_FILE] {
            remove_old_result(&folder.join(file))?;
        }
        let id = format!("{}-seed{}", spec.task.id, spec.seed);
        let driving =
            Driving { operators: Some(Operators::PerRobot), patience_s: Some(PATIENCE_S), talk: Some(true) };
        let files = RunFolder { pages: output.pages, ..RunFolder::from(folder) };
        let (episode, start) = self.server.host(&id, spec.clone(), &driving, files)?;
        if let Some(reason) = start.briefing.recording_failed {
            return Err(PlayError::Lost(reason));
        }
        let number = self.planned.iter().position(|(task, seed)| (task, *seed) == (&spec.task.id, spec.seed));
        self.collection.begin(CollectedEpisode {
            episode_id: id.clone(),
            task: spec.task.id.clone(),
            seed: spec.seed,
            number: number.map_or(0, |before| before + 1),
        });
        while !episode.ended() {
            thread::sleep(POLL_INTERVAL);
        }
        let thought = episode.thought();
        self.server.remove(&id)?;
        let result = own_result(&episode)?;
        match &*self.collection.wait_for_marks() {
            [] => {
                fs::write(folder.join(GOOD_FILE), "").map_err(|error| lost("no mark", error))?;
                Ok(PlayOutcome { result, thought, stopped: None })
            }
            bad => Err(self.put_aside(folder, bad)?),
        }
    }
}

/// Returns the URL of a server at `address`, with its configured name or with this machine's network address.
fn base_url(scheme: &str, address: SocketAddr, name: Option<&str>) -> String {
    let port = address.port();
    if let Some(name) = name {
        return format!("{scheme}://{name}:{port}");
    }
    let ip = match address.ip() {
        ip if ip.is_unspecified() => own_address().unwrap_or(ip),
        ip => ip,
    };
    format!("{scheme}://{}", SocketAddr::new(ip, port))
}

/// Returns the network address of this machine. Connecting a UDP socket chooses the address and sends
/// nothing.
fn own_address() -> Option<IpAddr> {
    let socket = UdpSocket::bind("0.0.0.0:0").ok()?;
    // This address is reserved for documentation.
    socket.connect("192.0.2.1:9").ok()?;
    socket.local_addr().ok().map(|address| address.ip())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn links_name_what_others_reach() {
        let check = |address: &str, name: Option<&str>, expected: &str| {
            let scheme = expected.split(':').next().unwrap();
            assert_eq!(base_url(scheme, address.parse().unwrap(), name), expected);
        };
        check("127.0.0.1:8700", None, "http://127.0.0.1:8700");
        check("10.0.0.5:1", None, "http://10.0.0.5:1");
        check("[::1]:8700", None, "http://[::1]:8700");
        check("0.0.0.0:8700", Some("lab.example"), "http://lab.example:8700");
        check("0.0.0.0:8700", Some("lab.example"), "https://lab.example:8700");
    }
}
