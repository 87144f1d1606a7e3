"use strict";
// Charts of one column a frame, redrawn at the width of the page.
const HEIGHT = 190, TOP = 12, BOTTOM = 24, LEFT = 40;

function niceStep(largest) {
  const rough = largest / 4, power = 10 ** Math.floor(Math.log10(rough));
  return [1, 2, 5, 10].map((factor) => factor * power).find((step) => step >= rough);
}

function stagePaint(place) { return { color: `var(--stage-${place % 5 + 1})`, hatched: Math.floor(place / 5) % 2 === 1 }; }

function block(parent, x, y, width, height, paint) {
  make("rect", { x, y, width, height, fill: paint.color, stroke: "var(--back)", "stroke-width": height > 3 ? 0.7 : 0 }, parent);
  if (paint.hatched) make("rect", { x, y, width, height, fill: "url(#hatch)" }, parent);
}

function marker(parent, shape, x, y, color) {
  const r = 3.6, shapes = {
    circle: ["circle", { cx: x, cy: y, r }],
    square: ["rect", { x: x - r, y: y - r, width: 2 * r, height: 2 * r }],
    triangle: ["path", { d: `M${x},${y - r - 1}L${x + r + 1},${y + r}L${x - r - 1},${y + r}Z` }],
  };
  const [name, attributes] = shapes[shape];
  make(name, { ...attributes, fill: color, stroke: "var(--back)" }, parent);
}

function drawChart(figure) {
  const chart = run.charts[figure.dataset.chart], count = run.frames.length;
  const svg = figure.querySelector("svg"), width = Math.max(200, figure.clientWidth);
  const right = chart.kind === "lines" ? 46 : 8, space = width - LEFT - right, slot = space / count;
  svg.replaceChildren();
  svg.setAttribute("viewBox", `0 0 ${width} ${HEIGHT}`);
  svg.setAttribute("height", HEIGHT);
  const sums = run.frames.map((_, i) => chart.kind === "stack"
    ? chart.series.reduce((sum, line) => sum + (line.values[i] || 0), 0) : Math.max(...chart.series.map((line) => line.values[i] || 0)));
  const largest = Math.max(chart.least || 0, ...sums) || 1, step = niceStep(largest), end = Math.ceil(largest / step - 1e-9) * step;
  const y = (value) => HEIGHT - BOTTOM - value / end * (HEIGHT - TOP - BOTTOM), x = (i) => LEFT + (i + 0.5) * slot;
  const band = make("rect", { class: "current", y: TOP - 6, width: Math.max(slot, 3), height: HEIGHT - TOP - BOTTOM + 6 }, svg);
  figure.mark = (index) => band.setAttribute("x", x(index) - Math.max(slot, 3) / 2);
  for (let value = 0; value <= end * 1.001; value += step) {
    make("line", { class: "grid", x1: LEFT, x2: width - right, y1: y(value), y2: y(value) }, svg);
    make("text", { x: LEFT - 6, y: y(value) + 4, "text-anchor": "end" }, svg, Number(value.toPrecision(6)));
  }
  const every = Math.ceil(count / Math.max(1, Math.floor(space / 34)));
  for (let i = 0; i < count; i += every) make("text", { x: x(i), y: HEIGHT - 8, "text-anchor": "middle" }, svg, i);
  const bar = Math.max(1, Math.min(42, slot * 0.72));
  if (chart.kind === "lines") drawLines(svg, chart, x, y, width - right, slot);
  else run.frames.forEach((_, i) => {
    let sum = 0;
    chart.series.forEach((line, place) => {
      const value = line.values[i] || 0;
      if (value) block(svg, x(i) - bar / 2, y(sum + value), bar, y(sum) - y(sum + value),
        chart.kind === "stack" ? stagePaint(place) : { color: "var(--bar)" });
      sum += value;
    });
    if (chart.kind === "bars" && slot > 20) make("text", { class: "name", x: x(i), y: y(sum) - 3, "text-anchor": "middle" }, svg, sum);
  });
  run.frames.forEach((frame, i) => {
    const column = make("rect", { class: "column", x: x(i) - slot / 2, y: 0, width: slot, height: HEIGHT - BOTTOM }, svg);
    const parts = chart.series.map((line) => `${line.name}: ${line.values[i] === null ? "unknown" : line.values[i]}`);
    make("title", {}, column, [`frame ${i}`, ...parts].join("\n"));
    column.addEventListener("click", () => frames.show(i));
  });
  figure.mark(frames.current);
}

function drawLines(svg, chart, x, y, right, slot) {
  const crowded = slot < 9;
  const names = [];
  chart.series.forEach((line, place) => {
    const { color } = stagePaint([0, 1, 3][place % 3]), shape = ["circle", "square", "triangle"][place % 3];
    const known = line.values.map((value, i) => [i, value]).filter(([, value]) => value !== null);
    if (!known.length) return;
    make("polyline", { points: known.map(([i, value]) => `${x(i)},${y(value)}`).join(" "), fill: "none", stroke: color,
      "stroke-width": crowded ? 1.4 : 2, "stroke-dasharray": ["", "6 3", "2 3"][place % 3] }, svg);
    if (!crowded || known.length === 1) known.forEach(([i, value]) => marker(svg, shape, x(i), y(value), color));
    names.push({ at: y(known[known.length - 1][1]), name: line.name });
  });
  names.sort((a, b) => a.at - b.at);
  names.forEach((name, i) => {
    if (i) name.at = Math.max(name.at, names[i - 1].at + 13);
  });
  const over = names.length ? Math.max(0, names[names.length - 1].at - (HEIGHT - BOTTOM)) : 0;
  names.forEach((name) => make("text", { class: "name", x: right + 6, y: name.at - over + 4 }, svg, name.name));
}

function drawLegend(figure) {
  const chart = run.charts[figure.dataset.chart], list = figure.querySelector(".legend");
  if (!list || chart.kind !== "stack") return;
  chart.series.forEach((line, place) => {
    const item = document.createElement("li"), svg = make("svg", { viewBox: "0 0 16 12", "aria-hidden": "true" });
    block(svg, 0, 0, 16, 12, stagePaint(place));
    const known = line.values.filter((value) => value !== null);
    const mean = known.reduce((sum, value) => sum + value, 0) / Math.max(1, known.length);
    item.append(svg, `${line.name} ${mean.toFixed(1)}`);
    list.append(item);
  });
}

if (run.frames.length) {
  const hatch = make("svg", { width: 0, height: 0, "aria-hidden": "true" });
  hatch.style.position = "absolute";
  const pattern = make("pattern", { id: "hatch", width: 5, height: 5, patternUnits: "userSpaceOnUse", patternTransform: "rotate(45)" },
    make("defs", {}, hatch));
  make("rect", { width: 2, height: 5, fill: "var(--back)", "fill-opacity": 0.75 }, pattern);
  document.body.append(hatch);
  const figures = [...document.querySelectorAll(".chart")];
  figures.forEach((figure) => { drawLegend(figure); drawChart(figure); });
  const sizes = new ResizeObserver((entries) => entries.forEach((entry) => {
    if (entry.target.drawn !== entry.target.clientWidth) { entry.target.drawn = entry.target.clientWidth; drawChart(entry.target); }
  }));
  figures.forEach((figure) => sizes.observe(figure));
  frames.listeners.push((index) => figures.forEach((figure) => figure.mark(index)));
}
