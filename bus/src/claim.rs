//! Who is on a bus: one locked file for each role.
//!
//! A process that plays a role holds an exclusive lock (`flock`) on the role's file as long as it lives.
//! The system drops the lock at the very moment a process ends, however it ends, and keeps it while the
//! process is stopped (`SIGSTOP`): so the lock tells the dead from the slow, and needs no clock.

use crate::header::{ROLES, role_index};
use crate::name::NAME_PREFIX;
use crate::{BusError, BusName};
use schemas::topics::Role;
use std::fs::{DirBuilder, File, OpenOptions, Permissions, TryLockError};
use std::io::{ErrorKind, Write};
use std::os::unix::fs::{DirBuilderExt, MetadataExt, OpenOptionsExt, PermissionsExt};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::{Duration, Instant};

/// How long a role is tried again before it counts as taken: others lock the role of nobody for moments,
/// to see whether it is alive.
const CLAIM_PATIENCE: Duration = Duration::from_millis(200);
/// How long the door is waited for: others hold it while they join or leave, which takes milliseconds; on an
/// overloaded machine, more.
const DOOR_PATIENCE: Duration = Duration::from_secs(10);
/// Pause between two tries.
const PAUSE: Duration = Duration::from_millis(2);

/// Where Linux shows shared memory as files.
const SHARED_MEMORY: &str = "/dev/shm";

/// The lock files of a bus, open, none of them locked by this value.
#[derive(Debug)]
pub(crate) struct Roster([File; 3]);

impl Roster {
    fn open(root_dir: &Path) -> Result<Self, BusError> {
        let open = |role| open_lock_file(&lock_path(root_dir, role));
        Ok(Roster([open(ROLES[0])?, open(ROLES[1])?, open(ROLES[2])?]))
    }

    /// Whether a living process plays `role`; one that is stopped by a signal lives.
    pub(crate) fn alive(&self, role: Role) -> bool {
        let file = &self.0[role_index(role)];
        match file.try_lock_shared() {
            Ok(()) => {
                // Nothing can be done about a failure, and the lock goes with the file at the latest.
                let _ = file.unlock();
                false
            }
            Err(TryLockError::WouldBlock) => true,
            // Interrupted or out of lock memory: not a proof of death.
            Err(TryLockError::Error(_)) => true,
        }
    }
}

/// A role held by this process. Dropping it frees the role and, when no other role is held, removes what
/// the bus has left in the file system.
#[derive(Debug)]
pub(crate) struct Claim {
    name: BusName,
    roster: Arc<Roster>,
    /// Locked as long as the claim lives.
    locked: File,
    /// Held while this process leaves.
    door: Option<Door>,
}

impl Claim {
    /// Takes `role` on the bus; removes leftovers of dead processes when nobody else is on it. Everything
    /// that joining makes must be made before the door is dropped.
    pub(crate) fn take(name: &BusName, role: Role) -> Result<(Self, Door), BusError> {
        let root_dir = name.root_dir();
        let door = Door::pass(&root_dir, true, DOOR_PATIENCE)?;
        let roster = Arc::new(Roster::open(&root_dir)?);
        let path = lock_path(&root_dir, role);
        let mut locked = open_lock_file(&path)?;
        let begin = Instant::now();
        while let Err(refused) = locked.try_lock() {
            if let TryLockError::Error(source) = refused {
                return Err(file_error("locking", &path, source));
            }
            if begin.elapsed() > CLAIM_PATIENCE {
                let process = std::fs::read_to_string(&path).unwrap_or_default();
                let process = if process.is_empty() { "?".to_owned() } else { process };
                return Err(BusError::NameInUse { name: name.to_string(), role, process });
            }
            std::thread::sleep(PAUSE);
        }
        // The number is only for the message to who finds the role taken.
        let written = locked.set_len(0).and_then(|()| write!(locked, "{}", std::process::id()));
        written.map_err(|source| file_error("writing", &path, source))?;
        if let Some(_others) = lock_all(&roster, Some(role)) {
            wipe(name)?;
        }
        Ok((Claim { name: name.clone(), roster, locked, door: None }, door))
    }

