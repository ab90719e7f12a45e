//! The console process.

use console::{Console, ConsoleConfig, Page, SystemClock, claim_again};
use std::io::Write;
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;
use std::time::Duration;
use tokio::signal::unix::{SignalKind, signal};

const USAGE: &str = "usage: sereno-console --config FILE [--data DIR] [--web DIR] [--claim]

  --config FILE  the configuration (deploy/config/console.toml)
  --data DIR     where accounts, logs and reports are kept, in place of what the file says
  --web DIR      serve the page from this folder, not from the binary: for who writes the page
  --claim        print a fresh claim code for a console that nobody has claimed, and end
";

#[derive(Default)]
struct Arguments {
    config: Option<PathBuf>,
    data: Option<PathBuf>,
    web: Option<PathBuf>,
    claim: bool,
}

fn arguments() -> Result<Option<Arguments>, String> {
    let mut found = Arguments::default();
    let mut words = std::env::args_os().skip(1);
    while let Some(word) = words.next() {
        let word = word.to_string_lossy().into_owned();
        let mut file = || words.next().map(PathBuf::from).ok_or_else(|| format!("{word} needs a path"));
        match word.as_str() {
            "--config" => found.config = Some(file()?),
            "--data" => found.data = Some(file()?),
            "--web" => found.web = Some(file()?),
            "--claim" => found.claim = true,
            "--help" | "-h" => return Ok(None),
            other => return Err(format!("{other:?} is no argument\n\n{USAGE}")),
        }
    }
    Ok(Some(found))
}

fn main() -> ExitCode {
    if let Err(sentence) = console::threads::ensure() {
        // Nothing can be done when stderr is closed.
        let _ = writeln!(std::io::stderr(), "sereno-console: {sentence}");
        return ExitCode::FAILURE;
    }
    // What zenoh says below a warning is not for who runs a console.
    tracing_subscriber::fmt()
        .with_max_level(tracing::Level::WARN)
        .with_writer(std::io::stderr)
        .with_ansi(false)
        .init();
    match run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            // Nothing can be done when stderr is closed.
            let _ = writeln!(std::io::stderr(), "sereno-console: {error}");
            ExitCode::FAILURE
        }
    }
}

fn say(line: &str) {
    // Nobody may read it: a closed pipe is no reason to stop watching.
    let _ = writeln!(std::io::stdout(), "{line}").and_then(|()| std::io::stdout().flush());
}

fn run() -> Result<(), String> {
    let Some(arguments) = arguments()? else {
        say(USAGE);
        return Ok(());
    };
    let path = arguments.config.ok_or_else(|| format!("--config is missing\n\n{USAGE}"))?;
    let mut config = ConsoleConfig::read(&path).map_err(|error| error.to_string())?;
    if let Some(data) = arguments.data {
        config.data = data;
    }
    let page = match arguments.web {
        Some(folder) if !folder.is_dir() => {
            return Err(format!("--web {}: there is no such folder", folder.display()));
        }
        Some(folder) => Page::Folder(folder),
        None => Page::Embedded,
    };
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .enable_all()
        .build()
        .map_err(|error| format!("cannot start: {error}"))?;
    let result = runtime.block_on(async {
        if arguments.claim {
            let code = claim_again(&config).await.map_err(|error| error.to_string())?;
            say(&format!("claim code: {code}"));
            return Ok(());
        }
        serve(&config, page).await
    });
    runtime.shutdown_timeout(Duration::from_secs(1));
    result
}

async fn serve(config: &ConsoleConfig, page: Page) -> Result<(), String> {
    let failed = |error: std::io::Error| format!("cannot wait for signals: {error}");
    let mut hang_up = signal(SignalKind::hangup()).map_err(failed)?;
    let mut terminate = signal(SignalKind::terminate()).map_err(failed)?;
    let mut interrupt = signal(SignalKind::interrupt()).map_err(failed)?;
    let console =
        Console::start(config, page, Arc::new(SystemClock)).await.map_err(|error| error.to_string())?;
    say(&format!("the watch room: https://{}/", console.address));
    if let Some(code) = &console.claim {
        say(&format!("nobody has claimed it yet; claim code: {code}"));
    }
    notify(&[sd_notify::NotifyState::Ready]);
    // Half of what is asked for; without anybody who asks, a beat that nobody hears.
    let beat = sd_notify::watchdog_enabled().map_or(Duration::from_secs(3600), |limit| limit / 2);
    let mut beats = tokio::time::interval(beat.max(Duration::from_millis(10)));
    loop {
        tokio::select! {
            _ = beats.tick() => notify(&[sd_notify::NotifyState::Watchdog]),
            _ = hang_up.recv() => match console.read_certificate_again() {
                Ok(()) => say("the page's certificate was read again"),
                Err(error) => say(&format!("{error}: the one in use stays")),
            },
            _ = terminate.recv() => break,
            _ = interrupt.recv() => break,
        }
    }
    notify(&[sd_notify::NotifyState::Stopping]);
    Ok(())
}

fn notify(states: &[sd_notify::NotifyState<'_>]) {
    // Whoever supervises and does not listen will notice by itself.
    let _ = sd_notify::notify(states);
}
