"""What the examples share: a connection to one drone, by the contract in docs/off-board.md.

Needs `pip install -r requirements.txt` and a configuration that `sereno certs client NAME --role ROLE` wrote.
"""

import json
import os
import secrets
import threading

# Before zenoh is imported: one thread for reading and writing TLS (https://github.com/eclipse-zenoh/zenoh/issues/2557).
os.environ.setdefault("ZENOH_RUNTIME", "(rx: (handover: tx), tx: (worker_threads: 1))")

import zenoh

# A route is worked out within ten seconds, and said to be too late after that.
ORDER_PATIENCE_S = 14.0
PATIENCE_S = 3.0


class Refused(Exception):
    """The drone does not obey; the text says why."""


class Drone:
    """One drone over zenoh, as the certificate in the configuration."""

    def __init__(self, config_file, name=None):
        config = zenoh.Config.from_file(config_file)
        metadata = json.loads(config.get_json("metadata"))
        self.certificate = metadata["certificate"]
        self.session = zenoh.open(config)
        alive = sorted(str(reply.ok.key_expr).split("/")[1]
                       for reply in self.session.liveliness().get("sereno/*/alive", timeout=PATIENCE_S) if reply.ok)
        if name is None:
            if len(alive) != 1:
                self.session.close()
                raise Refused(f"choose a drone: there are {', '.join(alive) or 'none, or none that knows this certificate'}")
            name = alive[0]
        self.name = name
        self._beacon_ns = 0
        self._heard = threading.Event()
        self._beacons = self.session.declare_subscriber(self.key("beacon"), self._on_beacon)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.session.close()

    def key(self, rest):
        return f"sereno/{self.name}/{rest}"

    def _on_beacon(self, sample):
        self._beacon_ns = json.loads(sample.payload.to_bytes())["beacon_ns"]
        self._heard.set()

    def follow(self, topic):
        """Messages of a topic as they come, as dictionaries. Who is slow loses the older ones."""
        with self.session.declare_subscriber(self.key(f"telemetry/{topic}"), zenoh.handlers.RingChannel(8)) as messages:
            for sample in messages:
                yield json.loads(sample.payload.to_bytes())

    def about(self):
        """What the drone says of itself: plan, rooms, vehicle, topics."""
        for reply in self.session.get(self.key("about"), timeout=PATIENCE_S):
            if reply.ok:
                return json.loads(reply.ok.payload.to_bytes())
        raise Refused(f"{self.name} does not answer the certificate {self.certificate}")

    def order(self, verb, **more):
        """Gives an order (`takeoff`, `goto` with x_m and y_m, `patrol-start`, ...) and returns the answer's text."""
        if not self._heard.wait(PATIENCE_S):
            raise Refused(f"{self.name} does not tell its clock")
        order = {"id": secrets.token_hex(8), "beacon_ns": self._beacon_ns, **more}
        replies = self.session.get(self.key(f"command/{verb}/{self.certificate}"), payload=json.dumps(order),
                                   timeout=ORDER_PATIENCE_S)
        for reply in replies:
            if reply.ok:
                answer = json.loads(reply.ok.payload.to_bytes())
                if answer["accepted"]:
                    return answer["text"]
                raise Refused(answer["text"])
        raise Refused(f"{self.name} does not answer the certificate {self.certificate}")
