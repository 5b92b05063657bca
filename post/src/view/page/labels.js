// What is written over the scene: title, time, colours with numbers, axes with numbers, the mark of a particle.

const EXTENT = [0, 1, 2].map((axis) => meta.domain[1][axis] - meta.domain[0][axis]);
// Corners of the domain, in metres from the lower corner of the box round the particles.
const LOW = [0, 1, 2].map((axis) => (axis < meta.dimension ? meta.domain[0][axis] - meta.bounds[0][axis] : 0));
const HIGH = LOW.map((x, axis) => x + EXTENT[axis]);

const TITLE = 18;
const TICK = 11.5;
const TITLE_LINES = 3;

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
    // Rectangles that are taken, which axes keep clear of; what was written, for tests.
    this.taken = [];
    this.ticks = [];
    this.heading(state);
    this.legend(state);
    if (state.axes) this.axes(state.box);
    if (state.picked) this.mark(state.picked.place);
  }

  font(size, bold = false) {
    this.context.font = `${bold ? 600 : 400} ${size}px system-ui, sans-serif`;
  }

  write(words, x, y, { size = 13, bold = false, align = "left" } = {}) {
    const { context } = this;
    this.font(size, bold);
    context.textAlign = align;
    context.textBaseline = "middle";
    context.lineWidth = 3;
    context.strokeStyle = this.ink === "#28282c" ? "#fafaf8c0" : "#16181cc0";
    context.strokeText(words, x, y);
    context.fillStyle = this.ink;
    context.fillText(words, x, y);
  }

  measure(words, size, bold = false) {
    this.font(size, bold);
    return this.context.measureText(words).width;
  }

  // What of a text fits into a width, with an ellipsis for the rest.
  shortened(words, width, size, bold) {
    if (this.measure(words.slice(0, 1000), size, bold) <= width && words.length <= 1000) return words;
    let [low, high] = [0, Math.min(words.length, 1000)];
    while (low < high) {
      const middle = Math.ceil((low + high) / 2);
      if (this.measure(`${words.slice(0, middle)}…`, size, bold) <= width) low = middle;
      else high = middle - 1;
    }
    return `${words.slice(0, low).trimEnd()}…`;
  }

  // A text in lines, broken between words.
  lines(words, width, size, bold) {
    const lines = [];
    let rest = words.split(/\s+/).filter(Boolean);
    while (rest.length) {
      let count = 1;
      while (count < rest.length && this.measure(rest.slice(0, count + 1).join(" "), size, bold) <= width) count++;
      if (lines.length + 1 === TITLE_LINES) count = rest.length;
      lines.push(this.shortened(rest.slice(0, count).join(" "), width, size, bold));
      rest = rest.slice(count);
    }
    return lines;
  }

  // Pixels that title and legend take from the left and from the top, in a window of so many pixels.
  room(state, width) {
    const { column, leaves } = state;
    const more = 22 * Math.max(this.lines(meta.title, width - 32, TITLE, true).length - 1, 0);
    let widest = this.measure(named(column), 13, true);
    const words = column.kind === "integer" ? this.classesOf(column).map((value) => meaning(column, value)) : ["-0.000123"];
    for (const word of words) widest = Math.max(widest, 22 + this.measure(this.name(word), 13));
    if (leaves) widest = Math.max(widest, this.measure("level of leaves", 13, true));
    return { left: Math.min(16 + widest, 0.35 * width), top: 60 + more };
  }

  // A name as the legend has it.
  name(words) {
    return this.shortened(words, 200, 13);
  }

  classesOf({ range: [low, high] }) {
    return Array.from({ length: Math.min(high - low + 1, 64) }, (_, i) => low + i);
  }

  take(x, y, width, height) {
    this.taken.push([x - 4, y - 4, x + width + 4, y + height + 4]);
  }

  isTaken(x, y, width, height) {
    return this.taken.some(([left, top, right, bottom]) => x < right && x + width > left && y < bottom && y + height > top);
  }

  heading({ frame, shown }) {
    const { time, step, particles } = meta.frames[frame];
    let y = 22;
    for (const line of this.lines(meta.title, this.width - 32, TITLE, true)) {
      this.write(line, 16, y, { size: TITLE, bold: true });
      this.take(16, y - 11, this.measure(line, TITLE, true), 22);
      y += 22;
    }
    const count = particles.toLocaleString("en").replaceAll(",", "\u2009");
    const of = shown < 1 ? `, ${Math.round(100 * shown)} % drawn while turning` : "";
    const words = `t = ${text(time, 5)} s   step ${step}   ${count} particles${of}`;
    this.top = Math.max(y, 44);
    this.write(words, 16, this.top);
    this.take(16, this.top - 8, this.measure(words, 13), 16);
  }

  legend(state) {
    const { column, leaves, levels } = state;
    const [x, top] = [16, this.top + 34];
    this.write(named(column), x, top, { bold: true });
    this.take(x, top - 8, this.measure(named(column), 13, true), 16);
    let end = top;
    if (column.kind === "integer") {
      end = this.classes(this.classesOf(column).map((value) => [value, meaning(column, value)]), x, top + 22);
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
    // The last line says how many have none.
    const fitting = Math.max(Math.floor((this.height - top) / 20), 1);
    const shown = entries.length <= fitting ? entries : entries.slice(0, fitting - 1);
    shown.forEach(([number, words], i) => {
      context.fillStyle = `rgb(${classColour(number).join()})`;
      context.fillRect(x, top + 20 * i - 7, 14, 14);
      this.write(this.name(words), x + 22, top + 20 * i);
      this.take(x, top + 20 * i - 8, 22 + this.measure(this.name(words), 13), 16);
    });
    if (shown.length < entries.length) this.write(`and ${entries.length - shown.length} more`, x, top + 20 * shown.length);
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
      // As many digits as tell the numbers of the bar apart.
      const span = range[1] - range[0];
      const more = span > 0 && !logarithmic ? Math.ceil(Math.log10(Math.max(...range.map(Math.abs)) / span)) : 0;
      const words = text(value, 3 + Math.min(Math.max(more, 0), 9));
      const y = top + 16 + (1 - tick / 4) * (height - 1);
      this.write(words, x + 22, y);
      this.take(x, y - 8, 22 + this.measure(words, 13), 16);
    }
    this.take(x, top + 16, 14, height);
    return top + 16 + height;
  }

  // Numbers along one edge of a box for each axis, on the side that faces the reader.
  axes({ low, high }) {
    const middle = this.at(low.map((x, axis) => (x + high[axis]) / 2));
    const places = [0, 1, 2].slice(0, meta.dimension).flatMap((axis) => [low, high].map((end) => end[axis] + meta.bounds[0][axis]));
    const unit = metric(Math.max(...places.map(Math.abs)));
    for (let axis = 0; axis < meta.dimension; axis++) {
      const others = [0, 1, 2].filter((other) => other !== axis && other < meta.dimension);
      let best;
      for (let corner = 0; corner < 1 << others.length; corner++) {
        const from = [...low];
        others.forEach((other, i) => corner & (1 << i) && (from[other] = high[other]));
        const to = from.with(axis, high[axis]);
        const [a, b] = [this.at(from), this.at(to)];
        if (!a.ahead || !b.ahead) continue;
        // On the outline, as far from the middle as can be; of two the one below or to the left.
        const centre = { x: (a.x + b.x) / 2 - middle.x, y: (a.y + b.y) / 2 - middle.y };
        const length = Math.hypot(b.x - a.x, b.y - a.y) || 1;
        const away = Math.abs((b.y - a.y) * centre.x - (b.x - a.x) * centre.y) / length;
        const merit = away + 0.2 * (centre.y - centre.x);
        if (!best || merit > best.merit) best = { merit, from, a, b, centre, span: [low[axis], high[axis]] };
      }
      if (best) this.axis(axis, best, unit);
    }
  }

  // Ticks of an axis at a step: places on the screen with their numbers.
  ticksOf(axis, { from, span }, step, by) {
    const shift = meta.bounds[0][axis];
    const ticks = [];
    const last = Math.floor((span[1] + shift) / step + 1e-6);
    for (let tick = Math.ceil((span[0] + shift) / step - 1e-6); tick <= last; tick++) {
      const words = tickText((tick * step) / by, step / by);
      ticks.push({ ...this.at(from.with(axis, tick * step - shift)), words, width: this.measure(words, TICK) });
    }
    return ticks;
  }

  axis(axis, best, [by, unit]) {
    const { a, b, centre, span } = best;
    const length = Math.hypot(b.x - a.x, b.y - a.y);
    if (length < 12) return;
    const away = [b.y - a.y, a.x - b.x].map((x) => x / length);
    const sign = away[0] * centre.x + away[1] * centre.y < 0 ? -1 : 1;
    const [nx, ny] = away.map((x) => sign * x);
    // As close as the numbers have room.
    let step = nice(((span[1] - span[0]) * 40) / length);
    let ticks = this.ticksOf(axis, best, step, by);
    const meet = (one, i) => {
      const other = ticks[i + 1];
      return other && Math.abs(other.x - one.x) < (one.width + other.width) / 2 + 8 && Math.abs(other.y - one.y) < TICK + 8;
    };
    while (ticks.length > 1 && ticks.some(meet)) {
      step = nice(2.6 * step);
      ticks = this.ticksOf(axis, best, step, by);
    }
    const { context } = this;
    context.strokeStyle = this.ink;
    context.lineWidth = 1;
    // Left edge of a text beside a place, outwards (1) or inwards (-1).
    const left = (x, width, side) => x + 12 * side * nx - (side * nx > 0.4 ? 0 : side * nx < -0.4 ? width : width / 2);
    for (const { x, y, words, width } of ticks) {
      // Inside where title or legend stand outside.
      const isFree = (side) => !this.isTaken(left(x, width, side), y + 14 * side * ny - TICK / 2, width, TICK);
      const side = isFree(1) || !isFree(-1) ? 1 : -1;
      context.beginPath();
      context.moveTo(x, y);
      context.lineTo(x + 5 * side * nx, y + 5 * side * ny);
      context.stroke();
      this.write(words, left(x, width, side), y + 14 * side * ny, { size: TICK });
      this.ticks.push({ axis, words, side, box: [left(x, width, side), y + 14 * side * ny - TICK / 2, width, TICK] });
    }
    const name = `${"xyz"[axis]} [${unit}]`;
    const wide = this.measure(name, 12.5, true);
    const beyond = 20 + Math.abs(nx) * Math.max(0, ...ticks.map((tick) => tick.width));
    const along = [b.x - a.x, b.y - a.y].map((x) => x / length);
    // Beside the middle, or behind an end.
    const places = [
      [(a.x + b.x) / 2 + beyond * nx, (a.y + b.y) / 2 + (18 + 14 * Math.abs(ny)) * ny],
      [b.x + (14 + wide / 2) * along[0], b.y + 14 * along[1]],
      [a.x - (14 + wide / 2) * along[0], a.y - 14 * along[1]],
      [(a.x + b.x) / 2 - 24 * nx, (a.y + b.y) / 2 - 24 * ny],
    ];
    const edge = (x) => x - (nx > 0.4 ? 0 : nx < -0.4 ? wide : wide / 2);
    const fits = ([x, y]) =>
      edge(x) >= 0 && edge(x) + wide <= this.width && y >= 8 && y <= this.height - 8 && !this.isTaken(edge(x), y - 7, wide, 14);
    const [x, y] = places.find(fits) ?? places[0];
    this.write(name, edge(x), y, { size: 12.5, bold: true });
    this.take(edge(x), y - 7, wide, 14);
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
