//! What the manifest allows whom.

use manifest::Manifest;

/// Whether `who` may read `topic`, and if so whether a message is to wake it.
pub(crate) fn subscription(manifest: &Manifest, who: &str, topic: &str) -> Option<bool> {
    if let Some(service) = manifest.services.get(who) {
        return service.subscribes.get(topic).map(|subscription| subscription.wake);
    }
    manifest.tools.get(who).and_then(|tool| tool.may_read(topic).then_some(false))
}

/// Whether `who` may publish `topic`.
pub(crate) fn may_publish(manifest: &Manifest, who: &str, topic: &str) -> bool {
    manifest.services.get(who).is_some_and(|service| service.may_publish(topic))
        || manifest.tools.get(who).is_some_and(|tool| tool.publishes.contains(topic))
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
