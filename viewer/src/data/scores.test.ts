import { describe, expect, it } from "vitest";
import { fromYaw, yawOf } from "../math/pose";
import { clockText, Playback } from "./playback";
import { marksOf, placeOdometry, poseBetween, scoresOf } from "./scores";
import { emptyTracks } from "./tracks";

const row = (t: number, x: number, y: number, yaw: number): number[] => {
  const { p, q } = fromYaw(x, y, yaw);
  return [t, ...p, ...q];
};

describe("scores", () => {
  const tracks = emptyTracks();
  for (let i = 0; i <= 20; ++i) {
    const t = i / 10;
    tracks.truth.push(...row(t, 5 + t, 2, 0)); // along x, 2 cm left of the route below
    tracks.odometry.push(...row(t, 0, t, Math.PI / 2), 1, 0); // the same trajectory, in its own frame
    tracks.estimate.push(...row(t, 5 + t, 2.01, 0.1), 0, 0, 0, 0);
  }
  const map_T_odom = placeOdometry(tracks);
  const scores = scoresOf(tracks, { closed: false, xy: Float64Array.from([0, 1.98, 100, 1.98]) }, map_T_odom);
  it("align odometry with the beginning of the truth", () => {
    expect(map_T_odom.p[0]).toBeCloseTo(5, 9);
    scores.headingOdometry.v.forEach((v) => expect(v).toBeCloseTo(0, 9));
  });
  it("measure the distance from the route in cm, left positive", () => {
    scores.crossTrackTruth.v.forEach((v) => expect(v).toBeCloseTo(2, 9));
    scores.crossTrackEstimate.v.forEach((v) => expect(v).toBeCloseTo(3, 9));
  });
  it("have no heading before the truth begins", () => {
    const early = emptyTracks();
    for (let i = 0; i < 10; ++i) early.odometry.push(...row(i, 0, 0, 0.1), 1, 0);
    for (let i = 5; i < 10; ++i) early.truth.push(...row(i, 0, 0, 0));
    const { headingOdometry } = scoresOf(early, undefined, fromYaw(0, 0, 0));
    expect(headingOdometry.t).toEqual([5, 6, 7, 8, 9]);
    headingOdometry.v.forEach((v) => expect(v).toBeCloseTo(5.7296, 3));
  });
  it("measure the heading in degrees", () => scores.headingEstimate.v.forEach((v) => expect(v).toBeCloseTo(5.7296, 3)));
  it("are empty without a route or truth", () => {
    const none = scoresOf(emptyTracks(), undefined, map_T_odom);
    expect(Object.values(none).every((curve) => curve.t.length === 0)).toBe(true);
  });
});

it("a pose between two rows is interpolated linearly, for any sign of the quaternions", () => {
  const { truth } = emptyTracks();
  truth.push(...row(0, 0, 0, 0.2));
  truth.push(...row(2, 4, 2, 0.6).map((v, i) => (i >= 4 ? -v : v)));
  const pose = poseBetween(truth, 1)!;
  expect(pose.p[0]).toBeCloseTo(2, 12);
  expect(yawOf(pose.q)).toBeCloseTo(0.4, 9);
  expect(poseBetween(truth, -1)).toBeUndefined();
  expect(poseBetween(truth, 9)!.p[0]).toBe(4);
});

it("marks show times without tags and stops of the robot", () => {
  const tracks = emptyTracks();
  for (let i = 0; i < 50; ++i) {
    const t = i / 10;
    tracks.tags.push(t, 0, t >= 1 && t < 2.5 ? -1 : 7, 0, 0, 0, 0, 0, 0, 0, 0);
    if (t < 1) tracks.tags.push(t, 0, 8, 0, 0, 0, 0, 0, 0, 0, 0);
    tracks.command.push(t, t >= 3 && t < 4 ? 0 : 0.3, 0);
  }
  expect(marksOf(tracks).map((m) => [m.kind, m.t])).toEqual([["blind", 1], ["stop", 3], ["go", 4]]);
  const { tagsInView } = scoresOf(tracks, undefined, fromYaw(0, 0, 0));
  expect([tagsInView.v[0], tagsInView.v[15], tagsInView.v[30]]).toEqual([2, 0, 1]);
});

describe("playback", () => {
  it("plays, ends, and restarts", () => {
    const play = new Playback();
    play.toggle();
    expect(play.playing).toBe(false); // nothing to play
    play.duration = 10;
    play.speed = 4;
    play.toggle();
    play.advance(1);
    expect(play.t).toBe(4);
    play.advance(5);
    expect([play.t, play.playing]).toEqual([10, false]);
    play.toggle();
    expect([play.t, play.playing]).toEqual([0, true]);
  });
  it("steps from frame to frame", () => {
    const play = new Playback();
    play.duration = 3;
    const times = [0, 0.5, 0.5, 1.5];
    const seen = [1, 1, 1, -1, -1].map((direction) => { play.step(times, direction as 1 | -1); return play.t; });
    expect(seen).toEqual([0.5, 1.5, 2.5, 1.5, 0.5]);
  });
  it("shows a clock", () => expect([0, 59.96, 65.34].map(clockText)).toEqual(["0:00.0", "1:00.0", "1:05.3"]));
});
