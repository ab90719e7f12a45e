//! What the drone sees is recorded from the page and played in it to its end.

use crate::browser::Guard;
use crate::rig::{LONG, Rig};

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_guard_records_and_plays_what_was_seen_to_its_end() {
    let rig = Rig::start();
    let guard = Guard::open(&rig.address).await;
    crate::hand::claim(&guard, &rig).await;
    guard.press(".record-button").await;
    let bar = "document.querySelector('.record-bar')";
    guard.until("the page says that it records", &format!("{bar}.dataset.on === 'true'"), LONG).await;
    // The list says it once the first key frame has come.
    guard.look("location.hash = '#/recordings'").await;
    guard.until("a file is being written", "document.querySelectorAll('tbody tr').length === 1", LONG).await;
    guard.look("location.hash = '#/'").await;
    let seconds = "Number(document.querySelector('.record-time').textContent.split(':')[1])";
    guard.until("some seconds are recorded", &format!("{seconds} >= 6 && {seconds} < 60"), LONG).await;
    guard.picture("recording").await;
    guard.press(".record-button").await;
    guard.until("it has ended", &format!("{bar}.dataset.on === 'false'"), LONG).await;
    guard.look("location.hash = '#/recordings'").await;
    guard.until("it can be erased", "document.querySelector('tbody .danger') !== null", LONG).await;
    guard.picture("recordings-desk").await;
    guard.size(390, 844).await;
    guard.picture("recordings-phone").await;
    guard.size(1440, 900).await;
    guard.press("tbody button").await;
    let film = "document.querySelector('dialog .film')";
    guard.until("its length is known", &format!("{film}.duration > 1 && {film}.duration < 3600"), LONG).await;
    guard.until("it is played to its end", &format!("{film}.ended && {film}.videoWidth > 0"), LONG).await;
    guard.picture("recording-played").await;
    guard.press("dialog .icon-button").await;
    guard.press("tbody .danger").await;
    guard.press("dialog button[type=submit]").await;
    guard.until("it is erased", "document.querySelectorAll('tbody tr').length === 0", LONG).await;
    guard.close().await;
}