    /// Waits for the door, to go before the claim does: what joining made is then taken down while nobody
    /// else joins or leaves.
    pub(crate) fn begin_to_leave(&mut self) {
        if self.door.is_none() {
            // The claim keeps the directory at its place, so the door is still the right one.
            match Door::pass(&self.name.root_dir(), false, DOOR_PATIENCE) {
                Ok(door) => self.door = Some(door),
                Err(error) => tracing::warn!("leaving bus {} without its door: {error}", self.name),
            }
        }
    }

    /// Who else is there.
    pub(crate) fn roster(&self) -> Arc<Roster> {
        Arc::clone(&self.roster)
    }
}

impl Drop for Claim {
    fn drop(&mut self) {
        self.begin_to_leave();
        // Without the door, somebody has held it for too long; whoever leaves later cleans up.
        let Some(_door) = self.door.take() else { return };
        let _ = self.locked.unlock();
        if let Some(_all) = lock_all(&self.roster, None)
            && let Err(error) = wipe(&self.name).and_then(|()| remove_root_dir(&self.name))
        {
            tracing::warn!("leftovers of bus {} may stay: {error}", self.name);
        }
    }
}

/// Removes what the bus `name` has left behind, unless a living process is on it. Returns whether nothing
/// of it is left.
///
/// # Errors
/// [`BusError::File`] when a file cannot be removed.
pub(crate) fn clean_up(name: &BusName) -> Result<bool, BusError> {
    clean_up_within(name, DOOR_PATIENCE)
}

fn clean_up_within(name: &BusName, patience: Duration) -> Result<bool, BusError> {
    let root_dir = name.root_dir();
    if !root_dir.exists() {
        return Ok(true);
    }
    let opened = Door::pass(&root_dir, false, patience).and_then(|door| Ok((door, Roster::open(&root_dir)?)));
    let (_door, roster) = match opened {
        // The last process has removed the directory in between.
        Err(BusError::File { source, .. }) if source.kind() == ErrorKind::NotFound => return Ok(true),
        opened => opened?,
    };
    let Some(_all) = lock_all(&roster, None) else { return Ok(false) };
    wipe(name)?;
    remove_root_dir(name)?;
    Ok(true)
}

/// Removes what dead processes have left on any bus of this temporary directory. What cannot be removed, that of
/// another user for instance, stays.
pub(crate) fn clean_up_all() {
    let Ok(entries) = std::fs::read_dir(std::env::temp_dir()) else { return };
    for entry in entries.flatten() {
        let file_name = entry.file_name();
        let Some(name) = file_name.to_str().and_then(|name| name.strip_prefix(NAME_PREFIX)) else { continue };
        let removed = match name.parse() {
            // Where somebody joins or leaves, somebody lives.
            Ok(name) => clean_up_within(&name, Duration::ZERO).map(drop),
            // A directory that was moved away to be removed, by a process that died before it had.
            Err(_) if name.contains(".gone-") => std::fs::remove_dir_all(entry.path())
                .map_err(|source| file_error("removing", &entry.path(), source)),
            Err(_) => Ok(()),
        };
        if let Err(error) = removed {
            tracing::debug!("leftovers stay: {error}");
        }
    }
}

/// The lock that lets one process at a time join, leave or clean up. So who joins an empty bus knows that
/// whatever is there was left by the dead, and of two that leave at the same moment one is the last.
#[derive(Debug)]
pub(crate) struct Door(File);

