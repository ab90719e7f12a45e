//! A real browser: headless Chromium over its own protocol.

use chromiumoxide::cdp::browser_protocol::emulation::{
    SetDeviceMetricsOverrideParams, SetFocusEmulationEnabledParams,
};
use chromiumoxide::cdp::browser_protocol::page::CaptureScreenshotFormat;
use chromiumoxide::page::ScreenshotParams;
use chromiumoxide::{Browser, BrowserConfig, Page};
use futures_util::StreamExt;
use sereno_tests::programs;
use std::path::PathBuf;
use std::time::{Duration, Instant};

/// A gamepad as browsers show one, moved by `sereno.move(...)`: its timestamp lives while `sereno.alive` is true.
const FAKED_GAMEPAD: &str = r#"
window.sereno = { alive: true, axes: [0, 0, 0, 0], hold: false, frozen: 0 };
navigator.getGamepads = () => [{
  id: "Test pad (STANDARD GAMEPAD)", index: 0, connected: true, mapping: "standard",
  timestamp: window.sereno.alive ? (window.sereno.frozen = performance.now()) : window.sereno.frozen,
  axes: window.sereno.axes,
  buttons: Array.from({ length: 17 }, (_, k) => ({ pressed: k === 5 && window.sereno.hold, touched: false, value: 0 })),
}];
"#;

/// One page in one browser.
pub(crate) struct Guard {
    browser: Browser,
    page: Page,
    _profile: tempfile::TempDir,
}

impl Guard {
    /// Opens `address` in a fresh profile.
    pub(crate) async fn open(address: &str) -> Self {
        let profile = tempfile::tempdir().unwrap();
        let config = BrowserConfig::builder()
            .no_sandbox()
            .user_data_dir(profile.path())
            .window_size(1440, 900)
            .args([
                "--disable-gpu",
                "--disable-quic",
                "--no-first-run",
                "--disable-background-networking",
                "--disable-component-update",
                "--disable-sync",
                "--autoplay-policy=no-user-gesture-required",
            ])
            .build()
            .unwrap();
        let (browser, mut events) = Browser::launch(config).await.expect("is chromium installed?");
        tokio::spawn(async move { while events.next().await.is_some() {} });
        let page = browser.new_page("about:blank").await.unwrap();
        page.evaluate_on_new_document(FAKED_GAMEPAD).await.unwrap();
        page.execute(SetFocusEmulationEnabledParams::new(true)).await.unwrap();
        let guard = Self { browser, page, _profile: profile };
        guard.size(1440, 900).await;
        guard.page.goto(address).await.unwrap();
        guard
    }

    /// The window's size, in the page's own pixels.
    pub(crate) async fn size(&self, width: i64, height: i64) {
        let metrics = SetDeviceMetricsOverrideParams::new(width, height, 1.0, width < 600);
        self.page.execute(metrics).await.unwrap();
    }

    /// What an expression comes to; `Null` when it throws.
    pub(crate) async fn look(&self, expression: &str) -> serde_json::Value {
        let wrapped =
            format!("(() => {{ try {{ return ({expression}) ?? null; }} catch {{ return null; }} }})()");
        match self.page.evaluate(wrapped).await {
            Ok(found) => found.value().cloned().unwrap_or_default(),
            Err(_) => serde_json::Value::Null,
        }
    }

    /// Waits until an expression is true, or says what the page shows instead.
    pub(crate) async fn until(&self, what: &str, expression: &str, patience: Duration) {
        let began = Instant::now();
        while self.look(expression).await != serde_json::Value::Bool(true) {
            if began.elapsed() > patience {
                self.picture("stuck").await;
                let text = self.look("document.body.innerText").await;
                panic!("{what}: not within {} s; the page says: {text}", patience.as_secs());
            }
            tokio::time::sleep(Duration::from_millis(50)).await;
        }
    }

    /// Presses the button that a selector names, as a hand does: only one that is there, enabled and seen.
    pub(crate) async fn press(&self, selector: &str) {
        let found = format!("document.querySelector({selector:?})");
        let ready = format!("!{found}.disabled && {found}.getClientRects().length > 0");
        self.until(&format!("{selector} can be pressed"), &ready, Duration::from_secs(30)).await;
        self.look(&format!("{found}.click()")).await;
    }

    /// Presses the button that bears these words.
    pub(crate) async fn press_words(&self, words: &str) {
        let found = format!(
            "[...document.querySelectorAll('button, a')].find((b) => b.innerText.trim() === {words:?} && b.getClientRects().length > 0)"
        );
        self.until(
            &format!("{words:?} can be pressed"),
            &format!("!{found}.disabled"),
            Duration::from_secs(30),
        )
        .await;
        self.look(&format!("{found}.click()")).await;
    }

    /// Fills the field of a form.
    pub(crate) async fn fill(&self, name: &str, text: &str) {
        let there = format!("document.querySelector('input[name={name}]') !== null");
        self.until(name, &there, Duration::from_secs(30)).await;
        self.look(&format!("document.querySelector('input[name={name}]').value = {text:?}")).await;
    }

    /// Keeps what is seen, for people to look at.
    pub(crate) async fn picture(&self, name: &str) {
        let place: PathBuf = programs().with_file_name("screenshots");
        std::fs::create_dir_all(&place).unwrap();
        let parameters = ScreenshotParams::builder().format(CaptureScreenshotFormat::Png).build();
        let _ = self.page.save_screenshot(parameters, place.join(format!("{name}.png"))).await.unwrap();
    }

    /// Dies as a browser that is killed: nothing is said to anybody.
    pub(crate) async fn kill(mut self) {
        let _ = self.browser.kill().await;
    }

    /// Closes the browser.
    pub(crate) async fn close(mut self) {
        let _ = self.browser.close().await;
        let _ = self.browser.wait().await;
    }
}
