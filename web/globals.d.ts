/** What waymark.js, which emscripten writes, gives to the pages. */
interface WaymarkModule {
  readonly HEAPU8: Uint8Array;
  ccall(name: string, returns: "number", kinds: readonly string[], values: readonly (number | string)[]): number;
  ccall(name: string, returns: "string", kinds: readonly string[], values: readonly (number | string)[]): string;
}
declare function loadWaymark(): Promise<WaymarkModule>;
