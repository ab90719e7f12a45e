//! What the manifest allows whom.

use manifest::{Manifest, Subscription};

/// How `who` reads `topic`; `None` when it may not. Tools are not woken and keep as much as there is room for.
pub(crate) fn subscription(manifest: &Manifest, who: &str, topic: &str, most: usize) -> Option<Subscription> {
    if let Some(service) = manifest.services.get(who) {
        return service.subscribes.get(topic).cloned();
    }
    let tool = manifest.tools.get(who)?;
    tool.may_read(topic).then_some(Subscription { depth: most, wake: false })
}

/// Whether `who` may publish `topic`.
pub(crate) fn may_publish(manifest: &Manifest, who: &str, topic: &str) -> bool {
    manifest.services.get(who).is_some_and(|service| service.may_publish(topic))
        || manifest.tools.get(who).is_some_and(|tool| tool.publishes.contains(topic))
}

/// Longest healthy silence of `who` on `topic`, nanoseconds; 0 for none.
pub(crate) fn deadline_ns(manifest: &Manifest, who: &str, topic: &str) -> u64 {
    let publication = manifest.services.get(who).and_then(|service| service.publishes.get(topic));
    publication.map_or(0, |publication| u64::from(publication.deadline_ms) * 1_000_000)
}

/// Path of the device called `name` of `who`.
pub(crate) fn device<'a>(manifest: &'a Manifest, who: &str, name: &str) -> Option<&'a str> {
    manifest.services.get(who)?.devices.get(name).map(String::as_str)
}

/// Services that a message on `topic` wakes.
pub(crate) fn woken_by<'a>(manifest: &'a Manifest, topic: &'a str) -> impl Iterator<Item = &'a str> {
    manifest
        .services
        .values()
        .filter(move |service| service.subscribes.get(topic).is_some_and(|subscription| subscription.wake))
        .map(|service| service.name.as_str())
}
