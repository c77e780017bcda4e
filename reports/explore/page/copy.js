// The present point as case keys in TOML, as a command, and the curves as CSV.

// Ten digits: what is pasted simulates what is drawn.
const written = (si, quantity) => `${Number((si * quantity.factor).toPrecision(10))} ${quantity.unit}`.trim();
const quotedToml = (text) => `"${text.replace(/\\/g, "\\\\").replace(/"/g, '\\"')}"`;
const keyToml = (text) => (/^[A-Za-z0-9_-]+$/.test(text) ? text : quotedToml(text));
const quotedShell = (text) => (/^[\w@%+=:,./-]+$/.test(text) ? text : `'${text.replace(/'/g, "'\\''")}'`);

// Time constant [s] of a sensor that is slower by x: time constants add (solver.effects.instrument).
const slowness = (x, stated) => Math.max(x + (stated.bandwidth ? 1 / (2 * Math.PI * stated.bandwidth) : 0), 1e-9);

// How a fault of one sensor stands in a case: key under instrument.<sensor>, and its value in TOML.
const INSTRUMENT = {
  sensor_gain: (x, stated) => ["gain", String(Number((stated.gain * (1 + x)).toPrecision(10)))],
  time_offset: (x, stated) => ["time_offset", quotedToml(`${Number((stated.time_offset + x).toPrecision(10))} s`)],
  sensor_drift: (x, stated) => ["drift", quotedToml(`${Number((stated.drift + x).toPrecision(10))} m/s`)],
  sensor_bandwidth: (x, stated) => ["bandwidth", quotedToml(`${Number((1 / (2 * Math.PI * slowness(x, stated))).toPrecision(10))} 1/s`)],
};

// Magnitude of a fault of all instruments beside what a case declares of it (solver.effects.instrument.combined).
const beside = (effect, x, declared) => Math.max(effect.name === "sensor_gain" ? (1 + declared) * (1 + x) - 1 : declared + x, effect.least);

// [section, key, value in TOML, note] of every parameter, and of those effects that are there.
const keysOf = (view, point, effects = view.effects) => {
  const rows = view.parameters.map((axis, i) => {
    const parts = axis.key.split(".").map(keyToml), key = parts.pop(), value = point.theta[i];
    return [parts.join("."), key, axis.unit ? quotedToml(written(value, axis)) : String(Number(value.toPrecision(10))), ""];
  });
  effects.filter((effect) => point.effects[effect.label]).forEach((effect) => {
    const found = point.effects[effect.label], x = effect.declared ? beside(effect, found, effect.declared) : found, alone = effect.label.split("@")[1], note = alone ? `of shot ${alone} alone` : "";
    if (effect.single) {
      const [key, value] = INSTRUMENT[effect.name](x, effect.stated);
      const elsewhere = Object.entries(effect.elsewhere).map(([shot, stated]) => `of shot ${shot}: ${INSTRUMENT[effect.name](x, stated)[1]}`);
      rows.push([`instrument.${keyToml(effect.single)}`, key, value, [note, ...elsewhere].filter(Boolean).join("; ")]);
      return;
    }
    rows.push(["effects", keyToml(effect.name), effect.unit ? quotedToml(written(x, effect)) : String(Number(x.toPrecision(10))), note]);
  });
  return rows;
};

const tomlOf = (view, point) => {
  const rows = keysOf(view, point), sections = [...new Set(rows.map(([section]) => section))];
  return sections.map((section) => [`[${section}]`, ...rows.filter(([own]) => own === section).map(
    ([, key, value, note]) => `${key} = ${value}${note ? ` # ${note.replace(/[\r\n]/g, " ")}` : ""}`)].join("\n")).join("\n\n") + "\n";
};

// Of the first shot, whose case it names.
const commandOf = (view, point) => {
  const acting = view.effects.filter((effect) => effect.shots.includes(view.shots[0].name));
  const set = keysOf(view, point, acting).map(([section, key, value]) => {
    const text = value.startsWith('"') ? JSON.parse(value) : value;
    return `--set ${quotedShell(`${section}.${key}=${text}`)}`;
  });
  return ["birdstrike simulate", quotedShell(view.case), ...set, "--out what_if"].join(" ");
};

// Every drawn curve with its standard deviation, SI, one row an instant.
const curvesCsv = (panels, view) => {
  const blocks = view.shots.map((shot) => {
    const own = panels.filter((panel) => panel.shot === shot), { time } = view.systems[shot.system];
    const head = ["time_s", ...own.flatMap(({ channel }) => [`${channel.name}_${channel.si}`, `${channel.name}_sd_${channel.si}`].map((n) => n.replace(/_$/, "")))];
    const lines = Array.from(time, (t, i) => [t, ...own.flatMap((panel) => [panel.curve[i], panel.error[i]])].map((v) => v.toPrecision(9)).join(","));
    return [...(view.shots.length > 1 ? [`# ${shot.name}`] : []), head.join(","), ...lines].join("\n");
  });
  return `${blocks.join("\n\n")}\n`;
};

// To the clipboard where the browser lets the page, and always to a text that can be selected.
const offer = (text, box) => {
  const area = box.querySelector("textarea"), note = box.querySelector("output");
  box.hidden = false; area.value = text; area.rows = Math.min(text.split("\n").length + 1, 12);
  area.focus(); area.select();
  const done = (words) => { note.textContent = words; };
  if (!navigator.clipboard) { done("Press Ctrl+C to copy."); return; }
  navigator.clipboard.writeText(text).then(() => done("Copied."), () => done("Press Ctrl+C to copy."));
};