impl Door {
    /// Waits for the door. With `make`, the bus's directory is made if it is not there.
    fn pass(root_dir: &Path, make: bool, patience: Duration) -> Result<Door, BusError> {
        let path = root_dir.join("door.lock");
        let begin = Instant::now();
        loop {
            if make {
                make_root_dir(root_dir)?;
            }
            match open_lock_file(&path) {
                // The last process that leaves removes the directory.
                Err(BusError::File { source, .. }) if make && source.kind() == ErrorKind::NotFound => {}
                opened => {
                    let file = opened?;
                    match file.try_lock() {
                        // A lock on a file that is no longer at its place protects nothing.
                        Ok(()) if is_at(&file, &path) => return Ok(Door(file)),
                        Ok(()) => {}
                        Err(TryLockError::WouldBlock) if begin.elapsed() < patience => {}
                        Err(refused) => return Err(file_error("locking", &path, refused.into())),
                    }
                }
            }
            std::thread::sleep(PAUSE);
        }
    }
}

impl Drop for Door {
    fn drop(&mut self) {
        // It is freed with the file at the latest.
        let _ = self.0.unlock();
    }
}

/// Locks on roles; freed when dropped.
struct Locks<'a>(Vec<&'a File>);

impl Drop for Locks<'_> {
    fn drop(&mut self) {
        for file in &self.0 {
            let _ = file.unlock();
        }
    }
}

/// Locks all roles but `own`; `None` when one of them is held.
fn lock_all(roster: &Roster, own: Option<Role>) -> Option<Locks<'_>> {
    let mut locks = Locks(Vec::new());
    for role in ROLES.into_iter().filter(|role| Some(*role) != own) {
        let file = &roster.0[role_index(role)];
        file.try_lock().ok()?;
        locks.0.push(file);
    }
    Some(locks)
}

fn lock_path(root_dir: &Path, role: Role) -> PathBuf {
    root_dir.join(format!("{}.lock", role.name()))
}

fn open_lock_file(path: &Path) -> Result<File, BusError> {
    OpenOptions::new()
        .create(true)
        .truncate(false)
        .write(true)
        .mode(0o600)
        .open(path)
        .map_err(|source| file_error("opening", path, source))
}

/// Makes the directory of a bus. Only its owner may enter: whatever lies below is private, whatever its own
/// mode is.
fn make_root_dir(root_dir: &Path) -> Result<(), BusError> {
    match DirBuilder::new().mode(0o700).create(root_dir) {
        Err(source) if source.kind() != ErrorKind::AlreadyExists => {
            Err(file_error("creating", root_dir, source))
        }
        _ => Ok(()),
    }
}

/// Whether the open file is still the one at `path`.
fn is_at(file: &File, path: &Path) -> bool {
    match (file.metadata(), std::fs::metadata(path)) {
        (Ok(open), Ok(there)) => (open.dev(), open.ino()) == (there.dev(), there.ino()),
        _ => false,
    }
}

/// Removes the bus's shared memory and all in its directory but the lock files. All roles are locked.
fn wipe(name: &BusName) -> Result<(), BusError> {
    let prefix = name.shared_memory_prefix();
    let remove = |path: &Path, is_dir: bool| {
        if is_dir { std::fs::remove_dir_all(path) } else { std::fs::remove_file(path) }
    };
    for_entries(Path::new(SHARED_MEMORY), |entry| entry.starts_with(&prefix), "removing", remove)?;
    for_entries(&name.root_dir(), |entry| !entry.ends_with(".lock"), "removing", remove)
}

/// Takes the bus's shared memory from other users. iceoryx2 makes all of it private by itself, but for the
/// counter of its ids.
pub(crate) fn make_private(name: &BusName) -> Result<(), BusError> {
    let prefix = name.shared_memory_prefix();
    for_entries(
        Path::new(SHARED_MEMORY),
        |entry| entry.starts_with(&prefix),
        "restricting",
        |path, _| std::fs::set_permissions(path, Permissions::from_mode(0o600)),
    )
}

