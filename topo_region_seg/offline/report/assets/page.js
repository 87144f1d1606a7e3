"use strict";
// One frame at a time. Without scripts the page shows all of them.
const read = (id) => { const block = document.getElementById(id); return block ? JSON.parse(block.textContent) : null; };
const run = read("run");
const SVG = "http://www.w3.org/2000/svg";

function make(name, attributes, parent, text) {
  const element = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  if (text !== undefined) element.textContent = text;
  if (parent) parent.append(element);
  return element;
}

const frames = {
  current: 0,
  listeners: [],
  sections: [...document.querySelectorAll(".frame")],
  show(index) {
    this.current = Math.max(0, Math.min(run.frames.length - 1, index));
    this.sections.forEach((section, place) => { section.hidden = place !== this.current; });
    const slider = document.getElementById("frame");
    slider.value = this.current;
    slider.setAttribute("aria-valuetext", `frame ${this.current} of ${run.frames.length}`);
    this.listeners.forEach((listener) => listener(this.current));
  },
};

if (run.frames.length) {
  const say = (index) => {
    frames.show(index);
    document.getElementById("frame-status").textContent = `Frame ${frames.current}: ${run.frames[frames.current].regions} regions`;
  };
  document.getElementById("frame-controls").hidden = false;
  document.getElementById("frame").addEventListener("input", (event) => frames.show(Number(event.target.value)));
  document.getElementById("previous").addEventListener("click", () => say(frames.current - 1));
  document.getElementById("next").addEventListener("click", () => say(frames.current + 1));
  frames.show(0);
}
