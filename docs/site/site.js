/* Search without a network or a server; and a tab stop for what scrolls sideways, only where it does. */
"use strict";
const base = document.currentScript.dataset.base;
const form = document.querySelector(".find");
const input = form.querySelector("input");
const box = form.querySelector(".hits");
const SHOWN = 12, AROUND = 60;

/* The index is a script, since a page that was opened as a file may not fetch. */
let index;
function load() {
  index ??= new Promise((done) => {
    const script = document.createElement("script");
    script.src = `${base}/index.js`;
    script.onload = () => done(window.searchIndex);
    document.head.append(script);
  });
  return index;
}

/* A section is found if it has all words; a word in its heading counts most. */
function rank(section, words) {
  let sum = 0;
  for (const word of words) {
    const heading = section.heading.toLowerCase();
    const place = section.text.toLowerCase().indexOf(word);
    if (heading.includes(word)) sum += heading.startsWith(word) ? 6 : 4;
    else if (section.page.toLowerCase().includes(word)) sum += 2;
    else if (place >= 0) sum += 1;
    else return 0;
  }
  return sum;
}

function excerpt(section, words) {
  const place = Math.max(0, ...words.map((word) => section.text.toLowerCase().indexOf(word)));
  const start = Math.max(0, place - AROUND);
  return (start ? "…" : "") + section.text.slice(start, place + 2 * AROUND).trim();
}

function hit(section, words) {
  const item = document.createElement("li"), link = document.createElement("a");
  const more = document.createElement("small");
  link.href = `${base}/${section.address}`;
  link.textContent = section.heading === section.page ? section.page : `${section.page}: ${section.heading}`;
  more.textContent = excerpt(section, words);
  link.append(more);
  item.append(link);
  return item;
}

async function search() {
  const words = input.value.toLowerCase().split(/\s+/).filter(Boolean);
  if (!words.length) { box.hidden = true; return; }
  const sections = await load();
  const found = sections.map((section) => [rank(section, words), section]).filter(([sum]) => sum);
  found.sort((one, other) => other[0] - one[0]);
  box.querySelector("p").textContent = found.length ? `${found.length} sections` : "Nothing found; try fewer words.";
  box.querySelector("ol").replaceChildren(...found.slice(0, SHOWN).map(([, section]) => hit(section, words)));
  box.hidden = false;
}

form.hidden = false;
input.addEventListener("focus", load);
input.addEventListener("input", search);
form.addEventListener("submit", async (event) => {
  event.preventDefault();
  await search();
  box.querySelector("a")?.click();
});
form.addEventListener("keydown", (event) => {
  if (event.key !== "Escape") return;
  box.hidden = true;
  input.focus();
});
form.addEventListener("focusout", (event) => { if (!form.contains(event.relatedTarget)) box.hidden = true; });
box.addEventListener("click", () => { box.hidden = true; });

function stops() {
  for (const element of document.querySelectorAll("pre, .scroll, .formula")) {
    if (element.scrollWidth > element.clientWidth) element.tabIndex = 0;
    else element.removeAttribute("tabindex");
  }
}
const narrow = matchMedia("(max-width: 52rem)");
const fold = () => { document.querySelector(".pages details").open = !narrow.matches; };
narrow.addEventListener("change", fold);
fold();

/* The list of pages may be longer than the window: the page that is open stands in its middle. */
const pages = document.querySelector(".pages details"), current = pages.querySelector("[aria-current]");
if (current) pages.scrollTop = current.offsetTop - pages.clientHeight / 2;
addEventListener("resize", stops);
stops();
