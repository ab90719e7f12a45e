//! The watch room as a guard has it: a real browser on the page of a real console, on a system of processes that flies in the
//! simulator. Screenshots are left in `target/screenshots`.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::print_stdout, reason = "tests")]

mod browser;
mod hand;
mod recording;
mod rig;

use browser::Guard;
use hand::{Witness, claim, fly_by_hand, start_round};
use ipc_types::{Phase, SticksState};
use rig::{LONG, Rig, wait_until};
use std::time::{Duration, Instant};

/// Pictures of the drone's camera come out of the browser's decoder, one after another.
async fn video_decodes(guard: &Guard) {
    let video = "document.querySelector('.video-stage video')";
    let frames = format!("{video}.getVideoPlaybackQuality().totalVideoFrames");
    let seen = format!("!{video}.hidden && {video}.videoWidth > 0 && {frames} > 0");
    guard.until("a picture is decoded", &seen, LONG).await;
    let first = guard.look(&frames).await.as_u64().unwrap();
    // Two seconds of the slowest pace that the page asks for.
    let grows = format!("{frames} >= {first} + 30 && {video}.currentTime > 0");
    guard.until("picture after picture is decoded", &grows, LONG).await;
}

/// The whole story of the issue: claim, watch, start a round, take over, fly, release, land, read the report.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_guard_claims_watches_orders_takes_over_and_reads_the_report() {
    let rig = Rig::start();
    let mut drone = Witness::open(&rig);
    let guard = Guard::open(&rig.address).await;
    claim(&guard, &rig).await;
    video_decodes(&guard).await;
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
