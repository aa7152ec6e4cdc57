import { parseMap, parseRoute, parseTum, parseWorld, type MapTag, type Route, type World } from "./data/map_files";
import type { Answer, Request } from "./data/protocol";
import type { RecordingInfo } from "./data/recording";
import { emptyTracks, trackNames, type TrackName, type Tracks } from "./data/tracks";

/** The open content: a recording, a map, or both. */
export interface Content {
  info: RecordingInfo | undefined;
  tracks: Tracks;
  families: readonly string[];
  complete: boolean;
  tags: MapTag[];
  route: Route | undefined;
  otherRoutes: Map<string, Route>; // route-NAME.yaml, as written by `waymark optimize`
  world: World | undefined;
  hull: [number, number, number];
  tagSize: number | undefined; // [m], of a running robot
  seen: MapTag[]; // placed by odometry, before there is a map
}

export const emptyContent = (): Content => ({
  info: undefined, tracks: emptyTracks(), families: [], complete: false, tags: [], route: undefined, otherRoutes: new Map(), world: undefined, hull: [0.32, 0.22, 0.25],
  tagSize: undefined, seen: [],
});

/** Adds a text file to the content; returns a message if it contains nothing that can be shown. */
export function takeText(content: Content, name: string, text: string): string | undefined {
  const base = name.split("/").pop() ?? name;
  try {
    if (text.includes("format: waymark-map-1")) content.tags = parseMap(text);
    else if (text.includes("format: waymark-route-1")) {
      const other = /^route-(.+)\.yaml$/.exec(base)?.[1];
      if (other === undefined) content.route = parseRoute(text);
      else content.otherRoutes.set(other, parseRoute(text));
    }
    else if (base === "tags.yaml") content.tagSize = Number(/tag_size_m: *([0-9.eE+-]+)/.exec(text)?.[1]) || undefined;
    else if (base === "robot.yaml") content.hull = hullOf(text);
    else if (base === "truth_trajectory.txt") takeTrajectory(content, "truth", text);
    else if (base === "trajectory.txt") takeTrajectory(content, "estimate", text);
    else if (/^tag_family:/m.test(text)) content.world = parseWorld(text);
    else return `${name}: neither a map nor a route. Open a recording, or map.yaml and route.yaml of a folder that waymark map wrote.`;
  } catch (error) {
    return `${name}: ${(error as Error).message}`;
  }
  return undefined;
}

function hullOf(text: string): [number, number, number] {
  const value = (key: string): number => Number(new RegExp(`${key}: *([0-9.]+)`).exec(text)?.[1] ?? NaN);
  const hull: [number, number, number] = [value("front_m") + value("rear_m"), value("width_m"), value("height_m")];
  return hull.every(Number.isFinite) ? hull : [0.32, 0.22, 0.25];
}

function takeTrajectory(content: Content, name: "truth" | "estimate", text: string): void {
  const rows = parseTum(text);
  const start = rows[0]?.[0] ?? 0;
  for (const row of rows) content.tracks[name].push(row[0]! - start, ...row.slice(1), ...(name === "estimate" ? [0, 0, 0, 0] : []));
  content.complete = true;
}

/** Poses of the tags from the best source: the map, or else the simulator's world. */
export const tagsOf = (content: Content): readonly MapTag[] => (content.tags.length > 0 ? content.tags : (content.world?.tags ?? []));

/** Tags to draw: those of the map or the world, or else those observed so far. */
export const drawnTagsOf = (content: Content): readonly MapTag[] => (tagsOf(content).length > 0 ? tagsOf(content) : content.seen);

const newWorker = (): Worker => new Worker(new URL("./data/worker.ts", import.meta.url), { type: "module" });

/** The worker that reads the recording. One image is requested at a time; of later requests only the last is kept. */
export class Reader {
  private worker: Worker | undefined;
  private spare: Worker | undefined = newWorker(); // starts together with the page
  private pending = false;
  private nextTime: number | undefined;

  constructor(private readonly onAnswer: (answer: Answer) => void) {}

  open(source: File | string): void {
    this.worker?.terminate();
    this.pending = true; // the first image is sent without a request
    this.nextTime = undefined;
    this.worker = this.spare ?? newWorker();
    this.spare = undefined;
    this.worker.onmessage = ({ data }: MessageEvent<Answer>) => this.receive(data);
    this.worker.onerror = (event) => this.onAnswer({ type: "failed", words: event.message || "the reader did not start" });
    this.post({ ask: "open", source });
  }
  image(t: number): void {
    if (this.pending) { this.nextTime = t; return; }
    this.pending = true;
    this.post({ ask: "image", t });
  }
  private receive(answer: Answer): void {
    this.onAnswer(answer);
    if (answer.type !== "image") return;
    this.pending = false;
    const { nextTime } = this;
    this.nextTime = undefined;
    if (nextTime !== undefined) this.image(nextTime);
  }
  private post(request: Request): void {
    this.worker?.postMessage(request);
  }
}

export function takeRows(content: Content, rows: Partial<Record<TrackName, Float64Array>>): void {
  for (const name of trackNames) {
    const part = rows[name];
    if (part) content.tracks[name].append(part);
  }
}

/** A file that the server offers (`GET session.json`). */
export interface Offer {
  readonly name: string;
  readonly url: string;
  readonly kind: "recording" | "text";
  readonly size_bytes: number;
}
