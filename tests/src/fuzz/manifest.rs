//! The manifest and its overlay.

use super::{FILE, check_finite, halves, refused, text_memory, within_memory};
use manifest::{Manifest, ManifestError};

/// A manifest's TOML, and after [`super::BETWEEN`] an overlay's.
///
/// What is checked and found right has one publisher a topic; an overlay with nothing in it changes nothing, and laid
/// over twice it does what it did once.
pub fn manifest(data: &[u8]) -> bool {
    let (base, above) = halves(data);
    let (Ok(base), Ok(above)) = (std::str::from_utf8(base), std::str::from_utf8(above)) else { return false };
    let Some(manifest) = loaded(base.len(), || Manifest::parse(FILE, base)) else { return false };
    let same = manifest.overlay(FILE, "");
    assert!(same.as_ref().is_ok_and(|same| alike(same, &manifest)), "an empty overlay made it {same:?}");
    // An overlay is held together with its base.
    let Some(over) = loaded(base.len() + above.len(), || manifest.overlay(FILE, above)) else { return false };
    let twice = over.overlay(FILE, above);
    assert!(twice.as_ref().is_ok_and(|twice| alike(twice, &over)), "twice made it {twice:?}");
    true
}

/// In all but the names of its files.
fn alike(a: &Manifest, b: &Manifest) -> bool {
    a.system == b.system && a.services == b.services && a.tools == b.tools
}

fn loaded(length: usize, load: impl FnOnce() -> Result<Manifest, ManifestError>) -> Option<Manifest> {
    match within_memory(text_memory(length), load) {
        Ok(manifest) => {
            check(&manifest);
            Some(manifest)
        }
        Err(error) => {
            refused(&error);
            None
        }
    }
}

fn known_topics() -> Vec<&'static str> {
    struct Names(Vec<&'static str>);
    impl ipc_types::TopicVisitor for Names {
        type Output = ();
        fn visit<T: ipc_types::Message>(&mut self) {
            self.0.push(T::TOPIC);
        }
    }
    let mut names = Names(Vec::new());
    ipc_types::visit_all(&mut names);
    names.0
}

fn check(manifest: &Manifest) {
    check_finite(manifest);
    let known = known_topics();
    let problems = manifest.problems(&known);
    for problem in &problems {
        refused(problem);
    }
    assert_eq!(manifest.check(&known).is_ok(), problems.is_empty());
    if problems.is_empty() {
        for topic in manifest.topics() {
            let services =
                topic.publishers.iter().filter(|name| manifest.services.contains_key(*name)).count();
            let wishes = topic.name.starts_with("operator/") || topic.name == "camera/wish";
            assert!(services <= 1 || wishes, "{topic:?}");
        }
    }
    let order = manifest.start_order();
    assert_eq!(order.len(), manifest.services.len());
    assert!(order.is_sorted_by_key(|service| service.criticality));
    let (graph, table) = (manifest.graph(), manifest.table());
    for service in manifest.services.values() {
        assert!((1..=32).contains(&service.name.len()));
        assert!(service.priority <= 99 && service.heartbeat_ms >= 50);
        assert!(service.tick_hz > 0.0 || service.subscribes.values().any(|topic| topic.wake));
        assert!(service.subscribes.values().all(|topic| (1..=64).contains(&topic.depth)));
        assert!(service.retained().all(|topic| service.may_publish(topic)));
        assert!(graph.contains(&service.name) && table.contains(&service.name));
    }
}
