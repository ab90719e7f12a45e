//! The two buses, as the suite sees them.

use manifest::Manifest;
use runtime::shm::{Holder, RunDir};
use runtime::{Cache, Lockstep, Ports, Tool};

const MANIFEST: &str = r#"
[system]
name = "conformance"
plan = "plan.yaml"
vehicle = "vehicle.toml"
simulated = true
[service.writer]
run = "writer"
criticality = "flight"
tick_hz = 10
publishes.'localization/pose' = { hz = 20 }
publishes.'localization/particles' = { hz = 20, retained = true }
publishes.'pilot/state' = { hz = 5, retained = true }
[service.reader]
run = "reader"
criticality = "mission"
tick_hz = 10
subscribes.'localization/pose' = { depth = 16, wake = true }
subscribes.'localization/particles' = { depth = 2 }
subscribes.'operator/command' = { depth = 8 }
[service.shallow]
run = "shallow"
criticality = "mission"
tick_hz = 10
subscribes.'localization/pose' = { depth = 2 }
subscribes.'localization/particles' = { depth = 3 }
subscribes.'operator/command' = { depth = 2 }
[service.single]
run = "single"
criticality = "mission"
tick_hz = 10
subscribes.'localization/pose' = { depth = 1 }
[tool.operator]
publishes = ["operator/command"]
[tool."other-operator"]
publishes = ["operator/command"]
[tool."late-operator"]
publishes = ["operator/command"]
[tool.listener]
"#;

pub(crate) fn manifest() -> Manifest {
    Manifest::parse("conformance.toml", MANIFEST).unwrap()
}

/// A bus as the suite sees it: ports for any service, a way to let messages arrive, and death.
pub(crate) trait Bus {
    fn ports(&mut self, service: &str) -> &mut Ports;
    fn settle(&mut self);
    /// The service is gone, its ports with it.
    fn die(&mut self, service: &str);
}

struct Simulated(Lockstep, Vec<Ports>);
impl Bus for Simulated {
    fn ports(&mut self, service: &str) -> &mut Ports {
        self.1.push(self.0.tool(service));
        self.1.last_mut().unwrap()
    }
    fn die(&mut self, service: &str) {
        self.0.kill(service);
    }
    fn settle(&mut self) {
        // Longer than the longest delay of the lockstep bus.
        let now = self.0.now();
        self.0.run_until(now + 20_000_000);
    }
}

pub(crate) struct Shared {
    tools: Vec<(String, Tool)>,
    pub(crate) holder: Option<Holder>,
    pub(crate) run_dir: RunDir,
    _directory: tempfile::TempDir,
}
impl Shared {
    pub(crate) fn new() -> Self {
        let directory = tempfile::tempdir().unwrap();
        let run_dir = RunDir::new(directory.path());
        run_dir.wipe();
        let holder = Holder::create(&manifest(), &run_dir).unwrap();
        Self { tools: Vec::new(), holder: Some(holder), run_dir, _directory: directory }
    }
}
impl Bus for Shared {
    fn ports(&mut self, service: &str) -> &mut Ports {
        let tool = Tool::join(service, manifest(), &self.run_dir).unwrap();
        self.tools.push((service.to_owned(), tool));
        &mut self.tools.last_mut().unwrap().1.ports
    }
    fn settle(&mut self) {
        for (_, tool) in &self.tools {
            tool.tick();
        }
    }
    fn die(&mut self, service: &str) {
        self.tools.retain(|(name, _)| name != service);
        let Some(holder) = &self.holder else { unreachable!() };
        holder.cleanup_dead_nodes();
    }
}
impl Drop for Shared {
    fn drop(&mut self) {
        self.tools.clear();
        self.holder = None;
        self.run_dir.wipe();
    }
}

pub(crate) fn on_both(test: impl Fn(&mut dyn Bus)) {
    let lockstep = Lockstep::new(manifest(), std::path::Path::new("."), 7, Cache::default());
    test(&mut Simulated(lockstep, Vec::new()));
    test(&mut Shared::new());
}
