// How far the curves are from the record: RMS of the residual over the standard deviation of the noise; 1 = noise.

// Record less model at the record's instants, SI; NaN after the simulation's end. Where each point of the record is the
// mean over `block` instants, the model's is so too.
const residualsOf = (time, curve, record, clock) => {
  const last = time.length - 2, end = time[last + 1] * (1 + 1e-9), out = new Float64Array(record.time.length).fill(NaN);
  const { block = 1, instants = record.time } = record;
  let i = 0;
  for (let j = 0; j < out.length && instants[(j + 1) * block - 1] - clock <= end; j += 1) {
    let sum = 0;
    for (let k = j * block; k < (j + 1) * block; k += 1) {
      const t = instants[k] - clock;
      while (i < last && time[i + 1] < t) i += 1;
      const w = clamp((t - time[i]) / (time[i + 1] - time[i]), 0, 1);
      sum += curve[i] * (1 - w) + curve[i + 1] * w;
    }
    out[j] = record.values[j] - sum / block;
  }
  return out;
};

const sumOfSquares = (time, curve, record, clock) => {
  const off = residualsOf(time, curve, record, clock);
  let sum = 0, count = 0;
  for (let j = 0; j < off.length && !Number.isNaN(off[j]); j += 1) {
    const share = off[j] / record.sigma[j];
    sum += share * share; count += 1;
  }
  return [sum, count];
};

const channelsOf = (view) => view.shots.flatMap((shot) => shot.channels.map((channel) => ({ shot, channel })));

// Over all records of a view, or NaN where there is none or no run stands behind the point.
const totalMisfit = (view, point) => {
  let sum = 0, count = 0;
  if (!view.systems.every((system) => covered(system, point.theta))) return NaN;
  for (const { shot, channel } of channelsOf(view)) {
    if (!channel.record) continue;
    const { time } = view.systems[shot.system];
    const buffer = channel.buffer || (channel.buffer = new Float64Array(time.length));
    const [own, points] = sumOfSquares(time, curveOf(view, shot, channel.name, point, buffer), channel.record, point.clock);
    sum += own; count += points;
  }
  return count ? Math.sqrt(sum / count) : NaN;
};
