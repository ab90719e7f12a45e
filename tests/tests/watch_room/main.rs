//! The watch room as a guard has it: a real browser on the page of a real console, on a system of processes that flies in the
//! simulator. Screenshots are left in `target/screenshots`.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::print_stdout, reason = "tests")]

mod browser;
mod recording;
mod rig;

use browser::Guard;
use ipc_types::{Phase, PilotState, SticksState, Truth};
use rig::{LONG, Rig, wait_until};
use runtime::{Input, Tool};
use std::time::{Duration, Instant};

const PASSWORD: &str = "a lamp and a bunch of keys";

/// What the drone says of itself, and the truth.
struct Witness {
    tool: Tool,
    state: Input<PilotState>,
    truth: Input<Truth>,
    pilot: PilotState,
    at: Truth,
}

impl Witness {
    fn open(rig: &Rig) -> Self {
        let (manifest, run_dir) = rig.manifest();
        let mut tool = Tool::join("cli", manifest, &run_dir).unwrap();
        let (state, truth) = (tool.ports.input().unwrap(), tool.ports.input().unwrap());
        Self { tool, state, truth, pilot: PilotState::default(), at: Truth::default() }
    }

    fn look(&mut self) -> (Option<Phase>, Option<SticksState>) {
        self.tool.tick();
        while let Some(state) = self.state.receive() {
            self.pilot = *state;
        }
        while let Some(truth) = self.truth.receive() {
            self.at = *truth;
        }
        (Phase::from_code(self.pilot.phase), SticksState::from_code(self.pilot.sticks))
    }

    fn look_yaw(&mut self) -> f32 {
        wait_until("the truth is told", || {
            self.look();
            self.at.header.sequence > 0
        });
        self.at.yaw_rad
    }

    fn wait_phase(&mut self, phase: Phase) {
        wait_until(&format!("the pilot is in phase {phase}"), || self.look().0 == Some(phase));
    }

    fn wait_sticks(&mut self, sticks: SticksState) {
        wait_until(&format!("the sticks are {sticks}"), || self.look().1 == Some(sticks));
    }

    fn speed(&self) -> f32 {
        self.at.velocity_x_m_s.hypot(self.at.velocity_y_m_s)
    }
}

