"""Saves what the drone sees: `python save_picture.py viewer.json5 [picture.jpg]`."""

import sys

from sereno_client import Drone, Refused


def main(config, file="picture.jpg"):
    with Drone(config) as drone:
        still = drone.picture()
        with open(file, "wb") as out:
            out.write(still.jpeg)
        print(f"{drone.name}: {still.width}x{still.height}, {len(still.jpeg)} bytes, {still.age_s:.1f} s old: {file}")


if __name__ == "__main__":
    try:
        main(*sys.argv[1:3])
    except Refused as refusal:
        sys.exit(f"refused: {refusal}")
    except OSError as error:
        sys.exit(f"not saved: {error}")
