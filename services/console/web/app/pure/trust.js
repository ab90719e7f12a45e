// How sure the drone is of its place, from `localization/pose`, as something that can be said in words.

/** The larger and smaller standard deviation of the position and the direction of the larger one (rad, plan frame). */
export function ellipse(pose) {
  const mean = 0.5 * (pose.variance_x_m2 + pose.variance_y_m2);
  const half = 0.5 * (pose.variance_x_m2 - pose.variance_y_m2);
  const root = Math.hypot(half, pose.covariance_xy_m2);
  return {
    major_m: Math.sqrt(Math.max(mean + root, 0)),
    minor_m: Math.sqrt(Math.max(mean - root, 0)),
    direction_rad: 0.5 * Math.atan2(2 * pose.covariance_xy_m2, pose.variance_x_m2 - pose.variance_y_m2),
  };
}

/** Above these the pilot itself stops trusting the place (DESIGN 4). */
export const P_LOST_LIMIT = 0.05;
export const SIGMA_LIMIT_M = 0.5;

/**
 * {level: "sure" | "fair" | "unsure" | "searching" | "lost", key, within}: `key` names the sentence, `within` the length
 * that fills it. Two standard deviations, so that "sure to" holds 19 times out of 20; `places` is the number of competing
 * hypotheses where they are known, else null.
 */
export function trust(pose, places = null) {
  if (!pose || pose.x_m === null) return { level: "lost", key: "trust.none", within: null };
  const within = lengthParts(2 * ellipse(pose).major_m);
  if (pose.searching) {
    return places > 1
      ? { level: "searching", key: "trust.searching_places", within: { value: String(places), unit: "" } }
      : { level: "searching", key: "trust.searching", within };
  }
  if (pose.state === 0) return { level: "lost", key: places > 1 ? "trust.lost_places" : "trust.lost", within: places > 1 ? { value: String(places), unit: "" } : within };
  if (pose.state === 1 || pose.p_lost > P_LOST_LIMIT) {
    return places > 1
      ? { level: "unsure", key: "trust.between", within: { value: String(places), unit: "" } }
      : { level: "unsure", key: "trust.unsure", within };
  }
  const sigma = ellipse(pose).major_m;
  if (sigma > SIGMA_LIMIT_M) return { level: "unsure", key: "trust.wide", within };
  return { level: sigma > 0.2 ? "fair" : "sure", key: "trust.sure", within };
}

/** A length as people say it: whole centimetres up to a metre (to 5 above 20), then metres with one digit. */
export function lengthParts(metres) {
  const cm = Math.max(1, Math.round(metres * 100));
  if (cm < 20) return { value: String(cm), unit: "cm" };
  if (cm < 100) return { value: String(5 * Math.round(cm / 5)), unit: "cm" };
  return { value: metres.toFixed(1), unit: "m" };
}
