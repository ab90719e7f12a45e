//! The drone on zenoh: what its topics say goes out, orders come in. `docs/off-board.md` is the contract.
//!
//! What decides is pure, with time as an argument: [`gate`] (who may order, how often, how fresh, none twice), [`order`] (what
//! is an order), [`pending`] (when it is given and what is answered), [`acl`] (who may say what on which key). The shell
//! over zenoh is [`network`] with threads of its own; a step of [`Bridge`] waits for nobody.
//!
//! [`authority`] makes certificates, [`remote`] is a client by the same contract: `sereno` uses both.

pub mod about;
pub mod acl;
pub mod authority;
pub mod config;
mod ear;
pub mod edit;
pub mod editor;
mod files;
pub mod form;
pub mod gate;
pub mod identity;
pub mod keys;
pub mod network;
pub mod order;
pub mod pending;
pub mod remote;
pub mod revision;
pub mod roles;
pub mod schema;
mod service;
mod sessions;
mod signals;
mod taps;
pub mod threads;
pub mod wishes;
pub mod x509;
pub mod zenoh_config;

pub use authority::Authority;
pub use config::BridgeConfig;
pub use service::Bridge;
