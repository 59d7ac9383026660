//! Checks of the machine's other software and settings: ffmpeg, Python, a GPU, proxies, free disk space and
//! the date.

use std::{
    path::Path,
    process::Command,
    time::{Duration, SystemTime, UNIX_EPOCH},
};

use tandem_episodes::RendererKind;

use super::{Finding, Findings};
use crate::{drivers::interpreter, settings::Layer};

/// Extras of the wheel that users most often lack, with the modules that each installs.
pub(super) const EXTRAS: [(&str, &[&str]); 4] = [
    ("agents", &["anthropic", "openai"]),
    ("gym", &["gymnasium"]),
    ("lerobot", &["av", "gymnasium", "pyarrow"]),
    ("baselines", &["av", "pyarrow", "torch"]),
];

/// Python script that takes modules as arguments. It prints Python's version and the modules that are
/// installed.
const LOOK: &str = "import importlib.util, platform, sys
found = [name for name in sys.argv[1:] if importlib.util.find_spec(name)]
if 'tandem' in found: import tandem
print(platform.python_version(), *found)";

/// Free space below which a night of episodes may fill the disk.
pub(super) const MIN_FREE_BYTES: u64 = 5_000_000_000;
/// Lower limit for a correct clock: the beginning of 2026, when this program was written.
pub(super) const PROGRAM_DATE: Duration = Duration::from_secs(1_767_225_600);
/// Tolerated difference between the clocks of the build machine and this machine.
const MAX_DRIFT: Duration = Duration::from_secs(86_400);

/// Names by which clients on this machine reach a server on it.
const LOOPBACK: [&str; 2] = ["127.0.0.1", "localhost"];
/// Variables that make clients use a proxy. Many programs also read them in lower case.
const PROXIES: [&str; 3] = ["HTTP_PROXY", "HTTPS_PROXY", "ALL_PROXY"];

/// Checks the environment of the program. Episodes need none of it, except for a correct date and free space.
pub fn check(layer: &Layer) -> Findings {
    vec![
        (RendererKind::Gpu.name(), gpu(layer.renderer())),
        ("ffmpeg", ffmpeg("ffmpeg")),
        ("python", python(&interpreter())),
        ("proxy", proxy(|name| std::env::var(name).ok())),
        ("disk", disk(free_bytes(&layer.runs_folder()))),
        ("date", date(SystemTime::now(), built())),
    ]
}

/// Reports the renderer of `--renderer gpu`, unless the server uses it and it is therefore already reported.
fn gpu(chosen: RendererKind) -> Finding {
    let embedded = RendererKind::Cpu.describe().unwrap_or_default();
    match RendererKind::Gpu.describe() {
        _ if chosen == RendererKind::Gpu => Finding::Works("see renderer".into()),
        Ok(text) if text.starts_with(&embedded) => Finding::Note(format!(
            "with --renderer gpu {text}; install the GPU's Vulkan driver (`vulkaninfo --summary` lists those \
             found)"
        )),
        Ok(text) => Finding::Works(format!("with --renderer gpu {text}")),
        Err(error) => Finding::Note(format!("for --renderer gpu: {error}")),
    }
}

/// Looks for a program that encodes films as MP4.
pub(super) fn ffmpeg(program: &str) -> Finding {
    let output = Command::new(program).arg("-version").output();
    let said = output.ok().filter(|output| output.status.success());
    let text = said.map(|output| String::from_utf8_lossy(&output.stdout).into_owned()).unwrap_or_default();
    match text.split_whitespace().skip_while(|word| *word != "version").nth(1) {
        Some(version) => Finding::Works(format!("version {version} makes MP4 of films")),
        None => Finding::Note(
            "not found; install it for films as FILE.mp4. FILE.webp and FILE.gif do not need it".into(),
        ),
    }
}

/// Checks a Python interpreter for the package and its extras.
pub(super) fn python(interpreter: &str) -> Finding {
    let modules = EXTRAS.iter().flat_map(|(_, modules)| *modules);
    let output = Command::new(interpreter).args(["-c", LOOK, "tandem"]).args(modules).output();
    match output {
        Err(error) => Finding::Note(format!(
            "{interpreter} cannot be started ({error}); language models, data sets and environments need \
             Python 3.10 or later, or TANDEM_PYTHON with the name of an interpreter"
        )),
        Ok(output) if output.status.success() => {
            installed(interpreter, &String::from_utf8_lossy(&output.stdout))
        }
        Ok(output) => {
            let said = String::from_utf8_lossy(&output.stderr);
            let last = said.lines().rfind(|line| !line.trim().is_empty()).unwrap_or("it says nothing");
            Finding::Note(format!(
                "{interpreter} does not import tandem: {last}; pip install \
                 --force-reinstall tandem-sim, or run it in another folder"
            ))
        }
    }
}

