//! The table as a page for people: `docs/failsafes.md`.

use super::condition::{Condition, Loss, Stage};
use super::policy::{OperatorLost, Policy};
use super::table::{Clears, Row, TABLE};
use super::{Action, Evidence, Memory, TakeOver, judge};
use core::fmt::{self, Write};

/// A condition in words, with its numbers.
fn words(condition: Condition, p: &Policy) -> String {
    match condition {
        Condition::NavigationSilent => {
            "following navigation, which has no setpoint that has not expired".into()
        }
        Condition::OperatorSilent => {
            "who held the sticks is not heard, and nobody has taken over or ordered anything since".into()
        }
        Condition::SideSonarSilent => "a side sonar has given nothing for two of its turns".into(),
        Condition::AllSonarsSilent => "no side sonar has given anything for two of its turns".into(),
        Condition::PoseUncertain => format!(
            "the pose is older than {} s (`pose_stale_s`), not tracked, P(lost) > {} % (`p_lost`) or sigma > {} m (`sigma_m`)",
            p.pose_stale_s,
            p.p_lost * 100.0,
            p.sigma_m
        ),
        Condition::FewWalls => {
            "the pose is uncertain, nothing holds the velocity, fewer than two walls in echo".into()
        }
        Condition::Adrift => "the pose is uncertain and nothing holds the velocity".into(),
        Condition::HomeUncovered => format!(
            "the charge left does not cover the way home through the corridors + {} % (`home_reserve`)",
            p.home_reserve * 100.0
        ),
        Condition::ChargeUnknown => format!(
            "volts or charge drawn are not told, or older than {} s (`power_stale_s`), or no way home is known",
            p.power_stale_s
        ),
        Condition::CellLow => format!("under {} V a cell (`return_volts`)", p.return_volts),
        Condition::CellEmpty => format!("under {} V a cell (`land_volts`)", p.land_volts),
        Condition::HeightSilent => "no believable range of what is below".into(),
        Condition::LinkSilent => format!(
            "`flight` says that the controller is silent, or nothing for {} s (`link_stale_s`)",
            p.link_stale_s
        ),
        Condition::TiltedOver => format!("tilt over {} degrees (`tilt_deg`)", p.tilt_deg),
        Condition::Searching => {
            "in the air, and the plan is being searched for the place; a hover or a search move is flown"
                .into()
        }
        Condition::LandOrdered => "the operator's order to land stands".into(),
    }
}

/// What is done, in words.
fn sentence(action: Action) -> &'static str {
    match action {
        Action::None => "nothing; it is told",
        Action::Hover => "stop and hover; without a height the learned throttle is held",
        Action::Return => "fly home and land, by navigation's route behind the shield",
        Action::Land => "land here, holding the place as far as it is known",
        Action::Descend => "come down level, without position control",
        Action::Cut => "stop the motors",
    }
}

fn condition(row: &Row, p: &Policy) -> String {
    let all: Vec<String> = row.conditions.iter().map(|condition| words(*condition, p)).collect();
    let mut text = all.join("; and ");
    if let Some(answer) = row.only {
        text = format!("{text} (with `operator_lost = \"{}\"`)", answer.word());
    }
    text
}

fn after(row: &Row, p: &Policy) -> String {
    match row.after.key {
        "" => "at once".into(),
        key => format!("{} s (`{key}`)", (row.after.seconds)(p)),
    }
}

fn clears(row: &Row, p: &Policy) -> String {
    let each = row.conditions.iter().map(|condition| match condition.clear(p) {
        Some((seconds, key)) => format!("{seconds} s without it (`{key}`)"),
        None => "at once".into(),
    });
    let gone = each.collect::<Vec<_>>().join(" or ");
    match row.clears {
        Clears::Gone => gone,
        Clears::Landed => format!("on the ground, motors off; before it has acted: {gone}"),
    }
}

fn rows(out: &mut String, p: &Policy) -> fmt::Result {
    writeln!(
        out,
        "| cause | condition | after | action | clears | may a human take over | take-off |\n|---|---|---|---|---|---|---|"
    )?;
    let mut sorted: Vec<&Row> = TABLE.iter().collect();
    sorted.sort_by_key(|row| (row.cause, row.action));
    for row in sorted {
        writeln!(
            out,
            "| {} | {} | {} | {} | {} | {} | {} |",
            row.cause.words(),
            condition(row, p),
            after(row, p),
            row.action.word(),
            clears(row, p),
            row.take_over.words(),
            if row.cause.refuses_arming() { "refused" } else { "" }
        )?;
    }
    Ok(())
}

