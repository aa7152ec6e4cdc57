import { nearestOnRoute } from "../math/plane";
import { compose, identity, inverse, wrapAngle, yawOf, type Pose, type Quat, type Vec3 } from "../math/pose";
import type { Route } from "./map_files";
import type { Series } from "./series";
import type { Tracks } from "./tracks";

/** One curve of a plot: times and values. */
export interface Curve {
  readonly t: number[];
  readonly v: number[];
}
export interface Mark {
  readonly t: number;
  readonly kind: "start" | "stop" | "go" | "blind";
  readonly words: string;
}

/** The pose of a row of truth, odometry or estimates: t x y z qx qy qz qw … */
export function poseOf(series: Series, row: number): Pose {
  const v = series.row(row);
  return { p: v.slice(1, 4) as unknown as Vec3, q: v.slice(4, 8) as unknown as Quat };
}
export function poseAt(series: Series, t: number): Pose | undefined {
  const row = series.indexAt(t);
  return row < 0 ? undefined : poseOf(series, row);
}

/** Interpolates between the two rows around t: position linearly, rotation by constant angular velocity. */
export function poseBetween(series: Series, t: number): Pose | undefined {
  const row = series.indexAt(t);
  if (row < 0) return undefined;
  const before = poseOf(series, row);
  if (row + 1 >= series.length) return before;
  const after = poseOf(series, row + 1);
  const share = (t - series.time(row)) / (series.time(row + 1) - series.time(row));
  const same = before.q.reduce((sum, v, i) => sum + v * after.q[i]!, 0) >= 0 ? 1 : -1;
  const mixed = before.q.map((v, i) => (1 - share) * v + share * same * after.q[i]!);
  const norm = Math.hypot(...mixed);
  return {
    p: before.p.map((v, i) => (1 - share) * v + share * after.p[i]!) as unknown as Vec3,
    q: mixed.map((v) => v / norm) as unknown as Quat,
  };
}

/** map_T_odom that places the beginning of the odometry at the truth, or else at the first estimate. */
export function placeOdometry(tracks: Tracks): Pose {
  const reference = tracks.truth.length > 0 ? tracks.truth : tracks.estimate;
  if (reference.length === 0 || tracks.odometry.length === 0) return identity;
  const t = Math.max(reference.time(0), tracks.odometry.time(0));
  return compose(poseAt(reference, t)!, inverse(poseAt(tracks.odometry, t)!));
}

/** Values at most every `apart` seconds, so that long recordings draw as fast as short ones; rows without a value are skipped. */
function sampled(series: Series, apart: number, value: (row: number) => number): Curve {
  const curve: Curve = { t: [], v: [] };
  let next = -Infinity;
  for (let row = 0; row < series.length; ++row) {
    if (series.time(row) < next) continue;
    const v = value(row);
    if (!Number.isFinite(v)) continue;
    next = series.time(row) + apart;
    curve.t.push(series.time(row));
    curve.v.push(v);
  }
  return curve;
}

export interface Scores {
  readonly crossTrackTruth: Curve;
  readonly crossTrackEstimate: Curve;
  readonly headingEstimate: Curve;
  readonly headingOdometry: Curve;
  readonly speed: Curve;
  readonly commanded: Curve;
  readonly tagsInView: Curve;
  readonly nis: Curve;
  readonly latency: Curve;
}

export function scoresOf(tracks: Tracks, route: Route | undefined, map_T_odom: Pose, apart = 0.05): Scores {
  const degrees = 180 / Math.PI;
  const crossTrack = (series: Series): Curve =>
    route ? sampled(series, apart, (row) => nearestOnRoute(route.xy, route.closed, series.at(row, 1), series.at(row, 2)).crossTrack * 100)
          : { t: [], v: [] };
  const headingError = (series: Series, a_T_frame: Pose): Curve =>
    tracks.truth.length === 0 ? { t: [], v: [] } : sampled(series, apart, (row) => {
      const truth = poseAt(tracks.truth, series.time(row));
      return truth ? wrapAngle(yawOf(compose(a_T_frame, poseOf(series, row)).q) - yawOf(truth.q)) * degrees : NaN;
    });
  return {
    crossTrackTruth: crossTrack(tracks.truth), crossTrackEstimate: crossTrack(tracks.estimate),
    headingEstimate: headingError(tracks.estimate, identity), headingOdometry: headingError(tracks.odometry, map_T_odom),
    speed: sampled(tracks.odometry, apart, (row) => tracks.odometry.at(row, 8)),
    commanded: sampled(tracks.command, apart, (row) => tracks.command.at(row, 1)),
    tagsInView: tagCounts(tracks.tags),
    latency: sampled(tracks.latency, apart, (row) => tracks.latency.at(row, 1)),
    nis: sampled(tracks.nis, 0, (row) => tracks.nis.at(row, 2) / tracks.nis.at(row, 3)),
  };
}

function tagCounts(tags: Series): Curve {
  const curve: Curve = { t: [], v: [] };
  for (let row = 0; row < tags.length; ++row) {
    const seen = tags.at(row, 2) < 0 ? 0 : 1;
    const last = curve.t.length - 1;
    if (last >= 0 && curve.t[last] === tags.time(row)) curve.v[last]! += seen;
    else { curve.t.push(tags.time(row)); curve.v.push(seen); }
  }
  return curve;
}

/** Marks of a timeline: the first estimate, stops, and times without any tag. */
export function marksOf(tracks: Tracks, blindFrom = 1, stoppedFrom = 0.5): Mark[] {
  const marks: Mark[] = [];
  if (tracks.estimate.length > 0) marks.push({ t: tracks.estimate.time(0), kind: "start", words: "first estimate" });
  const stops = intervals(tracks.command, (row) => tracks.command.at(row, 1) === 0 && tracks.command.at(row, 2) === 0, stoppedFrom);
  for (const [from, to, open] of stops) {
    marks.push({ t: from, kind: "stop", words: `stationary for ${(to - from).toFixed(1)} s` });
    if (!open) marks.push({ t: to, kind: "go", words: "moves again" });
  }
  for (const [from, to] of intervals(tracks.tags, (row) => tracks.tags.at(row, 2) < 0, blindFrom))
    marks.push({ t: from, kind: "blind", words: `no tag for ${(to - from).toFixed(1)} s` });
  return marks.sort((a, b) => a.t - b.t);
}

/** Intervals of at least `atLeast` seconds in which the condition holds: start, end, and whether it holds to the end of the series. */
function intervals(series: Series, holds: (row: number) => boolean, atLeast: number): [number, number, boolean][] {
  const found: [number, number, boolean][] = [];
  let from: number | undefined;
  for (let row = 0; row <= series.length; ++row) {
    const open = row === series.length;
    if (!open && holds(row)) { from ??= series.time(row); continue; }
    if (from === undefined) continue;
    const to = series.time(open ? row - 1 : row);
    if (to - from >= atLeast) found.push([from, to, open]);
    from = undefined;
  }
  return found;
}
