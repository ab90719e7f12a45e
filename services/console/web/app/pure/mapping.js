// From the axes and buttons of a gamepad or a radio transmitter to the four wishes of the sticks.

/** What a transmitter sends, in the order of the thesis's OpenTX model. */
export const CHANNELS = ["throttle", "aileron", "elevator", "rudder", "arm"];
/** Those without which nothing can be flown. */
export const NEEDED = ["throttle", "aileron", "elevator", "rudder"];

/** Takes out the middle ±`band` and stretches the rest, so that the wish begins at zero and ends at one. */
export function deadBand(value, band) {
  if (!Number.isFinite(value)) return 0;
  const size = Math.min(Math.abs(value), 1);
  if (size <= band) return 0;
  return (Math.sign(value) * (size - band)) / (1 - band);
}

/**
 * {kind: "gamepad" | "radio"} for a device that can fly, {error: "few_axes", have, need} for one that cannot. A device that the
 * browser maps as a standard gamepad is one; all else with four axes is taken for a transmitter.
 */
export function recognise(device) {
  const have = device.axes.length;
  if (have < NEEDED.length) return { error: "few_axes", have, need: NEEDED.length };
  return { kind: device.mapping === "standard" ? "gamepad" : "radio" };
}

/** The mapping to begin with: a gamepad's two sticks and right bumper, or a transmitter's first five channels. */
export function defaultMapping(device) {
  const seen = recognise(device);
  if (seen.error) return null;
  if (seen.kind === "gamepad") {
    return {
      throttle: { axis: 1, sign: -1 }, rudder: { axis: 0, sign: 1 },
      elevator: { axis: 3, sign: -1 }, aileron: { axis: 2, sign: 1 },
      arm: null, hold: { button: 5 },
    };
  }
  const mapping = { arm: null, hold: null };
  CHANNELS.forEach((channel, axis) => {
    if (channel !== "arm") mapping[channel] = { axis, sign: 1 };
    else if (axis < device.axes.length) mapping.arm = { axis, sign: 1 };
  });
  return mapping;
}

/** Whether `mapping`, as it was kept, fits `device`: every axis and button named is there, none twice. */
export function fits(mapping, device) {
  if (!mapping || typeof mapping !== "object") return false;
  const axes = new Set();
  for (const channel of [...CHANNELS, "hold"]) {
    const input = mapping[channel];
    if (!input) {
      if (NEEDED.includes(channel)) return false;
      continue;
    }
    const { axis, button } = input;
    if (Number.isInteger(axis)) {
      if (axis < 0 || axis >= device.axes.length || axes.has(axis) || Math.abs(input.sign) !== 1) return false;
      axes.add(axis);
    } else if (Number.isInteger(button)) {
      if (button < 0 || button >= device.buttons.length || NEEDED.includes(channel)) return false;
    } else return false;
  }
  return true;
}

function level(device, input) {
  if (Number.isInteger(input.axis)) return (device.axes[input.axis] ?? 0) * input.sign;
  const button = device.buttons[input.button];
  return button?.pressed ? 1 : -1;
}

/**
 * The wishes: forward, left, up, turn in -1..1 (left and counter-clockwise positive), `held` (null when the device has no such
 * button), `arm` "absent" | "off" | "on".
 */
export function apply(device, mapping, band) {
  const channel = (name) => deadBand(level(device, mapping[name]), band);
  return {
    forward: channel("elevator"),
    left: 0 - channel("aileron"),
    up: channel("throttle"),
    turn: 0 - channel("rudder"),
    held: mapping.hold ? level(device, mapping.hold) > 0.5 : null,
    arm: mapping.arm ? (level(device, mapping.arm) > 0.25 ? "on" : "off") : "absent",
  };
}
