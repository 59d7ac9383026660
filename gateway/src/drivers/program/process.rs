//! A program and all that it starts, as one group of processes, which is stopped as one.

use std::{
    fs::File,
    io,
    path::Path,
    process::{Child, Command, ExitStatus, Stdio},
    sync::{Arc, Mutex, MutexGuard},
    thread,
    time::{Duration, Instant},
};

use super::kept_output::KeptOutput;

/// The file in a program's folder with the brief, which it reads on its standard input.
pub const BRIEF_FILE: &str = "brief.txt";

/// The files there that its output is written to.
pub const STDOUT_FILE: &str = "stdout.txt";
pub const STDERR_FILE: &str = "stderr.txt";

/// How long a group may take to end once it has been asked to.
const TERMINATION_GRACE: Duration = Duration::from_secs(5);
const POLL_INTERVAL: Duration = Duration::from_millis(20);

/// The numbers of the groups that are running.
#[derive(Debug, Default)]
pub struct ProcessGroups(Mutex<Vec<u32>>);

impl ProcessGroups {
    fn lock(&self) -> MutexGuard<'_, Vec<u32>> {
        // Nothing panics while it holds the lock.
        self.0.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
    }
}

/// A program and all that it has started. Dropping it stops them.
pub struct ProcessGroup {
    child: Child,
    groups: Arc<ProcessGroups>,
    outputs: Vec<KeptOutput>,
    /// How the program ended, once the group has been stopped.
    status: Option<ExitStatus>,
}

impl ProcessGroup {
    /// Starts `command` by a shell, with the brief in `folder` on its standard input and its output kept there.
    pub fn start(
        groups: &Arc<ProcessGroups>,
        command: &str,
        environment: &[(&str, String)],
        folder: &Path,
    ) -> io::Result<ProcessGroup> {
        let output = |name: &str| File::create(folder.join(name));
        let mut shell = Command::new(SHELL[0]);
        shell
            .arg(SHELL[1])
            .arg(command)
            .envs(environment.iter().map(|(name, value)| (name, value)))
            .stdin(Stdio::from(File::open(folder.join(BRIEF_FILE))?))
            .stdout(Stdio::piped())
            .stderr(Stdio::piped());
        let files = [output(STDOUT_FILE)?, output(STDERR_FILE)?];
        in_own_group(&mut shell);
        // A signal that comes between the start and the note of it would miss the program.
        let mut running = groups.lock();
        let child = shell.spawn()?;
        running.push(child.id());
        drop(running);
        let mut group = ProcessGroup { child, groups: groups.clone(), outputs: Vec::new(), status: None };
        group.keep_outputs(files)?;
        Ok(group)
    }

    fn keep_outputs(&mut self, [stdout, stderr]: [File; 2]) -> io::Result<()> {
        if let Some(said) = self.child.stdout.take() {
            self.outputs.push(KeptOutput::start(said, stdout)?);
        }
        if let Some(said) = self.child.stderr.take() {
            self.outputs.push(KeptOutput::start(said, stderr)?);
        }
        Ok(())
    }

    /// Whether the program has ended well, whatever it has left running; `None` while it runs.
    pub fn ended_well(&mut self) -> io::Result<Option<bool>> {
        ended_well(&mut self.child)
    }

    /// Asks the group to end, ends it if it does not, and says how the program ended.
    pub fn stop(mut self) -> io::Result<String> {
        self.end().map(|status| status.to_string())
    }

    fn end(&mut self) -> io::Result<ExitStatus> {
        if let Some(status) = self.status {
            return Ok(status);
        }
        if self.ended_well()?.is_none() {
            terminate(self.child.id());
            let asked = Instant::now();
            while self.ended_well()?.is_none() && asked.elapsed() < TERMINATION_GRACE {
                thread::sleep(POLL_INTERVAL);
            }
        }
        // No other process gets the group's number before the program has been waited for.
        let mut running = self.groups.lock();
        kill(&mut self.child);
        running.retain(|id| *id != self.child.id());
        let status = self.child.wait()?;
        self.outputs.drain(..).for_each(KeptOutput::finish);
        self.status = Some(status);
        Ok(status)
    }
}

impl Drop for ProcessGroup {
    fn drop(&mut self) {
        // Nobody is left to whom an error could be reported.
        let _ = self.end();
    }
}

/// Has a signal that ends this process end every group first, from now on.
pub fn stop_on_shutdown(groups: &Arc<ProcessGroups>) {
    let groups = Arc::downgrade(groups);
    thread::spawn(move || {
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build();
        let Ok(runtime) = runtime else { return };
        runtime.block_on(crate::http::shutdown_signal());
        if let Some(groups) = groups.upgrade() {
            // Held to the end, so that no further group starts.
            let running = groups.lock();
            running.iter().for_each(|id| kill_group(*id));
            std::process::exit(INTERRUPTED);
        }
        std::process::exit(INTERRUPTED);
    });
}

/// What shells report of a process that SIGINT has ended.
const INTERRUPTED: i32 = 130;

#[cfg(unix)]
mod system {
    use std::{io, os::unix::process::CommandExt, process::Child, process::Command};

    use rustix::process::{Pid, Signal, WaitId, WaitIdOptions, kill_process_group, waitid};

    pub const SHELL: [&str; 2] = ["sh", "-c"];

    /// Has the command start in a process group of its own.
    pub fn in_own_group(command: &mut Command) {
        command.process_group(0);
    }

    /// Whether the child has ended with status 0; `None` while it runs. It is not waited for, so that no other process gets its number.
    pub fn ended_well(child: &mut Child) -> io::Result<Option<bool>> {
        let Some(pid) = number(child.id()) else { return Ok(Some(false)) };
        let look = WaitIdOptions::EXITED | WaitIdOptions::NOHANG | WaitIdOptions::NOWAIT;
        Ok(waitid(WaitId::Pid(pid), look)?.map(|status| status.exit_status() == Some(0)))
    }

    pub fn terminate(id: u32) {
        signal(id, Signal::TERM);
    }

    pub fn kill(child: &mut Child) {
        kill_group(child.id());
    }

    pub fn kill_group(id: u32) {
        signal(id, Signal::KILL);
    }

    fn signal(id: u32, signal: Signal) {
        if let Some(pid) = number(id) {
            // The call fails where no process of the group is left, which is what is wanted.
            let _ = kill_process_group(pid, signal);
        }
    }

    fn number(id: u32) -> Option<Pid> {
        Pid::from_raw(id.try_into().ok()?)
    }
}

#[cfg(not(unix))]
mod system {
    use std::{io, process::Child, process::Command};

    pub const SHELL: [&str; 2] = ["cmd", "/C"];

    pub fn in_own_group(_: &mut Command) {}

    pub fn ended_well(child: &mut Child) -> io::Result<Option<bool>> {
        Ok(child.try_wait()?.map(|status| status.success()))
    }

    pub fn terminate(_: u32) {}

    pub fn kill(child: &mut Child) {
        let _ = child.kill();
    }

    pub fn kill_group(_: u32) {}
}

use system::{SHELL, ended_well, in_own_group, kill, kill_group, terminate};
