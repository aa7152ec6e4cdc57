import { describe, expect, it } from "vitest";
import { rotate } from "../math/pose";
import { facingTag, parseMap, parseRoute, parseTum, parseWorld } from "./map_files";

const map = (tag: string): string => `format: waymark-map-1\nanchor: "tag36h11:0"\ntags:\n  - {tag: "${tag}", size_m: 0.16, position_m: [1, 2, 0.3], quaternion_xyzw: [0, 0, 0, 1]}\n`;

describe("map.yaml", () => {
  it("returns the tags", () => {
    expect(parseMap(map("tag36h11:7"))).toEqual([{ family: "tag36h11", id: 7, size: 0.16, map_T_tag: { p: [1, 2, 0.3], q: [0, 0, 0, 1] } }]);
  });
  it("reports errors", () => {
    expect(() => parseMap("tags: []")).toThrow("not a map");
    expect(() => parseMap(map("seven"))).toThrow("not a tag");
    expect(() => parseMap(map("tag36h11:7").replace("0.16", "wide"))).toThrow("'size_m'");
    expect(() => parseMap("- 1")).toThrow("not a table");
  });
  it("rejects a truncated file", () => {
    const counted = map("tag36h11:7").replace("anchor", "tag_count: 1\nanchor");
    expect(parseMap(`${counted}end: 1\n`)).toHaveLength(1);
    expect(() => parseMap(counted)).toThrow("truncated");
    expect(() => parseMap(`${counted.replace("tag_count: 1", "tag_count: 2")}end: 2\n`)).toThrow("'tag_count' is 2");
  });
  it("converts the tangent's covariance to the uncertainty of the centre", () => {
    const upper = new Array<number>(21).fill(0); // only a yaw about the map origin with variance 0.0001, the last entry of row 5
    upper[20] = 1e-4;
    const tag = parseMap(map("tag36h11:7").replace("}", `, covariance: [${upper.join(", ")}]}`))[0]!;
    expect(tag.sigma![0]).toBeCloseTo(0.02, 9); // y = 2 m away
    expect(tag.sigma![1]).toBeCloseTo(0.01, 9); // x = 1 m away
    expect(tag.sigma![2]).toBe(0);
  });
});

describe("route.yaml", () => {
  it("returns the points", () => {
    const route = parseRoute("format: waymark-route-1\nclosed: true\npoints: [[0, 1, 2, 0, 0, 0.3], [1, 3, 4, 0, 0, 0.3]]");
    expect([...route.xy]).toEqual([1, 2, 3, 4]);
    expect(route.closed).toBe(true);
  });
  it("rejects a single point", () => {
    expect(() => parseRoute("format: waymark-route-1\npoints: [[0, 1, 2, 0, 0, 0.3]]")).toThrow("two points");
  });
  it("rejects a truncated file", () => {
    const points = "points: [[0, 1, 2, 0, 0, 0.3], [1, 3, 4, 0, 0, 0.3]]";
    expect(() => parseRoute(`format: waymark-route-1\npoint_count: 3\n${points}`)).toThrow("truncated");
  });
});

describe("a world", () => {
  it("places an upright tag as its map does", () => {
    const q = facingTag(0, 0, 0, (-126.8698976 * Math.PI) / 180, 0).q; // from `waymark map` for tag 0 of circuit24
    const wanted = [-0.6707616, 0.223783, -0.223783, 0.6707616];
    const sign = Math.sign(q[3]) === Math.sign(wanted[3]!) ? 1 : -1;
    wanted.forEach((v, i) => expect(sign * q[i]!).toBeCloseTo(v, 3));
  });
  it("points a tag tilted by a right angle upwards", () => {
    const into = rotate(facingTag(0, 0, 0, 0.3, Math.PI / 2).q, [0, 0, 1]);
    expect(into[2]).toBeCloseTo(-1, 9);
  });
  it("converts walls to boxes, and places tags on panels", () => {
    const world = parseWorld("name: w\nwalls:\n  - {from_m: [0, 0], to_m: [0, 4]}\npanels:\n  - {x_m: 1, y_m: 3, z_m: 0.5, facing_deg: 0, tags: [{id: 7, right_m: 0.2, up_m: 0.05}]}");
    expect(world.boxes[0]).toMatchObject({ x: 0, y: 2, length: 4, height: 2.5 });
    world.tags[0]!.map_T_tag.p.forEach((v, i) => expect(v).toBeCloseTo([1, 3.2, 0.55][i]!, 9));
  });
});

it("TUM text", () => {
  expect(parseTum("# a\n1 2 3 4 0 0 0 1\n\n")).toEqual([[1, 2, 3, 4, 0, 0, 0, 1]]);
  expect(() => parseTum("1 2 3")).toThrow("8 numbers");
});
