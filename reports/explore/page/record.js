// A record that is dropped on the page: the rules of birdstrike's measured-data CSV, every error with its line.

const HEADER = /^\s*([A-Za-z][A-Za-z0-9_.]*)\s*(?:\[([^\]]*)\])?\s*$/;
const NUMBER = /^[+-]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][+-]?\d{1,3})?$/;
const UNKNOWN_NOISE = 0.01; // of the peak, where neither the record nor the case states any

class RecordError extends Error {
  constructor(lines) { super(lines.join("\n")); this.lines = lines; }
}

const cellsOf = (line) => {
  const cells = [];
  let cell = "", quoted = false;
  for (const sign of line) {
    if (sign === '"') quoted = !quoted;
    else if (sign === "," && !quoted) { cells.push(cell.trim()); cell = ""; } else cell += sign;
  }
  return [...cells, cell.trim()];
};

const unitNamed = (units, text) => units[text] || units[text.replace(/[.·]/g, "*").replace(/µ|μ/g, "u")]
  || units[text.replace(/\*/g, " ")] || units[text.replace(/([a-z])(\d)/g, "$1^$2")];

const headOf = (text, units) => {
  const match = HEADER.exec(text);
  if (!match || match[2] === undefined) {
    return { error: `"${text}" needs a name and a unit in square brackets, such as "time [ms]"` };
  }
  const unit = unitNamed(units, match[2].trim());
  return unit ? { text, name: match[1], ...unit } : { error: `"${text}": "${match[2]}" is not a unit that is known here` };
};

// Lines of cells with their numbers, the header first.
const rowsOf = (text) => {
  const lines = text.replace(/^\uFEFF/, "").split(/\r\n|\r|\n/);
  const rows = lines.map((line, i) => ({ line: i + 1, text: line })).filter(({ text: t }) => t.trim() && !t.startsWith("#"));
  if (!rows.length) throw new RecordError(['no table; its header is "time [ms],displacement_centre [mm]"']);
  const all = rows.map(({ line, text: t }) => ({ line, cells: cellsOf(t) }));
  if (all[0].cells.length < 2) throw new RecordError([`line ${all[0].line}: one column only; columns are separated by commas`]);
  return all;
};

const numberIn = (cell, head, line, errors) => {
  if (!cell) return NaN;
  if (NUMBER.test(cell) && Number.isFinite(Number(cell) * head.factor)) return Number(cell) * head.factor;
  errors.push(`line ${line}: ${head.name} = "${cell}" is not a finite number; leave the cell empty for a gap`);
  return NaN;
};

const headsOf = ([header, ...rows], units) => {
  const heads = header.cells.map((cell) => headOf(cell, units));
  const names = heads.map((head) => head.name);
  const errors = heads.filter((head) => head.error).map((head) => `line ${header.line}: ${head.error}`);
  new Set(names.filter((name, i) => name && names.indexOf(name) < i)).forEach(
    (name) => errors.push(`line ${header.line}: "${name}" stands twice in the header`));
  rows.filter(({ cells }) => cells.length !== heads.length).forEach(({ line, cells }) => errors.push(
    `line ${line}: ${cells.length} cells where the header has ${heads.length}`));
  if (errors.length) throw new RecordError(errors);
  return heads;
};

const clockErrors = (head, time, rows, header) => {
  if (head.name !== "time" || head.si !== "s") return [`line ${header}: the first column is "${head.text}" and must be "time [ms]"`];
  if (rows.length < 2) return [`line ${header}: ${rows.length} rows follow; a record needs at least 2`];
  const errors = [];
  time.forEach((t, i) => {
    const { line, cells } = rows[i];
    if (Number.isNaN(t)) errors.push(`line ${line}: the time is missing; a gap is an empty cell of a sensor's column`);
    else if (i && t <= time[i - 1]) errors.push(`line ${line}: the time ${cells[0]} does not increase; sort the rows, one for each instant`);
  });
  return errors;
};

