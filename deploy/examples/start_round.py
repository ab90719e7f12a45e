"""Starts the drone's round and says how it goes: `python start_round.py guard.json5 [seconds]`."""

import sys
import time

from sereno_client import Drone, Refused

STATES = ["idle", "planning", "flying", "paused", "returning", "landing", "done", "failed", "going there"]


def main(config, seconds=None):
    with Drone(config) as drone:
        print(f"accepted: {drone.order('patrol-start')}", flush=True)
        began, said = time.monotonic(), None
        for patrol in drone.follow("navigation/patrol"):
            line = f"{STATES[patrol['state']]}, {100 * patrol['coverage']:.0f} % seen: {patrol['text']}"
            if line != said:
                print(line, flush=True)
                said = line
            over = seconds is not None and time.monotonic() - began > seconds
            if over or STATES[patrol["state"]] in ("done", "failed"):
                return


if __name__ == "__main__":
    try:
        main(sys.argv[1], float(sys.argv[2]) if len(sys.argv) > 2 else None)
    except Refused as refusal:
        sys.exit(f"refused: {refusal}")
    except KeyboardInterrupt:
        pass
