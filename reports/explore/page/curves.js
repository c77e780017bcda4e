// A panel a sensor: record with its noise, the emulator's curve with its error, a campaign's run, the residual below.

const MS = 1e3, WIDE_95 = 1.96, LEFT = 54, RIGHT = 14, TOP = 8, FOOT = 32, GAP = 14;
const RESIDUAL_ROWS = 3; // at least one tick on either side of 0, whatever the reach

const panelOf = (shot, channel, many, read) => {
  const name = many ? `${channel.label}, ${shot.name}` : channel.label;
  const misfit = element("output", { className: "chip" });
  const canvas = element("canvas", { tabIndex: 0, role: "img" });
  const reading = element("span", { className: "reading", "aria-live": "polite" });
  const box = element("figure", { className: "panel" },
    element("figcaption", {}, element("b", {}, name), ` [${channel.unit}] `, misfit, reading), canvas);
  const panel = { box, canvas, misfit, reading, shot, channel, name, frames: null, still: document.createElement("canvas") };
  canvas.addEventListener("pointermove", (event) => read(panel, event.offsetX));
  canvas.addEventListener("pointerleave", () => { reading.textContent = ""; });
  canvas.addEventListener("keydown", (event) => {
    if (!["ArrowLeft", "ArrowRight"].includes(event.key) || !panel.frames) return;
    event.preventDefault();
    panel.place = clamp((panel.place || 0.5) + (event.key === "ArrowRight" ? 0.02 : -0.02), 0, 1);
    read(panel, panel.frames.upper.left + panel.place * panel.frames.upper.width);
  });
  return panel;
};

const largestOf = (values) => {
  let largest = 0;
  for (let i = 0; i < values.length; i += 1) { const size = Math.abs(values[i]); if (size > largest) largest = size; }
  return largest;
};

// What the scales must hold: record, noise, the campaign's runs and the curve at hand; they grow, but do not shrink.
const fixedBounds = (panel, view) => {
  const { record, name } = panel.channel, rows = [[0]];
  if (record) rows.push(record.values, record.left_out.values);
  if (view.runs && view.runs.shot === view.shots.indexOf(panel.shot) && view.runs.curves[name]) rows.push(...view.runs.curves[name]);
  return boundsOf(...rows);
};
const scalesOf = (panel, view, { time, curve, error, off }) => {
  const { record, factor } = panel.channel;
  if (!panel.scales) panel.bounds = fixedBounds(panel, view);
  const old = panel.scales, found = boundsOf(panel.bounds, curve).map((v) => v * factor);
  const y = old && found[0] >= old.y[0] && found[1] <= old.y[1] ? old.y : padded(found);
  const noise = record ? WIDE_95 * largestOf(record.sigma) * factor : 0;
  const reach = Math.max(3 * noise, 1.15 * largestOf(off) * factor, WIDE_95 * largestOf(error) * factor);
  const kept = old && reach <= old.reach && reach > 0.3 * old.reach;
  return { y, reach: kept ? old.reach : 1.3 * reach || 1, x: [0, Math.max(time[time.length - 1], record ? record.time[record.time.length - 1] : 0) * MS] };
};

const framesOf = (width, height, scales) => {
  const [left, foot, gap, right] = [LEFT, FOOT, GAP, RIGHT].map((size) => size * theme.scale), inner = width - left - right;
  const low = Math.round(0.26 * (height - foot)), high = height - foot - gap - TOP - low;
  return {
    upper: frameOf(left, TOP, inner, high, scales.x, scales.y),
    lower: frameOf(left, TOP + high + gap, inner, low, scales.x, [-scales.reach, scales.reach]),
  };
};

// Stretches of a record without a gap, as [first, last + 1]: across a gap nothing is drawn.
const GAP_STEPS = 5; // a gap: so many times the middle interval of the record
const stretchesOf = (record) => {
  if (record.stretches) return record.stretches;
  const { time } = record, steps = Array.from(time.slice(1), (t, i) => t - time[i]), middle = [...steps].sort((a, b) => a - b)[steps.length >> 1];
  const starts = [0, ...steps.flatMap((step, i) => (step > GAP_STEPS * middle ? [i + 1] : []))];
  record.stretches = starts.map((from, i) => [from, starts[i + 1] ?? time.length]);
  return record.stretches;
};

// What does not move while a slider does: axes, record, noise.
const drawStill = (panel, frames, size) => {
  const { still, canvas, channel: { record, factor } } = panel;
  still.width = canvas.width; still.height = canvas.height;
  const pen = still.getContext("2d"), ratio = canvas.width / size.width;
  pen.setTransform(ratio, 0, 0, ratio, 0, 0);
  pen.font = size.font;
  drawAxes(pen, frames.upper, { below: false });
  drawAxes(pen, frames.lower, { rows: RESIDUAL_ROWS });
  pen.fillStyle = theme.soft; pen.textAlign = "right"; pen.textBaseline = "bottom";
  pen.fillText("time [ms]", size.width - RIGHT * theme.scale, size.height - 1);
  pen.textAlign = "left"; pen.textBaseline = "top";
  pen.fillText(record ? "record − model" : "no record", frames.lower.left + 6, frames.lower.top - 2);
  if (!record) return;
  const band = record.sigma.map((s) => WIDE_95 * s), lows = record.values.map((v, i) => v - band[i]), highs = record.values.map((v, i) => v + band[i]);
  const { left_out: leftOut } = record;
  const drawNoise = (frame, low, high) => stretchesOf(record).forEach(([from, to]) => drawBand(
    pen, frame, record.time.slice(from, to), low.slice(from, to), high.slice(from, to), MS, factor, { colour: theme.noise }));
  inside(pen, frames.upper, () => {
    drawNoise(frames.upper, lows, highs);
    drawPoints(pen, frames.upper, leftOut.time, leftOut.values, MS, factor, { colour: theme.mark });
    drawPoints(pen, frames.upper, record.time, record.values, MS, factor, { colour: theme.record });
  });
  inside(pen, frames.lower, () => drawNoise(frames.lower, band.map((b) => -b), band));
};

