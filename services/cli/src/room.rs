//! The demo's watch room: certificates, a drone's own place on the network, and the console.

use anyhow::{Context, Result, bail};
use bridge::Authority;
use cli::place::Place;
use std::io::{BufRead, BufReader};
use std::net::{Ipv4Addr, TcpListener};
use std::os::unix::fs::DirBuilderExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

/// Where a drone and a console listen when nobody else does.
const BRIDGE_PORT: u16 = 7447;
const CONSOLE_PORT: u16 = 8443;

/// Between two attempts to start a console.
const PAUSE: Duration = Duration::from_secs(10);

/// Makes what is missing of a simulated system's certificates, and leaves what is there.
pub(crate) fn certificates(directory: &Path, drones: &[String], endpoints: &[String]) -> Result<Authority> {
    let authority = Authority::at(std::path::absolute(directory)?);
    let now_s = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default().as_secs().cast_signed();
    authority.init(drones, &[], endpoints, now_s)?;
    Ok(authority)
}

/// Where the demo keeps certificates and the console's accounts between two demos.
pub(crate) fn state_directory() -> PathBuf {
    let absolute = |name: &str| std::env::var_os(name).map(PathBuf::from).filter(|path| path.is_absolute());
    absolute("XDG_STATE_HOME")
        .or_else(|| absolute("HOME").map(|home| home.join(".local/state")))
        .unwrap_or_else(std::env::temp_dir)
        .join("sereno/demo")
}

/// The port, or any other where somebody listens already.
fn free_port(wanted: u16) -> Result<u16> {
    let bound = TcpListener::bind((Ipv4Addr::LOCALHOST, wanted))
        .or_else(|_| TcpListener::bind((Ipv4Addr::LOCALHOST, 0)))
        .context("no port is free on 127.0.0.1")?;
    Ok(bound.local_addr()?.port())
}

/// A drone's own copy of the shipped plan: what is changed from the page stays for the next demo and leaves the checkout alone.
/// When another plan is shipped, it gets a new one.
fn own_plan(place: &Place, directory: &Path, drone: &str) -> Result<PathBuf> {
    let (manifest, root) = place.manifest(true)?;
    let shipped = root.join(&manifest.system.plan);
    let read = |path: &Path| std::fs::read(path).with_context(|| path.display().to_string());
    let header = read(&shipped)?;
    let image = floorplan::PlanHeader::parse(&manifest.system.plan, &header)?.image;
    let side = shipped.with_extension("rooms.yaml");
    let mut files = vec![
        (shipped.clone(), header),
        (shipped.with_file_name(&image), read(&shipped.with_file_name(&image))?),
    ];
    if side.is_file() {
        files.push((side.clone(), read(&side)?));
    }
    let whole: Vec<u8> = files.iter().flat_map(|(_, bytes)| bytes.iter().copied()).collect();
    let own = directory.join(format!("{drone}-building-{:016x}", runtime::fnv(&whole)));
    let header = own.join(shipped.file_name().unwrap_or_default());
    if header.is_file() {
        return Ok(header);
    }
    std::fs::create_dir_all(&own).with_context(|| own.display().to_string())?;
    // The header last: by it a whole copy is known.
    for (path, bytes) in files.iter().rev() {
        let to = own.join(path.file_name().unwrap_or_default());
        std::fs::write(&to, bytes).with_context(|| to.display().to_string())?;
    }
    Ok(header)
}

/// One drone of the demo: what makes it another than the next.
#[derive(Debug)]
pub(crate) struct Berth {
    /// Its name.
    pub(crate) name: String,
    /// Laid over the manifest.
    pub(crate) overlay: PathBuf,
    /// Where its bridge listens.
    endpoint: String,
}

/// Certificates, berths and the console of a demo.
#[derive(Debug)]
pub(crate) struct Room {
    directory: PathBuf,
    deploy: PathBuf,
    pub(crate) berths: Vec<Berth>,
    console: Option<Child>,
    said: Option<Receiver<String>>,
    /// Not to be started before, after it has ended by itself.
    again: Instant,
}

