// The map of the misfit over two axes and the profile over one, with the campaign's runs and the best point.

const CELLS = 44, PLACES = 41, MAP_LEFT = 52, MAP_FOOT = 34, MAP_RIGHT = 22, NEAR = 9;
const COLOURS = [[68, 1, 84], [59, 82, 139], [33, 145, 140], [94, 201, 98], [253, 231, 37]]; // viridis, dark is small

const colourAt = (share) => {
  const place = clamp(share, 0, 1) * (COLOURS.length - 1), i = Math.min(Math.floor(place), COLOURS.length - 2), w = place - i;
  return COLOURS[i].map((c, k) => Math.round(c * (1 - w) + COLOURS[i + 1][k] * w));
};

const finite = (rows) => rows.flatMap((row) => [...row]).filter(Number.isFinite);

// A map as a picture of its cells; cells without runs behind them are left out.
const pictureOf = (rows) => {
  const n = rows.length, picture = new ImageData(n, n), values = finite(rows);
  const [low, high] = [Math.min(...values), Math.max(...values)].map(Math.log);
  rows.forEach((row, j) => row.forEach((value, i) => {
    const at = 4 * ((n - 1 - j) * n + i);
    if (!Number.isFinite(value)) return;
    const [r, g, b] = colourAt((Math.log(value) - low) / (high - low || 1));
    picture.data.set([r, g, b, 255], at);
  }));
  const canvas = element("canvas", { width: n, height: n });
  canvas.getContext("2d").putImageData(picture, 0, 0);
  return canvas;
};

const mapFrame = (width, height, x, y) => {
  const [left, foot, right] = [MAP_LEFT, MAP_FOOT, MAP_RIGHT].map((size) => size * theme.scale);
  return frameOf(left, 10, width - left - right, height - 10 - foot, x, y);
};
const endsOf = (axis) => [axis.low * axis.factor, axis.high * axis.factor];
// Places of an axis are shares of its slider, so that a logarithmic axis is one on the map as well.
const placeOf = (frame, across, up, point) => [
  frame.left + clamp(shareOf(across, across.get(point)), 0, 1) * frame.width,
  frame.top + (1 - clamp(shareOf(up, up.get(point)), 0, 1)) * frame.height];

const cross = (pen, [x, y], colour, size = 8) => {
  [[4, theme.paper], [2, colour]].forEach(([width, ink]) => {
    pen.lineWidth = width; pen.strokeStyle = ink;
    pen.beginPath(); pen.moveTo(x - size, y); pen.lineTo(x + size, y); pen.moveTo(x, y - size); pen.lineTo(x, y + size); pen.stroke();
  });
};
// Seen on the bright and the dark end of the map, and on the page beside it.
const markBest = (pen, place) => {
  [[4.5, "#1b1f24"], [1.5, "#ffffff"]].forEach(([width, ink]) => {
    pen.lineWidth = width; pen.strokeStyle = ink;
    pen.beginPath(); pen.arc(...place, 8, 0, 2 * Math.PI); pen.stroke();
  });
};
const disc = (pen, [x, y], colour, radius) => {
  pen.beginPath(); pen.arc(x, y, radius, 0, 2 * Math.PI);
  pen.lineWidth = 1.5; pen.strokeStyle = theme.paper; pen.fillStyle = colour;
  pen.fill(); pen.stroke();
};

const labelAxes = (pen, frame, across, up, width, height) => {
  pen.fillStyle = theme.soft; pen.textAlign = "right"; pen.textBaseline = "bottom";
  pen.fillText(`${across.title} [${across.unit || "–"}]`, frame.left + frame.width, height - 1);
  pen.save(); pen.translate(10 * theme.scale, frame.top); pen.rotate(-Math.PI / 2); pen.textBaseline = "middle";
  pen.fillText(`${up.title} [${up.unit || "–"}]`, 0, 0);
  pen.restore();
};

// Ticks at nice values, where the slider has them.
const mapTicks = (pen, frame, across, up) => {
  pen.fillStyle = theme.soft; pen.strokeStyle = theme.soft; pen.lineWidth = 1;
  pen.strokeRect(frame.left + 0.5, frame.top + 0.5, frame.width - 1, frame.height - 1);
  pen.textAlign = "center"; pen.textBaseline = "top";
  ticksOf(frame.x, frame.width / (80 * theme.scale)).forEach((v) => pen.fillText(
    shownNumber(v, 3), frame.left + shareOf(across, v / across.factor) * frame.width, frame.top + frame.height + 5));
  pen.textAlign = "right"; pen.textBaseline = "middle";
  ticksOf(frame.y, frame.height / (50 * theme.scale)).forEach((v) => pen.fillText(
    shownNumber(v, 3), frame.left - 5, frame.top + (1 - shareOf(up, v / up.factor)) * frame.height));
};

const runPoint = (view, i) => ({ theta: view.runs.parameters[i], effects: {}, clock: 0 });
const runsShown = (view) => (view.runs ? view.runs.parameters.length : 0);

// What stays while a slider moves is drawn once, on a canvas of its own.
const stillOf = (holder, canvas, key, draw) => {
  if (holder.stillKey !== key || holder.stillOf !== holder.rows) {
    const still = holder.still || (holder.still = document.createElement("canvas"));
    still.width = canvas.width; still.height = canvas.height;
    const pen = still.getContext("2d"), from = canvas.getContext("2d");
    pen.setTransform(from.getTransform()); pen.font = from.font;
    draw(pen);
    holder.stillKey = key; holder.stillOf = holder.rows;
  }
  const pen = canvas.getContext("2d");
  pen.save(); pen.setTransform(1, 0, 0, 1, 0, 0);
  pen.clearRect(0, 0, canvas.width, canvas.height); pen.drawImage(holder.still, 0, 0);
  pen.restore();
};

