// Camera placement so that a scene fits into the image.
import type { Vec3 } from "./pose";

/** The axes of a camera that looks along `forward`, with `up` pointing up in its image. */
export interface ViewAxes {
  readonly right: Vec3;
  readonly up: Vec3;
  readonly forward: Vec3;
}

const dot = (a: Vec3, b: Vec3): number => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];

/**
 * The smallest distance [m] from `target`, against `axes.forward`, at which a pinhole camera has all points in its image. `tanHalf` is the
 * tangent of half the vertical field of view, `aspect` width over height of the image. O(number of points).
 */
export function distanceToFit(points: readonly Vec3[], target: Vec3, axes: ViewAxes, tanHalf: number, aspect: number): number {
  let distance = 0;
  for (const point of points) {
    const d: Vec3 = [point[0] - target[0], point[1] - target[1], point[2] - target[2]];
    const lateral = Math.max(Math.abs(dot(d, axes.right)) / (tanHalf * aspect), Math.abs(dot(d, axes.up)) / tanHalf);
    distance = Math.max(distance, lateral - dot(d, axes.forward));
  }
  return distance;
}
