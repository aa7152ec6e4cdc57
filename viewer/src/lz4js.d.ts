declare module "lz4js" {
  export function decompress(source: Uint8Array, maxSize?: number): Uint8Array;
}