/// Takes the sticks and holds the button, as a patient human does: on a loaded machine the page may be silent for a moment, and
/// then the drone wants the sticks let go once more, or taken again. Until `holds` is true while the drone follows.
async fn fly_by_hand(
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
async fn start_round(guard: &Guard, drone: &mut Witness) {
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

async fn claim(guard: &Guard, rig: &Rig) {
    guard.fill("code", &rig.claim).await;
    guard.fill("name", "Ana").await;
    guard.fill("surname", "Sereno").await;
    guard.fill("email", "ana@example.org").await;
    guard.fill("password", PASSWORD).await;
    guard.picture("claim").await;
    guard.press("form button[type=submit]").await;
}

/// The whole story of the issue: claim, watch, start a round, take over, fly, release, land, read the report.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_guard_claims_watches_orders_takes_over_and_reads_the_report() {
    let rig = Rig::start();
    let mut drone = Witness::open(&rig);
    let guard = Guard::open(&rig.address).await;
    claim(&guard, &rig).await;
    start_round(&guard, &mut drone).await;
    guard.until("the page says that it flies", "document.body.innerText.includes('Flying')", LONG).await;
    guard.picture("round-desk").await;
    guard.size(390, 844).await;
    guard.picture("round-phone").await;
    guard.size(1440, 900).await;

    // Taking over: it stops, the sticks are in the middle, it follows while the button is held.
    guard.press_words("Sticks").await;
    let before = drone.look_yaw();
    // Turning is free wherever it stands.
    fly_by_hand(&guard, &mut drone, "[0.8, 0, 0, 0]", |drone| (drone.at.yaw_rad - before).sin().abs() > 0.3)
        .await;
    assert_eq!(drone.look().0, Some(Phase::Manual));
    guard.picture("by-hand").await;
    // Frozen: the pad still says the same, and nothing new comes of it.
    guard.look("sereno.alive = false").await;
    tokio::task::block_in_place(|| {
        wait_until("it follows no more", || drone.look().1 != Some(SticksState::Following));
    });
    guard.look("(sereno.alive = true, sereno.axes = [0, 0, 0, 0])").await;
    tokio::task::block_in_place(|| {
        wait_until("it hovers", || {
            drone.look();
            drone.speed() < 0.25
        });
    });
    guard.look("sereno.hold = false").await;
    // The silence may have lasted for the second that ends a lease.
    guard.look("document.querySelector('.sticks-release').click()").await;
    tokio::task::block_in_place(|| drone.wait_sticks(SticksState::Free));
    assert_eq!(drone.look().0, Some(Phase::Hover), "nothing resumes by itself");

    guard.press_words("Land").await;
    tokio::task::block_in_place(|| drone.wait_phase(Phase::Grounded));
    // The list is read when it is opened, and the report is written when the drone has come to rest.
    let listed = "document.querySelector('#view a[href^=\"#/reports/\"]') !== null";
    let began = Instant::now();
    while guard.look(listed).await != serde_json::Value::Bool(true) {
        assert!(began.elapsed() < LONG, "no report: {}", guard.look("document.body.innerText").await);
        guard.look("location.hash = '#/password'").await;
        tokio::time::sleep(Duration::from_millis(300)).await;
        guard.look("location.hash = '#/reports'").await;
        tokio::time::sleep(Duration::from_secs(1)).await;
    }
    guard.look("document.querySelector('#view a[href^=\"#/reports/\"]').click()").await;
    guard.until("the report is read", "document.querySelector('#view').innerText.includes('%')", LONG).await;
    guard.picture("report").await;
    guard.close().await;
}

/// A browser that dies while it flies: hovering 300 ms after the last input, the lease gone at a second (DESIGN 4, and a step
/// of each of the pilot and whoever tells).
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_browser_that_dies_lets_the_drone_hover_and_holds_nothing() {
    let rig = Rig::start();
    let mut drone = Witness::open(&rig);
    let guard = Guard::open(&rig.address).await;
    claim(&guard, &rig).await;
    start_round(&guard, &mut drone).await;
    guard.press_words("Sticks").await;
    fly_by_hand(&guard, &mut drone, "[0, 0, 0, 0]", |_| true).await;
    let died = Instant::now();
    guard.kill().await;
    // The state may be passed between two looks: at the latest it ends the lease.
    tokio::task::block_in_place(|| {
        wait_until("it follows no more", || drone.look().1 != Some(SticksState::Following));
    });
    let silent = died.elapsed();
    tokio::task::block_in_place(|| drone.wait_sticks(SticksState::Free));
    let free = died.elapsed();
    println!("silent {silent:?}, free {free:?} after the browser was killed");
    assert!(free >= Duration::from_millis(500), "a lease outlives a hiccup");
    assert_eq!(drone.look().0, Some(Phase::Hover));
}

/// A browser without H.264 says so in words, and shows a still a second with its age in place of the video.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_browser_without_h264_is_shown_stills_and_told_why() {
    let rig = Rig::start();
    let guard = Guard::open(&rig.address).await;
    let vp8 = "{ codecs: [{ mimeType: 'video/VP8', clockRate: 90000 }], headerExtensions: [] }";
    guard.look(&format!("(RTCRtpReceiver.getCapabilities = () => ({vp8}), true)")).await;
    claim(&guard, &rig).await;
    let image = "document.querySelector('.video-stage img')";
    guard.until("a still is shown", &format!("{image}.naturalWidth === 640 && !{image}.hidden"), LONG).await;
    let says = |words: &str| format!("document.querySelector('.video-panel').innerText.includes({words:?})");
    guard.until("it says why", &says("no decoder for H.264"), LONG).await;
    guard.until("and how old the picture is", &says(" s old"), LONG).await;
    guard.look(&format!("(sereno.first = {image}.src)")).await;
    let another = format!("sereno.first !== {image}.src && {image}.naturalWidth === 640");
    guard.until("the next still comes", &another, LONG).await;
    assert_eq!(guard.look("document.querySelector('.video-stage video').hidden").await, true);
    guard.picture("stills-desk").await;
    guard.size(390, 844).await;
    guard.picture("stills-phone").await;
    guard.close().await;
}
