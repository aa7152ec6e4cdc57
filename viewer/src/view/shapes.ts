// Objects in the map, as three.js objects. Map axes: z up.
import {
  AxesHelper, BoxGeometry, BufferAttribute, BufferGeometry, ConeGeometry, DoubleSide, EdgesGeometry, Group, Line, LineBasicMaterial,
  LineLoop, LineSegments, Mesh, MeshBasicMaterial, MeshLambertMaterial, PlaneGeometry, Sprite, SpriteMaterial, type InterleavedBufferAttribute, type Object3D,
} from "three";
import { Line2 } from "three/examples/jsm/lines/Line2.js";
import { LineGeometry } from "three/examples/jsm/lines/LineGeometry.js";
import { LineMaterial } from "three/examples/jsm/lines/LineMaterial.js";
import { withoutIntrinsics, type Camera } from "../math/camera";
import { thinned, type Ellipse } from "../math/plane";
import type { Pose } from "../math/pose";
import type { MapTag, Route, Wall } from "../data/map_files";
import { labelTexture, tagBitmap, tagTexture } from "./tag_texture";

export function place(object: Object3D, pose: Pose): void {
  object.position.set(...(pose.p as [number, number, number]));
  object.quaternion.set(...(pose.q as [number, number, number, number]));
}

/** A printed tag with its id above; `changed` is called when its texture is loaded. */
export function tagObject(tag: MapTag, changed: () => void): Group {
  const group = new Group();
  place(group, tag.map_T_tag);
  const face = new Mesh(new PlaneGeometry(tag.size, tag.size), new MeshBasicMaterial({ color: 0x888888, side: DoubleSide }));
  face.rotation.x = Math.PI; // a plane faces along +z with y up; a tag along -z with y down
  group.add(face);
  const shelf = new Mesh(new BoxGeometry(tag.size, 0.02, 0.05), new MeshBasicMaterial({ color: 0x7b8594 })); // an upright face is invisible from above
  shelf.position.set(0, tag.size * 0.75, 0);
  group.add(shelf);
  const label = new Sprite(new SpriteMaterial({ map: labelTexture(String(tag.id)), depthTest: false }));
  label.scale.set(0.44, 0.22, 1);
  label.position.set(0, -tag.size * 0.5 - 0.14, 0);
  group.add(label);
  group.name = `${tag.family}:${tag.id}`;
  void tagBitmap(tag.family, tag.id).then((bitmap) => {
    if (!bitmap) return;
    const side = (tag.size * bitmap.total_width) / bitmap.width_at_border;
    face.geometry.dispose();
    face.geometry = new PlaneGeometry(side, side);
    face.material = new MeshBasicMaterial({ map: tagTexture(bitmap), side: DoubleSide, transparent: true });
    changed();
  });
  return group;
}

export function boxObject(wall: Wall): Group {
  const group = new Group();
  const geometry = new BoxGeometry(wall.length, wall.width, wall.height);
  group.add(new Mesh(geometry, new MeshLambertMaterial({ color: 0x9aa3b0, transparent: true, opacity: 0.35, depthWrite: false })));
  group.add(new LineSegments(new EdgesGeometry(geometry), new LineBasicMaterial({ color: 0x7b8594 })));
  group.position.set(wall.x, wall.y, wall.z);
  group.rotation.z = wall.yaw;
  return group;
}

export function polygonObject(points: readonly (readonly [number, number])[], color: number): Line {
  const flat = points.flatMap(([x, y]) => [x, y, 0.004]);
  return new LineLoop(geometryOf(flat), new LineBasicMaterial({ color }));
}

export function routeObject(route: Route, color: string): Line {
  const flat: number[] = [];
  for (let i = 0; i < route.xy.length; i += 2) flat.push(route.xy[i]!, route.xy[i + 1]!, 0.003);
  const material = new LineBasicMaterial({ color });
  return route.closed ? new LineLoop(geometryOf(flat), material) : new Line(geometryOf(flat), material);
}

const geometryOf = (flat: ArrayLike<number>): BufferGeometry =>
  new BufferGeometry().setAttribute("position", new BufferAttribute(Float32Array.from(flat), 3));

/** A trajectory: the driven part is opaque, the rest faint. Drawn with as few segments as its shape needs. */
export class PathObject {
  readonly object = new Group();
  private readonly done: Line2;
  private readonly tip: Line2; // from the last drawn point to the current position
  private readonly rows: readonly number[]; // rows that are drawn
  private readonly drawable: boolean;

