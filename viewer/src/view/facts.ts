import { ellipseOf } from "../math/plane";
import { wrapAngle, yawOf, type Pose } from "../math/pose";
import type { Content } from "../session";

/** The values next to the image. */
export function factsAt(content: Content, poses: ReadonlyMap<string, Pose>, t: number, tagsInView: number, unreliable: number): [string, string][] {
  const facts: [string, string][] = [];
  const estimate = poses.get("estimate"), truth = poses.get("truth");
  const where = (pose: Pose): string =>
    `${pose.p[0].toFixed(2)}, ${pose.p[1].toFixed(2)} m, ${((yawOf(pose.q) * 180) / Math.PI).toFixed(1)}°`;
  if (estimate) facts.push(["Estimate", where(estimate)]);
  if (truth) facts.push(["Truth", where(truth)]);
  if (estimate && truth) {
    const off = Math.hypot(estimate.p[0] - truth.p[0], estimate.p[1] - truth.p[1]) * 100;
    facts.push(["Error", `${off.toFixed(1)} cm, ${((wrapAngle(yawOf(estimate.q) - yawOf(truth.q)) * 180) / Math.PI).toFixed(1)}°`]);
  }
  const row = content.tracks.estimate.indexAt(t);
  if (row >= 0 && content.tracks.estimate.at(row, 8) > 0) {
    const { major } = ellipseOf(content.tracks.estimate.at(row, 8), content.tracks.estimate.at(row, 9), content.tracks.estimate.at(row, 10));
    facts.push(["Sigma", `${(major * 100).toFixed(1)} cm`]);
  }
  const odometry = content.tracks.odometry.indexAt(t);
  if (odometry >= 0) facts.push(["Speed", `${content.tracks.odometry.at(odometry, 8).toFixed(2)} m/s`]);
  facts.push(["Tags in view", unreliable > 0 ? `${tagsInView}, and ${unreliable} unreliable` : String(tagsInView)]);
  return facts;
}

/** A warning if observations constrain the pose only weakly. */
export function warningAt(content: Content, t: number, tagsInView: number): string {
  const { tags, estimate } = content.tracks;
  if (tags.length === 0 || tagsInView > 1 || tags.indexAt(t) < 0) return "";
  let row = tags.indexAt(t);
  if (tagsInView === 1) {
    while (row > 0 && tags.time(row - 1) !== tags.time(row)) --row; // back to the last frame with two tags
    const alone = t - tags.time(row);
    return alone < 1 ? "" : `Only one tag in view for ${alone.toFixed(1)} s: the pose is weakly constrained.`;
  }
  while (row >= 0 && tags.at(row, 2) < 0) --row;
  const blind = t - (row >= 0 ? tags.time(row) : tags.time(0));
  if (blind < 0.5) return "";
  return `No tag for ${blind.toFixed(1)} s: ${estimate.length > 0 ? "the estimate uses odometry only" : "the pose is unknown"}.`;
}
