//! A program and all its children as one process group, which is stopped as a whole.

use std::{
    fs::File,
    io::{self, Write},
    path::Path,
    process::{Child, ExitStatus, Stdio},
    sync::{Arc, Mutex, MutexGuard, PoisonError, Weak},
    thread,
    time::{Duration, Instant},
};

use super::kept_output::KeptOutput;

/// File with the brief in a program's folder. The program reads it on its standard input.
pub const BRIEF_FILE: &str = "brief.txt";

/// Files in the same folder for the program's output.
pub const STDOUT_FILE: &str = "stdout.txt";
pub const STDERR_FILE: &str = "stderr.txt";

/// Time that a process group has to end after it is asked to terminate.
const TERMINATION_GRACE: Duration = Duration::from_secs(5);
const POLL_INTERVAL: Duration = Duration::from_millis(20);

/// Ids of the running process groups.
#[derive(Debug, Default)]
pub struct ProcessGroups(Mutex<Vec<u32>>);

impl ProcessGroups {
    fn lock(&self) -> MutexGuard<'_, Vec<u32>> {
        // Nothing panics while it holds the lock.
        self.0.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
    }
}

/// A program with all its children. Dropping it stops them.
pub struct ProcessGroup {
    child: Child,
    /// Process that ends the group once this process has ended for any reason; `None` if it could not be
    /// started.
    guard: Option<Child>,
    groups: Arc<ProcessGroups>,
    outputs: Vec<KeptOutput>,
    /// Exit status of the program, once the group has been stopped.
    status: Option<ExitStatus>,
}

impl ProcessGroup {
    /// Starts `command` in a shell. The brief in `folder` is its standard input, and its output is kept in
    /// `folder`.
    pub fn start(
        groups: &Arc<ProcessGroups>,
        command: &str,
        environment: &[(&str, String)],
        folder: &Path,
    ) -> io::Result<ProcessGroup> {
        let output = |name: &str| File::create(folder.join(name));
        let mut shell = shell(command);
        shell
            .envs(environment.iter().map(|(name, value)| (name, value)))
            .stdin(Stdio::from(File::open(folder.join(BRIEF_FILE))?))
            .stdout(Stdio::piped())
            .stderr(Stdio::piped());
        let files = [output(STDOUT_FILE)?, output(STDERR_FILE)?];
        in_own_group(&mut shell);
        // The lock is held during the start, so that a signal handler cannot miss the program.
        let mut running = groups.lock();
        let child = shell.spawn()?;
        running.push(child.id());
        drop(running);
        let guard = guard(child.id());
        if let Err(error) = &guard {
            tracing::warn!(%error, "nobody ends the program if this process is killed");
        }
        let guard = guard.ok().flatten();
        let mut group =
            ProcessGroup { child, guard, groups: groups.clone(), outputs: Vec::new(), status: None };
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

    /// Returns true if the program has ended with status 0, and `None` while it runs. Its children may
    /// still run.
    pub fn ended_well(&mut self) -> io::Result<Option<bool>> {
        ended_well(&mut self.child)
    }

    /// Asks the group to end, kills it after a grace period, and returns the program's exit status as
    /// text.
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
        // The group's id is not reused before the program has been waited for.
        let mut running = self.groups.lock();
        kill(&mut self.child);
        running.retain(|id| *id != self.child.id());
        let status = self.child.wait()?;
        self.outputs.drain(..).for_each(KeptOutput::finish);
        if let Some(guard) = self.guard.take() {
            dismiss(guard);
        }
        self.status = Some(status);
        Ok(status)
    }
}

impl Drop for ProcessGroup {
    fn drop(&mut self) {
        // There is no caller to whom an error could be reported.
        let _ = self.end();
    }
}

/// Process groups of all policies of this process.
static ALL: Mutex<Vec<Weak<ProcessGroups>>> = Mutex::new(Vec::new());

