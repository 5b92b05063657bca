// Numbers of the page: compressed columns of frames and trees. See src/view/pack.rs for how they are made.

const meta = JSON.parse(document.getElementById("meta").textContent);

// The numbers under an identifier, as bytes.
async function bytesOf(id) {
  const text = atob(document.getElementById(id).textContent);
  const packed = new Uint8Array(text.length);
  for (let i = 0; i < text.length; i++) packed[i] = text.charCodeAt(i);
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

// Reads columns one after the other: differences as planes of bytes, the sign in the lowest bit.
class Reader {
  constructor(bytes) {
    this.bytes = bytes;
    this.at = 0;
  }

  column(count, width) {
    return width === 8 ? this.wide(count) : this.narrow(count, width);
  }

  narrow(count, width) {
    const out = new { 1: Uint8Array, 2: Uint16Array, 4: Uint32Array }[width](count);
    const { bytes, at } = this;
    for (let i = 0, value = 0; i < count; i++) {
      let coded = 0;
      for (let byte = 0; byte < width; byte++) coded |= bytes[at + byte * count + i] << (8 * byte);
      value = (value + ((coded >>> 1) ^ -(coded & 1))) | 0;
      out[i] = value;
    }
    this.at += count * width;
    return out;
  }

  wide(count) {
    const out = new BigUint64Array(count);
    for (let i = 0, value = 0n; i < count; i++) {
      let coded = 0n;
      for (let byte = 0; byte < 8; byte++) coded |= BigInt(this.bytes[this.at + byte * count + i]) << BigInt(8 * byte);
      value = BigInt.asUintN(64, value + ((coded >> 1n) ^ -(coded & 1n)));
      out[i] = value;
    }
    this.at += count * 8;
    return out;
  }
}

// An order in which the first sixteenth, eighth and so on of the particles are spread over all of them.
function spread(count) {
  const order = new Uint32Array(count);
  let next = 0;
  for (const first of [0, 8, 4, 12, 2, 10, 6, 14, 1, 9, 5, 13, 3, 11, 7, 15]) {
    for (let i = first; i < count; i += 16) order[next++] = i;
  }
  return order;
}

function inOrder(values, order) {
  const out = new values.constructor(values.length);
  for (let i = 0; i < order.length; i++) out[i] = values[order[i]];
  return out;
}

// The particles of a frame: `place` holds x, y, z and half width, packed, of each; `columns` the levels of each column.
async function readFrame(number) {
  const { particles: count } = meta.frames[number];
  const reader = new Reader(await bytesOf(`frame-${number}`));
  const order = spread(count);
  const place = new Uint16Array(4 * count);
  for (let part = 0; part < 4; part++) {
    const values = reader.column(count, part < 3 ? 2 : 1);
    for (let i = 0; i < count; i++) place[4 * i + part] = values[order[i]];
  }
  const columns = meta.columns.map((column) => inOrder(reader.column(count, column.kind === "id" ? 8 : 2), order));
  return { number, count, place, columns };
}

// Leaves of a frame: level, lower corner (relative to that of the box round the particles) and edge of each, m.
async function readTree(number) {
  const { leaves: count, tree } = meta.frames[number];
  const reader = new Reader(await bytesOf(`tree-${tree}`));
  const levels = reader.column(count, 1);
  const corners = new Float32Array(3 * count);
  const edges = new Float32Array(count);
  for (let i = 0; i < count; i++) edges[i] = meta.root_edge / 2 ** levels[i];
  for (let axis = 0; axis < 3; axis++) {
    const coords = reader.column(count, 4);
    const shift = meta.domain[0][axis] - meta.bounds[0][axis];
    for (let i = 0; i < count; i++) {
      corners[3 * i + axis] = axis < meta.dimension ? shift + (coords[i] * meta.root_edge) / 2 ** levels[i] : 0;
    }
  }
  return { tree, count, levels, corners, edges };
}

// Values of a column at its levels; see Scale in src/view/columns.rs.
function valueOf(column, level) {
  const [unit, low, high, levels] = column.scale;
  if (column.kind === "id") return level;
  if (column.kind === "integer") return low + level;
  const place = low + (level / Math.max(levels - 1, 1)) * (high - low);
  return Math.abs(place) < 1e-12 ? 0 : unit * Math.sinh(place);
}

// Recently used frames and trees, as promises, up to about so many bytes.
class Store {
  constructor(read, bytesEach, budget = 600e6) {
    this.read = read;
    this.most = Math.max(3, Math.floor(budget / Math.max(bytesEach, 1)));
    this.kept = new Map();
  }

  get(number) {
    const found = this.kept.get(number) ?? this.read(number);
    this.kept.delete(number);
    this.kept.set(number, found);
    if (this.kept.size > this.most) this.kept.delete(this.kept.keys().next().value);
    return found;
  }
}