/// What the loss ends in when all else is well.
fn end_of(loss: Loss, stage: Stage, policy: &Policy) -> Action {
    let evidence = if loss.matters(stage) {
        Evidence::new(stage).with(loss.condition(), f32::INFINITY)
    } else {
        Evidence::new(stage)
    };
    // Who holds the sticks holds them already.
    let (_, memory) = judge(&Evidence::new(stage), &Memory::default(), policy);
    judge(&evidence, &memory, policy).0.action
}

fn losses(out: &mut String, p: &Policy) -> fmt::Result {
    writeln!(out, "| lost for good | in a hover | following navigation | by hand |\n|---|---|---|---|")?;
    for loss in Loss::ALL {
        let end = |stage| end_of(*loss, stage, p).word();
        writeln!(
            out,
            "| {} | {} | {} | {} |",
            loss.words(),
            end(Stage::Airborne),
            end(Stage::Autonomous),
            end(Stage::Manual)
        )?;
    }
    Ok(())
}

fn write(out: &mut String, p: &Policy) -> fmt::Result {
    writeln!(
        out,
        "# Failsafes\n\n\
         Printed from `services/lib/control/src/failsafe/table.rs` by\n\
         `cargo run -p control --example failsafes > docs/failsafes.md`; a test compares. Numbers are the defaults; each\n\
         stands under `[failsafe]` in `deploy/config/pilot.toml`, with its bounds.\n"
    )?;
    rows(out, p)?;
    writeln!(
        out,
        "\nIn the air the most severe action of all rows that hold wins, and between equal actions the cause farther down is\n\
         named. On the ground nothing acts; what is marked *refused* keeps the drone there.\n"
    )?;
    for action in Action::ALL {
        writeln!(out, "- **{}**: {}.", action.word(), sentence(*action))?;
    }
    writeln!(
        out,
        "\n**Clears.** A row ends when one of its conditions has gone for long enough. One that says *on the ground* has begun\n\
         something that is not called back: a landing, a way home on a battery that does not fill up in the air, a cut. When\n\
         its conditions go, a *{}* becomes a *{}*: it is still a landing, and the place is held again.\n",
        Action::Descend.word(),
        Action::Descend.kept().word()
    )?;
    writeln!(
        out,
        "**Taking over.** A take-over always stops the drone first. *{}*: the cause ends with it, or does not concern who\n\
         flies by hand. *{}*: the cause may go on; it acts again when it has gone and comes anew. *{}*: what the\n\
         sticks are flown by has failed, or there is no time left; that wins over every other row. Who holds the sticks when\n\
         a row of the last two kinds begins to act, or who is silent for `operator_lease_s`, holds them no longer.\n",
        TakeOver::Yes.words(),
        TakeOver::AfterStop.words(),
        TakeOver::No.words()
    )?;
    writeln!(
        out,
        "When the pilot itself is silent, `flight` levels and comes down by its own ladder: `services/flight/src/ladder.rs`.\n\n\
         ## If it were lost now\n\n\
         What the loss of one thing ends in when all else is well (`operator_lost = \"{}\"`). `pilot/state` says the same of\n\
         the flight as it is, with all that is wrong already.\n",
        OperatorLost::default().word()
    )?;
    losses(out, p)?;
    writeln!(
        out,
        "\n## How well it is tested\n\n\
         cargo-mutants 27 breaks the table in every small way and lists what no test notices. The million random flights are\n\
         left out, since they take seconds for each mutant.\n\n\
         ```sh\n\
         cargo mutants -p control -f 'services/lib/control/src/failsafe*' -f 'services/lib/control/src/failsafe/*' \\\n  \
         -- --test failsafe -- --skip sequences\n\
         ```"
    )
}

/// `docs/failsafes.md` for these numbers.
#[must_use]
pub fn page(policy: &Policy) -> String {
    let mut out = String::new();
    // A string takes whatever is written into it.
    let _ = write(&mut out, policy);
    out
}
