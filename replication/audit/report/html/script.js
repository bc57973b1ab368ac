// Optional: one page at a time, the picture of claims, search, evidence drawn on opening, contents that follow.
"use strict";
(() => {
  document.documentElement.classList.add("js");
  const all = (selector, root = document) => [...root.querySelectorAll(selector)];
  const one = (selector, root = document) => root.querySelector(selector);
  const views = all(".view");
  const pages = all(".pages a");
  const copied = (selector, root) => one(selector, root).cloneNode(true).childNodes;
  const still = matchMedia("(prefers-reduced-motion: reduce)").matches;

  // Evidence: packed once, unpacked when the browser has time, drawn into what is opened.
  const bytes = Uint8Array.from(atob(one("#evidence").textContent), (letter) => letter.charCodeAt(0));
  let evidence = null;
  const unpacked = new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"))).json()
    .then((parts) => { evidence = parts; });

  function draw(details) {
    const place = one(":scope > .evidence, :scope > .drawn", details);
    const html = evidence?.[details.dataset.draw ?? details.id];
    if (!place || !html || place.dataset.drawn) return;
    const held = place.contains(document.activeElement);
    place.dataset.drawn = "yes";
    place.innerHTML = html;
    watch(place);
    if (held) one("a, button, summary", place)?.focus();
  }

  document.addEventListener("toggle", ({ target }) => {
    if (target.open && target.matches(".claim, [data-draw]")) unpacked.then(() => draw(target));
  }, true);

  // What does not scroll needs no stop on the way through the page by Tab.
  const stops = new ResizeObserver((boxes) => {
    for (const { target } of boxes) {
      if (target.scrollWidth > target.clientWidth) target.tabIndex = 0;
      else target.removeAttribute("tabindex");
    }
  });
  function watch(root) { for (const box of all(".scroll", root)) stops.observe(box); }

  // One page at a time. The browser's own search opens hidden ones.
  const hidden = "onbeforematch" in document.body ? "until-found" : "";
  function show(view) {
    for (const other of views) {
      if (other === view) other.removeAttribute("hidden");
      else other.setAttribute("hidden", hidden);
    }
    // The answer is the first of all headings; where it is not shown, the report's name is.
    const name = one(".brand span");
    for (const [key, value] of [["role", "heading"], ["aria-level", "1"]]) {
      if (view === views[0]) name.removeAttribute(key);
      else name.setAttribute(key, value);
    }
    for (const link of pages) {
      link.removeAttribute("aria-current");
      if (link.hash !== `#${view.id}`) continue;
      link.setAttribute("aria-current", "page");
      link.parentElement.scrollLeft = link.offsetLeft - link.parentElement.offsetLeft - 40;
    }
  }

  function follow(first) {
    const place = document.getElementById(location.hash.slice(1));
    const view = place?.closest(".view");
    if (view || first || !place) show(view ?? views[0]);
    for (let fold = place?.closest("details"); fold; fold = fold.parentElement.closest("details")) fold.open = true;
    if (place && place !== view) place.scrollIntoView();
    else if (!first || place) scrollTo(0, 0);
    track();
  }

  // Contents that follow.
  const here = one(".here");
  function track() {
    const view = views.find((other) => !other.hasAttribute("hidden"));
    const parts = all(".sec", view);
    const current = parts.findLast((part) => part.getBoundingClientRect().top <= innerHeight * 0.3);
    here.hidden = !current;
    here.textContent = current ? one(`.toc a[href="#${CSS.escape(current.id)}"]`, view).textContent : "";
    for (const link of all(".toc a", view)) {
      const on = current && link.hash === `#${current.id}`;
      if (on) link.setAttribute("aria-current", "true");
      else link.removeAttribute("aria-current");
    }
  }
  let waiting = 0;
  addEventListener("scroll", () => {
    waiting ||= requestAnimationFrame(() => { waiting = 0; track(); });
  }, { passive: true });

  // Search: a printed number or a place first, then a name, then words of statement, verdict, paper and rank.
  const form = one(".find");
  const field = one("input", form);
  const box = one(".hits", form);
  let index = null;
  const plain = (text) => text.toLowerCase().replace(/_/g, "").replace(/\s+/g, " ").replace(/−/g, "-").trim();
  const paper = (part) => part.closest("[data-cited]")?.dataset.cited ?? "";
  const text = (selector, root) => plain(one(selector, root)?.textContent ?? "");
  function entries() {
    return all(".claim").map((claim) => ({
      link: claim.id, mark: one(".mark", claim), place: text(".pl", claim), name: plain(claim.dataset.id), of: paper(claim), title: text(".st > bdi", claim),
      numbers: `${one(".pv", claim).textContent} ${one(".ov", claim).textContent}`.split(/[^\d.−-]+/).map(plain),
      verdict: claim.dataset.v, counted: "n" in claim.dataset,
      said: [one(".vd .verdict", claim).textContent, ...[["printed", ".pv"], ["ours", ".ov"]].map(([word, at]) => {
        const value = one(at, claim).firstElementChild?.textContent.trim() || one(at, claim).textContent.trim();
        return value && `${word} ${value.replace(/\s+/g, " ").slice(0, 40)}`;
      })].filter(Boolean).join(", "),
      more: [text(".vd", claim), text("h4", claim.closest(".cg")), text(".reason", claim)].join(" "),
      shown: () => copied(".st > bdi", claim), at: () => copied(".pl", claim),
    })).concat(all("figure[id], .erratum").map((part) => {
      const [place, title] = part.matches("figure") ? all("figcaption strong bdi", part) : all("bdi", part);
      return { link: part.id, of: paper(part), mark: null, place: plain(place.textContent), name: plain(part.id), title: plain(title.textContent), numbers: [],
        more: part.matches("figure") ? "figure" : `erratum misprint ${plain(part.textContent)}`,
        shown: () => title.cloneNode(true).childNodes, at: () => place.cloneNode(true).childNodes };
    }));
  }
  // What a reader may call a verdict; it finds the claims that the chips of the answer count, and no others.
  const CALLED = {
    reproduced: ["as printed"], consistent: ["true"], compatible: ["possible"], "reproduced-after-erratum": ["corrected"],
    differs: ["fails", "wrong", "does not agree", "off"], refuted: ["fails", "false", "wrong", "does not agree", "does not hold", "untrue"],
    undetermined: ["undecided", "open", "not settled", "unsettled", "cannot be checked", "not checkable", "unknown"], error: ["failed"],
  };
  const verdicts = (query) => Object.keys(CALLED).filter((verdict) => verdict.replace(/-/g, " ") === query || CALLED[verdict].includes(query));
  // A place in full: Table 1 is neither Table 10 nor Table I, nor a table that has a 1 somewhere.
  const PLACE = /^(table|fig\.?|figure|sec\.?|section|theorem|lemma|example|eq\.?|corollary|algorithm) \(?[\divx]+\)?$/;
  function found(query) {
    const words = query.split(" ").filter(Boolean), wanted = verdicts(query);
    if (!words.length) return [];
    if (wanted.length) return index.filter((entry) => entry.counted && wanted.includes(entry.verdict));
    if (PLACE.test(query)) {
      const bare = (text) => text.replace(/[.()]/g, ""), name = bare(query).replace(/^figure/, "fig").replace(/^section/, "sec"), whole = new RegExp(`(^|\\W)${name}(?!\\w)`);
      const at = (entry) => [entry.place, entry.title].findIndex((text) => whole.test(bare(text)));
      const starts = (entry) => !bare(entry.place).startsWith(name);
      return index.filter((entry) => at(entry) >= 0).sort((a, b) => at(a) - at(b) || starts(a) - starts(b));
    }
    return index.map((entry) => [rank(entry, query, words), entry]).filter(([at]) => at !== null).sort(([a], [b]) => a - b).map(([, entry]) => entry);
  }
  function rank(entry, query, words) {
    entry.all ??= `${entry.place} ${entry.name} ${entry.title} ${entry.of.toLowerCase()} ${entry.more} ${entry.numbers.join(" ")}`;
    if (!words.every((word) => entry.all.includes(word))) return null;
    if (entry.numbers.includes(query) || entry.numbers.includes(query.replace(/^0\./, "."))) return 0;
    const after = entry.place[query.length];
    if (entry.place.startsWith(query) && (!after || !/[\w.]/.test(after))) return 0;
    if (entry.place.startsWith(query)) return 1;
    if (entry.place.includes(query)) return 2;
    if (entry.more.startsWith(query)) return 3;
    if (words.every((word) => entry.place.includes(word))) return 4;
    if (entry.name.includes(query)) return 5;
    return entry.title.includes(query) ? 6 : 7;
  }
  const more = one("button", box);
  const FIRST = 12;
  function search(whole = false) {
    index ??= entries();
    const query = plain(field.value);
    const hits = found(query);
    box.hidden = !query;
    more.hidden = whole || hits.length <= FIRST;
    one("p", box).textContent = hits.length ? `${hits.length} found${more.hidden ? "" : `, the first ${FIRST}:`}` : "Nothing found; try a printed number, a place such as Table 1, or a verdict.";
    more.textContent = `Show all ${hits.length}`;
    one("ol", box).replaceChildren(...hits.slice(0, whole ? hits.length : FIRST).map((entry) => {
      const line = document.createElement("li");
      const link = document.createElement("a");
      link.href = `#${entry.link}`;
      if (entry.mark) link.append(entry.mark.cloneNode(true));
      const place = document.createElement("b");
      place.append(...entry.at());
      const of = document.createElement("small");
      of.textContent = [entry.of, entry.said].filter(Boolean).join(": ");
      link.append(place, " ", ...entry.shown(), " ", of);
      line.append(link);
      return line;
    }));
  }
  form.hidden = false;
  field.addEventListener("input", () => search());
  // A press on the list leaves the focus where it is, so that the list stays open.
  box.addEventListener("mousedown", (event) => event.preventDefault());
  more.addEventListener("click", () => { search(true); all("a", box)[FIRST].focus(); });
  form.addEventListener("submit", (event) => { event.preventDefault(); one("a", box)?.click(); });
  form.addEventListener("click", (event) => { if (event.target.closest("a")) box.hidden = true; });
  form.addEventListener("focusout", (event) => { if (!form.contains(event.relatedTarget)) box.hidden = true; });
  field.addEventListener("focus", () => { if (field.value) search(); });
  form.addEventListener("keydown", (event) => {
    const links = [field, ...all("a, button:not([hidden])", box)];
    const step = { ArrowDown: 1, ArrowUp: -1 }[event.key];
    if (event.key === "Escape") box.hidden = true;
    if (!step) return;
    event.preventDefault();
    links[links.indexOf(document.activeElement) + step]?.focus();
  });

  // The picture of all claims.
  const picture = one("#field");
  const marks = all(".k");
  function point(mark) {
    const read = one(".read");
    const [verdict] = mark.getAttribute("aria-label").split(": ", 1);
    const data = mark.dataset;
    for (const other of marks) other.classList.toggle("on", other === mark);
    read.hidden = false;
    const word = document.createElement("span");
    word.textContent = verdict;
    one(".verdict", read).replaceChildren(one("svg", mark).cloneNode(true), word);
    one(".verdict", read).className = `verdict v-${data.v}`;
    const claim = document.getElementById(mark.hash.slice(1));
    one(".said", read).replaceChildren(...copied(".st > bdi", claim));
    one(".src", read).replaceChildren(`${one(".lane-name a", mark.closest(".lane")).textContent}, `, ...copied(".pl", claim));
    const said = [data.w, data.o, data.f, sure(data), claim.dataset.id];
    all("dd", read).forEach((cell, at) => {
      (cell.firstElementChild ?? cell).textContent = said[at] ?? "";
      cell.parentElement.hidden = !said[at];
    });
    one(".go", read).href = mark.hash;
  }
  function sure(data) {
    if ("q" in data) return "proved, with a certificate";
    if ("s" in data) return "supported by a theorem";
    return data.v === "undetermined" ? "not settled by the text" : "computed";
  }
  function rove(mark) { for (const other of marks) other.tabIndex = other === mark ? 0 : -1; }
  function start() {
    let touched = false;
    rove(marks[0]);
    point(marks[0]);
    picture.addEventListener("pointerover", ({ target, pointerType }) => {
      const mark = target.closest(".k");
      if (mark && pointerType === "mouse") point(mark);
    });
    picture.addEventListener("focusin", ({ target }) => {
      const mark = target.closest(".k");
      if (mark) { point(mark); rove(mark); }
    });
    picture.addEventListener("pointerdown", ({ pointerType }) => { touched = pointerType !== "mouse"; });
    picture.addEventListener("click", (event) => {
      const mark = event.target.closest(".k");
      // A first tap selects; the link of the read-out leads on.
      if (mark && touched) { event.preventDefault(); picture.classList.add("used"); mark.focus(); }
    });
    picture.addEventListener("keydown", (event) => {
      const mark = event.target.closest(".k");
      if (!mark) return;
      const kept = marks.filter((other) => !picture.classList.contains("filtered") || other.classList.contains("keep"));
      const next = { ArrowRight: kept[kept.indexOf(mark) + 1], ArrowLeft: kept[kept.indexOf(mark) - 1], Home: kept[0],
        End: kept.at(-1), ArrowDown: beside(mark, kept, 1), ArrowUp: beside(mark, kept, -1) }[event.key];
      if (/^(Arrow|Home|End)/.test(event.key)) event.preventDefault();
      next?.focus();
    });
    for (const button of all(".legend button")) {
      button.addEventListener("click", () => {
        const chosen = button.getAttribute("aria-pressed") !== "true";
        for (const other of all(".legend button")) other.setAttribute("aria-pressed", chosen && other === button);
        picture.classList.toggle("filtered", chosen);
        for (const mark of marks) mark.classList.toggle("keep", mark.dataset.v === button.dataset.v);
        const first = marks.find((mark) => !chosen || mark.dataset.v === button.dataset.v);
        if (first) { point(first); rove(first); }
      });
    }
    one(".seg").hidden = false;
    for (const button of all("[data-by]")) button.addEventListener("click", () => arrange(button));
    addEventListener("resize", lay);
  }
  function beside(mark, kept, way) {
    const from = mark.getBoundingClientRect();
    const far = (to) => Math.hypot(to.x - from.x, 3 * (to.y - from.y));
    return kept.map((other) => [other, other.getBoundingClientRect()]).filter(([, to]) => (to.top - from.top) * way > 4)
      .sort(([, a], [, b]) => far(a) - far(b))[0]?.[0];
  }
  function arrange(button) {
    const before = marks.map((mark) => mark.getBoundingClientRect());
    for (const other of all("[data-by]")) other.setAttribute("aria-pressed", other === button);
    picture.classList.toggle("far", button.dataset.by === "distance");
    for (const mark of marks) mark.style.cssText = "";
    for (const cells of all(".cells")) cells.style.height = "";
    lay();
    if (still) return;
    marks.forEach((mark, at) => {
      const to = mark.getBoundingClientRect();
      mark.animate([{ transform: `translate(${before[at].x - to.x}px,${before[at].y - to.y}px)` }, {}], { duration: 450, easing: "ease-out" });
    });
  }
  // By distance from the print, in units of its last place on a logarithmic scale; statements stand by themselves.
  function lay() {
    if (!picture.classList.contains("far")) return;
    const [low, high, size] = [-2, 4, 16];
    for (const cells of all(".cells")) {
      const width = cells.clientWidth;
      const own = all(".k", cells);
      const stated = own.filter((mark) => !("d" in mark.dataset));
      const left = Math.max(4 * size, Math.floor(0.28 * width / size) * size);
      const at = (units) => left + 2 * size + (width - left - 3 * size) * (Math.log10(Math.min(Math.max(units, 10 ** low), 10 ** high)) - low) / (high - low);
      const half = at(0.5);
      const piles = new Map();
      for (const mark of own.filter((other) => "d" in other.dataset).sort((a, b) => Math.abs(a.dataset.d) - Math.abs(b.dataset.d))) {
        const units = Math.abs(mark.dataset.d);
        const column = Math.floor((at(units) - half) / size + (units > 0.5 ? 1e-6 : -1e-6));
        piles.set(column, [...piles.get(column) ?? [], mark]);
      }
      const columns = Math.floor(left / size);
      const rows = Math.max(Math.ceil(stated.length / columns), ...[...piles.values()].map((pile) => pile.length), 1);
      const put = (mark, x, row) => { mark.style.left = `${x}px`; mark.style.top = `${(rows - row - 1) * size}px`; };
      stated.forEach((mark, place) => put(mark, (place % columns) * size, Math.floor(place / columns)));
      for (const [column, pile] of piles) pile.forEach((mark, row) => put(mark, Math.min(width - size, half + column * size), row));
      cells.style.height = `${rows * size}px`;
      cells.style.setProperty("--half", `${half}px`);
      const label = (units, text) => { const span = document.createElement("span"); span.style.left = `${at(units)}px`; span.textContent = text; return span; };
      if (cells === one(".cells")) {
        const ruler = one(".ruler");
        ruler.replaceChildren(...[[0.01, "0.01"], [0.1, "0.1"], [1, "1"], [10, "10"], [100, "100"], [1000, "1000"]].map(([units, text]) => label(units, text)));
        ruler.dataset.title = "Left: statements. Right: distance in units of the last printed place; right of the line a number does not round to the print";
      }
    }
  }

  // Pictures to move: the line, the dots and the values follow the slider.
  for (const slider of all(".pane input")) {
    const pane = slider.parentElement;
    const [places, names] = [slider.dataset.places, slider.dataset.names].map((list) => list.split(" "));
    const curves = all("[data-values]", pane).map((line, at) => ({
      cell: one("b", line), values: line.dataset.values.split("|"), heights: line.dataset.heights.split(" "), dot: all(".dot", pane)[at],
      label: one("bdi", line).textContent, band: one(".area", line),
    }));
    slider.hidden = false;
    const move = () => {
      const at = Number(slider.value);
      for (const mark of [one(".now", pane), ...curves.map((curve) => curve.dot)]) mark.style.left = `${places[at] / 10}%`;
      for (const { cell, values, heights, dot, band } of curves) {
        cell.textContent = values[at];
        dot.hidden = !heights[at] || band;
        dot.style.top = `${heights[at] / 10}%`;
      }
      one(".where", pane).textContent = names[at];
      slider.setAttribute("aria-valuetext", `${names[at]}: ${curves.map(({ label, values }) => `${label} ${values[at]}`).join(", ")}`);
    };
    slider.addEventListener("input", move);
    move();
  }

  // A drawing as it stands on the page, on its own paper.
  document.addEventListener("click", ({ target }) => {
    const button = target.closest("[data-save]");
    if (!button) return;
    const svg = one("svg.figure", button.closest("figure")).cloneNode(true);
    svg.setAttribute("xmlns", "http://www.w3.org/2000/svg");
    svg.setAttribute("style", "background:#fff;color:#1c1f23");
    const style = document.createElementNS("http://www.w3.org/2000/svg", "style");
    style.textContent = one("#drawn").textContent;
    svg.prepend(style);
    const link = document.createElement("a");
    link.href = URL.createObjectURL(new Blob([new XMLSerializer().serializeToString(svg)], { type: "image/svg+xml" }));
    link.download = `${button.dataset.save}.svg`;
    link.click();
    URL.revokeObjectURL(link.href);
  });
  for (const part of all(".save")) part.hidden = false;

  // On paper every claim has its line; evidence stays folded unless it was opened.
  let closed = [];
  for (const button of all("[data-print]")) {
    button.addEventListener("click", () => {
      const marked = [[document.documentElement, "one-page"], [button.closest(".view"), "alone"]];
      for (const [part, name] of marked) part.classList.add(name);
      print();
      for (const [part, name] of marked) part.classList.remove(name);
    });
  }
  addEventListener("beforeprint", () => {
    closed = all(".more:not([open])");
    for (const fold of closed) fold.open = true;
  });
  addEventListener("afterprint", () => { for (const fold of closed) fold.open = false; });

  watch(document);
  addEventListener("hashchange", () => follow(false));
  for (const view of views) view.addEventListener("beforematch", () => { show(view); track(); });
  if (marks.length) start();
  follow(true);
})();
