/** An image in a form that the page can draw. */
export type SourceImage =
  | { readonly kind: "rgba"; readonly width: number; readonly height: number; readonly rgba: Uint8ClampedArray<ArrayBuffer> }
  | { readonly kind: "file"; readonly mime: string; readonly bytes: Uint8Array<ArrayBuffer> };

interface RawImage {
  width: number;
  height: number;
  step: number;
  encoding: string;
  is_bigendian: number;
  data: Uint8Array;
}

// Bytes per pixel, and the offsets of red, green and blue.
const layouts: Record<string, readonly [number, number, number, number]> = {
  mono8: [1, 0, 0, 0], "8UC1": [1, 0, 0, 0], rgb8: [3, 0, 1, 2], bgr8: [3, 2, 1, 0], rgba8: [4, 0, 1, 2], bgra8: [4, 2, 1, 0],
  yuv422_yuy2: [2, 0, 0, 0], yuv422: [2, 1, 1, 1], // the grey byte
};

/** Converts a sensor_msgs/Image; throws an error with the reason if it cannot be drawn. */
export function imageOf(image: RawImage): SourceImage {
  const { width, height, step, encoding, data } = image;
  const sixteen = encoding === "mono16" || encoding === "16UC1";
  const high = image.is_bigendian ? 0 : 1;
  const layout = sixteen ? ([2, high, high, high] as const) : layouts[encoding];
  if (!layout) throw new Error(`unsupported image encoding '${encoding}'`);
  const [bytes, r, g, b] = layout;
  if (width * height > 1e8 || step < width * bytes || data.length < step * (height - 1) + width * bytes)
    throw new Error(`invalid image of ${width} x ${height} with ${data.length} bytes`);
  const rgba = new Uint8ClampedArray(width * height * 4);
  for (let y = 0, to = 0; y < height; ++y) {
    for (let x = 0, from = y * step; x < width; ++x, from += bytes, to += 4) {
      rgba[to] = data[from + r]!;
      rgba[to + 1] = data[from + g]!;
      rgba[to + 2] = data[from + b]!;
      rgba[to + 3] = 255;
    }
  }
  return { kind: "rgba", width, height, rgba };
}

/** Converts a sensor_msgs/CompressedImage, recognised by its first bytes. */
export function compressedImageOf(data: Uint8Array): SourceImage {
  const mime = data[0] === 0x89 && data[1] === 0x50 ? "image/png" : data[0] === 0xff && data[1] === 0xd8 ? "image/jpeg" : "";
  if (mime === "") throw new Error("the compressed image is neither JPEG nor PNG");
  return { kind: "file", mime, bytes: data.slice() };
}
