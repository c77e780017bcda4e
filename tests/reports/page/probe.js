// What a reader does with the page: looks at every figure, works every switch, points at curves, plays the strike.
(async () => {
  const found = { figures: {}, switches: {}, pointer: {}, animation: {}, errors: [] };
  window.addEventListener("error", (event) => found.errors.push(event.message));
  const wait = (ms) => new Promise((done) => setTimeout(done, ms));
  const shown = (part) => part.getClientRects().length > 0 && getComputedStyle(part).display !== "none";

  const scratch = document.createElement("canvas"), pen = scratch.getContext("2d", { willReadFrequently: true });
  const ink = (canvas) => {
    Object.assign(scratch, { width: canvas.width, height: canvas.height });
    pen.drawImage(canvas, 0, 0);
    const { data } = pen.getImageData(0, 0, canvas.width, canvas.height);
    let dark = 0, sum = 0;
    for (let i = 0; i < data.length; i += 4) {
      if (data[i] + data[i + 1] + data[i + 2] < 700) dark += 1;
      sum = (sum * 31 + data[i] + 2 * data[i + 1] + 3 * data[i + 2]) % 1000003;
    }
    return { share: dark / (data.length / 4), sum };
  };

  document.querySelectorAll("figure").forEach((figure) => {
    const part = figure.querySelector("svg, img, canvas"), box = part.getBoundingClientRect();
    const content = {
      svg: () => [...part.querySelectorAll("path, use")].filter((p) => p.getBoundingClientRect().width > 0).length,
      img: () => part.naturalWidth,
      canvas: () => 1e4 * ink(part).share,
    }[part.tagName.toLowerCase()]();
    found.figures[figure.id] = { width: box.width, height: box.height, content };
  });

  document.querySelectorAll("#switches input").forEach((box) => {
    const key = box.dataset.switch, parts = [...document.querySelectorAll(`figure [data-switch="${key}"]`)];
    const figures = [...new Set(parts.map((part) => part.closest("figure").id))];
    const before = parts.filter(shown).length;
    box.click();
    const off = parts.filter(shown).length;
    box.click();
    found.switches[key] = { figures, before, off, after: parts.filter(shown).length, parts: parts.length };
  });
  const all = document.querySelector("#switches button"), curves = [...document.querySelectorAll("figure [data-switch]")];
  all.click();
  found.none = curves.filter(shown).length;
  all.click();
  found.every = curves.filter(shown).length === curves.length;

  const tip = document.getElementById("tip");
  const point = (svg) => {
    const box = svg.getBoundingClientRect();
    const at = { clientX: box.left + 0.55 * box.width, clientY: box.top + 0.4 * box.height, bubbles: true };
    svg.dispatchEvent(new PointerEvent("pointermove", at));
    const text = tip.hidden ? "" : tip.innerText;
    return text;
  };
  document.querySelectorAll("figure script.readings").forEach((script) => {
    const figure = script.closest("figure"), svg = figure.querySelector("svg");
    const first = document.querySelector("#switches input[data-switch=elastic]");
    const text = point(svg);
    first.click();
    const without = point(svg);
    first.click();
    svg.dispatchEvent(new PointerEvent("pointerleave"));
    found.pointer[figure.id] = { text, without, gone: tip.hidden };
  });

  const whole = document.querySelector("figure.animation"), canvas = whole.querySelector("canvas");
  const slider = whole.querySelector("input[type=range]"), choice = whole.querySelector("select");
  const to = (frame) => { slider.value = frame; slider.dispatchEvent(new Event("input")); };
  to(0);
  const start = ink(canvas).sum;
  to(slider.max);
  const end = ink(canvas).sum;
  const models = [...choice.options].map((option) => {
    choice.value = option.value;
    choice.dispatchEvent(new Event("change"));
    return ink(canvas).sum;
  });
  to(0);
  const play = whole.querySelector("button.play");
  play.click();
  await wait(400);
  play.click();
  found.animation = { start, end, models, played: Number(slider.value), frames: Number(slider.max) + 1 };

  const answer = document.createElement("pre");
  answer.id = "answer";
  answer.textContent = JSON.stringify(found);
  document.body.append(answer);
})();
