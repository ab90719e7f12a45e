//! What answers the routes that are no sockets.

mod accounts;
mod drones;
mod login;
mod plans;
mod recordings;
mod rehearsals;
mod reports;
mod trust;

use crate::gate::Asked;
use crate::refusal::Refusal;
use crate::table::Action;
use axum::body::Body;
use axum::http::Response;

pub(crate) async fn act(action: Action, asked: Asked) -> Result<Response<Body>, Refusal> {
    match action {
        Action::Index => page(&asked, "index.html"),
        Action::App => {
            let name = asked.path.get("path").map_or("", String::as_str);
            page(&asked, &format!("app/{name}"))
        }
        Action::Trust => trust::page(&asked),
        Action::AuthorityFile => trust::certificate(&asked),
        Action::SeeTrust => Ok(trust::see(&asked)),
        Action::TrustCode => trust::qr(&asked),
        Action::SeeSession => Ok(login::session(&asked)),
        Action::Claim => login::claim(asked).await,
        Action::LogIn => login::log_in(asked).await,
        Action::LogOut => login::log_out(asked).await,
        Action::ChangeLanguage => accounts::language(asked).await,
        Action::ChangePassword => login::change_password(asked).await,
        Action::ListAccounts => Ok(accounts::list(&asked)),
        Action::AddAccount => accounts::add(asked).await,
        Action::ChangeAccount => accounts::change(asked).await,
        Action::ReadLog => accounts::log(asked).await,
        Action::ListDrones => drones::list(&asked),
        Action::About => drones::about(asked).await,
        Action::Plan => drones::plan(asked).await,
        Action::Still => drones::still(asked).await,
        Action::EditBuilding => plans::edit(asked).await,
        Action::ListDrafts => plans::list(asked).await,
        Action::AddDraft => plans::add(asked).await,
        Action::ReadDraft => plans::read(asked).await,
        Action::MakePlan => plans::make(asked).await,
        Action::DraftPicture => plans::picture(asked).await,
        Action::DraftPlan => plans::plan(asked).await,
        Action::InstallDraft => plans::install(asked).await,
        Action::ListRehearsals => Ok(rehearsals::list(&asked)),
        Action::Rehearse => rehearsals::begin(asked).await,
        Action::ReadRehearsal => rehearsals::read(&asked),
        Action::MarkIncident => drones::mark(asked).await,
        Action::ListIncidents => drones::incidents(asked).await,
        Action::ListRecordings => recordings::list(asked).await,
        Action::StartRecording => recordings::start(asked).await,
        Action::StopRecording => recordings::stop(asked).await,
        Action::ReadRecording => recordings::film(asked).await,
        Action::EraseRecording => recordings::erase(asked).await,
        Action::ListReports => reports::list(asked).await,
        Action::ReadReport => reports::read(asked).await,
        Action::Telemetry | Action::Sticks | Action::Signal => Err(Refusal::bad("this is a WebSocket")),
    }
}

fn page(asked: &Asked, name: &str) -> Result<Response<Body>, Refusal> {
    asked.app.page.answer(name, &asked.headers).ok_or_else(|| Refusal::missing("there is no such file"))
}

/// Longest name, surname, e-mail address and drone's name.
const NAME_BYTES: usize = 120;

/// A name as a person writes it: not empty, not long, on one line.
fn plain(what: &str, text: &str) -> Result<String, Refusal> {
    let text = text.trim();
    if text.is_empty() || text.len() > NAME_BYTES || text.chars().any(char::is_control) {
        return Err(Refusal::bad(format!("{what}: 1 to {NAME_BYTES} bytes on one line")));
    }
    Ok(text.to_owned())
}

/// An e-mail address: what is before and after one `@`. Whether post arrives there, nobody asks.
fn email(text: &str) -> Result<String, Refusal> {
    let text = plain("email", text)?;
    let good = text
        .split_once('@')
        .is_some_and(|(user, host)| !user.is_empty() && !host.is_empty() && !host.contains('@'))
        && !text.contains(char::is_whitespace);
    if good { Ok(text) } else { Err(Refusal::bad("email: an address like ana@example.org")) }
}

fn language(text: &str) -> Result<String, Refusal> {
    if matches!(text, "es" | "en") { Ok(text.to_owned()) } else { Err(Refusal::bad("language: es or en")) }
}
