//! Who may say and hear what, for zenoh's access control: everything that does not stand here is denied. By the common name
//! of a certificate, so that the last part of a key proves who put it there.

use crate::keys::{Direction, Keys};
use crate::roles::{Clients, Role, Standing};
use serde_json::{Value, json};

/// Towards the node that has these rules.
const IN: &str = "ingress";
/// Away from it.
const OUT: &str = "egress";

struct Rules {
    rules: Vec<Value>,
    subjects: Vec<Value>,
    policies: Vec<Value>,
}

impl Rules {
    fn allow(&mut self, id: &str, flow: &str, messages: &[&str], keys: &[String]) {
        self.rules.push(json!({
            "id": id, "permission": "allow", "flows": [flow], "messages": messages, "key_exprs": keys,
        }));
    }

    /// Gives a certificate the rules of these names.
    fn bind(&mut self, certificate: &str, rules: &[String]) {
        let id = format!("certificate {certificate}");
        self.subjects
            .push(json!({ "id": id, "cert_common_names": [certificate], "link_protocols": ["tls"] }));
        self.policies.push(json!({ "subjects": [id], "rules": rules }));
    }

    fn finish(self) -> Value {
        let mut access = json!({ "enabled": true, "default_permission": "deny" });
        // An empty list is none to zenoh. Without subjects everything is denied.
        if !self.subjects.is_empty() {
            access["rules"] = Value::from(self.rules);
            access["subjects"] = Value::from(self.subjects);
            access["policies"] = Value::from(self.policies);
        }
        access
    }

    /// What every client may: see. `commands` are the keys of the drones that may be ordered about here.
    fn of_clients(commands: &Keys, clients: &Clients) -> Self {
        let mut rules = Self { rules: Vec::new(), subjects: Vec::new(), policies: Vec::new() };
        let all = Keys::of("*");
        let seen = [all.telemetry("**"), all.beacon(), all.about(), all.plan()];
        rules.allow("see", IN, &["declare_subscriber", "query"], &seen);
        rules.allow("seen", OUT, &["put", "reply"], &seen);
        rules.allow("find", IN, &["liveliness_query", "declare_liveliness_subscriber"], &[all.alive()]);
        rules.allow("found", OUT, &["liveliness_token"], &[all.alive()]);
        // That somebody listens is no secret, and without it nobody sends.
        rules.allow("offers", OUT, &["declare_subscriber", "declare_queryable"], &["sereno/**".to_owned()]);
        for (name, standing) in clients.iter() {
            let Standing::Client(role) = standing else { continue };
            let asked = [commands.command("*", name), commands.edit(name)];
            let signals = |direction| commands.signal(name, "*", direction);
            let (ask, answer, say, hear, steer) = (
                format!("ask {name}"),
                format!("answer {name}"),
                format!("say {name}"),
                format!("hear {name}"),
                format!("steer {name}"),
            );
            // A viewer may ask too, and is refused in a sentence.
            rules.allow(&ask, IN, &["query"], &asked);
            rules.allow(&answer, OUT, &["reply"], &asked);
            rules.allow(&say, IN, &["put"], &[signals(Direction::In), commands.wish(name)]);
            rules.allow(&hear, IN, &["declare_subscriber"], &[signals(Direction::Out)]);
            rules.allow(&format!("heard {name}"), OUT, &["put"], &[signals(Direction::Out)]);
            let mut bound: Vec<String> = ["see", "seen", "find", "found", "offers"].map(str::to_owned).into();
            bound.extend([ask, answer, say, hear, format!("heard {name}")]);
            if role >= Role::Guard {
                rules.allow(&steer, IN, &["put"], &[commands.sticks(name)]);
                bound.push(steer);
            }
            rules.bind(name, &bound);
        }
        rules
    }
}

/// The rules of a drone: its clients, and the routers that carry what other clients say. A router is believed when it says
/// by its keys whose words it carries.
#[must_use]
pub fn of_drone(drone: &str, clients: &Clients) -> Value {
    let own = Keys::of(drone);
    let mut rules = Rules::of_clients(&own, clients);
    let everything = format!("sereno/{drone}/**");
    let routers: Vec<&str> =
        clients.iter().filter(|(_, standing)| *standing == Standing::Router).map(|(name, _)| name).collect();
    if !routers.is_empty() {
        rules.allow("carried", IN, &["query", "put"], std::slice::from_ref(&everything));
        rules.allow(
            "wanted",
            IN,
            &["declare_subscriber", "liveliness_query", "declare_liveliness_subscriber"],
            &["sereno/**".to_owned()],
        );
        rules.allow(
            "told",
            OUT,
            &["put", "reply", "liveliness_token", "declare_subscriber", "declare_queryable"],
            &[everything],
        );
    }
    for router in routers {
        rules.bind(router, &["carried", "wanted", "told"].map(str::to_owned));
    }
    rules.finish()
}

/// The rules of a router: clients as on a drone, and drones each on their own keys.
#[must_use]
pub fn of_router(clients: &Clients) -> Value {
    let mut rules = Rules::of_clients(&Keys::of("*"), clients);
    for (name, standing) in clients.iter() {
        if standing != Standing::Drone {
            continue;
        }
        let everything = format!("sereno/{name}/**");
        let (told, wanted, carried) =
            (format!("told {name}"), format!("wanted {name}"), format!("carried {name}"));
        rules.allow(
            &told,
            IN,
            &["put", "reply", "liveliness_token", "declare_subscriber", "declare_queryable"],
            std::slice::from_ref(&everything),
        );
        rules.allow(&carried, OUT, &["query", "put"], &[everything]);
        rules.allow(
            &wanted,
            OUT,
            &["declare_subscriber", "liveliness_query", "declare_liveliness_subscriber"],
            &["sereno/**".to_owned()],
        );
        rules.bind(name, &[told, wanted, carried]);
    }
    rules.finish()
}
