// Optional: sorts and filters the claims, keeps both in the address, opens what a link or the printer asks for.
"use strict";
(() => {
  const forms = [...document.querySelectorAll("form.filter")];
  const tables = [...document.querySelectorAll("table.claims")];
  const claims = [...document.querySelectorAll("tbody.claim")];
  const worst = new Map(claims.map((claim, index) => [claim, index]));
  const fields = ["verdict", "kind", "search", "proved"];
  const orders = {
    verdict: { ascending: "worst first", descending: "best first" },
    place: { ascending: "in the order of the paper", descending: "from the end of the paper" },
    deviation: { descending: "largest deviation first", ascending: "smallest deviation first" },
    seconds: { descending: "slowest first", ascending: "fastest first" },
  };
  let state = new URLSearchParams();

  function sorting() {
    const sort = state.get("sort") ?? "verdict";
    return [sort, state.get("order") ?? Object.keys(orders[sort])[0]];
  }

  function key(claim, sort) {
    if (sort === "verdict") return worst.get(claim);
    return sort in claim.dataset ? Number(claim.dataset[sort]) : null;
  }

  // What has no key stands last in both directions; equal keys keep the order worst first.
  function compare(one, other, sort, order) {
    const [a, b] = [key(one, sort), key(other, sort)];
    if (a === null || b === null) return (a === null) - (b === null) || worst.get(one) - worst.get(other);
    return (order === "descending" ? b - a : a - b) || worst.get(one) - worst.get(other);
  }

  function fits(claim) {
    const words = (state.get("search") ?? "").toLowerCase().split(/\s+/).filter(Boolean);
    return ["verdict", "kind", "proved"].every((name) => !state.has(name) || claim.dataset[name] === state.get(name))
      && (!words.length || words.every((word) => claim.textContent.toLowerCase().includes(word)));
  }

  function apply() {
    const [sort, order] = sorting();
    for (const claim of claims) claim.hidden = !fits(claim);
    tables.forEach((table, index) => {
      const own = [...table.tBodies];
      table.append(...own.toSorted((one, other) => compare(one, other, sort, order)));
      const shown = own.filter((claim) => !claim.hidden).length;
      table.nextElementSibling.hidden = shown > 0;
      forms[index].querySelector(".found").textContent = `${shown} of ${own.length} claims, ${orders[sort][order]}`;
      for (const header of table.querySelectorAll("th[data-sort]")) {
        if (header.dataset.sort === sort) header.setAttribute("aria-sort", order);
        else header.removeAttribute("aria-sort");
      }
    });
  }

  function set(wanted) {
    state = new URLSearchParams();
    for (const name of fields) if (wanted.get(name)) state.set(name, wanted.get(name));
    const [sort, order] = [wanted.get("sort"), wanted.get("order")];
    if (Object.hasOwn(orders, sort)) state.set("sort", sort);
    if (Object.hasOwn(orders, sort) && Object.hasOwn(orders[sort], order)) state.set("order", order);
    for (const form of forms) {
      for (const name of ["verdict", "kind", "search"]) {
        const [field, value] = [form.elements[name], state.get(name) ?? ""];
        // A blank at the end of what is being typed stays.
        if (field.value.trim() !== value) field.value = value;
      }
      form.elements.proved.checked = state.has("proved");
    }
    apply();
  }

  // The address is a place on the page, and behind a question mark what is shown there.
  function remember(place, wanted) {
    set(wanted);
    history.replaceState(null, "", `#${place}${state.size ? `?${state}` : ""}`);
  }

  function follow() {
    const [place, query] = location.hash.slice(1).split("?");
    if (query !== undefined) set(new URLSearchParams(query));
    const target = document.getElementById(place);
    if (!target) return;
    if (target.hidden) set(new URLSearchParams());
    if (target.classList.contains("claim")) target.querySelector("details").open = true;
    target.scrollIntoView();
  }

  function addSorting(table, place) {
    table.classList.add("sortable");
    for (const header of table.querySelectorAll("th[data-sort]")) {
      const button = document.createElement("button");
      button.type = "button";
      button.append(...header.childNodes);
      header.append(button);
      button.addEventListener("click", () => {
        const [sort, order] = sorting();
        const directions = Object.keys(orders[header.dataset.sort]);
        const next = sort === header.dataset.sort ? directions.find((other) => other !== order) : directions[0];
        const wanted = new URLSearchParams(state);
        wanted.set("sort", header.dataset.sort);
        wanted.set("order", next);
        remember(place, wanted);
      });
    }
  }

  forms.forEach((form, index) => {
    const place = form.dataset.place;
    const changed = () => remember(place, new URLSearchParams([...state].filter(([name]) => !fields.includes(name))
      .concat([...new FormData(form)].map(([name, value]) => [name, value.trim()]))));
    form.hidden = false;
    form.addEventListener("submit", (event) => event.preventDefault());
    for (const kind of ["input", "change"]) form.addEventListener(kind, changed);
    form.addEventListener("reset", () => remember(place, new URLSearchParams()));
    addSorting(tables[index], place);
  });
  for (const link of document.querySelectorAll("a[data-filter]")) link.href += `?${link.dataset.filter}`;

  // What does not scroll needs no stop on the way through the page by Tab.
  const stops = new ResizeObserver((boxes) => {
    for (const { target } of boxes) {
      if (target.scrollWidth > target.clientWidth) target.tabIndex = 0;
      else target.removeAttribute("tabindex");
    }
  });
  for (const box of document.querySelectorAll(".scroll")) stops.observe(box);

  let closed = [];
  addEventListener("hashchange", follow);
  addEventListener("beforeprint", () => {
    closed = [...document.querySelectorAll("details:not([open])")];
    for (const details of closed) details.open = true;
  });
  addEventListener("afterprint", () => { for (const details of closed) details.open = false; });
  apply();
  follow();
})();
