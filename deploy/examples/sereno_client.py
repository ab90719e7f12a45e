"""What the examples share: a connection to one drone, by the contract in docs/off-board.md.

Needs `pip install -r requirements.txt` and a configuration that `sereno certs client NAME --role ROLE` wrote.
"""

import json
import os
import secrets
import struct
import threading
import time
from collections import namedtuple

# Before zenoh is imported: one thread for reading and writing TLS (https://github.com/eclipse-zenoh/zenoh/issues/2557).
os.environ.setdefault("ZENOH_RUNTIME", "(rx: (handover: tx), tx: (worker_threads: 1))")

import zenoh

# A route is worked out within ten seconds, and said to be too late after that.
ORDER_PATIENCE_S = 14.0
PATIENCE_S = 3.0
# The camera may have slept, and a picture is made once a second.
PICTURE_PATIENCE_S = 10.0
# A wish is good for two seconds.
WISH_EVERY_S = 1.0
# `sereno schema` prints it as Still: behind the header times of capture and number, what encoding took, size, quality, length.
STILL = struct.Struct("<24x QQQ IIII")

Still = namedtuple("Still", "jpeg width height age_s")


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

    def picture(self):
        """What the camera sees now, as a JPEG file. The camera makes stills while somebody wishes for them."""
        if not self._heard.wait(PATIENCE_S):
            raise Refused(f"{self.name} does not tell its clock")
        wish = json.dumps({"video": None, "still": True})
        until = time.monotonic() + PICTURE_PATIENCE_S
        with self.session.declare_subscriber(self.key("telemetry/camera/still"), zenoh.handlers.RingChannel(1)) as stills:
            said_at = None
            while time.monotonic() < until:
                if said_at is None or time.monotonic() - said_at >= WISH_EVERY_S:
                    self.session.put(self.key(f"wish/{self.certificate}"), wish)
                    said_at = time.monotonic()
                sample = stills.try_recv()
                if sample is None:
                    time.sleep(0.02)
                    continue
                message = sample.payload.to_bytes()
                capture_ns, _, _, width, height, _, length = STILL.unpack_from(message)
                jpeg = message[STILL.size:]
                if len(jpeg) != length:
                    raise Refused(f"a picture of {length} bytes came with {len(jpeg)}")
                return Still(jpeg, width, height, max(0.0, (self._beacon_ns - capture_ns) / 1e9))
        raise Refused(f"{self.name} sends no picture")

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
