// The page's tables and arrays, and numbers as text.

const bytesOf = (base64) => {
  const raw = atob(base64.trim()), bytes = new Uint8Array(raw.length);
  for (let i = 0; i < raw.length; i += 1) bytes[i] = raw.charCodeAt(i);
  return bytes;
};

// One dimension: a typed array; more: an array of those, sharing its memory.
const shaped = (flat, shape) => {
  if (shape.length < 2) return flat;
  const size = shape.slice(1).reduce((a, b) => a * b, 1);
  return Array.from({ length: shape[0] }, (_, i) => shaped(flat.subarray(i * size, (i + 1) * size), shape.slice(1)));
};

const unpack = (packed, base64) => {
  const { buffer } = bytesOf(base64), { arrays, mark } = packed;
  const array = ({ at, shape, bits }) => {
    const count = shape.reduce((a, b) => a * b, 1);
    return shaped(bits === 64 ? new Float64Array(buffer, at, count) : new Float32Array(buffer, at, count), shape);
  };
  const revive = (value) => {
    if (Array.isArray(value)) return value.map(revive);
    if (value === null || typeof value !== "object") return value;
    if (mark in value) return array(arrays[value[mark]]);
    return Object.fromEntries(Object.entries(value).map(([key, entry]) => [key, revive(entry)]));
  };
  return revive(packed.tree);
};

const clamp = (x, low, high) => Math.min(Math.max(x, low), high);

// Without an exponent where a reader can do without one, with a true minus.
const plainNumber = (x, digits = 4) => {
  if (!Number.isFinite(x)) return "–";
  if (x === 0) return "0";
  const size = Math.abs(x);
  if (size >= 1e7 || size < 1e-5) return x.toExponential(Math.max(digits - 1, 0));
  return String(Number(x.toPrecision(digits)));
};
const shownNumber = (x, digits = 4) => plainNumber(x, digits).replace("-", "−");
const withUnit = (si, quantity, digits = 4) => `${shownNumber(si * quantity.factor, digits)} ${quantity.unit}`.trim();

// Two decimals, as the sentence of a diagnosis has them; of the least that they round to 0, a limit.
const probabilityText = (p) => (p >= 0.005 ? p.toFixed(2) : "< 0.01");

// Share 0..1 of a slider for an SI value, and back.
const shareOf = (axis, value) => (axis.log
  ? Math.log(value / axis.low) / Math.log(axis.high / axis.low)
  : (value - axis.low) / (axis.high - axis.low));
const valueAt = (axis, share) => {
  if (share <= 0) return axis.low;
  if (share >= 1) return axis.high;
  return axis.log ? axis.low * (axis.high / axis.low) ** share : axis.low + share * (axis.high - axis.low);
};
