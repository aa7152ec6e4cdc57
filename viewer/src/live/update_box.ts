import { FamilyNames } from "../data/messages";
import { emptyTracks, trackNames, type TrackName } from "../data/tracks";
import type { Camera } from "../math/camera";
import type { Pose } from "../math/pose";
import type { Control, RobotState } from "./frames";
import type { LiveImage, Updates } from "./link_protocol";

const maxImages = 300; // ten seconds of history
const maxWarnings = 20;

interface Taken extends LiveImage {
  readonly hostTime: bigint;
}

/** Buffer between the connection, which never blocks, and the page, which may be slow: collects bounded updates for the page. */
export class UpdateBox {
  readonly tracks = emptyTracks();
  readonly families = new FamilyNames();
  private readonly sent = new Map<TrackName, number>();
  private name: string | undefined;
  private isLost: boolean | undefined;
  private cameraUpdate: { camera?: Camera; base_T_cam?: Pose } = {};
  private states: RobotState[] = [];
  private control: Control | undefined;
  private texts = new Map<string, string>();
  private words: string[] = [];
  private images: LiveImage[] = [];
  private waiting: Taken[] = []; // waiting for their tags
  private ready: Taken | undefined;
  /** Whether there is an update. */
  full = false;

  opened(name: string): void { this.name = name; this.isLost = false; this.full = true; }
  lost(): void { this.isLost = true; this.full = true; }
  warn(words: string): void { if (this.words.length < maxWarnings) this.words.push(words); this.full = true; }
  setCamera(camera: Camera | undefined, base_T_cam: Pose | undefined): void {
    this.cameraUpdate = { ...(camera ? { camera } : {}), ...(base_T_cam ? { base_T_cam } : {}) };
    this.full = true;
  }
  state(state: RobotState): void {
    if (this.states.at(-1)?.phase === state.phase) this.states.pop();
    this.states.push(state);
    this.full = true;
  }
  controlled(control: Control): void { this.control = control; this.full = true; }
  text(name: string, text: string): void { this.texts.set(name, text); this.full = true; }

  /** Call when the tracks have new rows. An image becomes ready when its tags have arrived. */
  grown(): void {
    this.full = true;
    const { tags } = this.tracks;
    const newest = tags.length > 0 ? tags.time(tags.length - 1) + 1e-6 : -Infinity;
    while (this.waiting.length > 0 && this.waiting[0]!.t <= newest) this.ready = this.waiting.shift();
  }
  image(t: number, hostTime: bigint, bytes: Uint8Array<ArrayBuffer>): void {
    this.images.push({ t, bytes });
    if (this.images.length > maxImages) this.images.shift();
    this.waiting.push({ t, hostTime, bytes });
    if (this.waiting.length > maxImages) this.waiting.shift();
    this.grown();
  }

  /** The next image to show, returned once. */
  takeImage(): { t: number; hostTime: bigint; bytes: Uint8Array<ArrayBuffer> } | undefined {
    const { ready } = this;
    this.ready = undefined;
    return ready;
  }
  /** All updates except that image; empties the box. */
  take(): Omit<Updates, "shown"> {
    const rows: Partial<Record<TrackName, Float64Array>> = {};
    for (const name of trackNames) {
      const from = this.sent.get(name) ?? 0;
      if (this.tracks[name].length === from) continue;
      rows[name] = this.tracks[name].since(from);
      this.sent.set(name, this.tracks[name].length);
    }
    const updates = {
      rows, families: this.families.names, ...this.cameraUpdate, states: this.states, words: this.words, images: this.images,
      texts: [...this.texts].map(([name, text]) => ({ name, text })),
      ...(this.name === undefined ? {} : { name: this.name }), ...(this.isLost === undefined ? {} : { lost: this.isLost }),
      ...(this.control ? { control: this.control } : {}),
    };
    this.name = this.isLost = this.control = undefined;
    this.cameraUpdate = {};
    this.states = [];
    this.words = [];
    this.images = [];
    this.texts = new Map();
    this.full = false;
    return updates;
  }
}
