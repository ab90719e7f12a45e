"""Prints where the drone is: `python follow_pose.py viewer.json5 [messages]`."""

import math
import sys

from sereno_client import Drone, Refused

STATES = ["lost", "converging", "tracking"]


def main(config, count=None):
    with Drone(config) as drone:
        for number, pose in enumerate(drone.follow("localization/pose"), 1):
            state = STATES[pose["state"] & 0xFF]
            print(f"{drone.name}: x {pose['x_m']:.2f} m, y {pose['y_m']:.2f} m, "
                  f"heading {math.degrees(pose['heading_rad']):.0f} degrees, {state}", flush=True)
            if count is not None and number >= count:
                return


if __name__ == "__main__":
    try:
        main(sys.argv[1], int(sys.argv[2]) if len(sys.argv) > 2 else None)
    except Refused as refusal:
        sys.exit(f"refused: {refusal}")
    except KeyboardInterrupt:
        pass