/// Parses the output of [`LOOK`].
pub(super) fn installed(interpreter: &str, answer: &str) -> Finding {
    let mut words = answer.split_whitespace();
    let version = words.next().unwrap_or_default();
    let found: Vec<&str> = words.collect();
    if !found.contains(&"tandem") {
        return Finding::Note(format!(
            "{interpreter} ({version}) has no tandem; pip install tandem-sim (in a checkout \
             ./gateway/python) for language models, data sets and environments, or name another \
             interpreter in TANDEM_PYTHON"
        ));
    }
    let has = |modules: &[&str]| modules.iter().all(|module| found.contains(module));
    let (with, without): (Vec<_>, Vec<_>) = EXTRAS.iter().partition(|(_, modules)| has(modules));
    let names =
        |extras: &[&(&str, &[&str])]| extras.iter().map(|(name, _)| *name).collect::<Vec<_>>().join(",");
    let mut text = format!("{interpreter} ({version}) has tandem");
    if !with.is_empty() {
        text += &format!(" with the extras {}", names(&with));
    }
    if !without.is_empty() {
        text += &format!("; pip install 'tandem-sim[{}]' adds the others", names(&without));
    }
    Finding::Works(text)
}

/// Checks that clients on this machine reach a server on it without a proxy. Addresses of proxies may contain
/// passwords, so only the variables are named.
pub(super) fn proxy(variable: impl Fn(&str) -> Option<String>) -> Finding {
    let value = |name: &str| {
        let either = variable(name).or_else(|| variable(&name.to_lowercase()));
        either.filter(|text| !text.trim().is_empty())
    };
    let set: Vec<&str> = PROXIES.into_iter().filter(|name| value(name).is_some()).collect();
    if set.is_empty() {
        return Finding::Works("none is set".into());
    }
    let set = set.join(", ");
    let direct = value("NO_PROXY").unwrap_or_default();
    let direct: Vec<&str> = direct.split(',').map(str::trim).collect();
    let missing: Vec<&str> = LOOPBACK.into_iter().filter(|host| !direct.contains(host)).collect();
    match missing.is_empty() || direct.contains(&"*") {
        true => Finding::Works(format!("{set}, and NO_PROXY excepts this machine")),
        false => Finding::Note(format!(
            "{set} is set, and NO_PROXY lacks {}: clients here may send requests for this server to the proxy; \
             export NO_PROXY=127.0.0.1,localhost",
            missing.join(" and ")
        )),
    }
}

/// Checks that the free space suffices for recordings.
pub(super) fn disk(free_bytes: Option<u64>) -> Finding {
    let Some(free_bytes) = free_bytes else {
        return Finding::Note(
            "free space is not known on this system; a recording has some megabytes".into(),
        );
    };
    let free_gb = free_bytes as f64 / 1e9;
    match free_bytes < MIN_FREE_BYTES {
        true => Finding::Note(format!(
            "{free_gb:.1} GB are free for recordings of some megabytes each; make room, or give another --runs"
        )),
        false => Finding::Works(format!("{free_gb:.0} GB are free for recordings of some megabytes each")),
    }
}

/// Returns the free space on the disk of a folder, which need not exist yet.
#[cfg(unix)]
pub(super) fn free_bytes(folder: &Path) -> Option<u64> {
    let absolute = std::path::absolute(folder).ok()?;
    let existing = absolute.ancestors().find(|path| path.exists())?;
    let system = rustix::fs::statvfs(existing).ok()?;
    system.f_bavail.checked_mul(system.f_frsize)
}

/// Returns `None`, because other systems have no portable call for the free space.
#[cfg(not(unix))]
pub(super) fn free_bytes(_: &Path) -> Option<u64> {
    None
}

/// Returns the time at which this program's file was written, if the system knows it.
fn built() -> Option<SystemTime> {
    std::env::current_exe().ok()?.metadata().ok()?.modified().ok()
}

/// Checks that the system date, which results and recordings contain, is not before the build date.
pub(super) fn date(now: SystemTime, built: Option<SystemTime>) -> Finding {
    let earliest = built.into_iter().fold(UNIX_EPOCH + PROGRAM_DATE, SystemTime::max);
    match earliest.duration_since(now) {
        Ok(late) if late > MAX_DRIFT => Finding::Wrong(format!(
            "{:.1} days before this program was built, and results name the date; set it, for example by \
             `timedatectl set-ntp true`",
            late.as_secs_f64() / 86_400.0
        )),
        _ => Finding::Works("after this program was built".into()),
    }
}
