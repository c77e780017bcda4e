// The emulator of birdstrike.surrogate, evaluated: Gaussian processes of principal components, effects, instruments.

const FEWEST_RUNS = 2;
const LEAST_WEIGHT = 1e-150; // of a run, however far: its square must not underflow

const matern = (square) => {
  const x = Math.sqrt(5 * square);
  return (1 + x * (1 + x / 3)) * Math.exp(-x);
};

const correlations = (process, u) => {
  const { points, lengths } = process, out = process.buffer || (process.buffer = new Float64Array(points.length));
  for (let i = 0; i < points.length; i += 1) {
    const point = points[i];
    let square = 0;
    for (let j = 0; j < u.length; j += 1) {
      const apart = u[j] / lengths[j] - point[j];
      square += apart * apart;
    }
    out[i] = matern(square);
  }
  return out;
};

const dot = (a, b) => {
  let sum = 0;
  for (let i = 0; i < a.length; i += 1) sum += a[i] * b[i];
  return sum;
};
const processMean = (process, u) => dot(correlations(process, u), process.weights);

// Factor of Student's t for so many effective runs, from the table in 1/nu.
const studentFactor = (table, freedom) => {
  const place = clamp((1 / freedom - 1e-3) / (0.5 - 1e-3), 0, 1) * (table.length - 1);
  const i = Math.min(Math.floor(place), table.length - 2), w = place - i;
  return table[i] * (1 - w) + table[i + 1] * w;
};

// Variance of an error at u: that of the runs nearby, times Student's t for their effective number.
const localVariance = (missed, u, table) => {
  const correlation = correlations(missed, u), { squares, locality } = missed;
  let largest = 0;
  const raw = Array.from(correlation, (c) => { const w = c ** locality; largest = Math.max(largest, w); return w; });
  let total = 0, own = 0, weighted = 0;
  raw.forEach((w, i) => {
    const share = w + LEAST_WEIGHT + 1e-12 * largest;
    total += share; own += share * share; weighted += share * squares[i];
  });
  return (weighted / total) * studentFactor(table, Math.max((total * total) / own, FEWEST_RUNS));
};

// What of a parameter the solver can feel: an erosion limit counts only where it is active.
const FEATURES = {
  "": (x) => x,
  logarithm: (x) => Math.log(Math.abs(x)),
  tension_erosion: (x) => (x > 1 ? 1 / x : 0),
  compression_erosion: (x) => (x > 0 && x < 1 ? x : 0),
};
const inputs = (system, theta) => system.varied.map((j) => {
  const value = FEATURES[system.features[j]](theta[j]);
  return (value - system.low[j]) / (system.high[j] - system.low[j]);
});
const covered = (system, theta) => system.regions.some(([low, high]) => theta.every((x, i) => {
  const slack = 1e-9 * (high[i] - low[i]);
  return x >= low[i] - slack && x <= high[i] + slack;
}));

const addScaled = (out, row, factor) => { for (let i = 0; i < out.length; i += 1) out[i] += factor * row[i]; };

// Size of an effect's response to a magnitude in plausible sizes: piecewise linear, the last pieces continued.
const responseSize = (knots, b) => {
  let i = 0;
  while (i < knots.length - 2 && b > knots[i + 1][0]) i += 1;
  const [[x, y], [nextX, nextY]] = [knots[i], knots[i + 1]];
  return y + ((b - x) * (nextY - y)) / (nextX - x);
};

const addMesh = (mesh, name, z, out) => {
  addScaled(out, mesh.mean[name], 1);
  mesh.processes.forEach((process, c) => addScaled(out, mesh.directions[name][c], processMean(process, z)));
};
const addResponse = (response, name, z, h, out) => {
  const own = (h < 0 && response.negative) || response;
  addScaled(out, own.signature[name], h);
  own.slopes[name].forEach((row, j) => addScaled(out, row, h * (z[j] - response.centre[j])));
};

