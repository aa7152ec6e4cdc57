import { afterEach, describe, expect, it, vi } from "vitest";
import { HttpSource } from "./range_source";

/** A server that returns parts of a file; records the requests. */
function serve(file: Uint8Array<ArrayBuffer>, requested: string[], status = 206): void {
  vi.stubGlobal("location", new URL("http://x/worker.js"));
  vi.stubGlobal("fetch", (_url: string, { method, headers }: { method?: string; headers?: Record<string, string> }) => {
    const range = headers?.["range"] ?? "";
    requested.push(range || method!);
    if (method === "HEAD") return Promise.resolve(new Response(null, { headers: { "content-length": String(file.length) } }));
    const [, from, to] = /^bytes=(\d*)-(\d*)$/.exec(range)!;
    if (file.length === 0) return Promise.resolve(new Response(null, { status: 416 }));
    const first = from === "" ? Math.max(0, file.length - Number(to)) : Number(from);
    const last = from === "" || to === "" ? file.length - 1 : Math.min(file.length - 1, Number(to));
    return Promise.resolve(new Response(status === 206 ? file.slice(first, last + 1) : file, { status, headers: { "content-range": `bytes ${first}-${last}/${file.length}` } }));
  });
}
afterEach(() => vi.unstubAllGlobals());

describe("a file at a URL", () => {
  const file = Uint8Array.from({ length: 1_000_000 }, (_, i) => (i * 7919) >> 3);

  it("is read exactly, with one request for each end", async () => {
    const requested: string[] = [];
    serve(file, requested);
    const source = new HttpSource("http://x/files/0/a%20lap.mcap");
    expect(source.name).toBe("a lap.mcap");
    const places: [number, number][] = [[0, 8], [8, 100], [65000, 536], [999_000, 1000], [800_000, 5], [65_530, 10], [400_000, 50_000], [700_000, 100_000]];
    for (const [offset, length] of places)
      expect(await source.read(BigInt(offset), BigInt(length)), `${length} from ${offset}`).toEqual(file.slice(offset, offset + length));
    expect(await source.size()).toBe(1_000_000n);
    expect(requested).toEqual(["bytes=-262144", "bytes=0-65535", "bytes=65530-65539", "bytes=400000-449999", "bytes=700000-799999"]);
  });
  it("requests the length first on another site", async () => {
    const requested: string[] = [];
    serve(file, requested);
    const source = new HttpSource("https://elsewhere/lap.mcap");
    expect(await source.read(999_000n, 1000n)).toEqual(file.slice(999_000));
    expect(await source.size()).toBe(1_000_000n);
    expect(requested).toEqual(["HEAD", "bytes=737856-999999"]);
  });
  it("may be small, empty or truncated", async () => {
    const requested: string[] = [];
    serve(file.slice(0, 100), requested);
    const small = new HttpSource("http://x/small.mcap");
    expect(await small.read(10n, 20n)).toEqual(file.slice(10, 30));
    await expect(small.read(90n, 20n)).rejects.toThrow("small.mcap: ends before byte 110");
    serve(new Uint8Array(), requested);
    expect(await new HttpSource("http://x/empty.mcap").size()).toBe(0n);
  });
  it("needs a server that supports ranges", async () => {
    serve(file, [], 200);
    await expect(new HttpSource("http://x/whole.mcap").size()).rejects.toThrow("does not support ranges (200)");
    serve(file, [], 404);
    await expect(new HttpSource("http://x/gone.mcap").size()).rejects.toThrow("gone.mcap: 404");
  });
});
