import uPlot from "uplot";
import "uplot/dist/uPlot.min.css";
import type { Curve, Scores } from "../data/scores";
import { labelsOf, ticksOf } from "../math/ticks";

interface Line {
  readonly label: string;
  readonly color: string; // a custom property of the style sheet
  readonly curve: Curve;
  readonly dash?: number[];
  readonly points?: boolean;
}
interface Figure {
  readonly title: string;
  readonly unit: string;
  readonly lines: readonly Line[];
  readonly most?: number; // larger values are clipped, so that one outlier does not flatten the curve
}

export function figuresOf(scores: Scores): Figure[] {
  const figures: Figure[] = [
    { title: "Distance from the route", unit: "cm", lines: [
      { label: "truth", color: "--truth", curve: scores.crossTrackTruth },
      { label: "estimate", color: "--estimate", curve: scores.crossTrackEstimate, dash: [6, 4] }] },
    { title: "Heading error", unit: "°", lines: [
      { label: "odometry", color: "--odometry", curve: scores.headingOdometry, dash: [2, 3] },
      { label: "estimate", color: "--estimate", curve: scores.headingEstimate, dash: [6, 4] }] },
    { title: "Speed", unit: "m/s", lines: [
      { label: "odometry", color: "--odometry", curve: scores.speed },
      { label: "commanded", color: "--route", curve: scores.commanded, dash: [6, 4] }] },
    { title: "Tags in view", unit: "", lines: [{ label: "tags", color: "--text", curve: scores.tagsInView }] },
    { title: "Camera latency", unit: "ms", lines: [{ label: "latency", color: "--odometry", curve: scores.latency }] },
    { title: "NIS per degree of freedom (clipped at 10)", unit: "", most: 10, lines: [
      { label: "nis", color: "--estimate", curve: scores.nis, points: true }] },
  ];
  return figures.map((figure) => ({ ...figure, lines: figure.lines.filter((line) => line.curve.t.length > 1) }))
    .filter((figure) => figure.lines.length > 0);
}

/** Stacked figures with one cursor; a click seeks to that time. */
export class Plots {
  private plots: uPlot[] = [];
  private now = 0;
  private lastFigures: Figure[] = [];

  constructor(private readonly parent: HTMLElement, private readonly seek: (t: number) => void) {
    new ResizeObserver(() => this.plots.forEach((plot) => plot.setSize({ width: this.width, height: 110 }))).observe(parent);
  }

  private get width(): number {
    return Math.max(200, this.parent.clientWidth - 16);
  }

  show(figures: Figure[]): void {
    this.plots.forEach((plot) => plot.destroy());
    this.parent.replaceChildren();
    this.lastFigures = figures;
    this.plots = figures.map((figure) => this.draw(figure));
  }

  /** The same figures with more data; drawn again only if the set of figures changed. */
  refresh(figures: Figure[]): void {
    const names = (list: Figure[]): string => list.map((f) => f.title + f.lines.map((line) => line.label).join()).join("|");
    if (names(figures) !== names(this.lastFigures)) return this.show(figures);
    this.lastFigures = figures;
    figures.forEach((figure, i) => this.plots[i]?.setData(dataOf(figure)));
  }

  /** Draws again in the current colours. */
  recolour(): void {
    this.show(this.lastFigures);
  }

  at(t: number): void {
    this.now = t;
    this.plots.forEach((plot) => placeNow(plot, t));
  }

  private draw(figure: Figure): uPlot {
    const style = getComputedStyle(document.documentElement);
    const color = (name: string): string => style.getPropertyValue(name).trim();
    const title = document.createElement("h2");
    title.textContent = figure.unit ? `${figure.title} [${figure.unit}]` : figure.title;
    const holder = document.createElement("div");
    holder.setAttribute("role", "img");
    holder.setAttribute("aria-label", `${title.textContent} over time: ${figure.lines.map(summary).join("; ")}`);
    this.parent.append(title, holder);
    const axis = { stroke: color("--quiet"), grid: { stroke: color("--line"), width: 0.5 }, ticks: { stroke: color("--line") } };
    const options: uPlot.Options = {
      width: this.width, height: 110, legend: { show: false },
      cursor: { sync: { key: "time" }, drag: { x: false, y: false } },
      scales: { x: { time: false }, ...(figure.most === undefined ? {} : { y: { range: [0, figure.most * 1.04] as [number, number] } }) },
      axes: [{ ...axis, size: 24 }, { ...axis, size: 46, splits: (_plot, _axis, low, high) => ticksOf(low, high), values: (_plot, ticks) => labelsOf(ticks) }],
      series: [{}, ...figure.lines.map((line): uPlot.Series => ({
        label: line.label, stroke: color(line.color), width: line.points ? 0 : 1.5, spanGaps: true,
        ...(line.dash ? { dash: line.dash } : {}),
        points: { show: line.points === true, size: 3, fill: color(line.color) },
      }))],
      hooks: {
        draw: [(plot) => placeNow(plot, this.now)],
        ready: [(plot) => {
          const now = document.createElement("div");
          now.className = "now";
          plot.over.append(now);
          placeNow(plot, this.now);
          plot.over.addEventListener("click", () => this.seek(plot.posToVal(plot.cursor.left ?? 0, "x")));
        }],
      },
    };
    return new uPlot(options, dataOf(figure), holder);
  }
}

/** A line over the curves, which are not redrawn. */
function placeNow(plot: uPlot, t: number): void {
  const now = plot.over.querySelector<HTMLElement>(".now"), x = plot.valToPos(t, "x");
  if (now) now.style.transform = `translateX(${Number.isFinite(x) ? x : -9}px)`;
}

function summary(line: Line): string {
  const { v } = line.curve;
  let low = Infinity, high = -Infinity;
  for (const value of v) if (Number.isFinite(value)) { low = Math.min(low, value); high = Math.max(high, value); }
  return `${line.label} from ${low.toFixed(2)} to ${high.toFixed(2)}`;
}

function dataOf({ lines, most = Infinity }: Figure): uPlot.AlignedData {
  return joined(lines.map(({ curve: { t, v } }) => ({ t, v: most === Infinity ? v : v.map((value) => Math.min(value, most)) })));
}

/** Joins curves for uPlot, which needs one list of times; a curve without a value at a time has a gap. */
export function joined(curves: readonly Curve[]): uPlot.AlignedData {
  const tables = curves.map((curve): uPlot.AlignedData => [curve.t, curve.v]);
  return tables.length === 1 ? tables[0]! : uPlot.join(tables);
}
