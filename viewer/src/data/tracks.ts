import { Series } from "./series";

/** The small messages of a recording, kept in memory. */
export const columnsOf = {
  truth: 8, // t x y z qx qy qz qw
  odometry: 10, // t x y z qx qy qz qw v w
  estimate: 12, // t x y z qx qy qz qw cov_xx cov_xy cov_yy cov_yaw
  uncertain: 12,
  command: 3, // t v w
  nis: 5, // t tag nis dof accepted
  latency: 2, // t, milliseconds until it was recorded or shown
  tags: 11, // t family id, then corners TL TR BR BL; t 0 -1 … for a frame without tags
  unreliable: 11, // the same for tags with unreliable corners, which are not in `tags`; only frames that have such tags
} as const;

export type TrackName = keyof typeof columnsOf;
export type Tracks = { readonly [name in TrackName]: Series };
export const trackNames = Object.keys(columnsOf) as TrackName[];

export function emptyTracks(): Tracks {
  return Object.fromEntries(trackNames.map((name) => [name, new Series(columnsOf[name])])) as unknown as Tracks;
}

/** The rows of the last frame of tags at t: from, to (exclusive). */
export function frameAt(tags: Series, t: number): [number, number] {
  const last = tags.indexAt(t);
  if (last < 0) return [0, 0];
  let first = last;
  while (first > 0 && tags.time(first - 1) === tags.time(last)) --first;
  return [first, last + 1];
}
