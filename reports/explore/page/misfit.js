// How far the curves are from the record: RMS of the residual over the standard deviation of the noise; 1 = noise.

const sumOfSquares = (time, curve, record, clock) => {
  let sum = 0, count = 0;
  for (let i = 0; i < record.time.length; i += 1) {
    const model = sampleAt(time, curve, record.time[i] - clock);
    if (Number.isNaN(model)) continue;
    const off = (record.values[i] - model) / record.sigma[i];
    sum += off * off; count += 1;
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
