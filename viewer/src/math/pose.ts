// Rigid transforms as plain values. A name a_T_b takes coordinates in b to a.

export type Vec3 = readonly [number, number, number];
export type Quat = readonly [number, number, number, number]; // x y z w
export interface Pose {
  readonly p: Vec3;
  readonly q: Quat;
}

export const identity: Pose = { p: [0, 0, 0], q: [0, 0, 0, 1] };

export function multiply(a: Quat, b: Quat): Quat {
  const [ax, ay, az, aw] = a;
  const [bx, by, bz, bw] = b;
  return [
    aw * bx + ax * bw + ay * bz - az * by,
    aw * by - ax * bz + ay * bw + az * bx,
    aw * bz + ax * by - ay * bx + az * bw,
    aw * bw - ax * bx - ay * by - az * bz,
  ];
}

export const conjugate = (q: Quat): Quat => [-q[0], -q[1], -q[2], q[3]];

export function rotate(q: Quat, v: Vec3): Vec3 {
  const [x, y, z] = multiply(multiply(q, [v[0], v[1], v[2], 0]), conjugate(q));
  return [x, y, z];
}

export function transform(a_T_b: Pose, b_p: Vec3): Vec3 {
  const r = rotate(a_T_b.q, b_p);
  return [r[0] + a_T_b.p[0], r[1] + a_T_b.p[1], r[2] + a_T_b.p[2]];
}

export const compose = (a_T_b: Pose, b_T_c: Pose): Pose => ({
  p: transform(a_T_b, b_T_c.p),
  q: multiply(a_T_b.q, b_T_c.q),
});

export function inverse(a_T_b: Pose): Pose {
  const q = conjugate(a_T_b.q);
  const p = rotate(q, a_T_b.p);
  return { p: [-p[0], -p[1], -p[2]], q };
}

/** Heading about z [rad] of a pose whose z points up. */
export function yawOf(q: Quat): number {
  const [x, y, z, w] = q;
  return Math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z));
}

export const fromYaw = (x: number, y: number, yaw: number, z = 0): Pose => ({
  p: [x, y, z],
  q: [0, 0, Math.sin(yaw / 2), Math.cos(yaw / 2)],
});

/** Wraps an angle into (-π, π]. */
export function wrapAngle(angle: number): number {
  const turned = angle - 2 * Math.PI * Math.floor((angle + Math.PI) / (2 * Math.PI));
  return turned === -Math.PI ? Math.PI : turned;
}
