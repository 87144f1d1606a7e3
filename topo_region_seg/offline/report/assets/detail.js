"use strict";
// The chosen frames: one of them in 3D, with its barcode.
const detail = document.getElementById("detail-body");
if (detail) {
  const view = new View3D(document.getElementById("view")), figure = document.getElementById("bars");
  const buttons = [...document.querySelectorAll("[data-detail]")], modes = [...document.querySelectorAll("[data-mode]")];
  const note = document.getElementById("bars-note"), caption = document.getElementById("view-note");
  let bars = null;
  const press = (group, chosen) => group.forEach((button) => button.setAttribute("aria-pressed", String(button === chosen)));
  const choose = (button) => {
    const points = read(`points-${button.dataset.detail}`);
    press(buttons, button);
    bars = read(`bars-${button.dataset.detail}`);
    view.load(points);
    press(modes, modes.find((mode) => mode.dataset.mode === view.mode));
    caption.textContent = `${points.count.toLocaleString("en")} of ${points.total.toLocaleString("en")} points.`;
    figure.hidden = !bars;
    if (!bars) { note.textContent = "The barcode of this frame is not known."; return; }
    drawBarcode(figure, bars);
    note.textContent = `${bars.total.toLocaleString("en")} bars, ${bars.forever.toLocaleString("en")} never die; once small ones are merged or removed ` +
      `there are ${bars.region_count} regions.${bars.computed ? " Computed from the source when this page was written." : ""}`;
  };
  buttons.forEach((button) => button.addEventListener("click", () => choose(button)));
  modes.forEach((mode) => mode.addEventListener("click", () => { view.color(mode.dataset.mode); press(modes, mode); }));
  const acts = { left: () => view.turn(-0.25, 0), right: () => view.turn(0.25, 0), up: () => view.turn(0, -0.25), down: () => view.turn(0, 0.25),
    nearer: () => view.scale(1.25), farther: () => view.scale(0.8), reset: () => view.reset() };
  document.querySelectorAll("[data-act]").forEach((button) => button.addEventListener("click", acts[button.dataset.act]));
  new ResizeObserver(() => { if (bars) drawBarcode(figure, bars); }).observe(figure);
  detail.hidden = false;
  if (buttons.length) choose(buttons[0]);
}
