// A counter-example to play with: the loop x' = a x + b u, y = c x with a slow sensor, simulated in the page.
"use strict";
(() => {
  // Over a fast period T the command u = K z is held, and so is what stands for the measurement in z' = a z + b u + L (y - c z).
  const integral = (rate, T) => (rate === 0 ? T : Math.expm1(rate * T) / rate);
  const LOOPS = {
    // Eq. (6): the prediction starts anew from the estimate at every fast instant.
    printed: ({ a, b, c }, { z, u }, T) => c * (Math.exp(a * T) * z + b * integral(a, T) * u),
    // The repair: the last value, plus what the model says that it has changed by; the true one at slow instants.
    restarted: ({ a, b, c }, { y, z, u }, T) => y + c * (Math.expm1(a * T) * z + b * integral(a, T) * u),
    fast: ({ c }, { x }) => c * x,
  };
  // From x and z at a slow instant over M fast periods; `each` is told of every fast instant.
  function slowPeriod(loop, name, state, each = () => {}) {
    const { a, b, c, K, L, T, M } = loop, guided = a - L * c, grows = Math.exp(a * T), settles = Math.exp(guided * T);
    let { x, z } = state, y = c * x;
    for (let k = 0; k < M; k += 1) {
      const u = K * z;
      const next = grows * x + b * integral(a, T) * u, after = LOOPS[name](loop, { x: next, y, z, u }, T);
      z = settles * z + integral(guided, T) * (b * u + L * y);
      [x, y] = [next, after];
      each(x);
    }
    return { x, z };
  }
  // The largest modulus of the eigenvalues of (x, z) -> (x, z) over a slow period.
  function radius(loop, name) {
    const [p, q] = [{ x: 1, z: 0 }, { x: 0, z: 1 }].map((unit) => slowPeriod(loop, name, unit));
    const half = (p.x + q.z) / 2, root = half * half - (p.x * q.z - q.x * p.z);
    return root < 0 ? Math.sqrt(p.x * q.z - q.x * p.z) : Math.abs(half) + Math.sqrt(root);
  }
  // The left side of (18), alpha_4 lambda_max(P) T, with J'P + PJ = -I for J = [a + bK, -bK; 0, a - Lc]; none unless both
  // diagonal entries are negative, as the theorem assumes.
  function condition({ a, b, c, K, L, T }) {
    const fed = a + b * K, guided = a - L * c;
    if (!(fed < 0 && guided < 0)) return null;
    const first = -1 / (2 * fed), cross = (b * K * first) / (fed + guided), last = (2 * b * K * cross - 1) / (2 * guided);
    const middle = (first + last) / 2, spread = Math.hypot((first - last) / 2, cross);
    const least = Math.sqrt(middle - spread), most = middle + spread;
    const output = (Math.abs(c * a) + 2 * Math.abs(c * b * K)) / least, prediction = Math.abs(c * a) / least;
    const feedback = (2 * Math.abs(K * guided) + 2 * Math.abs(K * b * K) + Math.abs(K * L * c)) / least;
    const parts = feedback * Math.abs(b) + Math.abs(L) * output + prediction * (Math.abs(b * K * L) + Math.abs(L));
    return ((2 * parts * most) / least) * most * T;
  }
  // x at the fast instants from x = 1 and z = 0, until the time is over or x has left the picture.
  function run(loop, name, seconds, most = Infinity) {
    const found = [1];
    for (let state = { x: 1, z: 0 }; (found.length - 1) * loop.T < seconds && Math.abs(found.at(-1)) <= most;) {
      state = slowPeriod(loop, name, state, (x) => found.push(x));
    }
    return found;
  }
  globalThis.dualRate = { radius, condition, run };

  if (typeof document === "undefined") return;
  const made = (name, attributes = {}, ...inside) => {
    const svg = ["svg", "path", "text"].includes(name);
    const element = svg ? document.createElementNS("http://www.w3.org/2000/svg", name) : document.createElement(name);
    for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
    element.append(...inside);
    return element;
  };
  const shown = (x, digits = 3) => String(Number(x.toPrecision(digits))).replace("-", "\u2212");
  const NAMES = { printed: "as printed", restarted: "restarted predictor", fast: "true fast sensor" };
  const SECONDS = 4, SLOW_PERIODS = 12, TOP = 15, HEIGHT = 300, STEPS = 20;

  function build(place) {
    const given = JSON.parse(place.dataset.play), { name } = given, start = { ...given };
    for (const key of ["a", "b", "c", "K", "L", "T", "M"]) start[key] = Number(given[key]);
    const term = (factor, letter) => (factor === 1 ? letter : `${shown(factor)}·${letter}`);
    const hint = made("p", { class: "hint" }, `The loop x′ = ${term(start.a, "x")} + ${term(start.b, "u")}, u = K × the estimate, observer gain L. A sample of ${term(start.c, "x")} comes every M·T. Move the sliders.`);
    const title = made("h4", { id: `${name}-title` }), lamp = made("p", { class: "lamp", role: "status" });
    const plot = made("svg", { role: "img" }), key = made("ul", { class: "key" });
    // T moves in powers of ten about that of the certificate, the others in steps.
    const sliders = {
      T: ["period T", -STEPS / 2, 2.5 * STEPS, 1, 0, (s) => start.T * 10 ** (s / STEPS), (x) => `${shown(x)} s`],
      M: ["ratio M", 2, 20, 1, start.M, Number, String],
      K: ["gain K", start.K - 6, start.K + 1.5, 0.1, start.K, Number, shown],
      L: ["gain L", start.L - 1.5, start.L + 6, 0.1, start.L, Number, shown],
    };
    const inputs = {}, outputs = {}, controls = made("div", { class: "controls" });
    for (const [letter, [label, min, max, step, value]] of Object.entries(sliders)) {
      inputs[letter] = made("input", { type: "range", min, max, step, value });
      outputs[letter] = made("output");
      controls.append(made("label", {}, made("span", {}, label, " ", outputs[letter]), inputs[letter]));
      inputs[letter].addEventListener("input", draw);
    }
    const reset = made("button", { type: "button" }, "Back to the certified case");
    reset.addEventListener("click", () => {
      for (const [letter, [, , , , value]] of Object.entries(sliders)) inputs[letter].value = value;
      draw();
    });
    controls.append(reset);

    function draw() {
      const loop = { ...start };
      for (const [letter, [label, , , , , read, write]] of Object.entries(sliders)) {
        loop[letter] = read(inputs[letter].value);
        outputs[letter].textContent = `= ${write(loop[letter])}`;
        inputs[letter].setAttribute("aria-valuetext", `${label} ${write(loop[letter])}`);
      }
      const side = condition(loop), radii = Object.fromEntries(Object.keys(LOOPS).map((one) => [one, radius(loop, one)]));
      const diverges = radii.printed > 1, met = side !== null && side < 1;
      title.textContent = side === null ? "Outside the theorem: A + BK or A − LC is not Hurwitz"
        : met && diverges ? "Condition (18) is met, and the loop diverges all the same" : `The loop ${diverges ? "diverges" : "decays"} as printed; condition (18) is ${met ? "" : "not "}met`;
      const told = side === null ? "The theorem assumes that both are, and promises nothing here."
        : `Condition (18): ${shown(side)} ${met ? "<" : "≥"} 1. The theorem ${met ? "promises that the loop is stable" : "promises nothing here"}.`;
      lamp.textContent = told;
      lamp.dataset.met = side === null ? "none" : met;
      const seconds = Math.max(SECONDS, SLOW_PERIODS * loop.M * loop.T), curves = Object.keys(LOOPS).map((one) => [one, run(loop, one, seconds, 100 * TOP)]);
      const [high, low] = [1, -1].map((sign) => Math.min(TOP, Math.max(...curves.map(([, xs]) => xs.reduce((most, x) => Math.max(most, sign * x), 0.2)))));
      const wide = Math.max(300, Math.min(760, place.clientWidth || 760)), left = 40, at = (t, x) => `${(left + (t / seconds) * (wide - left - 8)).toFixed(1)} ${(12 + ((high - x) / (high + low)) * (HEIGHT - 44)).toFixed(1)}`;
      const text = (x, y, words, anchor = "start") => made("text", { x, y, "text-anchor": anchor }, words);
      const height = (x) => Number(at(0, x).split(" ")[1]);
      const size = 10 ** Math.floor(Math.log10((high + low) / 3)), step = [1, 2, 5, 10].find((one) => one * size >= (high + low) / 4) * size;
      const marks = [...Array(9)].map((_, k) => (k - 4) * step).filter((x) => x && x <= high && x >= -low);
      plot.replaceChildren(made("path", { class: "axis", d: `M${at(0, 0)}L${at(seconds, 0)}` }),
        ...marks.flatMap((x) => [made("path", { class: "hair", d: `M${at(0, x)}L${at(seconds, x)}` }), text(left - 6, height(x) + 4, shown(x, 2), "end")]),
        text(left - 6, height(0) + 4, "0", "end"),
        text(left, HEIGHT - 8, "x from 1, over time"), text(wide - 8, HEIGHT - 8, `${shown(seconds)} s`, "end"),
        ...curves.map(([one, xs]) => {
          const every = Math.max(1, Math.ceil(xs.length / 900)), points = [];
          for (let k = 0; k < xs.length; k += every) {
            const x = Math.max(-low, Math.min(high, xs[k]));
            points.push(at(Math.min(k * loop.T, seconds), x));
            if (x !== xs[k]) break;
          }
          return made("path", { class: `line ${one}`, d: `M${points.join("L")}` });
        }));
      plot.setAttribute("viewBox", `0 0 ${wide} ${HEIGHT}`);
      plot.setAttribute("aria-label", `${title.textContent}: x over ${shown(seconds)} s`);
      key.replaceChildren(...Object.entries(NAMES).map(([one, words]) => made("li", { class: one },
        `${words}: ${radii[one] > 1 ? "grows" : "decays"}, × ${shown(radii[one], 5)} in each slow period`)));
    }
    place.append(title, hint, lamp, plot, key, controls);
    place.setAttribute("aria-labelledby", title.id);
    place.hidden = false;
    draw();
    let width = 0;
    new ResizeObserver(() => {
      if (width !== place.clientWidth) draw();
      width = place.clientWidth;
    }).observe(place);
  }
  document.querySelectorAll("[data-play]").forEach(build);
})();
