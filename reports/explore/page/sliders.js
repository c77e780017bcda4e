// Sliders: one an axis, with its number, its interval on the track, and the presets as ticks.

const COARSE = 0.01, FINE = 0.001; // shares of the range by an arrow key, without and with Shift

const percent = (share) => `${(100 * clamp(share, 0, 1)).toFixed(2)}%`;

const trackOf = (axis, presets) => {
  const parts = [];
  if (axis.identified === false) parts.push(element("i", { className: "unknown", title: "not identifiable from this record" }));
  else if (axis.interval) {
    const [low, high] = axis.interval.map((v) => clamp(shareOf(axis, v), 0, 1)), part = element("i", { className: "interval" });
    part.title = `95 % interval ${withUnit(axis.interval[0], axis)} to ${withUnit(axis.interval[1], axis)}`;
    part.style.left = percent(low); part.style.width = percent(high - low);
    parts.push(part);
  }
  presets.forEach((preset) => {
    const tick = element("i", { className: "tick", title: `${preset.name}: ${withUnit(axis.get(preset), axis)}` });
    tick.style.left = percent(shareOf(axis, axis.get(preset)));
    parts.push(tick);
  });
  return element("span", { className: "track", "aria-hidden": "true" }, ...parts);
};

const factsOf = (axis) => {
  if (axis.identified === false) return "not identifiable from this record";
  if (axis.interval) return `95 %: ${shownNumber(axis.interval[0] * axis.factor, 3)} to ${withUnit(axis.interval[1], axis, 3)}`;
  return `${shownNumber(axis.low * axis.factor, 3)} to ${withUnit(axis.high, axis, 3)}`;
};

const stepped = (event, share) => {
  const step = event.shiftKey ? FINE : COARSE;
  const moves = {
    ArrowRight: step, ArrowUp: step, ArrowLeft: -step, ArrowDown: -step, PageUp: 10 * COARSE, PageDown: -10 * COARSE,
  };
  return event.key in moves ? clamp(share + moves[event.key], 0, 1) : null;
};

// A slider for an axis; changed(value SI) is called while it moves. Returns its element and how to show a point.
const sliderFor = (axis, presets, changed) => {
  const id = `slider-${axis.id.replace(/[^A-Za-z0-9]+/g, "-")}`;
  const range = element("input", { type: "range", id, min: 0, max: 1, step: "any" });
  const number = element("input", { type: "number", step: "any", className: "value", "aria-label": `${axis.title}${axis.unit ? `, ${axis.unit}` : ""}` });
  range.addEventListener("input", () => changed(valueAt(axis, Number(range.value))));
  range.addEventListener("keydown", (event) => {
    const share = stepped(event, Number(range.value));
    if (share === null) return;
    event.preventDefault();
    changed(valueAt(axis, share));
  });
  number.addEventListener("change", () => {
    const value = Number(number.value) / axis.factor;
    changed(number.value === "" || !Number.isFinite(value) ? axis.low : clamp(value, axis.low, axis.high));
  });
  const head = element("label", { htmlFor: id, title: axis.key || axis.meaning || "" }, axis.title);
  const box = element("div", { className: "slider" },
    element("div", { className: "head" }, head, element("span", { className: "unit" }, number, ` ${axis.unit}`)),
    element("div", { className: "rail" }, trackOf(axis, presets), range),
    element("div", { className: "facts" }, axis.effect ? `${axis.meaning}; probability ${probabilityText(axis.probability)}` : factsOf(axis)));
  const show = (point) => {
    const value = axis.get(point), text = withUnit(value, axis);
    range.value = shareOf(axis, value);
    range.setAttribute("aria-valuetext", text);
    if (document.activeElement !== number) number.value = plainNumber(value * axis.factor);
    if (axis.effect) box.classList.toggle("off", !value);
  };
  return { box, show, axis };
};

// All sliders of a view in their groups; unlikely effects folded away.
const slidersOf = (view, presets, changed) => {
  const axes = axesOf(view), made = axes.map((axis) => sliderFor(axis, presets, (value) => changed(axis, value)));
  const of = (test) => made.filter(({ axis }) => test(axis)).map(({ box }) => box);
  const groups = [element("fieldset", {}, element("legend", {}, "Parameters"), ...of((axis) => !axis.effect))];
  const likely = of((axis) => axis.effect && axis.likely), others = of((axis) => axis.effect && !axis.likely);
  if (likely.length) groups.push(element("fieldset", {}, element("legend", {}, "Likely effects"), ...likely));
  if (others.length) {
    const folded = element("details", {}, element("summary", {}, `${others.length} ${likely.length ? "less likely " : ""}effects`), ...others);
    groups.push(element("fieldset", {}, element("legend", {}, likely.length ? "Other effects" : "Effects"), folded));
  }
  return { groups, show: (point) => made.forEach((slider) => slider.show(point)) };
};