const drawMap = (canvas, view, state, map) => {
  const { pen, width, height } = penOf(canvas), { across, up } = map, found = state.best;
  if (!canvas.width || !canvas.height) return;
  const frame = mapFrame(width, height, endsOf(across), endsOf(up));
  map.frame = frame;
  stillOf(map, canvas, [across.id, up.id, state.run, width, height, theme.ink].join(), (own) => drawMapStill(own, view, state, map, width, height));
  if (found) markBest(pen, placeOf(frame, across, up, found.point));
  cross(pen, placeOf(frame, across, up, state.point), theme.mark);
};
const drawMapStill = (pen, view, state, map, width, height) => {
  const { across, up, rows, frame } = map;
  if (rows && finite(rows).length) {
    if (map.rows !== map.drawn) { map.picture = pictureOf(rows); map.drawn = rows; }
    pen.imageSmoothingEnabled = true;
    pen.drawImage(map.picture, frame.left, frame.top, frame.width, frame.height);
    drawContour(pen, frame, rows, 1.1 * Math.min(...finite(rows)));
  }
  mapTicks(pen, frame, across, up); labelAxes(pen, frame, across, up, width, height);
  for (let i = 0; i < runsShown(view); i += 1) {
    disc(pen, placeOf(frame, across, up, runPoint(view, i)), state.run === i ? theme.mark : theme.run, state.run === i ? 6 : 3.5);
  }
};

// Where the misfit passes a level: short strokes between cells.
const drawContour = (pen, frame, rows, level) => {
  const n = rows.length, x = (i) => frame.left + (i / (n - 1)) * frame.width, y = (j) => frame.top + (1 - j / (n - 1)) * frame.height;
  pen.strokeStyle = "#ffffff"; pen.lineWidth = 1.6; pen.beginPath();
  for (let j = 0; j < n - 1; j += 1) {
    for (let i = 0; i < n - 1; i += 1) {
      const corners = [[i, j], [i + 1, j], [i + 1, j + 1], [i, j + 1]], cut = [];
      corners.forEach(([a, b], k) => {
        const [c, d] = corners[(k + 1) % 4], [v, w] = [rows[b][a], rows[d][c]];
        if ((v < level) !== (w < level) && Number.isFinite(v + w)) { const s = (level - v) / (w - v); cut.push([x(a + s * (c - a)), y(b + s * (d - b))]); }
      });
      if (cut.length >= 2) { pen.moveTo(...cut[0]); pen.lineTo(...cut[1]); }
    }
  }
  pen.stroke();
};

const nearestRun = (view, map, x, y) => {
  let found = null, least = NEAR ** 2;
  for (let i = 0; i < runsShown(view); i += 1) {
    const [px, py] = placeOf(map.frame, map.across, map.up, runPoint(view, i)), apart = (px - x) ** 2 + (py - y) ** 2;
    if (apart < least) { least = apart; found = i; }
  }
  return found;
};

const drawProfile = (canvas, state, profile) => {
  const { pen, width, height } = penOf(canvas), { axis, values } = profile;
  if (!canvas.width || !canvas.height) return;
  profile.rows = values;
  stillOf(profile, canvas, [axis.id, width, height, theme.ink].join(), (own) => drawProfileStill(own, profile, width, height));
  if (!values) return;
  const { frame } = profile, here = frame.left + clamp(shareOf(axis, axis.get(state.point)), 0, 1) * frame.width;
  pen.strokeStyle = theme.mark; pen.lineWidth = 2; pen.setLineDash([4, 3]);
  pen.beginPath(); pen.moveTo(here, frame.top); pen.lineTo(here, frame.top + frame.height); pen.stroke(); pen.setLineDash([]);
};
const drawProfileStill = (pen, profile, width, height) => {
  const { axis, values } = profile;
  const known = values ? [...values].filter(Number.isFinite) : [], y = known.length ? padded([Math.min(...known, 1), Math.max(...known)], 0.08) : [0, 1];
  const frame = mapFrame(width, height, endsOf(axis), y);
  const x = (share) => frame.left + share * frame.width;
  profile.frame = frame;
  if (axis.interval && axis.identified !== false) {
    const [low, high] = axis.interval.map((v) => clamp(shareOf(axis, v), 0, 1));
    pen.fillStyle = theme.band; pen.fillRect(x(low), frame.top, Math.max(x(high) - x(low), 2), frame.height);
  }
  mapTicks(pen, frame, axis, { ...axis, log: false, low: y[0], high: y[1], factor: 1 });
  labelAxes(pen, frame, axis, { title: "smallest misfit", unit: "1 = noise" }, width, height);
  if (!known.length) return;
  pen.strokeStyle = theme.model; pen.lineWidth = 2; pen.beginPath();
  values.forEach((v, i) => { if (Number.isFinite(v)) pen.lineTo(x(i / (values.length - 1)), frame.py(v)); });
  pen.stroke();
};

// What a profile says, in words.
const profileWords = ({ axis, values }, found) => {
  const known = [...values].filter(Number.isFinite);
  if (!known.length) return "No record, hence no misfit.";
  const least = Math.min(...known), high = Math.max(...known), better = found && found.misfit <= least;
  const low = better ? found.misfit : least;
  const at = better ? axis.get(found.point) : valueAt(axis, values.indexOf(least) / (values.length - 1));
  const best = `smallest misfit ${shownNumber(low, 3)} at ${withUnit(at, axis, 3)}`;
  if (high < 1.05 * low) return `${axis.title}: ${best}, but it rises by less than 5 % over the whole range: the record hardly tells this value.`;
  return `${axis.title}: ${best}; it rises to ${shownNumber(high, 3)} within the range.`;
};
