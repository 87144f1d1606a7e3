"use strict";
// Points in 3D on a plain canvas with a depth buffer: turned by mouse, touch and keyboard.
function unpack(text) {
  const bytes = Uint8Array.from(atob(text), (character) => character.charCodeAt(0));
  return { bytes, words: () => new Uint16Array(bytes.buffer) };
}

class View3D {
  constructor(canvas) {
    this.canvas = canvas;
    this.context = canvas.getContext("2d");
    this.mode = "label";
    this.pointers = new Map();
    this.reset();
    canvas.addEventListener("pointerdown", (event) => { canvas.setPointerCapture(event.pointerId); this.pointers.set(event.pointerId, event); });
    canvas.addEventListener("pointermove", (event) => this.drag(event));
    for (const end of ["pointerup", "pointercancel"]) canvas.addEventListener(end, (event) => this.pointers.delete(event.pointerId));
    canvas.addEventListener("wheel", (event) => { // the page scrolls on unless the view is in use
      if (document.activeElement !== canvas && !event.ctrlKey) return;
      event.preventDefault();
      this.scale(Math.exp(-event.deltaY / 600));
    }, { passive: false });
    canvas.addEventListener("keydown", (event) => this.key(event));
    new ResizeObserver(() => this.request()).observe(canvas);
  }

  reset() { this.yaw = 0; this.pitch = 0; this.zoom = 1; this.request(); }
  turn(yaw, pitch) { this.yaw += yaw; this.pitch = Math.max(-1.5, Math.min(1.5, this.pitch + pitch)); this.request(); }
  scale(factor) { this.zoom = Math.max(0.3, Math.min(12, this.zoom * factor)); this.request(); }
  color(mode) { this.mode = mode; this.request(); }

  drag(event) {
    const before = this.pointers.get(event.pointerId);
    if (!before) return;
    if (this.pointers.size === 2) {
      const [a, b] = [...this.pointers.values()], other = a === before ? b : a;
      const span = (p) => Math.hypot(p.clientX - other.clientX, p.clientY - other.clientY);
      this.scale(span(event) / Math.max(1, span(before)));
    } else this.turn((event.clientX - before.clientX) / 160, (event.clientY - before.clientY) / 160);
    this.pointers.set(event.pointerId, event);
  }

  key(event) {
    const act = {
      ArrowLeft: () => this.turn(-0.15, 0), ArrowRight: () => this.turn(0.15, 0), ArrowUp: () => this.turn(0, -0.15), ArrowDown: () => this.turn(0, 0.15),
      "+": () => this.scale(1.2), "=": () => this.scale(1.2), "-": () => this.scale(1 / 1.2), 0: () => this.reset(), Home: () => this.reset(),
    }[event.key];
    if (!act || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    act();
  }

  load(points) {
    this.count = points.count;
    this.xyz = Float32Array.from(unpack(points.xyz).words(), (level) => level / 32767.5 - 1);
    this.colors = { rgb: unpack(points.rgb).bytes };
    const cycle = run.palette.length - 1;
    for (const name of ["label", "truth"]) if (points[name]) {
      const rgb = this.colors[name] = new Uint8Array(3 * this.count), labels = unpack(points[name]).words();
      labels.forEach((label, i) => rgb.set(run.palette[label ? (label - 1) % cycle + 1 : 0], 3 * i));
      if (name === "label") this.center(labels);
    }
    if (!this.colors[this.mode]) this.mode = "label";
    this.request();
  }

  center(labels) {
    const sums = new Map();
    labels.forEach((label, i) => {
      const sum = sums.get(label) || [0, 0, 0, 0];
      for (let axis = 0; axis < 3; axis++) sum[axis] += this.xyz[3 * i + axis];
      sum[3]++;
      sums.set(label, sum);
    });
    const enough = Math.max(20, this.count / 400);
    this.names = [...sums].filter(([label, sum]) => label && sum[3] >= enough).map(([label, sum]) => [label, ...sum.slice(0, 3).map((v) => v / sum[3])]);
  }

  request() {
    if (this.waiting || !this.context) return;
    this.waiting = true;
    requestAnimationFrame(() => { this.waiting = false; this.draw(); });
  }

  draw() {
    const ratio = Math.min(2, window.devicePixelRatio || 1), { canvas, context } = this;
    const width = canvas.width = Math.max(1, Math.round(canvas.clientWidth * ratio));
    const height = canvas.height = Math.max(1, Math.round(canvas.clientHeight * ratio));
    if (!this.xyz || width < 2) return;
    const image = context.createImageData(width, height), pixels = new Uint32Array(image.data.buffer);
    const depth = new Float32Array(width * height).fill(Infinity), rgb = this.colors[this.mode];
    pixels.fill(0xff161616);
    const [cy, sy, cp, sp] = [Math.cos(this.yaw), Math.sin(this.yaw), Math.cos(this.pitch), Math.sin(this.pitch)];
    const focal = 1.7 * Math.min(width * 0.8, height) * this.zoom, away = 2.4;
    const project = (x, y, z) => {
      const across = cy * x + sy * z, deep = cy * z - sy * x, down = cp * y - sp * deep, far = cp * deep + sp * y + away;
      return [width / 2 + focal * across / far, height / 2 + focal * down / far, far];
    };
    const size = focal / Math.sqrt(this.count) * 2.5;
    for (let i = 0, j = 0; i < this.count; i++, j += 3) {
      const [u, v, far] = project(this.xyz[j], this.xyz[j + 1], this.xyz[j + 2]);
      if (far < 0.15) continue;
      const side = Math.max(1, Math.min(14, Math.round(size / far))), shade = Math.max(0.55, Math.min(1, 1.25 - 0.12 * far));
      const color = 0xff000000 | rgb[j + 2] * shade << 16 | rgb[j + 1] * shade << 8 | rgb[j] * shade;
      const left = Math.max(0, Math.round(u - side / 2)), right = Math.min(width, Math.round(u - side / 2) + side);
      const top = Math.max(0, Math.round(v - side / 2)), bottom = Math.min(height, Math.round(v - side / 2) + side);
      for (let row = top; row < bottom; row++) for (let at = row * width + left; at < row * width + right; at++) {
        if (far < depth[at]) { depth[at] = far; pixels[at] = color; }
      }
    }
    context.putImageData(image, 0, 0);
    if (this.mode !== "label") return;
    context.font = `600 ${13 * ratio}px system-ui, sans-serif`;
    context.textAlign = "center";
    context.lineWidth = 3 * ratio;
    for (const [label, ...place] of this.names) {
      const [u, v] = project(...place);
      context.strokeStyle = "#000";
      context.strokeText(label, u, v);
      context.fillStyle = "#fff";
      context.fillText(label, u, v);
    }
  }
}