const drawMoving = (pen, panel, frames, view, state, { time, curve, error, off }) => {
  const { channel: { record, factor, name }, shot } = panel, shift = state.point.clock;
  const lows = new Float64Array(curve.length), highs = new Float64Array(curve.length);
  for (let i = 0; i < curve.length; i += 1) { lows[i] = curve[i] - WIDE_95 * error[i]; highs[i] = curve[i] + WIDE_95 * error[i]; }
  inside(pen, frames.upper, () => {
    drawBand(pen, frames.upper, time, lows, highs, MS, factor, { colour: theme.band, shift });
    if (state.run !== null && view.runs && view.runs.shot === view.shots.indexOf(shot) && view.runs.curves[name]) {
      drawLine(pen, frames.upper, view.runs.time, view.runs.curves[name][state.run], MS, factor, { colour: theme.run, dash: [6, 3], shift });
    }
    drawLine(pen, frames.upper, time, curve, MS, factor, { colour: theme.model, shift });
  });
  if (!record) return;
  const known = off.findIndex(Number.isNaN), shown = known < 0 ? off : off.subarray(0, known);
  inside(pen, frames.lower, () => stretchesOf(record).forEach(([from, to]) => {
    const end = Math.min(to, shown.length);
    drawLine(pen, frames.lower, record.time.slice(from, end), shown.slice(from, end), MS, factor, { colour: theme.model, width: 1.3 });
  }));
};

const paintPanel = (panel, view, state, drawn) => {
  const { canvas } = panel, { pen, width, height } = penOf(canvas);
  if (!canvas.width || !canvas.height) return;
  const scales = scalesOf(panel, view, drawn);
  const key = JSON.stringify([scales, canvas.width, canvas.height, theme.ink, theme.paper]);
  const frames = framesOf(width, height, scales);
  if (key !== panel.key) { drawStill(panel, frames, { width, height, font: pen.font }); panel.key = key; }
  Object.assign(panel, { scales, frames });
  pen.save(); pen.setTransform(1, 0, 0, 1, 0, 0);
  pen.clearRect(0, 0, canvas.width, canvas.height); pen.drawImage(panel.still, 0, 0);
  pen.restore();
  drawMoving(pen, panel, frames, view, state, drawn);
};

// Draw one panel at the point of the state; returns its sum of squares and its number of points.
const drawPanel = (panel, view, state, student) => {
  const { channel, shot } = panel, { time } = view.systems[shot.system];
  const curve = curveOf(view, shot, channel.name, state.point), error = errorOf(view, shot, channel.name, state.point, student);
  Object.assign(panel, { clock: state.point.clock, curve, error });
  const off = channel.record ? residualsOf(time, curve, channel.record, state.point.clock) : [];
  paintPanel(panel, view, state, { time, curve, error, off });
  const [sum, count] = channel.record ? sumOfSquares(time, curve, channel.record, state.point.clock) : [0, 0];
  panel.score = count ? Math.sqrt(sum / count) : NaN;
  panel.misfit.textContent = count ? `misfit ${shownNumber(panel.score, 3)}` : "";
  return [sum, count];
};

const peakOf = (time, curve) => {
  let top = 0;
  curve.forEach((y, i) => { if (Math.abs(y) > Math.abs(curve[top])) top = i; });
  return [time[top], curve[top]];
};
const describePanel = (panel, view) => {
  const { time } = view.systems[panel.shot.system], [t, peak] = peakOf(time, panel.curve), { channel } = panel;
  const score = Number.isNaN(panel.score) ? "no record" : `misfit ${shownNumber(panel.score, 3)}, 1 is noise`;
  panel.canvas.setAttribute("aria-label",
    `${panel.name}: model's peak ${withUnit(peak, channel, 3)} at ${shownNumber(t * MS, 3)} ms; ${score}. Arrow keys read values.`);
};

const readPanel = (panel, view, x) => {
  const { upper } = panel.frames, share = clamp((x - upper.left) / upper.width, 0, 1), t = (upper.x[0] + share * (upper.x[1] - upper.x[0])) / MS;
  const { time } = view.systems[panel.shot.system], { channel } = panel, model = sampleAt(time, panel.curve, t - panel.clock);
  const { record } = channel, parts = [`${shownNumber(t * MS, 3)} ms: model ${withUnit(model, channel, 3)}`];
  if (record && t <= record.time[record.time.length - 1]) parts.push(`record ${withUnit(sampleAt(record.time, record.values, t), channel, 3)}`);
  panel.reading.textContent = parts.join(", ");
};
