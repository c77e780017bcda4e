// The page: its state, and what happens when it changes.

const start = () => {
  const id = (name) => document.getElementById(name), numbers = id("numbers");
  const { views, student, units } = unpack(JSON.parse(id("content").textContent), numbers.textContent);
  numbers.remove();
  const state = { view: null, number: 0, point: null, run: null, panels: [], sliders: null, map: null, profile: null, best: null };
  const settled = { timer: 0 };

  const record = () => channelsOf(state.view).some(({ channel }) => channel.record);

  const draw = () => {
    let sum = 0, count = 0;
    state.panels.forEach((panel) => {
      const [own, points] = drawPanel(panel, state.view, state, student);
      sum += own; count += points;
    });
    id("misfit").textContent = count ? shownNumber(Math.sqrt(sum / count), 3) : "–";
    id("outside").hidden = state.view.systems.every((system) => covered(system, state.point.theta));
    if (state.map && !id("map-box").hidden) drawMap(id("map"), state.view, state, state.map);
    if (state.profile && !id("profile-box").hidden) drawProfile(id("profile"), state, state.profile);
  };

  let due = 0;
  const redraw = () => { if (!due) due = requestAnimationFrame(() => { due = 0; draw(); }); };

  // Effects that are there: a best fit and a profile hold for these.
  const effectsKey = () => JSON.stringify(Object.entries(state.point.effects).filter(([, value]) => value).sort());

  // What may wait until the slider rests: words for a screen reader, the map, the profile.
  const settle = () => {
    clearTimeout(settled.timer);
    settled.timer = setTimeout(() => {
      state.panels.forEach((panel) => describePanel(panel, state.view));
      id("said").textContent = record() ? `Misfit in all ${id("misfit").textContent}; 1 is noise.` : "";
      renewMap(); renewProfile();
      if (effectsKey() !== state.fitted) fit();
    }, 250);
  };
  const changed = () => { state.sliders.show(state.point); pressPreset(); redraw(); settle(); };
  const setAxis = (axis, value) => { axis.set(state.point, value); changed(); };
  const copied = (point) => ({ theta: Float64Array.from(point.theta), effects: { ...point.effects }, clock: point.clock });
  const setPoint = (point) => { state.point = copied(point); changed(); };

  const samePoint = (a, b) => axesOf(state.view).every((axis) => Math.abs(shareOf(axis, axis.get(a)) - shareOf(axis, axis.get(b))) < 1e-6);
  const pressPreset = () => id("presets").querySelectorAll("button").forEach((button, i) => {
    const preset = presetsOf(state.view)[i];
    button.setAttribute("aria-pressed", String(samePoint(preset, state.point)));
  });
  const presetsOf = (view) => [...view.presets, ...(state.best ? [{ name: "best fit of the emulator", ...state.best.point }] : [])];
  const showPresets = () => {
    id("presets").replaceChildren(...presetsOf(state.view).map((preset) => {
      const button = element("button", { type: "button" }, preset.name);
      button.addEventListener("click", () => setPoint(preset));
      return button;
    }));
    pressPreset();
  };

  // The map depends on all but its own two axes; it is made anew where another has moved.
  const restOf = (axes) => JSON.stringify(axesOf(state.view).filter((axis) => !axes.includes(axis.id)).map((axis) => axis.get(state.point)));
  const renewMap = () => {
    const { map } = state;
    if (!map || !record()) return;
    const key = restOf([map.across.id, map.up.id]) + map.across.id + map.up.id + state.recordNumber;
    if (key === map.key) return;
    map.key = key;
    id("map").setAttribute("aria-busy", "true");
    inSlices("map", mapOver(state.view, state.point, map.across, map.up, CELLS), (rows) => {
      if (map !== state.map) return; // another view was chosen meanwhile
      map.rows = rows;
      id("map").removeAttribute("aria-busy");
      describeMap();
      redraw();
    });
  };
  const describeMap = () => {
    const { map } = state, known = finite(map.rows);
    const words = known.length ? `misfit from ${shownNumber(Math.min(...known), 3)} (dark) to ${shownNumber(Math.max(...known), 3)} (bright); white line: at most 10 % above the smallest` : "no run stands behind this slice";
    id("map-words").textContent = `${map.across.title} across, ${map.up.title} up: ${words}. Dots: the campaign's runs; cross: this point; ring: best fit of the emulator.`;
    id("map").setAttribute("aria-label", `Map of the misfit. ${id("map-words").textContent} Arrow keys move the point.`);
  };
  const renewProfile = () => {
    const { profile } = state;
    if (!profile || !record()) return;
    const key = `${profile.axis.id} ${effectsKey()} ${state.recordNumber}`;
    if (key === profile.key) return;
    profile.key = key;
    inSlices("profile", profileOver(state.view, asPoint(state.point), profile.axis, PLACES), (values) => {
      if (profile !== state.profile) return;
      profile.values = values;
      sayProfile();
      redraw();
    });
  };
  const sayProfile = () => {
    if (!state.profile || !state.profile.values) return;
    const words = profileWords(state.profile, state.best);
    id("profile-words").textContent = words;
    id("profile").setAttribute("aria-label", words);
  };
  const choose = (select, axes, chosen, then) => {
    select.replaceChildren(...axes.map((axis, i) => element("option", { value: i, selected: axis.id === chosen }, axis.title)));
    select.onchange = () => then(axes[select.value]);
  };
  const showMaps = () => {
    const axes = axesOf(state.view), [across, up] = [axes[Math.min(1, axes.length - 1)], axes[0]];
    const first = state.view.parameters.length > 1 ? [axes[1], axes[0]] : [axes[0], axes.find((axis) => axis.likely) || axes[axes.length - 1]];
    id("map-box").hidden = axes.length < 2 || !record();
    id("profile-box").hidden = !record();
    state.map = axes.length < 2 ? null : { across: first[0], up: first[1] };
    state.profile = { axis: axes.find((axis) => axis.key && axis.key.endsWith("viscosity")) || across || up };
    if (state.map) {
      choose(id("map-across"), axes, state.map.across.id, (axis) => { state.map.across = axis; state.map.rows = null; renewMap(); redraw(); });
      choose(id("map-up"), axes, state.map.up.id, (axis) => { state.map.up = axis; state.map.rows = null; renewMap(); redraw(); });
    }
    choose(id("profile-axis"), axes, state.profile.axis.id, (axis) => { state.profile = { axis }; renewProfile(); redraw(); });
    const runs = Array.from({ length: runsShown(state.view) }, (_, i) => element("option", { value: i }, `run ${i + 1}`));
    id("run").replaceChildren(element("option", { value: "" }, "none"), ...runs);
  };

  // Best point of the emulator for the record, which a preset and the map then show.
  const fit = () => {
    if (!record()) return;
    const axes = axesOf(state.view).filter((axis) => !axis.effect);
    const { view } = state;
    state.fitted = effectsKey();
    inSlices("fit", best(view, asPoint(state.point), axes, 60), (found) => {
      if (view !== state.view || !Number.isFinite(found.misfit)) return;
      state.best = found;
      showPresets(); sayProfile(); redraw();
      if (state.dropped) sayBest(found);
    });
  };
  const sayBest = (found) => {
    const values = state.view.parameters.map((axis, i) => `${axis.label} ${withUnit(found.point.theta[i], axis, 3)}`).join(", ");
    id("dropped").replaceChildren(element("b", {}, `${state.dropped}: best fit of the emulator ${values}`),
      `, misfit ${shownNumber(found.misfit, 3)} (1 = noise). Intervals, and whether the record identifies these values, are what birdstrike train-and-invert states.`);
  };

  const showLeftOut = () => {
    id("legend-left-out").hidden = !channelsOf(state.view).some(({ channel: { record: own } }) => own && own.left_out.time.length);
  };

  const showView = (number) => {
    Object.assign(state, { view: views[number], number, run: null, best: null, dropped: null, fitted: null, recordNumber: 0 });
    document.querySelectorAll(".answer").forEach((part, i) => { part.hidden = i !== number; });
    const { view } = state, many = view.shots.length > 1;
    state.panels = channelsOf(view).map(({ shot, channel }) => panelOf(shot, channel, many, (panel, x) => readPanel(panel, view, x)));
    id("charts").replaceChildren(...state.panels.map((panel) => panel.box));
    id("charts").classList.toggle("single", state.panels.length === 1);
    id("charts").classList.toggle("few", state.panels.length < 3);
    state.sliders = slidersOf(view, view.presets, setAxis);
    id("sliders").replaceChildren(...state.sliders.groups);
    id("legend-run").hidden = !view.runs;
    showLeftOut();
    id("dropped").replaceChildren(); id("errors").replaceChildren();
    state.point = copied(view.presets[0]);
    showPresets(); showMaps(); changed(); fit();
  };

  // A dropped record takes the place of the first shot's.
  const takeRecord = (text, name) => {
    const { view } = state, [shot] = view.shots, { time } = view.systems[shot.system];
    const channels = matchRecord(readRecord(text, units), shot, time[0], time[time.length - 1], name);
    channels.forEach((channel, i) => { shot.channels[i].record = channel.record; });
    state.panels.forEach((panel) => { panel.key = null; panel.scales = null; });
    Object.assign(state, { dropped: name, best: null, recordNumber: state.recordNumber + 1 });
    showLeftOut();
    const guessed = channels.filter((channel) => channel.record && channel.record.guessed).map((channel) => channel.label);
    id("dropped").textContent = `${name} is drawn and scored.`;
    id("errors").replaceChildren(...(guessed.length ? [element("li", {}, `No noise is known of ${guessed.join(", ")}: 1 % of the peak is taken, so that a misfit of 1 is no measure; add a column of sigma.`)] : []));
    showPresets(); showMaps(); changed(); fit();
  };
  const textOf = (bytes) => {
    try { return new TextDecoder("utf-8", { fatal: true }).decode(bytes); } catch { throw new RecordError(["it is no UTF-8 text"]); }
  };
  const readFile = async (file) => {
    try {
      takeRecord(textOf(await file.arrayBuffer()), file.name);
    } catch (error) {
      if (!(error instanceof RecordError)) throw error;
      const { lines } = error;
      id("dropped").textContent = `${file.name} cannot be used:`;
      id("errors").replaceChildren(...lines.slice(0, 8).map((line) => element("li", {}, line)),
        ...(lines.length > 8 ? [element("li", {}, `and ${lines.length - 8} more`)] : []));
    }
  };
  const acceptFiles = () => {
    const { body } = document;
    ["dragover", "dragenter"].forEach((name) => body.addEventListener(name, (event) => { event.preventDefault(); body.classList.add("dropping"); }));
    body.addEventListener("dragleave", (event) => { if (!event.relatedTarget) body.classList.remove("dropping"); });
    body.addEventListener("drop", (event) => {
      event.preventDefault();
      body.classList.remove("dropping");
      if (event.dataTransfer.files.length) readFile(event.dataTransfer.files[0]);
    });
    id("file").addEventListener("change", () => { if (id("file").files.length) readFile(id("file").files[0]); id("file").value = ""; });
  };

  const mapMoves = () => {
    const canvas = id("map"), to = (x, y) => {
      const { frame, across, up } = state.map;
      across.set(state.point, valueAt(across, (x - frame.left) / frame.width));
      up.set(state.point, valueAt(up, 1 - (y - frame.top) / frame.height));
      changed();
    };
    const showRun = (run) => { if (run !== state.run) { state.run = run; id("run").value = run === null ? "" : run; redraw(); } };
    canvas.addEventListener("pointerdown", (event) => { canvas.setPointerCapture(event.pointerId); to(event.offsetX, event.offsetY); });
    canvas.addEventListener("pointermove", (event) => {
      if (event.buttons) to(event.offsetX, event.offsetY); else showRun(nearestRun(state.view, state.map, event.offsetX, event.offsetY));
    });
    canvas.addEventListener("pointerleave", () => showRun(null));
    canvas.addEventListener("keydown", (event) => {
      const { across, up } = state.map, axis = ["ArrowLeft", "ArrowRight"].includes(event.key) ? across : up;
      const share = stepped(event, shareOf(axis, axis.get(state.point)));
      if (share === null || !event.key.startsWith("Arrow")) return;
      event.preventDefault();
      setAxis(axis, valueAt(axis, share));
    });
    id("run").addEventListener("change", () => showRun(id("run").value === "" ? null : Number(id("run").value)));
  };

  const themes = () => {
    const renew = () => { readTheme(); state.panels.forEach((panel) => { panel.key = null; }); if (state.view) draw(); };
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", renew);
    window.addEventListener("beforeprint", () => { document.documentElement.classList.add("printing"); renew(); });
    window.addEventListener("afterprint", () => { document.documentElement.classList.remove("printing"); renew(); });
    new ResizeObserver(redraw).observe(id("charts"));
    window.addEventListener("resize", redraw);
  };

  readTheme();
  acceptFiles(); mapMoves(); themes();
  id("views").addEventListener("change", (event) => showView(Number(event.target.value)));
  id("copy-toml").addEventListener("click", () => offer(tomlOf(state.view, state.point), id("copied")));
  id("copy-command").addEventListener("click", () => offer(commandOf(state.view, state.point), id("copied")));
  id("copy-curves").addEventListener("click", () => offer(curvesCsv(state.panels, state.view), id("copied")));
  document.documentElement.classList.add("ready");
  showView(0);
  draw();
  window.explore = { state, draw, setPoint, showView, readFile }; // for scripts and the console
};
start();
