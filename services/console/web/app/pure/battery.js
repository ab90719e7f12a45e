// The battery in minutes, from `flight/power` and what `about` says of the vehicle's battery.

/** Below this current (A) the motors are off and minutes mean nothing. */
const IDLE_A = 2;
/** Usual resting voltage of a lithium polymer cell and the share of its charge left. */
const CURVE = [[3.3, 0], [3.5, 0.06], [3.65, 0.15], [3.75, 0.32], [3.82, 0.5], [3.95, 0.7], [4.1, 0.9], [4.2, 1]];

/** Share of charge left by resting voltage, 0..1. */
export function shareByVoltage(cell_volts) {
  if (!(cell_volts > 0)) return null;
  if (cell_volts <= CURVE[0][0]) return 0;
  for (let k = 1; k < CURVE.length; k += 1) {
    const [low_v, low] = CURVE[k - 1];
    const [high_v, high] = CURVE[k];
    if (cell_volts <= high_v) return low + ((high - low) * (cell_volts - low_v)) / (high_v - low_v);
  }
  return 1;
}

/** A slow mean of the current, so that minutes do not jump: time constant 10 s. */
export class MeanCurrent {
  constructor() {
    this.value = null;
    this.at = null;
  }
  add(amps, now) {
    if (!(amps >= IDLE_A)) {
      this.value = null;
      this.at = null;
      return;
    }
    if (this.value === null) this.value = amps;
    else this.value += (amps - this.value) * (1 - Math.exp(-(now - this.at) / 10_000));
    this.at = now;
  }
}

/**
 * {share 0..1 or null, minutes or null, cell_volts or null}. With a known capacity the charge drawn counts; without, the voltage.
 * `reserve` is the share that is not to be flown.
 */
export function battery(power, capacity_mah, mean_amps, reserve = 0.1) {
  if (!power) return { share: null, minutes: null, cell_volts: null };
  const cell_volts = power.volts > 0 && power.cells > 0 ? power.volts / power.cells : null;
  let share = null;
  let minutes = null;
  if (capacity_mah > 0 && power.drawn_mah !== null) {
    share = Math.min(Math.max(1 - power.drawn_mah / capacity_mah, 0), 1);
    if (mean_amps) minutes = Math.max(0, ((share - reserve) * capacity_mah * 60) / 1000 / mean_amps);
  } else if (!mean_amps) {
    share = shareByVoltage(cell_volts);
  }
  return { share, minutes, cell_volts };
}
