// Best point, map over two axes, profile over one: all by the misfit, in slices that leave the page free.

const SLICE = 12; // ms

// Work through a generator in slices; a newer task of the same name ends it.
const tasks = new Map();
const inSlices = (name, generator, done) => {
  const token = {};
  tasks.set(name, token);
  const step = () => {
    if (tasks.get(name) !== token) return;
    const begun = performance.now();
    let next = generator.next();
    while (!next.done && performance.now() - begun < SLICE) next = generator.next();
    if (next.done) { tasks.delete(name); done(next.value); } else setTimeout(step);
  };
  setTimeout(step);
};

const asPoint = (point) => ({ theta: [...point.theta], effects: { ...point.effects }, clock: point.clock });

// Axes of a view that can be varied: parameters, effects, the time origin.
const axesOf = (view) => [
  ...view.parameters.map((axis, i) => ({
    ...axis, id: axis.key, title: axis.label, set: (point, v) => { point.theta[i] = v; }, get: (point) => point.theta[i],
  })),
  ...(view.clock ? [{
    ...view.clock, id: "clock", title: view.clock.label, set: (point, v) => { point.clock = v; }, get: (point) => point.clock,
  }] : []),
  ...view.effects.map((effect) => ({
    ...effect, id: effect.label, effect: true,
    set: (point, v) => { point.effects[effect.label] = v; }, get: (point) => point.effects[effect.label] || 0,
  })),
];

// Nelder and Mead (Computer J. 7 (1965) 308) over shares 0..1 of the axes, one step a turn; returns [shares, value].
function* simplex(cost, start, size, most) {
  const n = start.length, inside = (x) => x.map((v) => clamp(v, 0, 1));
  const mirrored = (v) => (v + size > 1 ? v - size : v + size);
  const value = (x) => { const c = cost(x); return Number.isNaN(c) ? Infinity : c; };
  let points = [start, ...start.map((_, i) => start.map((v, j) => (i === j ? mirrored(v) : v)))].map((x) => [x, value(x)]);
  for (let turn = 0; turn < most; turn += 1) {
    points.sort((a, b) => a[1] - b[1]);
    const worst = points[n], middle = start.map((_, j) => points.slice(0, n).reduce((sum, [x]) => sum + x[j] / n, 0));
    if (points.every(([x]) => x.every((v, j) => Math.abs(v - points[0][0][j]) < 1e-4))) break;
    const along = (factor) => { const x = inside(middle.map((m, j) => m + factor * (worst[0][j] - m))); return [x, value(x)]; };
    const reflected = along(-1);
    if (reflected[1] < points[0][1]) { const far = along(-2); points[n] = far[1] < reflected[1] ? far : reflected; }
    else if (reflected[1] < points[n - 1][1]) points[n] = reflected;
    else {
      const near = along(reflected[1] < worst[1] ? -0.5 : 0.5);
      if (near[1] < Math.min(worst[1], reflected[1])) points[n] = near;
      else points = points.map(([x], i) => { const y = i ? x.map((v, j) => 0.5 * (v + points[0][0][j])) : x; return [y, i ? value(y) : points[0][1]]; });
    }
    yield null;
  }
  points.sort((a, b) => a[1] - b[1]);
  return points[0];
}

// The smallest misfit over some axes, the others held: from a coarse lattice's best points, then by simplex.
function* best(view, point, axes, starts = 40) {
  const trial = asPoint(point), place = (x) => { axes.forEach((axis, j) => axis.set(trial, valueAt(axis, x[j]))); return trial; };
  const cost = (x) => totalMisfit(view, place(x));
  const golden = axes.map((_, j) => (0.5 ** (1 / (axes.length + 1)) * (j + 1) * 1.618) % 1);
  const found = [axes.map((axis) => clamp(shareOf(axis, axis.get(point)), 0, 1))];
  for (let i = 1; i < starts; i += 1) found.push(golden.map((g, j) => (0.5 + i * (g + 0.1 * j)) % 1));
  const ranked = [];
  for (const x of found) { ranked.push([x, cost(x)]); yield null; }
  ranked.sort((a, b) => (Number.isNaN(a[1]) ? Infinity : a[1]) - (Number.isNaN(b[1]) ? Infinity : b[1]));
  let winner = ranked[0];
  for (const [x] of ranked.slice(0, 2)) {
    const end = yield* simplex(cost, x, 0.08, 30 * axes.length);
    if (!(end[1] >= winner[1])) winner = end;
  }
  return { point: asPoint(place(winner[0])), misfit: winner[1] };
}

// Misfits (n, n) over two axes, the rest as they stand; rows from the bottom.
function* mapOver(view, point, across, up, n) {
  const trial = asPoint(point), rows = [];
  for (let j = 0; j < n; j += 1) {
    up.set(trial, valueAt(up, j / (n - 1)));
    const row = new Float64Array(n);
    for (let i = 0; i < n; i += 1) {
      across.set(trial, valueAt(across, i / (n - 1)));
      row[i] = totalMisfit(view, trial);
      if (i % 8 === 7) yield null;
    }
    rows.push(row);
  }
  return rows;
}

// Smallest misfit at n places of one axis, over the other parameters and the time origin.
function* profileOver(view, point, axis, n) {
  const free = axesOf(view).filter((other) => other.id !== axis.id && !other.effect);
  const middle = Math.round(clamp(shareOf(axis, axis.get(point)), 0, 1) * (n - 1));
  const out = new Float64Array(n);
  for (const places of [Array.from({ length: n - middle }, (_, i) => middle + i), Array.from({ length: middle }, (_, i) => middle - 1 - i)]) {
    let from = asPoint(point);
    for (const i of places) {
      from = asPoint(from);
      axis.set(from, valueAt(axis, i / (n - 1)));
      if (free.length) {
        const found = yield* best(view, from, free, i === middle ? 25 : 2);
        from = found.point; out[i] = found.misfit;
      } else out[i] = totalMisfit(view, from);
      yield null;
    }
  }
  return out;
}
