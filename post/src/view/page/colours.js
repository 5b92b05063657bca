// Colour maps and the text of numbers.

const MAPS = {
  viridis: "440154 482475 414487 355f8d 2a788e 21918c 22a884 44bf70 7ad151 bddf26 fde725",
  magma: "000004 140e36 3b0f70 641a80 8c2981 b73779 de4968 f7705c fe9f6d fecf92 fcfdbf",
  coolwarm: "3b4cc0 5977e3 7b9ff9 9ebeff c0d4f5 dddcdc f2cbb7 f7ac8e ee8468 d65244 b40426",
  grey: "202020 e8e8e8",
};
const CLASSES = colours("0072b2 e69f00 009e73 d55e00 cc79a7 56b4e9 b8a800 999999 6a3d9a 8c564b");

function colours(words) {
  return words.split(" ").map((word) => [0, 2, 4].map((at) => parseInt(word.slice(at, at + 2), 16)));
}

const ANCHORS = Object.fromEntries(Object.entries(MAPS).map(([name, words]) => [name, colours(words)]));

// Colour at a place from 0 to 1.
function colourAt(map, place) {
  const anchors = ANCHORS[map];
  const at = Math.min(Math.max(place, 0), 1) * (anchors.length - 1);
  const below = Math.min(Math.floor(at), anchors.length - 2);
  return anchors[below].map((from, part) => from + (at - below) * (anchors[below + 1][part] - from));
}

// Behind the colours of the list hues go round by the golden ratio, which keeps them apart, on rings of five lightnesses and
// saturations.
const RINGS = [[0.55, 0.82], [0.45, 0.56], [0.27, 0.89], [0.43, 0.77], [0.6, 0.56]];

function classColour(number) {
  const of = Math.max(number, 0);
  if (of < CLASSES.length) return CLASSES[of];
  const more = of - CLASSES.length;
  const [lightness, saturation] = RINGS[more % RINGS.length];
  const hue = (0.38 + 0.618033988749895 * more) % 1;
  const reach = saturation * Math.min(lightness, 1 - lightness);
  return [0, 8, 4].map((shift) => {
    const k = (shift + 12 * hue) % 12;
    return Math.round(255 * (lightness - reach * Math.max(Math.min(k - 3, 9 - k, 1), -1)));
  });
}

// Where in the range a value lies: 0 to 1 inside.
function placeIn([low, high], value, logarithmic) {
  if (!(high > low)) return 0.5;
  if (!logarithmic) return (value - low) / (high - low);
  const start = Math.max(low, high * 1e-6);
  return value <= 0 ? -1 : Math.log(value / start) / Math.log(high / start);
}

// Colours of all levels of a column, four bytes each; what is hidden has no opacity.
function colourTable(column, { map, range, logarithmic, onlyRange }) {
  const levels = Math.min(column.scale[3], 65536);
  const table = new Uint8Array(4 * 256 * Math.ceil(levels / 256));
  for (let level = 0; level < levels; level++) {
    const value = valueOf(column, level);
    const outside = value < range[0] || value > range[1];
    const colour = column.kind === "integer" ? classColour(value) : colourAt(map, placeIn(range, value, logarithmic));
    table.set([...colour, onlyRange && outside ? 0 : 255], 4 * level);
  }
  return table;
}

// A number with as many digits as a reader wants.
function text(value, digits = 4) {
  if (typeof value === "bigint") return value.toString();
  if (value === 0) return "0";
  const size = Math.abs(value);
  if (size >= 1e-3 && size < 1e5) return String(Number(value.toPrecision(digits)));
  return value.toExponential(Math.max(digits - 2, 0)).replace("e+", "e");
}

const named = (column) => column.name.replaceAll("_", " ") + (column.unit ? ` [${column.unit}]` : "");

// What a value means: the name of a class, or the number.
function meaning(column, value, digits = 4) {
  return (column.kind === "integer" && column.names[value]) || text(value, digits);
}

// The largest of 1, 2 and 5 times a power of ten that is not above a length.
function nice(length) {
  const power = 10 ** Math.floor(Math.log10(length));
  return power * [5, 2, 1].find((digit) => digit * power <= length * 1.0001);
}

// The unit of places up to so many metres: its length in metres and its name.
function metric(greatest) {
  if (greatest < 2e-5) return [1e-6, "µm"];
  if (greatest < 2e-2) return [1e-3, "mm"];
  return greatest < 2e4 ? [1, "m"] : [1e3, "km"];
}

// A tick of an axis as text: as many decimals as the step between ticks has.
function tickText(value, step) {
  const decimals = Math.min(Math.max(Math.ceil(-Math.log10(step) - 1e-9), 0), 15);
  return String(Number(value.toFixed(decimals)) || 0);
}
