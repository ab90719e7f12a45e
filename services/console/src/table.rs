//! The one table of what there is to ask for and who may ask. Router, sockets and the tests of authorization are made
//! from it: what does not stand here does not exist, and nothing is allowed that is not allowed here.

use crate::Role;

/// HTTP methods in use.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs, reason = "the names of the protocol")]
pub enum Method {
    Get,
    Post,
    Patch,
}

/// The least that somebody must be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Least {
    /// No account is needed.
    Anybody,
    /// An account with this role or a higher one.
    Account(Role),
}

/// Where a request names its drone. Who asks must be assigned to it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Names {
    /// It concerns no single drone.
    NoDrone,
    /// `{drone}` in the path.
    InPath,
    /// `?drone=`.
    InQuery,
}

/// What answers a route.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs, reason = "one for each row of the table, which says it")]
pub enum Action {
    Index,
    App,
    Trust,
    AuthorityFile,
    SeeTrust,
    TrustCode,
    SeeSession,
    Claim,
    LogIn,
    LogOut,
    ChangeLanguage,
    ChangePassword,
    ListAccounts,
    AddAccount,
    ChangeAccount,
    ReadLog,
    ListDrones,
    About,
    Plan,
    Still,
    EditBuilding,
    ListDrafts,
    AddDraft,
    ReadDraft,
    MakePlan,
    DraftPicture,
    DraftPlan,
    InstallDraft,
    ListRehearsals,
    Rehearse,
    ReadRehearsal,
    MarkIncident,
    ListIncidents,
    ListRecordings,
    StartRecording,
    StopRecording,
    ReadRecording,
    EraseRecording,
    ListReports,
    ReadReport,
    Telemetry,
    Sticks,
    Signal,
}

/// A route.
#[derive(Clone, Copy, Debug)]
pub struct Route {
    /// How.
    pub method: Method,
    /// Where, in axum's notation.
    pub path: &'static str,
    /// Who.
    pub least: Least,
    /// For which drone.
    pub names: Names,
    /// What.
    pub action: Action,
}

impl Route {
    /// Bytes of a body at most.
    #[must_use]
    pub const fn body_bytes(&self) -> usize {
        match self.action {
            // A picture.
            Action::AddDraft => 16 * 1024 * 1024,
            // A building with all its corners.
            Action::EditBuilding | Action::MakePlan | Action::Rehearse => 256 * 1024,
            _ => 64 * 1024,
        }
    }

    /// Whether it becomes a WebSocket.
    #[must_use]
    pub fn is_socket(&self) -> bool {
        matches!(self.action, Action::Telemetry | Action::Sticks | Action::Signal)
    }

    /// Whether `Origin` must be ours: all that changes something, and every WebSocket.
    #[must_use]
    pub fn needs_origin(&self) -> bool {
        self.method != Method::Get || self.is_socket()
    }
}

const fn route(method: Method, path: &'static str, least: Least, names: Names, action: Action) -> Route {
    Route { method, path, least, names, action }
}

const VIEWER: Least = Least::Account(Role::Viewer);
const GUARD: Least = Least::Account(Role::Guard);
const INSTALLER: Least = Least::Account(Role::Installer);
const ADMINISTRATOR: Least = Least::Account(Role::Administrator);

