//! `sereno`, the command an operator or developer types.
#![allow(clippy::print_stdout, reason = "printing is what a command line is for")]

mod arguments;
mod certs;
mod check;
mod demo;
mod kills;
mod live;
mod operate;
mod rehearse;
mod remote;
mod room;
mod schema;
mod system;
mod topic;
mod trust;

use arguments::{Arguments, Verb};
use clap::Parser;
use std::process::ExitCode;

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    let place = &arguments.place;
    let json = arguments.json;
    if let Some(file) = &arguments.remote {
        return ended(far(file, &arguments));
    }
    let done = match &arguments.verb {
        Verb::Up(up) => system::up(place, up, json),
        Verb::Ps => system::ps(place, json),
        Verb::Reload => system::reload(place, json),
        Verb::Restart { service, in_flight } => system::restart(place, service, *in_flight, json),
        Verb::Hold { service: Some(service), in_flight } => system::hold(place, service, *in_flight, json),
        Verb::Hold { service: None, .. } => operate::give(place, operate::Order::Hold, json),
        Verb::Release { service } => system::release(place, service, json),
        Verb::Logs { service, lines } => system::logs(place, service, *lines, json),
        Verb::Down { now } => system::down(place, *now, json),
        Verb::Takeoff => operate::give(place, operate::Order::TakeOff, json),
        Verb::Land => operate::give(place, operate::Order::Land, json),
        Verb::Home => operate::give(place, operate::Order::Home, json),
        Verb::Goto { x, y } => {
            operate::Order::goto(*x, *y).and_then(|order| operate::give(place, order, json))
        }
        Verb::Patrol { order } => operate::give(place, (*order).into(), json),
        Verb::Stop => operate::give(place, operate::Order::Stop, json),
        Verb::Cut { yes_it_falls } => {
            operate::Order::cut(*yes_it_falls).and_then(|order| operate::give(place, order, json))
        }
        Verb::Automatic { switch } => operate::give(place, (*switch).into(), json),
        Verb::Topic { order } => topic::run(place, order, json),
        Verb::Foxglove(_) => Err(anyhow::anyhow!(
            "foxglove needs --remote FILE.json5, which `sereno certs client NAME` writes"
        )),
        Verb::Certs(certs) => certs::run(place, certs, json),
        Verb::Schema => schema::run(),
        Verb::Graph => check::graph(place, json),
        Verb::Check => check::check(place, json),
        Verb::Rehearse(rehearse) => rehearse::run(place, rehearse, json),
        Verb::Demo(demo) => demo::run(place, demo, json),
    };
    ended(done)
}

fn ended(done: anyhow::Result<ExitCode>) -> ExitCode {
    match done {
        Ok(code) => code,
        Err(error) => {
            // `{:#}` is the whole chain of causes in one line.
            eprintln!("sereno: {error:#}");
            ExitCode::FAILURE
        }
    }
}

/// The commands that a drone obeys over the network.
fn far(file: &std::path::Path, arguments: &Arguments) -> anyhow::Result<ExitCode> {
    use operate::Order;
    let json = arguments.json;
    let order = match &arguments.verb {
        Verb::Foxglove(order) => return live::run(&connect(file, arguments)?, order, json),
        Verb::Topic { order } => {
            let remote = connect(file, arguments)?;
            return remote::topic(&remote, order, json);
        }
        Verb::Takeoff => Order::TakeOff,
        Verb::Land => Order::Land,
        Verb::Home => Order::Home,
        Verb::Hold { service: None, .. } => Order::Hold,
        Verb::Goto { x, y } => Order::goto(*x, *y)?,
        Verb::Patrol { order } => (*order).into(),
        Verb::Stop => Order::Stop,
        Verb::Cut { yes_it_falls } => Order::cut(*yes_it_falls)?,
        Verb::Automatic { switch } => (*switch).into(),
        _ => anyhow::bail!(
            "this command is for the machine of the drone; over the network there are topic, foxglove, takeoff, land, hold, goto, \
             home, patrol, stop, cut and automatic"
        ),
    };
    remote::give(&connect(file, arguments)?, order, json)
}

fn connect(file: &std::path::Path, arguments: &Arguments) -> anyhow::Result<bridge::remote::Remote> {
    bridge::threads::ensure().map_err(anyhow::Error::msg)?;
    bridge::remote::Remote::connect(file, arguments.drone.as_deref()).map_err(anyhow::Error::msg)
}
