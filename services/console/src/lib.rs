//! The watch room: HTTPS, accounts and the page, as a zenoh client.
//!
//! What there is to ask for and who may ask stands in one table ([`table`]); every request passes one gate. Pure parts
//! (sessions, back-off, claim, reports) take time and randomness as arguments; what is kept is in SQLite behind one thread.

mod api;
mod app;
mod authority;
mod backoff;
mod config;
mod console;
mod directory;
mod fleet;
mod gate;
mod mailbox;
mod page;
pub mod password;
mod plans;
mod recording;
mod refusal;
mod role;
pub mod round;
pub mod secret;
mod server;
mod socket;
mod store;
pub mod table;
mod text;
pub mod threads;
mod tls;

pub use app::{App, Clock, SystemClock};
pub use authority::AuthorityError;
pub use backoff::{Backoff, LONGEST_MS};
pub use config::{ConfigError, ConsoleConfig, HttpsConfig, RehearsalConfig, SessionConfig, ZenohConfig};
pub use console::{Console, StartError, claim_again};
pub use directory::{Account, Directory, Lifetime, MOST_SESSIONS, Session};
pub use fleet::{Drone, Fleet, LinkError};
pub use mailbox::Mailbox;
pub use page::Page;
pub use recording::RecordingConfig;
pub use role::{EVERY_DRONE, Role, is_drone_name};
pub use store::{Entry, Incident, Kind, NewAccount, Recording, ReportLine, Store, StoreError};
pub use tls::{Certificate, CertificateError};