/// Registers these groups for [`end_all_programs`].
pub fn end_with_all(groups: &Arc<ProcessGroups>) {
    let mut all = ALL.lock().unwrap_or_else(PoisonError::into_inner);
    all.retain(|known| known.strong_count() > 0);
    all.push(Arc::downgrade(groups));
}

/// Ends every program that this process has started and prevents new ones, because the process is about
/// to end.
pub fn end_all_programs() {
    let all = ALL.lock().unwrap_or_else(PoisonError::into_inner);
    for groups in all.iter().filter_map(Weak::upgrade) {
        let running = groups.lock();
        running.iter().for_each(|id| kill_group(*id));
        // The lock is never released, so that no further group starts.
        std::mem::forget(running);
        std::mem::forget(groups.clone());
    }
}

/// Releases the guard of a group that has ended.
fn dismiss(mut guard: Child) {
    if let Some(mut stdin) = guard.stdin.take() {
        // The guard may have been killed.
        let _ = stdin.write_all(b"ended\n");
    }
    let _ = guard.wait();
}

#[cfg(unix)]
mod system {
    use std::{
        io,
        os::unix::process::CommandExt,
        process::{Child, Command, Stdio},
    };

    use rustix::process::{Pid, Signal, WaitId, WaitIdOptions, kill_process_group, waitid};

    /// Prepares a shell process that runs a command.
    pub fn shell(command: &str) -> Command {
        let mut shell = Command::new("sh");
        shell.args(["-c", command]);
        shell
    }

    /// Starts the command in a separate process group.
    pub fn in_own_group(command: &mut Command) {
        command.process_group(0);
    }

    /// Shell script that waits for a line and kills the group if its input ends without one. The kernel
    /// closes the pipe of a process that has ended.
    const GUARD: &str = r#"trap '' HUP INT TERM; read -r line || kill -s KILL -- "-$1""#;

    /// Starts the guard, which ends the group once this process has ended.
    pub fn guard(id: u32) -> io::Result<Option<Child>> {
        let mut shell = shell(GUARD);
        shell.args(["tandem-guard", &id.to_string()]);
        shell.stdin(Stdio::piped()).stdout(Stdio::null()).stderr(Stdio::null());
        in_own_group(&mut shell);
        shell.spawn().map(Some)
    }

    /// Returns true if the child has ended with status 0, and `None` while it runs. The child is not
    /// reaped, so that its id is not reused.
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
            // The call fails if the group has no process left, which is not an error here.
            let _ = kill_process_group(pid, signal);
        }
    }

    fn number(id: u32) -> Option<Pid> {
        Pid::from_raw(id.try_into().ok()?)
    }
}

#[cfg(not(unix))]
mod system {
    use std::{
        io,
        os::windows::process::CommandExt,
        process::{Child, Command, Stdio},
    };

    /// Prepares a shell process that runs a command. The shell only removes the outer quotes.
    pub fn shell(command: &str) -> Command {
        let mut shell = Command::new("cmd");
        shell.args(["/S", "/C"]).raw_arg(format!("\"{command}\""));
        shell
    }

    pub fn in_own_group(_: &mut Command) {}

    pub fn guard(_: u32) -> io::Result<Option<Child>> {
        Ok(None)
    }

    pub fn ended_well(child: &mut Child) -> io::Result<Option<bool>> {
        Ok(child.try_wait()?.map(|status| status.success()))
    }

    /// Kills the group, since a program without windows cannot be asked to end.
    pub fn terminate(id: u32) {
        kill_group(id);
    }

    pub fn kill(child: &mut Child) {
        let _ = child.kill();
    }

    /// Kills a running process and all processes that it has started.
    pub fn kill_group(id: u32) {
        let mut kill = Command::new("taskkill");
        kill.args(["/T", "/F", "/PID", &id.to_string()]);
        let _ = kill.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null()).status();
    }
}

use system::{ended_well, guard, in_own_group, kill, kill_group, shell, terminate};