  /** `width` in pixels; dashes in metres, 0 for none. */
  constructor(private readonly points: Float32Array, color: string, width: number, dash: number, height: number) {
    this.drawable = points.length >= 6;
    for (let i = 2; i < points.length; i += 3) points[i] = points[i]! + height;
    this.rows = thinned(points, 0.002);
    const drawn = Float32Array.from(this.rows.flatMap((row) => [points[3 * row]!, points[3 * row + 1]!, points[3 * row + 2]!]));
    const material = new LineMaterial({ color, linewidth: width, dashed: dash > 0, dashSize: dash, gapSize: dash * 0.6, depthWrite: false });
    const wideLine = (positions: ArrayLike<number>): Line2 => {
      const line = new Line2(new LineGeometry().setPositions(Float32Array.from(positions)), material);
      line.computeLineDistances();
      line.frustumCulled = false;
      line.renderOrder = height * 1000; // higher ones over lower ones at any distance
      this.object.add(line);
      return line;
    };
    this.done = wideLine(this.drawable ? drawn : [0, 0, 0, 0, 0, 0]);
    this.tip = wideLine([0, 0, 0, 0, 0, 0]);
    this.object.add(new Line(geometryOf(drawn), new LineBasicMaterial({ color, transparent: true, opacity: 0.35 })));
  }
  /** Draws up to this row, or to the last row that was known at construction. */
  until(wanted: number): void {
    const row = Math.min(wanted, this.points.length / 3 - 1);
    let low = 0, high = this.rows.length; // the last drawn point at or before the row
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.rows[middle]! <= row) low = middle + 1;
      else high = middle;
    }
    const last = this.rows[low - 1] ?? 0;
    this.done.visible = this.drawable && low > 1;
    this.done.geometry.instanceCount = Math.max(1, low - 1);
    this.tip.visible = this.drawable && row > last;
    if (!this.tip.visible) return;
    const ends = (this.tip.geometry.getAttribute("instanceStart") as InterleavedBufferAttribute).data;
    ends.set([...this.points.subarray(3 * last, 3 * last + 3), ...this.points.subarray(3 * row, 3 * row + 3)], 0);
    ends.needsUpdate = true;
  }
}

/** The robot: its body with an arrow forward, its axes, and the frustum of its camera. */
export function robotObject(color: string, hull: readonly [number, number, number], camera?: Camera, base_T_cam?: Pose): Group {
  const group = new Group();
  const [length, width, height] = hull;
  const geometry = new BoxGeometry(length, width, height);
  const body = new Group();
  body.add(new Mesh(geometry, new MeshLambertMaterial({ color, transparent: true, opacity: 0.6 })),
           new LineSegments(new EdgesGeometry(geometry), new LineBasicMaterial({ color })));
  body.position.z = height / 2;
  const bow = new Mesh(new ConeGeometry(width / 2, length / 2, 3), new MeshLambertMaterial({ color })); // points forward
  bow.scale.z = 0.1;
  bow.rotation.z = -Math.PI / 2;
  bow.position.set(length / 8, 0, height + 0.01);
  group.add(body, bow, new AxesHelper(0.3));
  if (!camera || !base_T_cam) return group;
  const eye = new Group();
  place(eye, base_T_cam);
  eye.add(new AxesHelper(0.12));
  const depth = 0.6;
  const corner = (u: number, v: number): number[] => [...withoutIntrinsics(camera, u, v).map((x) => x * depth), depth];
  const ends = [corner(0, 0), corner(camera.width, 0), corner(camera.width, camera.height), corner(0, camera.height)];
  const edges: number[] = [];
  ends.forEach((end, i) => edges.push(0, 0, 0, ...end, ...end, ...ends[(i + 1) % 4]!));
  eye.add(new LineSegments(geometryOf(edges), new LineBasicMaterial({ color, transparent: true, opacity: 0.7 })));
  group.add(eye);
  return group;
}

/** A unit circle; setEllipse() makes it a three-sigma ellipse. */
export function ellipseObject(color: string): LineLoop {
  const flat: number[] = [];
  for (let i = 0; i < 64; ++i) flat.push(Math.cos((i * Math.PI) / 32), Math.sin((i * Math.PI) / 32), 0);
  return new LineLoop(geometryOf(flat), new LineBasicMaterial({ color }));
}
export function setEllipse(object: Object3D, ellipse: Ellipse, x: number, y: number): void {
  object.position.set(x, y, 0.01);
  object.rotation.z = ellipse.angle;
  object.scale.set(Math.max(3 * ellipse.major, 1e-4), Math.max(3 * ellipse.minor, 1e-4), 1);
}