impl Room {
    /// Prepares the certificates and overlays of so many drones.
    pub(crate) fn prepare(place: &Place, directory: PathBuf, drones: usize) -> Result<Self> {
        // Certificates' keys and accounts are nobody else's.
        std::fs::DirBuilder::new()
            .recursive(true)
            .mode(0o700)
            .create(&directory)
            .with_context(|| format!("cannot make {}", directory.display()))?;
        let directory = std::path::absolute(directory)?;
        let first = place.manifest(true)?.0.system.name;
        let stem = first.strip_suffix("-1").unwrap_or(&first).to_owned();
        let certs = directory.join("certs");
        let mut berths = Vec::new();
        for k in 0..drones {
            let name = if k == 0 { first.clone() } else { format!("{stem}-{}", k + 1) };
            let wanted = BRIDGE_PORT.saturating_add(u16::try_from(k)?);
            let port = free_port(wanted)?;
            let endpoint = format!("tls/127.0.0.1:{port}");
            let config = directory.join(format!("{name}-bridge.toml"));
            let text = format!(
                "# Written by `sereno demo`.\ncertificates = {:?}\nlisten = [{endpoint:?}]\n",
                certs.display().to_string()
            );
            std::fs::write(&config, text).with_context(|| config.display().to_string())?;
            let overlay = directory.join(format!("{name}.toml"));
            let plan = own_plan(place, &directory, &name)?;
            let text = format!(
                "# Written by `sereno demo`.\n[system]\nname = {name:?}\nplan = {:?}\n\n[service.bridge]\nconfig = {:?}\n",
                plan.display().to_string(),
                config.display().to_string()
            );
            std::fs::write(&overlay, text).with_context(|| overlay.display().to_string())?;
            berths.push(Berth { name, overlay, endpoint });
        }
        let names: Vec<String> = berths.iter().map(|berth| berth.name.clone()).collect();
        let endpoints: Vec<String> = berths.iter().map(|berth| berth.endpoint.clone()).collect();
        let authority = certificates(&certs, &names, &endpoints)?;
        // Where the drones are may have changed since the last demo.
        let now_s = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default().as_secs().cast_signed();
        authority.client(
            "console",
            bridge::roles::Standing::Client(bridge::roles::Role::Administrator),
            &endpoints,
            now_s,
        )?;
        Ok(Self {
            directory,
            deploy: std::path::absolute(place.deploy()?)?,
            berths,
            console: None,
            said: None,
            again: Instant::now(),
        })
    }

    /// Starts the console when its program is there (it may still be built); true when it runs.
    pub(crate) fn open(&mut self) -> Result<bool> {
        if self.console.is_some() {
            return Ok(true);
        }
        if Instant::now() < self.again {
            return Ok(false);
        }
        // Should this fail, it fails the same way a moment later.
        self.again = Instant::now() + PAUSE;
        let program = std::env::current_exe().context("where am I?")?.with_file_name("sereno-console");
        if !program.is_file() {
            self.again = Instant::now();
            return Ok(false);
        }
        let port = free_port(CONSOLE_PORT)?;
        let config = self.directory.join("console.toml");
        let shipped = include_str!("../../../deploy/config/console.toml");
        let mut table: toml::Table = shipped.parse().context("the console's configuration")?;
        let certs = self.directory.join("certs");
        table.insert("data".into(), text(&self.directory.join("console-data")));
        if let Some(toml::Value::Table(https)) = table.get_mut("https") {
            https.insert("listen".into(), format!("127.0.0.1:{port}").into());
            https.insert("certificate".into(), text(&certs.join("https.pem")));
            https.insert("key".into(), text(&certs.join("https.key")));
            https.insert("authority".into(), text(&certs.join("ca.pem")));
        }
        if let Some(toml::Value::Table(zenoh)) = table.get_mut("zenoh") {
            zenoh.insert("client".into(), text(&certs.join("clients/console/console.json5")));
        }
        if let Some(toml::Value::Table(rehearsal)) = table.get_mut("rehearsal") {
            rehearsal.insert("program".into(), text(&program.with_file_name("sereno")));
            rehearsal.insert("deploy".into(), text(&self.deploy));
        }
        std::fs::write(&config, table.to_string()).with_context(|| config.display().to_string())?;
        let log = self.directory.join("console.log");
        let complaints = std::fs::File::create(&log).with_context(|| log.display().to_string())?;
        let mut child = Command::new(&program)
            .arg("--config")
            .arg(&config)
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(complaints)
            .spawn()
            .with_context(|| format!("cannot start {}", program.display()))?;
        let Some(out) = child.stdout.take() else { bail!("the console's output is closed") };
        let (send, said) = channel();
        std::thread::spawn(move || {
            for line in BufReader::new(out).lines().map_while(Result::ok) {
                if send.send(line).is_err() {
                    break;
                }
            }
        });
        (self.console, self.said) = (Some(child), Some(said));
        Ok(true)
    }

    /// What the console has said since: its address, its claim code.
    pub(crate) fn said(&self) -> impl Iterator<Item = String> + '_ {
        self.said.iter().flat_map(Receiver::try_iter)
    }

    /// How the console ended, if it has.
    pub(crate) fn ended(&mut self) -> Option<String> {
        let status = self.console.as_mut()?.try_wait().ok()??;
        self.console = None;
        let log = std::fs::read_to_string(self.directory.join("console.log")).unwrap_or_default();
        Some(format!("the console ended ({status}): {}", log.lines().last().unwrap_or("it said nothing")))
    }
}

fn text(path: &Path) -> toml::Value {
    toml::Value::String(path.display().to_string())
}

impl Drop for Room {
    fn drop(&mut self) {
        if let Some(console) = &mut self.console {
            // It keeps nothing that a kill could lose: SQLite's journal is whole at any moment.
            let _ = console.kill();
            let _ = console.wait();
        }
    }
}