/// Every route.
#[rustfmt::skip]
pub const ROUTES: &[Route] = &[
    route(Method::Get,   "/",                            Least::Anybody, Names::NoDrone, Action::Index),
    route(Method::Get,   "/app/{*path}",                 Least::Anybody, Names::NoDrone, Action::App),
    route(Method::Get,   "/trust",                       Least::Anybody, Names::NoDrone, Action::Trust),
    route(Method::Get,   "/trust/sereno-ca.crt",         Least::Anybody, Names::NoDrone, Action::AuthorityFile),
    route(Method::Get,   "/api/trust",                   ADMINISTRATOR,  Names::NoDrone, Action::SeeTrust),
    route(Method::Get,   "/api/trust/qr.svg",            ADMINISTRATOR,  Names::NoDrone, Action::TrustCode),
    route(Method::Get,   "/api/session",                 Least::Anybody, Names::NoDrone, Action::SeeSession),
    route(Method::Post,  "/api/claim",                   Least::Anybody, Names::NoDrone, Action::Claim),
    route(Method::Post,  "/api/login",                   Least::Anybody, Names::NoDrone, Action::LogIn),
    route(Method::Post,  "/api/logout",                  VIEWER,         Names::NoDrone, Action::LogOut),
    route(Method::Patch, "/api/session",                 VIEWER,         Names::NoDrone, Action::ChangeLanguage),
    route(Method::Post,  "/api/password",                VIEWER,         Names::NoDrone, Action::ChangePassword),
    route(Method::Get,   "/api/accounts",                ADMINISTRATOR,  Names::NoDrone, Action::ListAccounts),
    route(Method::Post,  "/api/accounts",                ADMINISTRATOR,  Names::NoDrone, Action::AddAccount),
    route(Method::Patch, "/api/accounts/{id}",           ADMINISTRATOR,  Names::NoDrone, Action::ChangeAccount),
    route(Method::Get,   "/api/log",                     ADMINISTRATOR,  Names::NoDrone, Action::ReadLog),
    route(Method::Get,   "/api/drones",                  VIEWER,         Names::NoDrone, Action::ListDrones),
    route(Method::Get,   "/api/drones/{drone}/about",    VIEWER,         Names::InPath,  Action::About),
    route(Method::Get,   "/api/drones/{drone}/plan.png", VIEWER,         Names::InPath,  Action::Plan),
    route(Method::Get,   "/api/drones/{drone}/still.jpg", VIEWER,        Names::InPath,  Action::Still),
    route(Method::Post,  "/api/drones/{drone}/building", INSTALLER,      Names::InPath,  Action::EditBuilding),
    route(Method::Get,   "/api/drones/{drone}/drafts",   INSTALLER,      Names::InPath,  Action::ListDrafts),
    route(Method::Post,  "/api/drones/{drone}/drafts",   INSTALLER,      Names::InPath,  Action::AddDraft),
    route(Method::Get,   "/api/drones/{drone}/drafts/{id}", INSTALLER,   Names::InPath,  Action::ReadDraft),
    route(Method::Post,  "/api/drones/{drone}/drafts/{id}", INSTALLER,   Names::InPath,  Action::MakePlan),
    route(Method::Get,   "/api/drones/{drone}/drafts/{id}/picture", INSTALLER, Names::InPath, Action::DraftPicture),
    route(Method::Get,   "/api/drones/{drone}/drafts/{id}/plan.png", INSTALLER, Names::InPath, Action::DraftPlan),
    route(Method::Post,  "/api/drones/{drone}/drafts/{id}/install", INSTALLER, Names::InPath, Action::InstallDraft),
    route(Method::Get,   "/api/drones/{drone}/rehearsals", INSTALLER,    Names::InPath,  Action::ListRehearsals),
    route(Method::Post,  "/api/drones/{drone}/rehearsals", INSTALLER,    Names::InPath,  Action::Rehearse),
    route(Method::Get,   "/api/drones/{drone}/rehearsals/{id}", INSTALLER, Names::InPath, Action::ReadRehearsal),
    route(Method::Get,   "/api/drones/{drone}/incidents", VIEWER,        Names::InPath,  Action::ListIncidents),
    route(Method::Post,  "/api/drones/{drone}/incidents", GUARD,         Names::InPath,  Action::MarkIncident),
    route(Method::Get,   "/api/drones/{drone}/recordings", GUARD,        Names::InPath,  Action::ListRecordings),
    route(Method::Post,  "/api/drones/{drone}/recordings", GUARD,        Names::InPath,  Action::StartRecording),
    route(Method::Post,  "/api/drones/{drone}/recordings/stop", GUARD,   Names::InPath,  Action::StopRecording),
    route(Method::Get,   "/api/drones/{drone}/recordings/{id}/film.mp4", GUARD, Names::InPath, Action::ReadRecording),
    route(Method::Post,  "/api/drones/{drone}/recordings/{id}/erase", ADMINISTRATOR, Names::InPath, Action::EraseRecording),
    route(Method::Get,   "/api/reports",                 VIEWER,         Names::NoDrone, Action::ListReports),
    route(Method::Get,   "/api/reports/{id}",            VIEWER,         Names::NoDrone, Action::ReadReport),
    route(Method::Get,   "/ws/telemetry",                VIEWER,         Names::InQuery, Action::Telemetry),
    route(Method::Get,   "/ws/sticks",                   GUARD,          Names::InQuery, Action::Sticks),
    route(Method::Get,   "/ws/signal",                   VIEWER,         Names::InQuery, Action::Signal),
];

