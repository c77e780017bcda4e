// Drawing on a canvas: scales, axes, lines, bands, points; colours come from the style sheet.

const INKS = ["ink", "soft", "line", "paper", "record", "model", "band", "noise", "run", "good", "mark"];
const theme = {};
const readTheme = () => {
  const style = getComputedStyle(document.documentElement);
  INKS.forEach((name) => { theme[name] = style.getPropertyValue(`--${name}`).trim(); });
  theme.scale = parseFloat(getComputedStyle(document.body).fontSize) / 15;
};

// The canvas in the size that it has on the page; its pen in CSS pixels.
const penOf = (canvas) => {
  const ratio = window.devicePixelRatio || 1, width = canvas.clientWidth, height = canvas.clientHeight;
  if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
    canvas.width = Math.round(width * ratio); canvas.height = Math.round(height * ratio);
  }
  const pen = canvas.getContext("2d");
  pen.setTransform(ratio, 0, 0, ratio, 0, 0);
  pen.font = `${11 * theme.scale}px system-ui, "Liberation Sans", Arial, sans-serif`;
  return { pen, width, height };
};

const niceStep = (span, count) => {
  const raw = span / Math.max(count, 1), power = 10 ** Math.floor(Math.log10(raw)), share = raw / power;
  return power * (share < 1.5 ? 1 : share < 3.5 ? 2 : share < 7.5 ? 5 : 10);
};
const ticksOf = ([low, high], count) => {
  const step = niceStep(high - low, count), first = Math.ceil(low / step - 1e-9);
  return Array.from({ length: Math.max(Math.floor(high / step + 1e-9) - first + 1, 0) }, (_, i) => (first + i) * step);
};

// A box of a canvas with its two scales. x, y: [low, high] in shown units.
const frameOf = (left, top, width, height, x, y) => ({
  left, top, width, height, x, y,
  px: (v) => left + ((v - x[0]) / (x[1] - x[0])) * width,
  py: (v) => top + height - ((v - y[0]) / (y[1] - y[0])) * height,
});

const drawAxes = (pen, frame, { below = true, rows = 4 } = {}) => {
  const { left, top, width, height } = frame;
  pen.strokeStyle = theme.line; pen.fillStyle = theme.soft; pen.lineWidth = 1;
  pen.textBaseline = "middle"; pen.textAlign = "right";
  ticksOf(frame.y, rows).forEach((v) => {
    const y = Math.round(frame.py(v)) + 0.5;
    pen.beginPath(); pen.moveTo(left, y); pen.lineTo(left + width, y); pen.stroke();
    pen.fillText(shownNumber(v, 3), left - 5, y);
  });
  pen.textBaseline = "top"; pen.textAlign = "center";
  ticksOf(frame.x, width / (70 * theme.scale)).forEach((v) => {
    const x = Math.round(frame.px(v)) + 0.5;
    pen.beginPath(); pen.moveTo(x, top + height); pen.lineTo(x, top + height + 4); pen.stroke();
    if (below) pen.fillText(shownNumber(v, 3), x, top + height + 6);
  });
  pen.strokeStyle = theme.soft;
  pen.beginPath(); pen.moveTo(left + 0.5, top); pen.lineTo(left + 0.5, top + height + 0.5); pen.lineTo(left + width, top + height + 0.5); pen.stroke();
};

const inside = (pen, frame, draw) => {
  pen.save();
  pen.beginPath(); pen.rect(frame.left, frame.top, frame.width, frame.height); pen.clip();
  draw();
  pen.restore();
};

const drawLine = (pen, frame, xs, ys, xFactor, yFactor, { colour, width = 2, dash = [], shift = 0 }) => {
  pen.strokeStyle = colour; pen.lineWidth = width; pen.lineJoin = "round"; pen.setLineDash(dash);
  const ax = frame.width / (frame.x[1] - frame.x[0]), ay = frame.height / (frame.y[1] - frame.y[0]);
  const x0 = frame.left - frame.x[0] * ax, y0 = frame.top + frame.height + frame.y[0] * ay;
  pen.beginPath();
  for (let i = 0; i < xs.length; i += 1) pen.lineTo(x0 + (xs[i] + shift) * xFactor * ax, y0 - ys[i] * yFactor * ay);
  pen.stroke(); pen.setLineDash([]);
};

const drawBand = (pen, frame, xs, lows, highs, xFactor, yFactor, { colour, shift = 0 }) => {
  const ax = frame.width / (frame.x[1] - frame.x[0]), ay = frame.height / (frame.y[1] - frame.y[0]);
  const x0 = frame.left - frame.x[0] * ax, y0 = frame.top + frame.height + frame.y[0] * ay;
  pen.fillStyle = colour;
  pen.beginPath();
  for (let i = 0; i < xs.length; i += 1) pen.lineTo(x0 + (xs[i] + shift) * xFactor * ax, y0 - highs[i] * yFactor * ay);
  for (let i = xs.length - 1; i >= 0; i -= 1) pen.lineTo(x0 + (xs[i] + shift) * xFactor * ax, y0 - lows[i] * yFactor * ay);
  pen.fill();
};

const drawPoints = (pen, frame, xs, ys, xFactor, yFactor, { colour, radius = 1.6 }) => {
  pen.fillStyle = colour;
  pen.beginPath();
  for (let i = 0; i < xs.length; i += 1) {
    const x = frame.px(xs[i] * xFactor), y = frame.py(ys[i] * yFactor);
    pen.moveTo(x + radius, y); pen.arc(x, y, radius, 0, 2 * Math.PI);
  }
  pen.fill();
};

const padded = ([low, high], share = 0.06) => {
  const room = (high - low || Math.abs(high) || 1) * share;
  return [low - room, high + room];
};
const boundsOf = (...rows) => {
  let low = Infinity, high = -Infinity;
  rows.forEach((row) => row.forEach((v) => { if (v < low) low = v; if (v > high) high = v; }));
  return low <= high ? [low, high] : [0, 1];
};

const element = (tag, given = {}, ...children) => {
  const made = document.createElement(tag);
  Object.entries(given).forEach(([key, value]) => {
    if (key in made && key !== "list" && key !== "role") made[key] = value; else made.setAttribute(key, value);
  });
  made.append(...children);
  return made;
};