const columnErrors = (columns, rows, header) => {
  const errors = [];
  columns.forEach(({ head, values }) => {
    const sigma = head.name.endsWith("_sigma"), base = columns.find(({ head: h }) => h.name === head.name.replace(/_sigma$/, ""));
    if (!base) errors.push(`line ${header}: "${head.text}" has no column "${head.name.replace(/_sigma$/, "")}" beside it`);
    else if (base.head.si !== head.si) errors.push(`line ${header}: "${head.text}" is not in a unit of "${base.head.text}"`);
    if (values.filter(Number.isFinite).length < 2) errors.push(`line ${header}: "${head.text}" has fewer than 2 values`);
    if (!sigma) return;
    values.forEach((v, i) => {
      if (v <= 0) errors.push(`line ${rows[i].line}: ${head.name} must be greater than 0`);
      else if (Number.isNaN(v) && base && Number.isFinite(base.values[i])) {
        errors.push(`line ${rows[i].line}: ${base.head.name} has a value here and ${head.name} has none`);
      }
    });
  });
  return errors;
};

// Time (n,) and channels {name: {si, values, sigma or null}}, SI; throws RecordError with every error.
const readRecord = (text, units) => {
  const [header, ...rows] = rowsOf(text), heads = headsOf([header, ...rows], units), errors = [];
  const columns = heads.map((head, j) => ({ head, values: rows.map(({ line, cells }) => numberIn(cells[j], head, line, errors)) }));
  if (errors.length) throw new RecordError(errors);
  const [{ head, values: time }, ...others] = columns;
  const wrong = [...clockErrors(head, time, rows, header.line), ...columnErrors(others, rows, header.line)];
  if (wrong.length) throw new RecordError(wrong);
  const channels = {};
  others.filter(({ head: h }) => !h.name.endsWith("_sigma")).forEach(({ head: h, values }) => {
    const sigma = others.find(({ head: other }) => other.name === `${h.name}_sigma`);
    channels[h.name] = { si: h.si, values, sigma: sigma ? sigma.values : null };
  });
  return { time, channels };
};

// One sensor's points since the simulations begin, with the noise that is known of it: the record's own, else the
// case's, else a share of the peak.
const pointsOf = (time, column, noise, source, start) => {
  const given = time.map((_, i) => i).filter((i) => time[i] >= start && Number.isFinite(column.values[i]));
  const peak = Math.max(...given.map((i) => Math.abs(column.values[i])));
  const sigma = (i) => (column.sigma ? column.sigma[i] : noise || UNKNOWN_NOISE * peak);
  return {
    time: given.map((i) => time[i]), values: given.map((i) => column.values[i]), sigma: given.map(sigma), source,
    left_out: { time: [], values: [] }, guessed: !column.sigma && !noise,
  };
};

// The shot's channels with the record's points; throws RecordError for sensors or units that the emulator has not.
const matchRecord = (record, shot, start, end, source) => {
  const known = shot.channels.map((channel) => channel.name), errors = [];
  Object.entries(record.channels).forEach(([name, column]) => {
    const own = shot.channels.find((channel) => channel.name === name);
    if (!own) errors.push(`"${name}" is no sensor of this page; its sensors: ${known.join(", ")}`);
    else if (own.si !== column.si) errors.push(`"${name}" is given in a unit of another kind than ${own.unit}`);
    else if (!column.values.some((v) => Number.isFinite(v) && v !== 0)) errors.push(`"${name}" is zero everywhere: a dead sensor? leave its column out`);
  });
  const inside = ({ values }) => record.time.filter((t, i) => t >= start && t <= end && Number.isFinite(values[i]));
  if (!errors.length && Object.values(record.channels).some((column) => inside(column).length < 3)) {
    errors.push(`fewer than 3 instants lie inside the simulated record (${plainNumber(1e3 * start)} to ${plainNumber(1e3 * end)} ms)`);
  }
  if (errors.length) throw new RecordError(errors);
  return shot.channels.map((channel) => {
    const column = record.channels[channel.name];
    return { ...channel, buffer: null, record: column ? pointsOf(record.time, column, channel.noise, source, start) : null };
  });
};
