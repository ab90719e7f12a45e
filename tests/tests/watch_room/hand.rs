//! A guard's hand on the page, and what the drone makes of it.

use crate::browser::Guard;
use crate::rig::{LONG, Rig, wait_until};
use ipc_types::{Phase, PilotState, SticksState, Truth};
use runtime::{Input, Tool};
use std::time::{Duration, Instant};

const EMAIL: &str = "ana@example.org";
const PASSWORD: &str = "a lamp and a bunch of keys";

/// What the drone says of itself, and the truth.
pub(crate) struct Witness {
    tool: Tool,
    state: Input<PilotState>,
    truth: Input<Truth>,
    /// The pilot's newest state.
    pub(crate) pilot: PilotState,
    /// Where it truly is.
    pub(crate) at: Truth,
}

impl Witness {
    pub(crate) fn open(rig: &Rig) -> Self {
        let (manifest, run_dir) = rig.manifest();
        let mut tool = Tool::join("cli", manifest, &run_dir).unwrap();
        let (state, truth) = (tool.ports.input().unwrap(), tool.ports.input().unwrap());
        Self { tool, state, truth, pilot: PilotState::default(), at: Truth::default() }
    }

    /// The newest phase, and what the sticks are.
    pub(crate) fn look(&mut self) -> (Option<Phase>, Option<SticksState>) {
        self.tool.tick();
        while let Some(state) = self.state.receive() {
            self.pilot = *state;
        }
        while let Some(truth) = self.truth.receive() {
            self.at = *truth;
        }
        (Phase::from_code(self.pilot.phase), SticksState::from_code(self.pilot.sticks))
    }

    pub(crate) fn look_yaw(&mut self) -> f32 {
        wait_until("the truth is told", || {
            self.look();
            self.at.header.sequence > 0
        });
        self.at.yaw_rad
    }

    pub(crate) fn wait_phase(&mut self, phase: Phase) {
        wait_until(&format!("the pilot is in phase {phase}"), || self.look().0 == Some(phase));
    }

    pub(crate) fn wait_sticks(&mut self, sticks: SticksState) {
        wait_until(&format!("the sticks are {sticks}"), || self.look().1 == Some(sticks));
    }

    pub(crate) fn speed(&self) -> f32 {
        self.at.velocity_x_m_s.hypot(self.at.velocity_y_m_s)
    }
}

/// Takes the sticks and holds the button, as a patient human does: on a loaded machine the page may be silent for a moment, and
/// then the drone wants the sticks let go once more, or taken again. Until `holds` is true while the drone follows.
pub(crate) async fn fly_by_hand(
    guard: &Guard,
    drone: &mut Witness,
    axes: &str,
    mut holds: impl FnMut(&Witness) -> bool,
) {
    let began = Instant::now();
    loop {
        let (_, sticks) = drone.look();
        match sticks {
            Some(SticksState::Free) => {
                guard.look("(sereno.hold = false, sereno.axes = [0, 0, 0, 0])").await;
                let take = "document.querySelector('.sticks-take')";
                guard.look(&format!("!{take}.disabled && {take}.click()")).await;
            }
            Some(SticksState::Following) => {
                guard.look(&format!("sereno.axes = {axes}")).await;
                if holds(drone) {
                    return;
                }
            }
            _ => {
                guard.look("(sereno.hold = true, sereno.axes = [0, 0, 0, 0])").await;
            }
        }
        assert!(began.elapsed() < LONG, "by hand: the sticks are {sticks:?}");
        tokio::time::sleep(Duration::from_millis(30)).await;
    }
}

/// Starts the round by the page's one button for it, again while the controller has not got through its boot (5 s, FACTS 1).
pub(crate) async fn start_round(guard: &Guard, drone: &mut Witness) {
    let began = Instant::now();
    loop {
        match drone.look().0 {
            Some(Phase::Autonomous) => return,
            Some(Phase::Grounded) => {
                let button = "document.querySelector('.dock-primary')";
                guard
                    .look(&format!(
                        "!{button}.disabled && {button}.innerText.includes('Start round') && {button}.click()"
                    ))
                    .await;
                tokio::time::sleep(Duration::from_secs(1)).await;
            }
            _ => {}
        }
        assert!(
            began.elapsed() < LONG,
            "the round does not start: {}",
            guard.look("document.body.innerText").await
        );
        tokio::time::sleep(Duration::from_millis(50)).await;
    }
}

/// Claims the console for its first administrator.
pub(crate) async fn claim(guard: &Guard, rig: &Rig) {
    guard.fill("code", &rig.claim).await;
    guard.fill("name", "Ana").await;
    guard.fill("surname", "Sereno").await;
    guard.fill("email", EMAIL).await;
    guard.fill("password", PASSWORD).await;
    guard.picture("claim").await;
    guard.press("form button[type=submit]").await;
}

/// Logs in who has claimed it.
#[allow(dead_code, reason = "of who opens several browsers one after another")]
pub(crate) async fn log_in(guard: &Guard) {
    guard.fill("email", EMAIL).await;
    guard.fill("password", PASSWORD).await;
    guard.press("form button[type=submit]").await;
}
