// Colours and axes of all plots, from the style sheet, so that they fit dark and light.
import type uPlot from "uplot";
import { short } from "../logic/format";

export function colour(name: string): string {
  return getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim() || "#888";
}

export function axis(label: string): uPlot.Axis {
  return {
    label, labelSize: 18, labelFont: "12px system-ui, sans-serif", font: "12px system-ui, sans-serif",
    stroke: () => colour("ink-soft"), size: 56,
    grid: { stroke: () => colour("grid"), width: 1 },
    ticks: { stroke: () => colour("grid"), width: 1 },
    values: (_, values) => values.map((value) => (value === null ? "" : short(value, 5))),
  };
}

export const kSeriesColours = ["series-1", "series-2", "series-3", "series-4", "series-5", "series-6"];

export function seriesColour(i: number): () => string {
  return () => colour(kSeriesColours[i % kSeriesColours.length] ?? "series-1");
}

// As wide as what it stands in, also when that changes.
export function fitWidth(plot: uPlot, holder: HTMLElement, height: number): () => void {
  const fit = (): void => {
    const width = Math.floor(holder.clientWidth);
    if (width > 0 && width !== plot.width) plot.setSize({ width, height });
  };
  const observer = new ResizeObserver(fit);
  observer.observe(holder);
  fit();
  return () => observer.disconnect();
}
