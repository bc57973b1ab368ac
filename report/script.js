// Optional: filters the claims, keeps the filter in the address, opens what a link or the printer asks for.
"use strict";
(() => {
  const form = document.getElementById("filter");
  const claims = [...document.querySelectorAll("tbody.claim")];
  const empty = document.getElementById("filter-count");

  function state() {
    const [verdict, kind] = [form.elements.verdict.value, form.elements.kind.value];
    return { verdict, kind, search: form.elements.search.value.trim() };
  }

  function apply() {
    const { verdict, kind, search } = state();
    const words = search.toLowerCase().split(/\s+/).filter(Boolean);
    let shown = 0;
    for (const claim of claims) {
      const text = claim.textContent.toLowerCase();
      const fits = (!verdict || claim.dataset.verdict === verdict) && (!kind || claim.dataset.kind === kind)
        && words.every((word) => text.includes(word));
      claim.hidden = !fits;
      shown += fits;
    }
    empty.textContent = `${shown} of ${claims.length} claims shown`;
  }

  function remember() {
    const fields = Object.entries(state()).filter(([, value]) => value);
    if (fields.length) history.replaceState(null, "", `#?${new URLSearchParams(fields)}`);
    else if (location.hash.startsWith("#?")) history.replaceState(null, "", location.pathname + location.search);
  }

  function set(wanted) {
    for (const name of ["verdict", "kind", "search"]) form.elements[name].value = wanted.get(name) ?? "";
    apply();
  }

  function follow() {
    if (location.hash.startsWith("#?")) set(new URLSearchParams(location.hash.slice(2)));
    const target = document.getElementById(location.hash.slice(1));
    if (!target) return;
    if (target.hidden) {
      set(new URLSearchParams());
      target.scrollIntoView();
    }
    const details = target.querySelector("details");
    if (details && target.classList.contains("claim")) details.open = true;
  }

  form.hidden = false;
  form.addEventListener("submit", (event) => event.preventDefault());
  for (const kind of ["input", "change"]) form.addEventListener(kind, () => { apply(); remember(); });
  form.addEventListener("reset", () => setTimeout(() => { apply(); remember(); }));
  addEventListener("hashchange", follow);
  addEventListener("beforeprint", () => document.querySelectorAll("details").forEach((details) => { details.open = true; }));
  apply();
  follow();
})();
