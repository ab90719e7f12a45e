//! `sereno`, the command an operator or developer types.
#![allow(clippy::print_stdout, reason = "printing is what a command line is for")]

mod arguments;
mod check;
mod demo;
mod kills;
mod operate;
mod rehearse;
mod system;
mod topic;

use arguments::{Arguments, Verb};
use clap::Parser;
use std::process::ExitCode;

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    let place = &arguments.place;
    let json = arguments.json;
    let done = match &arguments.verb {
        Verb::Up(up) => system::up(place, up, json),
        Verb::Ps => system::ps(place, json),
        Verb::Restart { service, in_flight } => system::restart(place, service, *in_flight, json),
        Verb::Hold { service: Some(service), in_flight } => system::hold(place, service, *in_flight, json),
        Verb::Hold { service: None, .. } => operate::give(place, operate::Order::Hold, json),
        Verb::Release { service } => system::release(place, service, json),
        Verb::Logs { service, lines } => system::logs(place, service, *lines, json),
        Verb::Down { now } => system::down(place, *now, json),
        Verb::Takeoff => operate::give(place, operate::Order::TakeOff, json),
        Verb::Land => operate::give(place, operate::Order::Land, json),
        Verb::Home => operate::give(place, operate::Order::Home, json),
        Verb::Goto { x, y } => operate::give(place, operate::Order::GoTo(*x, *y), json),
        Verb::Patrol { order } => operate::give(place, (*order).into(), json),
        Verb::Stop => operate::give(place, operate::Order::Stop, json),
        Verb::Cut { yes_it_falls } => operate::cut(place, *yes_it_falls, json),
        Verb::Automatic { switch } => operate::give(place, (*switch).into(), json),
        Verb::Topic { order } => topic::run(place, order, json),
        Verb::Graph => check::graph(place, json),
        Verb::Check => check::check(place, json),
        Verb::Rehearse(rehearse) => rehearse::run(place, rehearse, json),
        Verb::Demo(demo) => demo::run(place, demo, json),
    };
    match done {
        Ok(code) => code,
        Err(error) => {
            // `{:#}` is the whole chain of causes in one line.
            eprintln!("sereno: {error:#}");
            ExitCode::FAILURE
        }
    }
}
