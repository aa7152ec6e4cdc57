/** Round numbers (1, 2 or 5 times a power of ten) on an axis from low to high: at least three, and as few as possible. */
export function ticksOf(low: number, high: number): number[] {
  const span = high - low;
  if (!(span > 0) || !Number.isFinite(span)) return [];
  let ticks: number[] = [];
  const top = Math.floor(Math.log10(span));
  for (let power = top; ticks.length < 3 && power >= top - 2; --power)
    for (const factor of [5, 2, 1]) if (ticks.length < 3) ticks = multiplesOf(factor, power, low, high);
  return ticks;
}

function multiplesOf(factor: number, power: number, low: number, high: number): number[] {
  const step = factor * 10 ** power, slack = 1e-9 * (high - low), ticks: number[] = [];
  for (let i = Math.ceil((low - slack) / step); i * step <= high + slack; ++i) ticks.push(Number((i * step).toPrecision(12)));
  return ticks;
}

/** Labels with as many decimals as the finest tick needs. */
export function labelsOf(ticks: readonly number[]): string[] {
  const decimals = Math.max(0, ...ticks.map((tick) => (String(tick).split(".")[1] ?? "").length));
  return ticks.map((tick) => tick.toFixed(Math.min(decimals, 6)));
}