/// What a page may say on a WebSocket.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Says {
    /// `{"subscribe":[...]}`.
    Subscribe,
    /// One frame of the sticks.
    Frame,
    /// A message of WebRTC.
    Signal,
    /// `{"order":{"verb":...}}` with this verb.
    Order(&'static str),
}

/// A kind of message on a WebSocket.
#[derive(Clone, Copy, Debug)]
pub struct Message {
    /// The socket on which it may come.
    pub socket: Action,
    /// What it is.
    pub says: Says,
    /// Who may say it.
    pub least: Role,
}

const fn message(socket: Action, says: Says, least: Role) -> Message {
    Message { socket, says, least }
}

/// Every message that a page may send.
#[rustfmt::skip]
pub const MESSAGES: &[Message] = &[
    message(Action::Telemetry, Says::Subscribe,               Role::Viewer),
    message(Action::Telemetry, Says::Order("takeoff"),        Role::Guard),
    message(Action::Telemetry, Says::Order("land"),           Role::Guard),
    message(Action::Telemetry, Says::Order("hold"),           Role::Guard),
    message(Action::Telemetry, Says::Order("goto"),           Role::Guard),
    message(Action::Telemetry, Says::Order("patrol-start"),   Role::Guard),
    message(Action::Telemetry, Says::Order("patrol-pause"),   Role::Guard),
    message(Action::Telemetry, Says::Order("patrol-stop"),    Role::Guard),
    message(Action::Telemetry, Says::Order("home"),           Role::Guard),
    message(Action::Telemetry, Says::Order("stop"),           Role::Guard),
    message(Action::Telemetry, Says::Order("cut"),            Role::Guard),
    message(Action::Telemetry, Says::Order("automatic-off"),  Role::Guard),
    message(Action::Telemetry, Says::Order("automatic-on"),   Role::Guard),
    message(Action::Sticks,    Says::Frame,                   Role::Guard),
    message(Action::Sticks,    Says::Order("sticks-take"),    Role::Guard),
    message(Action::Sticks,    Says::Order("sticks-release"), Role::Guard),
    message(Action::Sticks,    Says::Order("stop"),           Role::Guard),
    message(Action::Sticks,    Says::Order("land"),           Role::Guard),
    message(Action::Signal,    Says::Signal,                  Role::Viewer),
];

/// The row for a message that is no order.
#[must_use]
pub fn message_rule(socket: Action, says: Says) -> Option<&'static Message> {
    MESSAGES.iter().find(|row| row.socket == socket && row.says == says)
}

/// The row for an order on this socket, and its verb as the table writes it.
#[must_use]
pub fn order_rule(socket: Action, verb: &str) -> Option<(&'static Message, &'static str)> {
    MESSAGES.iter().find_map(|row| match row.says {
        Says::Order(known) if row.socket == socket && known == verb => Some((row, known)),
        _ => None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn every_verb_of_the_drone_can_be_said_somewhere_and_no_other() {
        let said: BTreeSet<String> = MESSAGES
            .iter()
            .filter_map(|row| match row.says {
                Says::Order(verb) => Some(verb.to_owned()),
                _ => None,
            })
            .collect();
        let known = ipc_types::Verb::ALL.iter().map(|verb| verb.word().replace(' ', "-")).collect();
        assert_eq!(said, known);
    }

    #[test]
    fn no_row_stands_twice() {
        let mut seen = BTreeSet::new();
        for row in ROUTES {
            assert!(seen.insert(format!("{:?} {}", row.method, row.path)), "{}", row.path);
        }
        let mut seen = BTreeSet::new();
        for row in MESSAGES {
            assert!(seen.insert(format!("{:?} {:?}", row.socket, row.says)), "{:?}", row.says);
        }
    }

    #[test]
    fn orders_and_sticks_need_a_guard() {
        for row in MESSAGES {
            if matches!(row.says, Says::Order(_) | Says::Frame) {
                assert!(row.least >= Role::Guard, "{:?}", row.says);
            }
        }
    }
}
