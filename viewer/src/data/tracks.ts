import { Series } from "./series";

/** What of a recording is kept in memory: all that is small. */
export const columnsOf = {
  truth: 8, // t x y z qx qy qz qw
  odometry: 10, // t x y z qx qy qz qw v w
  estimate: 12, // t x y z qx qy qz qw cov_xx cov_xy cov_yy cov_yaw
  uncertain: 12,
  command: 3, // t v w
  nis: 5, // t tag nis dof accepted
  latency: 2, // t, milliseconds until it was recorded, or shown
  tags: 11, // t family id, then corners as the page draws them: TL TR BR BL; t 0 -1 … where a frame saw none
} as const;

export type TrackName = keyof typeof columnsOf;
export type Tracks = { readonly [name in TrackName]: Series };
export const trackNames = Object.keys(columnsOf) as TrackName[];

export function emptyTracks(): Tracks {
  return Object.fromEntries(trackNames.map((name) => [name, new Series(columnsOf[name])])) as unknown as Tracks;
}

/** The rows of the frame of tags that was last at t: from, to (exclusive). */
export function frameAt(tags: Series, t: number): [number, number] {
  const last = tags.indexAt(t);
  if (last < 0) return [0, 0];
  let first = last;
  while (first > 0 && tags.time(first - 1) === tags.time(last)) --first;
  return [first, last + 1];
}
