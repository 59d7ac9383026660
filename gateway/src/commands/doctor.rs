//! `tandem doctor`: what works on this machine, and what to do about what does not.

use std::{
    fs,
    net::TcpListener,
    path::Path,
    process::ExitCode,
    thread::available_parallelism,
    time::{Duration, Instant, SystemTime, UNIX_EPOCH},
};

use tandem_episodes::{EpisodeSpec, RendererKind, Session, create_private_folder, tasks};
use tandem_tools_spec::{Observe, Protocol, ToolCall, Wait};

use super::CommandResult;
use crate::{
    settings::{Layer, Settings},
    token::Token,
};

/// How many control steps the check of physics simulates.
const TRIED_STEPS: u32 = 25;
/// Below this factor, a call that simulates takes longer than the motion of its robots.
const MIN_REALTIME_FACTOR: f64 = 1.0;
/// A clock that is set right shows no earlier time than 2026, when this program was written.
const PROGRAM_DATE: Duration = Duration::from_secs(1_767_225_600);
/// The coarsest tick of a clock that can time calls.
const COARSEST_TICK: Duration = Duration::from_millis(1);
/// With fewer cores, episodes wait for each other.
const MIN_CORES: usize = 2;

/// Say what works on this machine: pictures, physics, the port, the folder of recordings, clocks and cores.
#[derive(Debug, clap::Args)]
pub struct DoctorArgs {
    /// The settings of the server that is to run here.
    #[command(flatten)]
    flags: Layer,
}

/// The result of a check: a line for people, or what is wrong and what to do.
type Finding = Result<String, String>;

/// Prints a line for each check. The program fails if anything does not work.
pub fn run(args: DoctorArgs) -> CommandResult {
    let renderer = args.flags.renderer.unwrap_or_default();
    let settings = Settings::resolve(Layer { token: Token::from_environment()?, ..args.flags }, None)?;
    let findings = [
        ("renderer", renderer.describe().map_err(|error| error.to_string())),
        ("physics", physics(renderer)),
        ("port", port(&settings)),
        ("runs", runs(&settings.runs)),
        ("clock", clock()),
        ("cores", cores()),
    ];
    for (what, finding) in &findings {
        let (word, text) = match finding {
            Ok(text) => ("ok", text),
            Err(text) => ("WRONG", text),
        };
        println!("{what:10}{word:7}{text}");
    }
    let sound = findings.iter().all(|(_, finding)| finding.is_ok());
    Ok(if sound { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

/// Plays half a second of the first task, and draws what both robots see.
fn physics(renderer: RendererKind) -> Finding {
    let play = || {
        let spec = EpisodeSpec { renderer, ..EpisodeSpec::new(&tasks::ALL[0], 0, Protocol::Benchmark) };
        let mut session = Session::start(&spec, None)?;
        session.call(Wait { steps: TRIED_STEPS }.into())?;
        let simulated_s = session.present().time_s;
        let began = Instant::now();
        session.call(ToolCall::from(Observe { robots: None, short: None }))?;
        Ok((simulated_s / session.physics().as_secs_f64(), began.elapsed()))
    };
    let (factor, look) =
        play().map_err(|error: tandem_episodes::EpisodeError| format!("{error}; please report it"))?;
    let text = format!("{factor:.0} times real time, {} ms for a look of two robots", look.as_millis());
    if factor < MIN_REALTIME_FACTOR {
        return Err(format!("{text}; build with --release, and run fewer episodes at once"));
    }
    Ok(text)
}

fn port(settings: &Settings) -> Finding {
    match TcpListener::bind(settings.listen) {
        Ok(_) => Ok(format!("{} is free", settings.listen)),
        Err(error) => {
            Err(format!("{}: {error}; stop what listens there, or give another --listen", settings.listen))
        }
    }
}

fn runs(folder: &Path) -> Finding {
    let shown = folder.display();
    let there = folder.exists();
    let probe = folder.join(format!(".doctor-{}", std::process::id()));
    let tried = create_private_folder(folder).and_then(|()| fs::write(&probe, "probe"));
    let cleared = fs::remove_file(&probe);
    if !there {
        // A folder that this check has made is removed again, unless somebody has put something in.
        let _ = fs::remove_dir(folder);
    }
    match tried.and(cleared) {
        Ok(()) => Ok(format!("{shown} can be written")),
        Err(error) => Err(format!("{shown}: {error}; make it writable, or give another --runs")),
    }
}

fn clock() -> Finding {
    let began = Instant::now();
    let mut tick = Duration::ZERO;
    while tick.is_zero() {
        tick = began.elapsed();
    }
    if tick > COARSEST_TICK {
        return Err(format!("ticks every {tick:?}, too coarse to time calls; run on another machine"));
    }
    match SystemTime::now().duration_since(UNIX_EPOCH) {
        Ok(now) if now >= PROGRAM_DATE => Ok(format!("ticks within {tick:?}, and its date can be")),
        _ => Err("shows a time before 2026, and recordings name theirs; set the date".into()),
    }
}

fn cores() -> Finding {
    match available_parallelism() {
        Ok(cores) if cores.get() < MIN_CORES => Err(format!(
            "{cores}; give at least {MIN_CORES}, or run one episode at a time with --max-episodes 1"
        )),
        Ok(cores) => Ok(format!("{cores}, as many episodes run at full speed")),
        Err(error) => Err(format!("not known: {error}; the program runs, as fast as it can")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_port_that_is_taken_and_a_folder_that_cannot_be_written_say_what_to_do() {
        let taken = TcpListener::bind("127.0.0.1:0").unwrap();
        let flags = Layer { listen: Some(taken.local_addr().unwrap()), ..Layer::default() };
        let settings = Settings::resolve(flags, None).unwrap();
        assert!(port(&settings).unwrap_err().contains("give another --listen"));
        drop(taken);
        assert!(port(&settings).is_ok());

        let place = tempfile::tempdir().unwrap();
        let file = place.path().join("file");
        fs::write(&file, "no folder").unwrap();
        assert!(runs(&file.join("runs")).unwrap_err().contains("give another --runs"));
        assert_eq!(fs::read_to_string(&file).unwrap(), "no folder");
    }

    #[test]
    fn looking_leaves_nothing_behind() {
        let place = tempfile::tempdir().unwrap();
        let (new, kept) = (place.path().join("new"), place.path().join("kept"));
        fs::create_dir(&kept).unwrap();
        assert!(runs(&new).is_ok() && runs(&kept).is_ok());
        assert!(!new.exists() && kept.exists());
        assert_eq!(fs::read_dir(&kept).unwrap().count(), 0);
    }
}
