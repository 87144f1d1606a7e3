"use strict";
// The H0 barcode of a frame: bars of regions, the longest of those that die, and how many die where.
const ROW = 7, REGION_ROW = 10, BARS_LEFT = 62, BARS_RIGHT = 32, HISTOGRAM = 90;

function regionColor(label) { return `rgb(${run.palette[label ? (label - 1) % (run.palette.length - 1) + 1 : 0].join(",")})`; }

function drawBarcode(figure, bars) {
  const svg = figure.querySelector("svg"), width = Math.max(220, figure.clientWidth), space = width - BARS_LEFT - BARS_RIGHT;
  const x = (mm) => BARS_LEFT + Math.min(1, mm / bars.max_mm) * space;
  svg.replaceChildren();
  let y = 8;
  const group = (rows, height, draw, name) => {
    if (!rows.length) return;
    const top = y;
    rows.forEach((row) => { draw(row, y + height / 2); y += height; });
    name.forEach((line, i) => make("text", { class: "name", x: BARS_LEFT - 8, y: (top + y) / 2 + 4 + (i - (name.length - 1) / 2) * 14,
      "text-anchor": "end" }, svg, line));
    y += 8;
  };
  group(bars.regions, REGION_ROW, ([label, death], at) => {
    const end = death === null ? `H${x(bars.max_mm) + 6}v-1.6l7,4l-7,4v-1.6` : `H${Math.max(x(0) + 1, x(death))}v4.8`;
    const bar = make("path", { d: `M${x(0)},${at - 2.4}${end}H${x(0)}Z`, fill: regionColor(label),
      stroke: "var(--ink)", "stroke-width": 0.5 }, svg);
    make("title", {}, bar, `region ${label}: ${death === null ? "never dies" : `dies at ${death} mm`}`);
    make("text", { class: "small", x: x(bars.max_mm) + 16, y: at + 3 }, svg, label);
  }, ["regions", `${bars.regions.length} of ${bars.region_count}`]);
  group(bars.longest, ROW, ([death, label], at) => {
    const bar = make("rect", { x: x(0), y: at - 2, width: Math.max(1, x(death) - x(0)), height: 4, fill: "var(--bar)" }, svg);
    make("title", {}, bar, `dies at ${death} mm in region ${label || "none"}`);
  }, ["longest", "that die"]);
  const most = Math.max(1, ...bars.histogram), each = space / bars.histogram.length, floor = y + HISTOGRAM;
  bars.histogram.forEach((count, i) => {
    const height = count ? Math.max(2, Math.log1p(count) / Math.log1p(most) * HISTOGRAM) : 0;
    const bar = make("rect", { x: BARS_LEFT + i * each + 0.5, y: floor - height, width: Math.max(1, each - 1), height, fill: "var(--bar)" }, svg);
    const low = i * bars.max_mm / bars.histogram.length, high = (i + 1) * bars.max_mm / bars.histogram.length;
    make("title", {}, bar, `${count} die from ${low.toFixed(2)} to ${high.toFixed(2)} mm`);
  });
  ["deaths", "(log)"].forEach((line, i) => make("text", { class: "name", x: BARS_LEFT - 8, y: floor - HISTOGRAM / 2 + 14 * i, "text-anchor": "end" }, svg, line));
  make("line", { class: "grid", x1: BARS_LEFT, x2: width - BARS_RIGHT, y1: floor, y2: floor }, svg);
  for (let i = 0; i <= 4; i++) make("text", { x: x(i * bars.max_mm / 4), y: floor + 15, "text-anchor": "middle" }, svg, Number((i * bars.max_mm / 4).toPrecision(3)));
  make("text", { x: BARS_LEFT + space / 2, y: floor + 31, "text-anchor": "middle" }, svg, "filtration value (mm)");
  svg.setAttribute("viewBox", `0 0 ${width} ${floor + 38}`);
  svg.setAttribute("height", floor + 38);
}
