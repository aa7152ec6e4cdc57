/** Random-access bytes: of a local file, or of a URL. */
export interface RangeSource {
  readonly name: string;
  size(): Promise<bigint>;
  read(offset: bigint, length: bigint): Promise<Uint8Array>;
}

export class BlobSource implements RangeSource {
  constructor(private readonly blob: Blob, readonly name: string) {}
  size(): Promise<bigint> {
    return Promise.resolve(BigInt(this.blob.size));
  }
  async read(offset: bigint, length: bigint): Promise<Uint8Array> {
    const part = this.blob.slice(Number(offset), Number(offset + length));
    if (BigInt(part.size) !== length) throw new Error(`${this.name}: ends before byte ${offset + length}`);
    return new Uint8Array(await part.arrayBuffer());
  }
}

const tailBytes = 256 * 1024; // enough for the index of an hour
const headBytes = 64 * 1024;

/** Requests the beginning and the end of the file, which contains its index, only once, because most small reads are there. */
export class HttpSource implements RangeSource {
  readonly name: string;
  private tail: Promise<{ readonly total: bigint; readonly bytes: Uint8Array }> | undefined;
  private head: Promise<Uint8Array> | undefined;

  constructor(private readonly url: string) {
    this.name = decodeURIComponent(url.split("/").pop() ?? url);
  }
  async size(): Promise<bigint> {
    return (await this.ending()).total;
  }
  async read(offset: bigint, length: bigint): Promise<Uint8Array> {
    if (length === 0n) return new Uint8Array();
    const { total, bytes } = await this.ending();
    const end = offset + length, tailStart = total - BigInt(bytes.length);
    if (end > total) throw new Error(`${this.name}: ends before byte ${end}`);
    if (offset >= tailStart) return bytes.slice(Number(offset - tailStart), Number(end - tailStart));
    if (end <= BigInt(headBytes)) {
      this.head ??= this.fetchPart(`0-${Math.min(headBytes, Number(total)) - 1}`).then((answer) => answer.bytes);
      return (await this.head).slice(Number(offset), Number(end));
    }
    const part = await this.fetchPart(`${offset}-${end - 1n}`);
    if (BigInt(part.bytes.length) !== length) throw new Error(`${this.name}: ${part.bytes.length} bytes instead of ${length}`);
    return part.bytes;
  }

  private ending(): Promise<{ readonly total: bigint; readonly bytes: Uint8Array }> {
    return (this.tail ??= this.isSameOrigin() ? this.localEnding() : this.foreignEnding());
  }
  private isSameOrigin(): boolean {
    return new URL(this.url, location.href).origin === location.origin;
  }
  private async localEnding(): Promise<{ readonly total: bigint; readonly bytes: Uint8Array }> {
    const answer = await this.fetchPart(`-${tailBytes}`);
    if (answer.total === undefined) throw new Error(`${this.name}: the server does not send the file size`);
    return { total: answer.total, bytes: answer.bytes };
  }
  /** Other sites allow ranges with a start only, and send the file size only for HEAD requests. */
  private async foreignEnding(): Promise<{ readonly total: bigint; readonly bytes: Uint8Array }> {
    const answer = await fetch(this.url, { method: "HEAD", cache: "no-store" });
    const length = answer.headers.get("content-length");
    if (!answer.ok || length === null) throw new Error(`${this.name}: ${answer.status} ${answer.statusText}`);
    const total = Number(length);
    return { total: BigInt(length), bytes: (await this.fetchPart(`${Math.max(0, total - tailBytes)}-${Math.max(0, total - 1)}`)).bytes };
  }
  private async fetchPart(range: string): Promise<{ readonly total: bigint | undefined; readonly bytes: Uint8Array }> {
    const answer = await fetch(this.url, { headers: { range: `bytes=${range}` }, cache: "no-store" });
    if (answer.status === 416) return { total: 0n, bytes: new Uint8Array() }; // an empty file has no ranges
    if (!answer.ok) throw new Error(`${this.name}: ${answer.status} ${answer.statusText}`);
    if (answer.status !== 206) {
      void answer.body?.cancel();
      throw new Error(`${this.name}: the server does not support ranges (${answer.status})`);
    }
    const total = /^bytes \d+-\d+\/(\d+)$/.exec(answer.headers.get("content-range") ?? "")?.[1];
    return { total: total === undefined ? undefined : BigInt(total), bytes: new Uint8Array(await answer.arrayBuffer()) };
  }
}
