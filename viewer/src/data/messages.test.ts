import { describe, expect, it } from "vitest";
import { add, FamilyNames, kindOf, mountingOf, secondsOf } from "./messages";
import { compressedImageOf, imageOf } from "./images";
import { Series } from "./series";
import { emptyTracks, frameAt } from "./tracks";

const pose = { position: { x: 1, y: 2, z: 3 }, orientation: { x: 0, y: 0, z: 0, w: 1 } };

describe("topics", () => {
  it("are recognised by type, and truth by name", () => {
    expect(kindOf("/anything", "nav_msgs/msg/Odometry")).toBe("odometry");
    expect(kindOf("/truth/pose", "geometry_msgs/msg/PoseStamped")).toBe("truth");
    expect(kindOf("/goal", "geometry_msgs/msg/PoseStamped")).toBeUndefined();
    expect(kindOf("/waymark/pose_uncertain", "geometry_msgs/msg/PoseWithCovarianceStamped")).toBe("uncertain");
  });
});

describe("messages", () => {
  it("use their own stamp, or the log time if it is zero", () => {
    expect(secondsOf({ header: { stamp: { sec: 12, nanosec: 500_000_000 } } }, 0n, 10_000_000_000n)).toBeCloseTo(2.5, 12);
    expect(secondsOf({ header: { stamp: { sec: 0, nanosec: 0 } } }, 11_000_000_000n, 10_000_000_000n)).toBeCloseTo(1, 12);
    expect(secondsOf({}, 11_000_000_000n, 10_000_000_000n)).toBeCloseTo(1, 12);
  });
  it("are added to the tracks", () => {
    const tracks = emptyTracks(), families = new FamilyNames();
    const covariance = new Array<number>(36).fill(0);
    covariance[0] = 4; covariance[1] = 1; covariance[6] = 3; covariance[7] = 9; covariance[35] = 0.1;
    add(tracks, families, "estimate", 1, { pose: { pose, covariance } });
    expect(tracks.estimate.row(0)).toEqual([1, 1, 2, 3, 0, 0, 0, 1, 4, 2, 9, 0.1]);
    add(tracks, families, "nis", 2, { status: [{ level: 1, name: "tag36h11:5", values: [{ key: "nis", value: "7.5" }, { key: "degrees_of_freedom", value: "3" }] }] });
    expect(tracks.nis.row(0)).toEqual([2, 5, 7.5, 3, 0]);
  });
  it("have their corners ordered TL TR BR BL", () => {
    const tracks = emptyTracks(), families = new FamilyNames();
    const corners = [{ x: 0, y: 9 }, { x: 9, y: 9 }, { x: 9, y: 0 }, { x: 0, y: 0 }]; // BL BR TR TL
    add(tracks, families, "tags", 1, { detections: [{ family: "36h11", id: 3, corners }] });
    expect(tracks.tags.row(0)).toEqual([1, 0, 3, 0, 0, 9, 0, 9, 9, 0, 9]);
    expect(families.names).toEqual(["tag36h11"]);
  });
  it("keep unreliable tags apart from the others", () => {
    const tracks = emptyTracks(), families = new FamilyNames();
    const corners = [{ x: 0, y: 9 }, { x: 9, y: 9 }, { x: 9, y: 0 }, { x: 0, y: 0 }];
    add(tracks, families, "tags", 1, { detections: [] });
    add(tracks, families, kindOf("/unreliable_tags", "waymark_msgs/msg/UnreliableTags")!, 1, { index: [0], detections: [{ family: "36h11", id: 3, corners }] });
    expect(tracks.tags.row(0)[2]).toBe(-1);
    expect(tracks.unreliable.row(0)).toEqual([1, 0, 3, 0, 0, 9, 0, 9, 9, 0, 9]);
    add(tracks, families, "unreliable", 2, { index: [], detections: [] });
    expect(tracks.unreliable.length).toBe(1);
  });
  it("with non-finite numbers or earlier stamps are skipped", () => {
    const tracks = emptyTracks(), families = new FamilyNames();
    add(tracks, families, "command", 2, { twist: { linear: { x: NaN }, angular: { z: 0 } } });
    add(tracks, families, "command", 2, { linear: { x: 1 }, angular: { z: 0 } });
    add(tracks, families, "command", 1, { linear: { x: 1 }, angular: { z: 0 } });
    expect(tracks.command.length).toBe(1);
  });
  it("of a mounting contain the optical frame", () => {
    const transform = { translation: { x: 0.1, y: 0, z: 0.2 }, rotation: { x: 0, y: 0, z: 0, w: 1 } };
    expect(mountingOf({ transforms: [{ child_frame_id: "laser", transform }] })).toBeUndefined();
    expect(mountingOf({ transforms: [{ child_frame_id: "camera_optical", transform }] })!.p).toEqual([0.1, 0, 0.2]);
  });
});

describe("series", () => {
  const series = new Series(2, 1);
  for (const t of [0, 1, 1, 3]) series.push(t, 10 * t);
  it("grow, and find the row at a time", () => {
    expect([-0.5, 0, 0.5, 1, 2.9, 3, 99].map((t) => series.indexAt(t))).toEqual([-1, 0, 0, 2, 2, 3, 3]);
  });
  it("can be copied in parts", () => {
    const copy = new Series(2);
    copy.append(series.since(0));
    expect([...copy.column(1)]).toEqual([0, 10, 10, 30]);
  });
  it("reject a row of another width", () => expect(() => series.push(1)).toThrow("columns"));
  it("return the frame at a time", () => {
    expect(frameAt(series, 1.5)).toEqual([1, 3]);
    expect(frameAt(series, -1)).toEqual([0, 0]);
  });
});

describe("images", () => {
  it("with padding and reversed colours are converted", () => {
    const image = imageOf({ width: 1, height: 2, step: 4, encoding: "bgr8", is_bigendian: 0, data: new Uint8Array([1, 2, 3, 0, 4, 5, 6]) });
    expect(image.kind === "rgba" && [...image.rgba]).toEqual([3, 2, 1, 255, 6, 5, 4, 255]);
  });
  it("with inconsistent sizes are rejected", () => {
    expect(() => imageOf({ width: 9, height: 9, step: 9, encoding: "mono8", is_bigendian: 0, data: new Uint8Array(80) })).toThrow("9 x 9");
    expect(() => compressedImageOf(new Uint8Array(3))).toThrow("neither");
  });
});
