import { projectTag, type Camera } from "../math/camera";
import type { Pose } from "../math/pose";
import type { MapTag } from "../data/map_files";
import type { SourceImage } from "../data/images";
import { frameAt, type Tracks } from "../data/tracks";

/** A tag detected in an image: pixel centres at integers, corners TL TR BR BL. */
export interface Quad {
  readonly name: string;
  readonly unreliable: boolean; // the image contradicts the corners, so no estimate uses them
  readonly corners: readonly (readonly [number, number])[];
}

/** The tags of the last frame at t: first those with usable corners, then the unreliable ones. */
export function quadsAt({ tags, unreliable }: Tracks, families: readonly string[], t: number): Quad[] {
  const quads: Quad[] = [];
  const take = (series: typeof tags, [from, to]: [number, number]): void => {
    for (let row = from; row < to; ++row) {
      const v = series.row(row);
      if (v[2]! < 0) continue;
      quads.push({ name: `${families[v[1]!] ?? "tag"}:${v[2]}`, unreliable: series === unreliable,
                   corners: [0, 1, 2, 3].map((i) => [v[3 + 2 * i]!, v[4 + 2 * i]!] as const) });
    }
  };
  const frame = frameAt(tags, t);
  take(tags, frame);
  const stamp = frame[1] > 0 ? tags.time(frame[1] - 1) : NaN, others = frameAt(unreliable, t);
  if (others[1] > 0 && unreliable.time(others[1] - 1) === stamp) take(unreliable, others);
  return quads;
}

/** The text below the image: the tags in view. */
export function wordsOf(quads: readonly Quad[], searched: boolean): string {
  if (!searched) return "the recording has no detections";
  if (quads.length === 0) return "no tag in view";
  return quads.map(({ name, unreliable }) => (unreliable ? `${name} (dashed: unreliable corners, not used)` : name)).join(", ");
}

/** The camera image with the detected quads, and crosses where map and estimate expect their corners. */
export class CameraView {
  private image: ImageData | ImageBitmap | undefined;

  constructor(private readonly canvas: HTMLCanvasElement, private readonly words: HTMLElement) {}

  async show(image: SourceImage | undefined): Promise<void> {
    if (!image) this.image = undefined;
    else if (image.kind === "rgba") this.image = new ImageData(image.rgba, image.width, image.height);
    else this.image = await createImageBitmap(new Blob([image.bytes], { type: image.mime }));
  }

  /** Takes ownership of the bitmap. */
  showBitmap(bitmap: ImageBitmap): void {
    if (this.image instanceof ImageBitmap) this.image.close();
    this.image = bitmap;
  }

  draw(camera: Camera | undefined, quads: readonly Quad[], expected: ReadonlyMap<string, MapTag>, map_T_cam: Pose | undefined,
       searched: boolean): void {
    const width = this.image?.width ?? camera?.width ?? 640, height = this.image?.height ?? camera?.height ?? 480;
    if (this.canvas.width !== width || this.canvas.height !== height) Object.assign(this.canvas, { width, height });
    const context = this.canvas.getContext("2d")!;
    if (this.image instanceof ImageData) context.putImageData(this.image, 0, 0);
    else if (this.image) context.drawImage(this.image, 0, 0);
    else { context.fillStyle = "#20252c"; context.fillRect(0, 0, width, height); }
    const residuals: number[] = [];
    for (const quad of quads) {
      this.drawQuad(context, quad, width);
      const tag = quad.unreliable ? undefined : expected.get(quad.name);
      const wanted = tag && camera && map_T_cam ? projectTag(camera, map_T_cam, tag.map_T_tag, tag.size) : undefined;
      if (wanted) residuals.push(...this.drawCrosses(context, quad, wanted, width));
    }
    const rms = Math.sqrt(residuals.reduce((sum, r) => sum + r * r, 0) / residuals.length);
    this.words.textContent = wordsOf(quads, searched) +
      (residuals.length > 0 ? `; residual ${rms.toFixed(2)} px rms (crosses: where map and estimate expect the corners)` : "");
  }

  private drawQuad(context: CanvasRenderingContext2D, quad: Quad, width: number): void {
    const points = quad.corners.map(([x, y]) => [x + 0.5, y + 0.5] as const); // canvas: pixel centres at half-integers
    context.lineWidth = Math.max(1.5, width / 400);
    context.strokeStyle = "#f0e442";
    context.beginPath();
    points.forEach(([x, y], i) => (i === 0 ? context.moveTo(x, y) : context.lineTo(x, y)));
    context.closePath();
    if (quad.unreliable) context.setLineDash([width / 80, width / 120]);
    context.stroke();
    context.setLineDash([]);
    if (!quad.unreliable) {
      this.line(context, points[3]!, points[2]!, "#d55e00"); // x axis: along its lower edge
      this.line(context, points[3]!, points[0]!, "#56b4e9"); // up: its left edge
    }
    const x = points.reduce((sum, p) => sum + p[0], 0) / 4, y = points.reduce((sum, p) => sum + p[1], 0) / 4;
    context.font = `bold ${Math.round(width / 36)}px system-ui, sans-serif`;
    context.textAlign = "center";
    context.textBaseline = "middle";
    context.lineWidth = width / 160;
    context.strokeStyle = "#000";
    const id = quad.name.split(":")[1]!;
    context.strokeText(id, x, y);
    context.fillStyle = "#fff";
    context.fillText(id, x, y);
  }

  private drawCrosses(context: CanvasRenderingContext2D, quad: Quad, wanted: readonly (readonly [number, number])[], width: number): number[] {
    const arm = width / 120;
    return wanted.map(([x, y], i) => {
      this.line(context, [x + 0.5 - arm, y + 0.5], [x + 0.5 + arm, y + 0.5], "#009e73");
      this.line(context, [x + 0.5, y + 0.5 - arm], [x + 0.5, y + 0.5 + arm], "#009e73");
      return Math.hypot(x - quad.corners[i]![0], y - quad.corners[i]![1]);
    });
  }

  private line(context: CanvasRenderingContext2D, from: readonly [number, number], to: readonly [number, number], color: string): void {
    context.strokeStyle = color;
    context.lineWidth = Math.max(1.5, context.canvas.width / 400);
    context.beginPath();
    context.moveTo(...(from as [number, number]));
    context.lineTo(...(to as [number, number]));
    context.stroke();
  }
}
