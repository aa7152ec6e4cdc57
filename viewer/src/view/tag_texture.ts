import { CanvasTexture, NearestFilter, SRGBColorSpace } from "three";

/** The printed tag, cell by cell (`GET tags/FAMILY/ID`): 0 black, 1 white, . outside the tag; rows from TL as seen by a viewer. */
export interface TagBitmap {
  readonly cells: string;
  readonly total_width: number;
  readonly width_at_border: number;
}

const cache = new Map<string, Promise<TagBitmap | undefined>>();

/** Undefined if the server does not have the tag, or there is no server. */
export function tagBitmap(family: string, id: number): Promise<TagBitmap | undefined> {
  const url = `tags/${encodeURIComponent(family)}/${id}`;
  let bitmap = cache.get(url);
  if (!bitmap) {
    bitmap = fetch(url).then((answer) => (answer.ok ? (answer.json() as Promise<TagBitmap>) : undefined)).catch(() => undefined);
    cache.set(url, bitmap);
  }
  return bitmap;
}

export function tagTexture({ cells, total_width }: TagBitmap): CanvasTexture {
  const canvas = document.createElement("canvas");
  canvas.width = canvas.height = total_width;
  const context = canvas.getContext("2d")!;
  for (let i = 0; i < cells.length; ++i) {
    if (cells[i] === ".") continue;
    context.fillStyle = cells[i] === "1" ? "#fff" : "#000";
    context.fillRect(i % total_width, Math.floor(i / total_width), 1, 1);
  }
  return finish(new CanvasTexture(canvas));
}

export function labelTexture(text: string): CanvasTexture {
  const canvas = document.createElement("canvas");
  canvas.width = 128;
  canvas.height = 64;
  const context = canvas.getContext("2d")!;
  context.font = "bold 44px system-ui, sans-serif";
  context.textAlign = "center";
  context.textBaseline = "middle";
  context.lineWidth = 8;
  context.strokeStyle = "#fff";
  context.strokeText(text, 64, 32);
  context.fillStyle = "#14171c";
  context.fillText(text, 64, 32);
  const texture = new CanvasTexture(canvas);
  texture.colorSpace = SRGBColorSpace;
  return texture;
}

function finish(texture: CanvasTexture): CanvasTexture {
  texture.magFilter = NearestFilter;
  texture.colorSpace = SRGBColorSpace;
  return texture;
}
