//! Carries out changes of the building on a thread of its own: writes the files and asks the supervisor to start the
//! services anew. One change at a time.

use crate::edit::{Edit, Files, Present, stem};
use crate::files::write_public;
use crate::network::{Asker, reply_now, spawn};
use crate::pending::refusal;
use crate::revision::BuildingFiles;
use floorplan::Plan;
use runtime::{Start, StartError};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::{SyncSender, TrySendError, sync_channel};
use supervisor::Client;

/// A change on its way to the thread.
struct Task {
    edit: Edit,
    asker: Asker,
}

/// Where changes go.
pub struct Editor {
    tasks: SyncSender<Task>,
}

struct Work {
    plan: Arc<Plan>,
    /// As the manifest names it.
    name: String,
    files: BuildingFiles,
    radius_m: f32,
    /// Of the running system; none for a bridge that was started by hand.
    run_dir: Option<PathBuf>,
}

impl Editor {
    /// Begins to wait for changes.
    ///
    /// # Errors
    /// When the plan cannot be read or the system gives no thread.
    pub fn start(start: &Start) -> Result<Self, StartError> {
        let name = start.system.plan.clone();
        let work = Work {
            plan: start.plan()?,
            files: BuildingFiles {
                header: start.root.join(&name),
                sidecar: start.root.join(start.sidecar_name()),
            },
            name,
            radius_m: start.vehicle.body.radius_m,
            run_dir: std::env::var_os(runtime::env::RUN_DIR).map(PathBuf::from),
        };
        let (tasks, taken) = sync_channel::<Task>(1);
        spawn("edit", move || {
            for task in taken {
                work.carry_out(task);
            }
        })?;
        Ok(Self { tasks })
    }

    /// Hands a change over; while another is worked at, who asked comes back, with a sentence.
    #[must_use]
    pub fn take(&self, edit: Edit, asker: Asker) -> Option<(Asker, &'static str)> {
        match self.tasks.try_send(Task { edit, asker }) {
            Ok(()) => None,
            Err(TrySendError::Full(task) | TrySendError::Disconnected(task)) => {
                Some((task.asker, "another change is being made"))
            }
        }
    }
}

impl Work {
    fn carry_out(&self, task: Task) {
        let Task { edit, asker } = task;
        let what = edit.what();
        match self.change(&edit) {
            Err(sentence) => reply_now(asker, &refusal(&sentence)),
            Ok(client) => {
                tracing::info!("bridge: {what} by {}", manifest::plain(&edit.account));
                let text = match &client {
                    Some(_) => format!("{what}: saved; the drone starts anew with it"),
                    None => format!(
                        "{what}: saved; no supervisor runs here, so start the services anew to use it"
                    ),
                };
                // Before the services end, and this one with them.
                reply_now(asker, &accepted(&text));
                if let Some(mut client) = client
                    && let Err(error) = client.ask(&supervisor::protocol::Request::Reload)
                {
                    tracing::warn!("bridge: {what} is saved and not used before the next start: {error}");
                }
            }
        }
    }

    /// Writes what is wanted; answers the supervisor, if there is one, who is to be told.
    fn change(&self, edit: &Edit) -> Result<Option<Client>, String> {
        let mut client = match &self.run_dir {
            Some(run_dir) => Some(Client::connect(run_dir).map_err(|error| error.to_string())?),
            None => None,
        };
        if let Some(client) = &mut client
            && client.ps().map_err(|error| error.to_string())?.airborne
        {
            return Err("the drone flies: land first".to_owned());
        }
        self.files.check(&edit.made_from)?;
        let present = Present { plan: &self.plan, name: &self.name, radius_m: self.radius_m };
        let files = edit.files(&present)?;
        self.write(&files)?;
        if let Err(error) = self.files.sign(&edit.account) {
            // Who comes after is told that it was changed, and not by whom.
            tracing::warn!("bridge: {error}");
        }
        Ok(client)
    }

    /// Keeps what was as `*.previous`, and writes: the picture, the side file, and last the header that names both.
    fn write(&self, files: &Files) -> Result<(), String> {
        keep(&self.files.sidecar)?;
        let Some((header, picture, bytes)) = &files.plan else {
            return write_public(&self.files.sidecar, files.sidecar.as_bytes());
        };
        keep(&self.files.header)?;
        write_public(&self.files.header.with_file_name(picture), bytes)?;
        write_public(&self.files.sidecar, files.sidecar.as_bytes())?;
        write_public(&self.files.header, header.as_bytes())?;
        self.tidy(picture);
        Ok(())
    }

    /// Removes pictures of sent plans but the newest and the one before it.
    fn tidy(&self, newest: &str) {
        let previous = std::fs::read_to_string(previous(&self.files.header)).unwrap_or_default();
        let Some(directory) = self.files.header.parent() else { return };
        let Ok(entries) = std::fs::read_dir(directory) else { return };
        let ours = |name: &str| {
            let middle = name.strip_prefix(stem(&self.name)).and_then(|rest| rest.strip_prefix('.'));
            let middle = middle.and_then(|rest| rest.strip_suffix(".png"));
            middle.is_some_and(|hash| hash.len() == 16 && hash.bytes().all(|byte| byte.is_ascii_hexdigit()))
        };
        for entry in entries.flatten() {
            let name = entry.file_name().to_string_lossy().into_owned();
            if ours(&name) && name != newest && !previous.contains(&name) {
                // One that stays is only in the way.
                let _ = std::fs::remove_file(entry.path());
            }
        }
    }
}

fn previous(path: &Path) -> PathBuf {
    let mut name = path.file_name().unwrap_or_default().to_owned();
    name.push(".previous");
    path.with_file_name(name)
}

/// Keeps a file as it is under another name, if it is there.
fn keep(path: &Path) -> Result<(), String> {
    match std::fs::read(path) {
        Ok(bytes) => write_public(&previous(path), &bytes),
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => Ok(()),
        Err(error) => Err(format!("cannot read {}: {error}", path.display())),
    }
}

fn accepted(text: &str) -> Value {
    json!({ "accepted": true, "text": text })
}
