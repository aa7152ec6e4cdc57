/** Bytes that are read piece by piece: a file of the reader's own, or one behind a URL. */
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

export class HttpSource implements RangeSource {
  readonly name: string;
  private total: bigint | undefined;

  constructor(private readonly url: string) {
    this.name = decodeURIComponent(url.split("/").pop() ?? url);
  }
  async size(): Promise<bigint> {
    if (this.total !== undefined) return this.total;
    const answer = await fetch(this.url, { method: "HEAD", cache: "no-store" });
    const length = answer.headers.get("content-length");
    if (!answer.ok || length === null) throw new Error(`${this.name}: ${answer.status} ${answer.statusText}`);
    this.total = BigInt(length);
    return this.total;
  }
  async read(offset: bigint, length: bigint): Promise<Uint8Array> {
    if (length === 0n) return new Uint8Array();
    const answer = await fetch(this.url, { headers: { range: `bytes=${offset}-${offset + length - 1n}` }, cache: "no-store" });
    if (answer.status !== 206) throw new Error(`${this.name}: the server gives no parts of files (${answer.status})`);
    const bytes = new Uint8Array(await answer.arrayBuffer());
    if (BigInt(bytes.length) !== length) throw new Error(`${this.name}: ${bytes.length} bytes instead of ${length}`);
    return bytes;
  }
}