// What a fault of an instrument, of a magnitude in SI, adds to a curve that the case's own instrument has read already
// (inversion.diagnosis.preparation.instrument.change). signal: that curve less the drift of its instrument.
const gradient = (time, curve) => curve.map((_, i) => {
  const a = Math.max(i - 1, 0), b = Math.min(i + 1, curve.length - 1);
  return (curve[b] - curve[a]) / (time[b] - time[a]);
});
const lowPass = (curve, step, tau) => {
  const h = step / tau, decay = Math.exp(-h), mean = -Math.expm1(-h) / h, out = new Float64Array(curve.length);
  out[0] = curve[0];
  for (let i = 1; i < curve.length; i += 1) {
    out[i] = decay * out[i - 1] + (1 - mean) * curve[i] + (mean - decay) * curve[i - 1];
  }
  return out;
};
const delayed = (late, time, curve) => {
  const end = time[time.length - 1], slope = gradient(time, curve)[time.length - 1];
  return curve.map((_, i) => {
    const t = time[i] - late;
    return sampleAt(time, curve, Math.min(t, end)) + Math.max(t - end, 0) * slope;
  });
};
const slower = (tau, time, signal, own) => {
  if (!(tau > 0)) return new Float64Array(signal.length);
  const whole = tau + (own.bandwidth ? 1 / (2 * Math.PI * own.bandwidth) : 0);
  return lowPass(signal, time[1] - time[0], whole).map((y, i) => (tau / whole) * (y - signal[i]));
};
const FAULTS = {
  sensor_gain: (gain, time, signal) => signal.map((y) => gain * y),
  sensor_drift: (rate, time) => Float64Array.from(time, (t) => rate * t),
  time_offset: (late, time, signal) => delayed(late, time, signal).map((y, i) => y - signal[i]),
  sensor_bandwidth: slower,
};

const acting = (view, point, shot) => view.effects.filter(
  (effect) => point.effects[effect.label] && effect.shots.includes(shot.name));

// One sensor's curve (m,) SI on the simulation's clock. point: theta, effects by label, all SI.
const curveOf = (view, shot, name, point, out = null) => {
  const system = view.systems[shot.system], channel = system.channels[name], time = system.time;
  const curve = out || new Float64Array(time.length), u = inputs(system, point.theta);
  curve.set(channel.mean);
  channel.processes.forEach((process, c) => addScaled(curve, channel.basis[c], processMean(process, u)));
  const z = view.parameters.map((axis, i) => shareOf(axis, point.theta[i]));
  if (system.mesh) addMesh(system.mesh, name, z, curve);
  const active = acting(view, point, shot);
  if (!active.length) return curve;
  const own = shot.channels.find((one) => one.name === name).instrument;
  const signal = own ? curve.map((y, i) => y - own.drift * time[i]) : null; // effects come with instruments alone
  active.forEach((effect) => {
    const b = point.effects[effect.label] / effect.size;
    if (!effect.sensors) {
      const response = system.responses[effect.name];
      addResponse(response, name, z, responseSize(response.knots, b), curve);
    } else if (effect.sensors.includes(name)) {
      addScaled(curve, FAULTS[effect.name](point.effects[effect.label], time, signal, own), 1);
    }
  });
  return curve;
};

// Standard deviation (m,) SI of the emulator's error there.
const errorOf = (view, shot, name, point, table) => {
  const system = view.systems[shot.system], channel = system.channels[name], u = inputs(system, point.theta);
  const sizes = channel.processes.map((process) => Math.sqrt(localVariance(process, u, table)));
  const variance = Float64Array.from(channel.outside);
  addScaled(variance, channel.rest, localVariance(channel.nearby, u, table));
  for (let i = 0; i < sizes.length; i += 1) {
    for (let j = 0; j <= i; j += 1) {
      const factor = sizes[i] * sizes[j] * channel.correlation[i][j] * (i === j ? 1 : 2);
      const a = channel.basis[i], b = channel.basis[j];
      for (let t = 0; t < variance.length; t += 1) variance[t] += factor * a[t] * b[t];
    }
  }
  return variance.map((v) => Math.sqrt(Math.max(v, 0)));
};

// Index of the last of increasing instants that is below t, at most the last but one.
const before = (time, t) => {
  let low = 0, high = time.length - 1;
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (time[middle] < t) low = middle; else high = middle;
  }
  return low;
};
// A curve at an instant of its own clock: linear, at rest before it, NaN after it.
const sampleAt = (time, curve, t) => {
  const end = time[time.length - 1];
  if (t > end * (1 + 1e-9)) return NaN;
  const i = before(time, t), w = clamp((t - time[i]) / (time[i + 1] - time[i]), 0, 1);
  return curve[i] * (1 - w) + curve[i + 1] * w;
};
