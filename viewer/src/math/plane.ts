// Curves and uncertainty in the plane.
import { wrapAngle } from "./pose";

export interface Ellipse {
  readonly major: number;
  readonly minor: number;
  /** From x to the major axis [rad]. */
  readonly angle: number;
}

/** Axes of the one-sigma ellipse of a 2×2 covariance. Negative eigenvalues from rounding count as zero. */
export function ellipseOf(xx: number, xy: number, yy: number): Ellipse {
  const mean = (xx + yy) / 2;
  const spread = Math.hypot((xx - yy) / 2, xy);
  return {
    major: Math.sqrt(Math.max(0, mean + spread)),
    minor: Math.sqrt(Math.max(0, mean - spread)),
    angle: 0.5 * Math.atan2(2 * xy, xx - yy),
  };
}

export interface OnRoute {
  /** Signed distance [m]: positive to the left of the polyline. */
  readonly crossTrack: number;
  /** Direction of the polyline there [rad]. */
  readonly yaw: number;
  /** The segment: from point i to the next. */
  readonly piece: number;
}

/** The nearest point of a polyline (x y pairs, at least two); O(number of points). */
export function nearestOnRoute(xy: ArrayLike<number>, closed: boolean, x: number, y: number): OnRoute {
  const count = xy.length / 2;
  let best: OnRoute = { crossTrack: Infinity, yaw: 0, piece: 0 };
  let bestDistance = Infinity;
  for (let i = 0; i < (closed ? count : count - 1); ++i) {
    const j = (i + 1) % count;
    const ax = xy[2 * i]!, ay = xy[2 * i + 1]!;
    const dx = xy[2 * j]! - ax, dy = xy[2 * j + 1]! - ay;
    const length2 = dx * dx + dy * dy;
    if (length2 === 0) continue;
    const along = Math.min(1, Math.max(0, ((x - ax) * dx + (y - ay) * dy) / length2));
    const distance = Math.hypot(x - ax - along * dx, y - ay - along * dy);
    if (distance >= bestDistance) continue;
    bestDistance = distance;
    const side = dx * (y - ay) - dy * (x - ax) >= 0 ? 1 : -1;
    best = { crossTrack: side * distance, yaw: Math.atan2(dy, dx), piece: i };
  }
  return best;
}

/**
 * The points (x y z, consecutive) that suffice to draw a polyline: no removed point is farther than `off` [m] from the line
 * through its kept neighbours. The first and the last are kept; O(number of points).
 */
export function thinned(xyz: ArrayLike<number>, off: number): number[] {
  const count = Math.floor(xyz.length / 3);
  const kept: number[] = count > 0 ? [0] : [];
  let anchor = 0, base = 0, low = -Infinity, high = Infinity, farthest = 0; // range of directions that pass all points since the anchor
  for (let i = 1; i < count; ++i) {
    const dx = xyz[3 * i]! - xyz[3 * anchor]!, dy = xyz[3 * i + 1]! - xyz[3 * anchor + 1]!, dz = xyz[3 * i + 2]! - xyz[3 * anchor + 2]!;
    const distance = Math.hypot(dx, dy);
    if (distance <= off && farthest <= off && Math.abs(dz) <= off) continue;
    const first = low === -Infinity;
    if (first) base = Math.atan2(dy, dx);
    const turned = first ? 0 : wrapAngle(Math.atan2(dy, dx) - base);
    if (turned < low || turned > high || distance < farthest - off || Math.abs(dz) > off) {
      if (anchor === i - 1) { // no point in between: this one is the next anchor
        kept.push(i);
        anchor = i;
      } else {
        kept.push(i - 1);
        anchor = i - 1;
        --i; // repeat from the new anchor
      }
      low = -Infinity; high = Infinity; farthest = 0;
      continue;
    }
    const half = Math.asin(Math.min(1, off / distance));
    low = Math.max(low, turned - half);
    high = Math.min(high, turned + half);
    farthest = Math.max(farthest, distance);
  }
  if (count > 1 && kept[kept.length - 1] !== count - 1) kept.push(count - 1);
  return kept;
}
