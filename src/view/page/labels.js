// What is written over the scene: title, time, colours with numbers, axes with numbers, the mark of a particle.

const EXTENT = [0, 1, 2].map((axis) => meta.domain[1][axis] - meta.domain[0][axis]);
// Corners of the domain, in metres from the lower corner of the box round the particles.
const LOW = [0, 1, 2].map((axis) => (axis < meta.dimension ? meta.domain[0][axis] - meta.bounds[0][axis] : 0));
const HIGH = LOW.map((x, axis) => x + EXTENT[axis]);

class Labels {
  constructor(canvas) {
    this.canvas = canvas;
    this.context = canvas.getContext("2d");
  }

  draw(view, state) {
    const { context, canvas } = this;
    const ratio = state.ratio;
    this.width = canvas.width / ratio;
    this.height = canvas.height / ratio;
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.clearRect(0, 0, this.width, this.height);
    this.ink = state.dark ? "#e6e6e6" : "#28282c";
    this.at = (place) => {
      const { x, y, depth, ahead } = view.project(place);
      return { x: x / ratio, y: y / ratio, depth, ahead };
    };
    if (state.axes) this.axes();
    this.heading(state);
    this.legend(state);
    if (state.picked) this.mark(state.picked.place);
  }

  write(words, x, y, { size = 13, bold = false, align = "left" } = {}) {
    const { context } = this;
    context.font = `${bold ? 600 : 400} ${size}px system-ui, sans-serif`;
    context.textAlign = align;
    context.textBaseline = "middle";
    context.lineWidth = 3;
    context.strokeStyle = this.ink === "#28282c" ? "#fafaf8c0" : "#16181cc0";
    context.strokeText(words, x, y);
    context.fillStyle = this.ink;
    context.fillText(words, x, y);
  }

  heading({ frame, shown }) {
    const { time, step, particles } = meta.frames[frame];
    this.write(meta.title, 16, 22, { size: 18, bold: true });
    const count = particles.toLocaleString("en").replaceAll(",", "\u2009");
    const of = shown < 1 ? `, ${Math.round(100 * shown)} % drawn while turning` : "";
    this.write(`t = ${text(time, 5)} s   step ${step}   ${count} particles${of}`, 16, 44);
  }

  legend(state) {
    const { column, leaves, levels } = state;
    const [x, top] = [16, 78];
    this.write(named(column), x, top, { bold: true });
    let end = top;
    if (column.kind === "integer") {
      const [low, high] = column.range;
      const values = Array.from({ length: Math.min(high - low + 1, 16) }, (_, i) => low + i);
      end = this.classes(values.map((value) => [value, meaning(column, value)]), x, top + 22);
    } else {
      end = this.bar(state, x, top);
    }
    if (leaves && levels) {
      this.write("level of leaves", x, end + 24, { bold: true });
      this.classes(levels.map((level) => [level, String(level)]), x, end + 46);
    }
  }

  // Colours with words beside them; returns where the next line could be.
  classes(entries, x, top) {
    const { context } = this;
    entries.forEach(([number, words], i) => {
      context.fillStyle = `rgb(${classColour(number).join()})`;
      context.fillRect(x, top + 20 * i - 7, 14, 14);
      this.write(words, x + 22, top + 20 * i);
    });
    return top + 20 * entries.length;
  }

  bar({ map, range, logarithmic }, x, top) {
    const { context } = this;
    const height = Math.max(Math.min(220, this.height - top - 180), 60);
    for (let row = 0; row < height; row++) {
      context.fillStyle = `rgb(${colourAt(map, 1 - row / (height - 1)).map(Math.round).join()})`;
      context.fillRect(x, top + 16 + row, 14, 1.5);
    }
    for (let tick = 0; tick <= 4; tick++) {
      const start = logarithmic ? Math.max(range[0], range[1] * 1e-6) : range[0];
      const value = logarithmic ? start * (range[1] / start) ** (tick / 4) : start + (tick / 4) * (range[1] - start);
      this.write(text(value, 3), x + 22, top + 16 + (1 - tick / 4) * (height - 1));
    }
    return top + 16 + height;
  }

  // Numbers along one edge of the domain for each axis, on the side that faces the reader.
  axes() {
    const middle = this.at(LOW.map((x, axis) => (x + HIGH[axis]) / 2));
    for (let axis = 0; axis < meta.dimension; axis++) {
      const others = [0, 1, 2].filter((other) => other !== axis && other < meta.dimension);
      let best;
      for (let corner = 0; corner < 1 << others.length; corner++) {
        const from = [...LOW];
        others.forEach((other, i) => corner & (1 << i) && (from[other] = HIGH[other]));
        const to = from.with(axis, HIGH[axis]);
        const [a, b] = [this.at(from), this.at(to)];
        if (!a.ahead || !b.ahead) continue;
        // On the outline, as far from the middle as can be; of two the one below or to the left.
        const centre = { x: (a.x + b.x) / 2 - middle.x, y: (a.y + b.y) / 2 - middle.y };
        const length = Math.hypot(b.x - a.x, b.y - a.y) || 1;
        const away = Math.abs((b.y - a.y) * centre.x - (b.x - a.x) * centre.y) / length;
        const merit = away + 0.2 * (centre.y - centre.x);
        if (!best || merit > best.merit) best = { merit, from, a, b, centre };
      }
      if (best) this.axis(axis, best);
    }
  }

  axis(axis, { from, a, b, centre }) {
    const length = Math.hypot(b.x - a.x, b.y - a.y);
    if (length < 40) return;
    const away = [b.y - a.y, a.x - b.x].map((x) => x / length);
    const sign = away[0] * centre.x + away[1] * centre.y < 0 ? -1 : 1;
    const [nx, ny] = away.map((x) => sign * x);
    const align = nx > 0.4 ? "left" : nx < -0.4 ? "right" : "center";
    const low = meta.domain[0][axis];
    const step = nice((EXTENT[axis] * 70) / length);
    const { context } = this;
    context.strokeStyle = this.ink;
    context.lineWidth = 1;
    for (let tick = Math.ceil(low / step - 1e-6); tick * step <= meta.domain[1][axis] + 1e-6 * step; tick++) {
      const { x, y } = this.at(from.with(axis, LOW[axis] + tick * step - low));
      // Title and legend stand there.
      if (x + 12 * nx < 130 && y > 0 && y < Math.min(340, this.height - 140)) continue;
      context.beginPath();
      context.moveTo(x, y);
      context.lineTo(x + 5 * nx, y + 5 * ny);
      context.stroke();
      this.write(text(tick * step), x + 12 * nx, y + 14 * ny, { size: 11.5, align });
    }
    const name = `${"xyz"[axis]}, m`;
    if ((a.x + b.x) / 2 + 50 * nx < 100 && (a.y + b.y) / 2 < 340) return;
    this.write(name, (a.x + b.x) / 2 + 50 * nx, (a.y + b.y) / 2 + 32 * ny, { size: 12.5, bold: true, align });
  }

  mark(place) {
    const { x, y, ahead } = this.at(place);
    if (!ahead) return;
    const { context } = this;
    for (const [width, style] of [[4, "#ffffff"], [2, "#d00000"]]) {
      context.lineWidth = width;
      context.strokeStyle = style;
      context.beginPath();
      context.arc(x, y, 9, 0, 2 * Math.PI);
      context.stroke();
    }
  }
}