/// Does something to the chosen entries of a directory; one that has just gone is no error.
fn for_entries(
    directory: &Path,
    chosen: impl Fn(&str) -> bool,
    action: &'static str,
    act: impl Fn(&Path, bool) -> std::io::Result<()>,
) -> Result<(), BusError> {
    let entries = match std::fs::read_dir(directory) {
        Err(source) if source.kind() == ErrorKind::NotFound => return Ok(()),
        entries => entries.map_err(|source| file_error("reading", directory, source))?,
    };
    for entry in entries {
        let entry = entry.map_err(|source| file_error("reading", directory, source))?;
        if !entry.file_name().to_str().is_some_and(&chosen) {
            continue;
        }
        let path = entry.path();
        let is_dir = entry.file_type().is_ok_and(|kind| kind.is_dir());
        match act(&path, is_dir) {
            Err(source) if source.kind() != ErrorKind::NotFound => {
                return Err(file_error(action, &path, source));
            }
            _ => {}
        }
    }
    Ok(())
}

/// Removes the bus's directory with the lock files. All roles and the door are locked.
///
/// It is moved away first: whoever joins at this moment finds either the locked door or no directory, and
/// never has a new lock file removed from under it.
fn remove_root_dir(name: &BusName) -> Result<(), BusError> {
    static COUNTER: AtomicU32 = AtomicU32::new(0);
    let root_dir = name.root_dir();
    let counter = COUNTER.fetch_add(1, Ordering::Relaxed);
    let suffix = format!("{NAME_PREFIX}{name}.gone-{}-{counter}", std::process::id());
    let gone = root_dir.with_file_name(suffix);
    std::fs::rename(&root_dir, &gone).map_err(|source| file_error("moving", &root_dir, source))?;
    match std::fs::remove_dir_all(&gone) {
        // Another process has tidied up.
        Err(source) if source.kind() == ErrorKind::NotFound => Ok(()),
        removed => removed.map_err(|source| file_error("removing", &gone, source)),
    }
}

fn file_error(action: &'static str, path: &Path, source: std::io::Error) -> BusError {
    BusError::File { action, path: path.to_owned(), source }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_role_is_held_once_and_free_after() {
        let name = BusName::unique();
        let (claim, _) = Claim::take(&name, Role::Recorder).unwrap();
        let error = Claim::take(&name, Role::Recorder).unwrap_err().to_string();
        let process = std::process::id().to_string();
        for word in [name.as_str(), "in use", "recorder", &process] {
            assert!(error.contains(word), "{error}");
        }
        assert!(claim.roster().alive(Role::Recorder) && !claim.roster().alive(Role::Simulator));
        let (other, _) = Claim::take(&name, Role::Simulator).unwrap();
        assert!(claim.roster().alive(Role::Simulator));
        drop(claim);
        assert!(!other.roster().alive(Role::Recorder));
        assert!(name.root_dir().exists());
        drop(other);
        assert!(!name.root_dir().exists());
    }

    /// The last two to leave may do it at the same moment.
    #[test]
    fn who_leaves_last_cleans_up_whoever_it_is() {
        for _ in 0..100 {
            let name = BusName::unique();
            let both = Arc::new(std::sync::Barrier::new(2));
            let leave = |role| {
                let ((claim, _), both) = (Claim::take(&name, role).unwrap(), Arc::clone(&both));
                std::thread::spawn(move || {
                    both.wait();
                    drop(claim);
                })
            };
            for thread in [leave(Role::Simulator), leave(Role::Recorder)] {
                thread.join().unwrap();
            }
            assert!(!name.root_dir().exists());
        }
    }

    #[test]
    fn leftovers_are_removed_only_when_nobody_is_there() {
        let name = BusName::unique();
        let shared = Path::new("/dev/shm").join(format!("{}left", name.shared_memory_prefix()));
        std::fs::create_dir(name.root_dir()).unwrap();
        std::fs::write(name.root_dir().join("left"), "").unwrap();
        std::fs::write(&shared, "").unwrap();
        let (claim, _) = Claim::take(&name, Role::Renderer).unwrap();
        assert!(!shared.exists() && !name.root_dir().join("left").exists());
        std::fs::write(&shared, "").unwrap();
        assert!(!clean_up(&name).unwrap());
        let (other, _) = Claim::take(&name, Role::Simulator).unwrap();
        drop(other);
        assert!(shared.exists(), "removed under a living process");
        drop(claim);
        assert!(!shared.exists());
        assert!(clean_up(&name).unwrap());
    }
}
